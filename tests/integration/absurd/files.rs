//! Rotor files, through the reader that every command and every deployment goes through.

use rotor_edge::sample;
use rotor_edge_desktop::effects::terms::Terms;
use rotor_edge_desktop::effects::{ALL, Effect, Place, Scale, Scales, entry, physical};
use rotor_edge_desktop::machine::drawing::{Rotor, Run};
use rotor_edge_desktop::rotor_file;
use toml::{Table, Value};

use super::values::{Dice, NOWHERE};

/// A bearing by each law, and what else may be stated of one.
const BEARINGS: [&str; 8] = [
    "stiffness_n_m = { xx = 1.2e8, yy = 1.4e8, xy = 1e6, yx = -1e6 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5, xy = 10.0, yx = 10.0 }",
    "coefficients_relative = 0.1\nelevation_m = 1.5e-4\nstiffness_n_m = { xx = 1.2e8, yy = 1.4e8 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5 }",
    "stiffness_n_m = { xx = 1.2e8, yy = 1.4e8 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5 }\n\
     pedestal = { stiffness_n_m = [6e8, 3e8], damping_n_s_m = [1e5, 1e5], mass_kg = [150.0, 90.0] }",
    "stiffness_n_m = { xx = 1.2e8, yy = 1.4e8 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5 }\n\
     learned = { reference_rpm = 3000.0, stiffness_per_log_n_m = { xx = 1e6, yy = 1e6 } }",
    "table = [\
     { speed_rpm = 2000.0, kxx = 1e8, kxy = 2e7, kyx = -4e7, kyy = 1.5e8, cxx = 3e5, cxy = 0.0, cyx = 0.0, cyy = 4e5 },\
     { speed_rpm = 6000.0, kxx = 1.1e8, kxy = 4e7, kyx = -6e7, kyy = 1.4e8, cxx = 2e5, cxy = 0.0, cyx = 0.0, cyy = 2e5 }]",
    "film = { kind = \"tilting_pad\", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, viscosity_pa_s = 0.02, \
     pads = 4, load_n = 3000.0, load_angle_deg = -80.0, pad_arc_deg = 70.0, preload = 0.3, offset = 0.55, load = \"on_pad\" }",
    "squeeze_film = { diameter_m = 0.13, length_m = 0.03, radial_clearance_m = 1.1e-4, viscosity_pa_s = 0.015, \
     ends = \"open\", film = \"full\", orbit_ratio = 0.2, spring_n_m = 2e7 }",
    "magnetic = { stiffness_n_m = 2e7, damping_n_s_m = 10.0 }",
];

/// What may have either sign.
const SIGNED: [&str; 14] = [
    "angle_deg",
    "load_angle_deg",
    "elevation_m",
    "poisson_ratio",
    "at_rest_v",
    "xy",
    "yx",
    "kxx",
    "kyy",
    "kxy",
    "kyx",
    "cxy",
    "cyx",
    "learned",
];
/// What nothing has none of.
const SIZES: [&str; 11] = [
    "length_m",
    "outer_diameter_m",
    "youngs_modulus_pa",
    "density_kg_m3",
    "diameter_m",
    "radial_clearance_m",
    "viscosity_pa_s",
    "sensitivity_v_mm",
    "fastest_rpm",
    "reference_rpm",
    "coefficients_relative",
];

/// Where a number is in a file.
type Path = Vec<Step>;

#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String),
    Item(usize),
}

/// How many absurd files there were, and which were taken.
#[derive(Default)]
struct Tally {
    made: usize,
    taken: Vec<String>,
}

impl Tally {
    fn judge(&mut self, what: &str, file: &Table) {
        self.made += 1;
        match rotor_file::parse("rotor.toml", &file.to_string()) {
            Ok(_) => self.taken.push(what.into()),
            Err(e) => assert!(!e.to_string().contains('\n'), "{what}: {e}"),
        }
    }

    fn end(self, of: &str) {
        let refused = self.made - self.taken.len();
        println!("{of}: {refused} of {} absurd files refused", self.made);
        assert!(self.taken.is_empty(), "taken: {:#?}", self.taken);
        assert!(self.made >= 1000, "{} files of {of}", self.made);
    }
}

fn machine() -> Rotor {
    let mut rotor = rotor_file::parse("rotor.toml", sample::ROTOR).unwrap();
    rotor.schema = 2;
    rotor.fastest_rpm = Some(12_000.0);
    for plane in &mut rotor.plane {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(100.0), Some(30.0));
    }
    rotor
}

fn table_of(rotor: &Rotor) -> Table {
    Table::try_from(rotor).unwrap()
}

/// The machine with its first bearing by another law.
fn on(law: &str) -> Table {
    let mut file = table_of(&machine());
    let bearing = file["bearing"][0].as_table_mut().unwrap();
    bearing.retain(|key, _| key == "name" || key == "position_m");
    bearing.extend(law.parse::<Table>().unwrap());
    rotor_file::parse("rotor.toml", &file.to_string()).unwrap_or_else(|e| panic!("{law}: {e}"));
    file
}

/// Every number below a value.
fn numbers(value: &Value, here: &mut Path, found: &mut Vec<(Path, f64)>) {
    let mut below = |step, value| {
        here.push(step);
        numbers(value, here, found);
        here.pop();
    };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| below(Step::Key(key.clone()), value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| below(Step::Item(i), value)),
        Value::Float(number) => found.push((here.clone(), *number)),
        Value::Integer(number) => found.push((here.clone(), *number as f64)),
        _ => {}
    }
}

fn numbers_of(file: &Table) -> Vec<(Path, f64)> {
    let mut found = Vec::new();
    numbers(&Value::Table(file.clone()), &mut Vec::new(), &mut found);
    found
}

fn with(file: &Table, path: &Path, value: Value) -> Table {
    let mut whole = Value::Table(file.clone());
    let place = path.iter().fold(&mut whole, |value, step| match step {
        Step::Key(key) => &mut value[key.as_str()],
        Step::Item(i) => &mut value[*i],
    });
    *place = value;
    match whole {
        Value::Table(table) => table,
        _ => unreachable!("a file is a table"),
    }
}

fn is_about(path: &Path, keys: &[&str]) -> bool {
    path.iter().any(|step| matches!(step, Step::Key(key) if keys.contains(&key.as_str())))
}

/// Each number of a file out of its bounds, in turn.
fn in_turn(file: &Table, only: &str, tally: &mut Tally) {
    let length_m = rotor_file::parse("rotor.toml", &file.to_string()).unwrap().length_m();
    for (path, value) in
        numbers_of(file).into_iter().filter(|(path, _)| only.is_empty() || is_about(path, &[only]))
    {
        let mut absurd = NOWHERE.to_vec();
        // magnets may pull
        if !is_about(&path, &SIGNED) && !is_about(&path, &["magnetic"]) {
            absurd.push(if value == 0.0 { -1.0 } else { -value });
            absurd.push(-1000.0);
        }
        if is_about(&path, &SIZES) {
            absurd.push(0.0);
        }
        if is_about(&path, &["position_m"]) {
            absurd.extend([-0.01, length_m + 0.01]);
        }
        for number in absurd {
            tally.judge(&format!("{path:?} = {number:e}"), &with(file, &path, Value::Float(number)));
        }
        tally.judge(&format!("{path:?} is a text"), &with(file, &path, Value::String("much".into())));
    }
}

#[test]
fn rotor_and_bearing_numbers_out_of_bounds_are_refused() {
    let mut tally = Tally::default();
    in_turn(&table_of(&machine()), "", &mut tally);
    for law in BEARINGS {
        in_turn(&on(law), "bearing", &mut tally);
    }
    tally.end("drawings and bearings in turn");
}

#[test]
fn numbers_beyond_anything_at_random_places_are_refused() {
    let mut tally = Tally::default();
    let mut dice = Dice::new();
    let files = BEARINGS.map(on);
    for _ in 0..1000 {
        let file = &files[dice.below(files.len())];
        let all = numbers_of(file);
        let (path, _) = &all[dice.below(all.len())];
        let number = dice.huge(15.0, 300.0);
        tally.judge(&format!("{path:?} = {number:e}"), &with(file, path, Value::Float(number)));
    }
    tally.end("drawings and bearings at random");
}

/// The machine with one more effect, at the first of its places.
fn effects() -> Vec<(&'static dyn Effect, Place, Rotor, Scales)> {
    let mut all = Vec::new();
    for effect in ALL {
        let found = BEARINGS.iter().find_map(|law| {
            let mut rotor = rotor_file::parse("rotor.toml", &on(law).to_string()).unwrap();
            // with nothing switched on, and a run to have an unbalance of its own
            rotor.physics.gyroscopic = effect.name() != "gyroscopic";
            rotor.physics.rotary_inertia = effect.name() != "rotary_inertia";
            rotor.physics.shear_deformation = effect.name() != "shear_deformation";
            let run = |name: &str| Run { name: name.into(), added_unbalance: Vec::new(), slow_roll: false };
            rotor.run = ["cold", "hot"].map(run).to_vec();
            // a file may state what is not sought on its machine
            let stated = effect.not_sought(&rotor).map(|_| Place::Machine);
            let place = effect.places(&rotor).into_iter().next().or(stated)?;
            let scales = physical::scales(&rotor, &Terms::drawn(&rotor), 1200.0, 1e-5);
            let small = vec![nalgebra::Complex::new(1e-9, 0.0); effect.unknowns(&rotor, place).len()];
            let start = &effect.starts(&scales)[0];
            rotor.effect = vec![entry::written(&rotor, effect, place, &scales, start, &small)];
            rotor.validate().ok()?;
            Some((effect, place, rotor, scales))
        });
        all.push(found.unwrap_or_else(|| panic!("{} has a place on no machine", effect.name())));
    }
    all
}

/// Numbers that lie outside of a parameter's bounds, near and far.
fn beyond([low, high]: [f64; 2], scale: Scale, dice: &mut Dice) -> Vec<f64> {
    let mut all = NOWHERE.to_vec();
    let far = 10_f64.powi(20 + dice.below(200) as i32);
    match scale {
        Scale::Linear(size) => {
            all.extend([far, -far].map(|far| far * size));
            all.extend([low - size.abs(), high + size.abs()].into_iter().filter(|number| number.is_finite()));
        }
        Scale::Logarithmic => {
            all.extend([0.0, -1.0, -1e12, -far]);
            all.extend([0.5 * low, 2.0 * high].into_iter().filter(|number| number.is_finite()));
        }
    }
    all
}

#[test]
fn effect_parameters_missing_or_out_of_bounds_are_refused() {
    let mut tally = Tally::default();
    let mut dice = Dice::new();
    for (effect, place, rotor, scales) in effects() {
        let file = table_of(&rotor);
        let parameters = |file: &Table| file["effect"][0].get("parameters").cloned();
        let Some(Value::Table(stated)) = parameters(&file) else { continue };
        let at = |key: &str| {
            let steps = ["effect", "parameters", key].map(|key| Step::Key(key.into()));
            let [list, parameters, key] = steps;
            vec![list, Step::Item(0), parameters, key]
        };
        let say = |key: &str, value: &Value| format!("{} {key} = {value}", effect.name());
        for key in stated.keys() {
            let mut without = stated.clone();
            without.remove(key);
            let path = at(key);
            tally.judge(
                &format!("{} without {key}", effect.name()),
                &with(&file, &path[..3].to_vec(), Value::Table(without)),
            );
        }
        for p in effect.parameters(&scales) {
            for number in beyond(p.bounds, p.scale, &mut dice) {
                let value = Value::Float(number);
                tally.judge(&say(p.name, &value), &with(&file, &at(p.name), value.clone()));
            }
        }
        for (setting, _) in effect.settings(&scales) {
            for number in NOWHERE.into_iter().chain([0.0, -1.0]) {
                let value = Value::Float(number);
                tally.judge(&say(setting, &value), &with(&file, &at(setting), value.clone()));
            }
        }
        let unknowns = effect.unknowns(&rotor, place);
        for (path, _) in
            numbers_of(&file).into_iter().filter(|(path, _)| path.len() > 4 && path[..3] == at("")[..3])
        {
            let far = dice.huge(15.0, 300.0);
            let largest = unknowns.iter().map(|u| 2.0 * u.largest).filter(|number| number.is_finite());
            for number in NOWHERE.into_iter().chain([far]).chain(largest) {
                let what = format!("{} {path:?} = {number:e}", effect.name());
                tally.judge(&what, &with(&file, &path, Value::Float(number)));
            }
        }
    }
    for _ in 0..3 {
        for (effect, _, rotor, scales) in effects() {
            let file = table_of(&rotor);
            for p in effect.parameters(&scales) {
                let mut path = vec![Step::Key("effect".into()), Step::Item(0)];
                path.extend(["parameters", p.name].map(|key| Step::Key(key.into())));
                for _ in 0..6 {
                    let number = dice.huge(30.0, 300.0);
                    let what = format!("{} {} = {number:e}", effect.name(), p.name);
                    tally.judge(&what, &with(&file, &path, Value::Float(number)));
                }
            }
        }
    }
    tally.end("effects");
}
