//! The page that describes `rotor.toml`, example by example, and what a machine's file is refused for.

use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::effects::{ALL, Place, Scales};
use rotor_edge_desktop::machine::drawing::{EffectEntry, Rotor};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;

const PAGE: &str = include_str!("../../../docs/rotor-file.md");

const HEAD: &str = "schema = 2\nname = \"example\"\n";
const SHAFT: &str = "[[shaft]]\nlength_m = 1.0\nouter_diameter_m = 0.1\n";
const DISK: &str = "[[disk]]\nname = \"wheel 1\"\nposition_m = 0.5\nmass_kg = 14.0\n\
    diametral_inertia_kg_m2 = 0.08\npolar_inertia_kg_m2 = 0.15\n";
const PROBE: &str = "[[probe]]\nname = \"AX\"\nbearing = \"A\"\nposition_m = 0.15\nangle_deg = 45\n";
const PLANE: &str = "[[plane]]\nname = \"left\"\nposition_m = 0.3\n";

fn bearing(name: &str, position_m: f64, law: &str) -> String {
    format!("[[bearing]]\nname = \"{name}\"\nposition_m = {position_m}\n{law}\n")
}

const CONSTANT: &str = "stiffness_n_m = { xx = 1e8, yy = 1e8 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5 }";

/// A machine with an example in the place of what it describes.
fn machine(example: &str) -> String {
    let has = |table: &str| example.contains(&format!("[[{table}]]"));
    let mut text = String::new();
    let top = example.starts_with("schema");
    text.push_str(if top { example } else { HEAD });
    text.push('\n');
    for (table, usual) in [("shaft", SHAFT), ("disk", DISK), ("probe", PROBE), ("plane", PLANE)] {
        text.push_str(if has(table) { "" } else { usual });
    }
    if !example.contains("[[bearing]]\nname = \"A\"") {
        text.push_str(&bearing("A", 0.1, CONSTANT));
    }
    text.push_str(&bearing("B", 0.9, CONSTANT));
    if !top {
        text.push_str(example);
    }
    text
}

fn examples() -> Vec<&'static str> {
    PAGE.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

fn read(text: &str) -> Rotor {
    rotor_file::parse("rotor.toml", text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

#[test]
fn every_documented_example_survives_write_and_read() {
    assert!(examples().len() >= 17, "the page has its examples");
    let folder = tempfile::tempdir().unwrap();
    let csv = PAGE.split("```csv\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    std::fs::write(folder.path().join("bearing-A.csv"), csv).unwrap();
    for (i, example) in examples().into_iter().enumerate() {
        let drawn = folder.path().join("drawn.toml");
        std::fs::write(&drawn, machine(example)).unwrap();
        let rotor = rotor_file::read(&drawn).unwrap_or_else(|e| panic!("{e}\n{example}"));
        let path = folder.path().join(format!("{i}.toml"));
        rotor_file::write(&path, &rotor).unwrap();
        let again = rotor_file::read(&path).unwrap();
        assert_eq!(rotor, again, "{example}");
        assert!(Model::finite_elements(&rotor).response(600.0).is_ok(), "{example}");
    }
}

#[test]
fn the_page_s_table_lists_every_effect_once_with_its_parameters() {
    let table = PAGE.split("| `kind`").nth(1).unwrap().split("\n\n").next().unwrap();
    let quoted = |cell: &str| cell.split('`').skip(1).step_by(2).map(String::from).collect::<Vec<_>>();
    let row = |row: &str| {
        let cells: Vec<&str> = row.split('|').collect();
        (quoted(cells[1]), quoted(cells[3]))
    };
    let rows: Vec<_> = table.lines().skip(2).map(row).collect();
    let scales = Scales {
        stiffness_n_m: 1e8,
        sagging_n_m: 0.0,
        rotor_kg: 100.0,
        fastest_rad_s: 1e3,
        reference_rad_s: 7e2,
        amplitude_m: 1e-5,
    };
    let rotor = read(&machine("[[run]]\nname = \"a\"\n[[run]]\nname = \"b\"\n"));
    for effect in ALL {
        let listed: Vec<_> = rows.iter().filter(|(kinds, _)| kinds.contains(&effect.name().into())).collect();
        let [(_, keys)] = listed[..] else { panic!("{} stands {} times", effect.name(), listed.len()) };
        let real = effect.parameters(&scales).into_iter().map(|p| p.name);
        let settings = effect.settings(&scales).into_iter().map(|(name, _)| name);
        let place = effect.places(&rotor).first().copied().unwrap_or(Place::Machine);
        let mut unknowns: Vec<&str> = effect.unknowns(&rotor, place).iter().map(|u| u.name).collect();
        unknowns.dedup();
        let taken: Vec<&str> = real.chain(settings).chain(unknowns).collect();
        assert_eq!(&taken, keys, "{}", effect.name());
    }
}

#[test]
fn every_key_of_the_page_s_table_is_one_that_a_film_takes() {
    let table = PAGE.split("| key of `film`").nth(1).unwrap().split("\n\n").next().unwrap();
    let cells = table.lines().skip(2).filter_map(|row| row.split('|').nth(1));
    let keys: Vec<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    assert!(keys.len() >= 8, "the table has its keys: {keys:?}");
    let films = [
        "film = { kind = \"tilting_pad\", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, \
         viscosity_pa_s = 0.02, pads = 4, load_n = 3000.0, load_angle_deg = -80.0, pad_arc_deg = 70.0, preload = 0.3, \
         offset = 0.55, load = \"on_pad\" }",
        "film = { kind = \"elliptical\", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, \
         viscosity_pa_s = 0.02, load_n = 3000.0, preload = 0.3, groove_arc_deg = 30.0 }",
    ];
    for film in films {
        read(&machine(&bearing("A", 0.1, film)));
    }
    for key in keys {
        assert!(films.iter().any(|film| film.contains(&format!(" {key} ="))), "{key} is in no example");
    }
}

#[test]
fn a_film_without_a_load_carries_its_share_of_the_weight() {
    let film = "film = { kind = \"plain\", diameter_m = 0.1, length_m = 0.05, radial_clearance_m = 1e-4, viscosity_pa_s = 0.02 }";
    let rotor = read(&machine(&bearing("A", 0.1, film)));
    let a = rotor.bearing.iter().find(|b| b.name == "A").unwrap();
    let Law::Film(law) = &a.law else { panic!("a film") };
    let shaft_kg = std::f64::consts::PI * 0.1_f64.powi(2) / 4.0 * 7850.0;
    // shaft and disk are both in the middle between the bearings
    let expected = 0.5 * (shaft_kg + 14.0) * 9.806_65;
    assert!((law.load_n() / expected - 1.0).abs() < 1e-9, "{} {expected}", law.load_n());
}

#[test]
fn impossible_machine_is_refused_with_key_and_number() {
    let table = |rows: &str| bearing("A", 0.1, &format!("table = [{rows}]"));
    let row = |rpm: f64| format!("{{ speed_rpm = {rpm}, kxx = 1e8, kyy = 1e8, cxx = 1e5, cyy = 1e5 }}");
    let film = |more: &str| {
        bearing(
            "A",
            0.1,
            &format!(
                "film = {{ kind = \"plain\", diameter_m = 0.1, length_m = 0.05, radial_clearance_m = 1e-4, viscosity_pa_s = 0.02{more} }}"
            ),
        )
    };
    let foundation = |names: &str, count: usize| {
        let shape = vec!["1.0"; count].join(", ");
        format!(
            "{}[foundation]\nbearings = [\"{names}\"]\nmode = [{{ frequency_hz = 40.0, modal_mass_kg = 100.0, x = [{shape}], \
             y = [{shape}] }}]\n",
            bearing("A", 0.1, CONSTANT)
        )
    };
    let two = bearing("A", 0.1, &format!("{CONSTANT}\ntable = [{}, {}]", row(1000.0), row(2000.0)));
    for (example, expected) in [
        (table(&row(1000.0)), "a table needs two speeds at least, 1 given"),
        (table(&[row(2000.0), row(1000.0)].join(", ")), "2000 rpm is followed by 1000 rpm"),
        (two, "has 2 laws"),
        (bearing("A", 0.1, ""), "has no law"),
        (bearing("A", 0.1, "stiffness_n_m = { xx = 1e8, yy = 1e8 }"), "damping_n_s_m is missing"),
        (film(", load_n = -500.0"), "-500"),
        (film(", preload = 3.0"), "preload"),
        (
            format!("{}{PROBE}gap = {{ at_rest_v = -9.8 }}\n", bearing("A", 0.1, CONSTANT)),
            "\"AX\" gap: needs a bearing with an oil film",
        ),
        (
            film("").replace("film =", "coefficients_relative = 0.1\nfilm ="),
            "is for coefficients that are stated",
        ),
        (foundation("A\", \"C", 2), "[foundation] bearings: there is no bearing \"C\""),
        (
            foundation("A\", \"B", 2).replace(
                "mode = [",
                "table = [{ frequency_hz = 9.0, response = \"A.z\", force = \"A.x\", \
             real_m_n = 1e-9, imaginary_m_n = 0.0 }]\nmode = [",
            ),
            "[foundation]: has modes and a table, expected one of the two",
        ),
        (foundation("A", 1), "1 given, a foundation joins two at least"),
        (foundation("A\", \"B", 3), "[foundation] mode 1 x: 3 numbers, expected one for each of 2 bearings"),
        (bearing("A", 0.9, CONSTANT), "the bearing \"B\" is at the same place"),
        (
            format!("{}{}", bearing("A", 0.1, CONSTANT), "[rated]\nspeed_rpm = [5000, 3000]\n"),
            "[rated] speed_rpm",
        ),
    ] {
        let error = rotor_file::parse("rotor.toml", &machine(&example)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with("rotor.toml"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn table_file_equals_inline_table_with_missing_columns_zero() {
    let folder = tempfile::tempdir().unwrap();
    let csv = "speed_rpm, kxx, kyx, kyy, cxx, cyy\n1000, 1e8, -4e7, 1.5e8, 3e5, 4e5\n2000, 2e8, -5e7, 2.5e8, 2e5, 1e5\n";
    std::fs::create_dir(folder.path().join("tables")).unwrap();
    std::fs::write(folder.path().join("tables/a.csv"), csv).unwrap();
    let path = folder.path().join("rotor.toml");
    std::fs::write(&path, machine(&bearing("A", 0.1, "table_file = \"tables/a.csv\""))).unwrap();
    let rows = "table = [{ speed_rpm = 1000, kxx = 1e8, kyx = -4e7, kyy = 1.5e8, cxx = 3e5, cyy = 4e5 }, \
                { speed_rpm = 2000, kxx = 2e8, kyx = -5e7, kyy = 2.5e8, cxx = 2e5, cyy = 1e5 }]";
    let inline = read(&machine(&bearing("A", 0.1, rows)));
    assert_eq!(rotor_file::read(&path).unwrap(), inline);
}

#[test]
fn a_table_s_file_that_cannot_be_used_is_told_with_file_and_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rotor.toml");
    let law = "table_file = \"a.csv\"";
    std::fs::write(&path, machine(&bearing("A", 0.1, law))).unwrap();
    let said = || rotor_file::read(&path).unwrap_err().to_string();
    assert!(said().contains("a.csv: cannot be read"), "{}", said());
    let head = "speed_rpm,kxx,kyy,cxx,cyy\n";
    for (csv, expected) in [
        (String::new(), "header: the column speed_rpm is missing"),
        ("speed_rpm,kxx,kyy,cxx\n".into(), "header: the column cyy is missing"),
        ("speed_rpm,kxx,kyy,cxx,cyy,mxx\n".into(), "header: \"mxx\" is no column, expected speed_rpm,kxx"),
        (format!("{head}1000,1e8,1e8,1e5,1e5\n"), "rows: a table needs two speeds at least, 1 given"),
        (format!("{head}1000,1e8,1e8,1e5,1e5\n2000,1e8,soft,1e5,1e5\n"), "row 3: kyy \"soft\" is no number"),
        (format!("{head}1000,1e8,1e8,1e5,1e5\n2000,1e8,1e5,1e5\n"), "row 3: expected 5 numbers"),
        (
            format!("{head}1000,1e8,1e8,1e5,1e5\n2000,-2e15,1e8,1e5,1e5\n"),
            "row 3: kxx -2000000000000000 is outside",
        ),
        (format!("{head}1000,nan,1e8,1e5,1e5\n2000,1e8,1e8,1e5,1e5\n"), "row 2: kxx NaN is outside"),
        (
            format!("{head}2000,1e8,1e8,1e5,1e5\n1000,1e8,1e8,1e5,1e5\n"),
            "row 3: the speeds of a table must ascend",
        ),
    ] {
        std::fs::write(folder.path().join("a.csv"), &csv).unwrap();
        let error = said();
        assert!(error.contains(&format!("a.csv: {expected}")), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let error = rotor_file::parse("rotor.toml", &machine(&bearing("A", 0.1, law))).unwrap_err().to_string();
    assert!(
        error.contains("\"a.csv\" lies beside the rotor's file, which must be read from disk"),
        "{error}"
    );
    std::fs::write(
        folder.path().join("a.csv"),
        format!("{head}1000,1e8,1e8,1e5,1e5\n2000,1e8,1e8,1e5,1e5\n"),
    )
    .unwrap();
    assert!(rotor_file::read(&path).is_ok());
    std::fs::write(&path, machine(&bearing("A", 0.1, &format!("{law}\n{CONSTANT}")))).unwrap();
    assert!(said().contains("has 2 laws"), "{}", said());
    std::fs::write(&path, machine(&bearing("A", 0.1, &format!("{law}\ntable = []")))).unwrap();
    assert!(said().contains("has a table as well"), "{}", said());
}

const TITANIUM: &str = "[[material]]\nname = \"titanium\"\nyoungs_modulus_pa = 1.14e11\ndensity_kg_m3 = 4430\npoisson_ratio = 0.34\n";

#[test]
fn segment_takes_properties_of_its_material_or_of_steel() {
    let segment = |more: &str| format!("[[shaft]]\nlength_m = 0.4\nouter_diameter_m = 0.1\n{more}\n");
    let shaft = [segment(""), segment("material = \"titanium\""), segment("material = \"steel\"")].concat();
    let rotor = read(&machine(&format!("{TITANIUM}{shaft}")));
    let numbers = rotor.shaft.iter().map(|s| (s.youngs_modulus_pa, s.density_kg_m3, s.poisson_ratio));
    let steel = (2.06e11, 7850.0, 0.3);
    assert_eq!(numbers.collect::<Vec<_>>(), [steel, (1.14e11, 4430.0, 0.34), steel]);
}

#[test]
fn materials_that_cannot_be_meant_are_refused_in_one_sentence() {
    let segment = |more: &str| format!("[[shaft]]\nlength_m = 1.0\nouter_diameter_m = 0.1\n{more}\n");
    let named = |more: &str| segment(&format!("material = \"titanium\"\n{more}"));
    for (example, expected) in [
        (
            format!("{TITANIUM}{}", segment("material = \"brass\"")),
            "there is no material \"brass\", expected one of \"titanium\", \"steel\"",
        ),
        (
            format!("{TITANIUM}{}", named("density_kg_m3 = 4000")),
            "has both material = \"titanium\" and density_kg_m3",
        ),
        (format!("{TITANIUM}{TITANIUM}{}", named("")), "the name \"titanium\" is used twice"),
        (
            format!("{}{}", TITANIUM.replace("1.14e11", "114"), named("")),
            "[[material]] \"titanium\" youngs_modulus_pa: 114 is outside",
        ),
        (
            format!("{}{}", TITANIUM.replace("density_kg_m3 = 4430\n", ""), named("")),
            "missing field `density_kg_m3`",
        ),
        (format!("{}{}", TITANIUM.replace("4430", "\"light\""), named("")), "invalid type: string"),
        (format!("{TITANIUM}{}", segment("material = 3")), "is no text"),
    ] {
        let error = rotor_file::parse("rotor.toml", &machine(&example)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with("rotor.toml"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let flat = machine("[[run]]\nname = \"a\"\n").replace(HEAD, &format!("{HEAD}material = 3\n"));
    let error = rotor_file::parse("rotor.toml", &flat).unwrap_err().to_string();
    assert!(error.contains("rotor.toml: line 3: material is no list"), "{error}");
    let old = machine(&format!("{TITANIUM}{}", named(""))).replace("schema = 2", "schema = 1");
    let error = rotor_file::parse("rotor.toml", &old).unwrap_err().to_string();
    assert!(error.contains("1 does not know [[material]], expected 2"), "{error}");
}

#[test]
fn raised_middle_bearing_and_film_load_equal_closed_form() {
    let height = 2e-5;
    let film = "film = { kind = \"plain\", diameter_m = 0.1, length_m = 0.05, radial_clearance_m = 1e-4, viscosity_pa_s = 0.02 }";
    let load = |elevation_m: f64| {
        let text = [
            HEAD,
            SHAFT,
            "[physics]\nshear_deformation = false\n",
            &bearing("L", 0.0, CONSTANT),
            &bearing("M", 0.5, &format!("elevation_m = {elevation_m}\n{film}")),
            &bearing("R", 1.0, CONSTANT),
            &PROBE.replace("\"A\"", "\"M\""),
            PLANE,
        ]
        .concat();
        let rotor = read(&text);
        let Law::Film(law) = &rotor.bearing[1].law else { panic!("a film") };
        law.load_n()
    };
    // a beam of 1 m on pins, lifted in its middle: 48 EI δ / L³
    let bending = 2.06e11 * std::f64::consts::PI * 0.1_f64.powi(4) / 64.0;
    let lift_n = 48.0 * bending * height;
    let found = load(height) - load(0.0);
    assert!((found / lift_n - 1.0).abs() < 1e-6, "{found} {lift_n}");
}

#[test]
fn elevations_and_grades_are_of_schema_2_and_in_range() {
    let raised = |m: f64| bearing("A", 0.1, &format!("elevation_m = {m}\n{CONSTANT}"));
    let graded = |g: f64| {
        format!("[[run]]\nname = \"a\"\n[rated]\nspeed_rpm = [1000, 3000]\nbalance_grade_mm_s = {g}\n")
    };
    for (example, expected) in [
        (raised(150.0), "[[bearing]] \"A\" elevation_m: 150 is outside -0.1 to 0.1 m"),
        (raised(f64::NAN), "elevation_m: NaN is outside"),
        (graded(0.0), "[rated] balance_grade_mm_s: 0 is outside 0.05 to 5000 mm/s"),
        (graded(-2.5), "balance_grade_mm_s: -2.5 is outside"),
    ] {
        let text = machine(&example).replace("NaN", "nan");
        let error = rotor_file::parse("rotor.toml", &text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    for example in [raised(1e-4), graded(2.5)] {
        assert!(rotor_file::parse("rotor.toml", &machine(&example)).is_ok());
        let old = machine(&example).replace("schema = 2", "schema = 1");
        let error = rotor_file::parse("rotor.toml", &old).unwrap_err().to_string();
        assert!(error.contains("schema: 1 does not know"), "{error}");
    }
}

#[test]
fn coupling_off_a_joint_or_at_a_shared_place_is_refused() {
    let spans = "[[shaft]]\nlength_m = 0.6\nouter_diameter_m = 0.1\n[[shaft]]\nlength_m = 0.4\nouter_diameter_m = 0.1\n";
    let coupling = |position_m: f64, keys: &str| {
        format!("[[coupling]]\nname = \"C\"\nposition_m = {position_m}\n{keys}\n")
    };
    let flexible = "lateral_stiffness_n_m = 4e7\nangular_stiffness_n_m_rad = 3e4";
    let with = |more: &str| format!("{spans}{}{more}", coupling(0.6, flexible));
    assert!(rotor_file::parse("rotor.toml", &machine(&with(""))).is_ok());
    let only = |keys: &str| format!("{spans}{}", coupling(0.6, keys));
    for (example, expected) in [
        (
            format!("{spans}{}", coupling(0.0, flexible)),
            "0 m joins nothing: [[shaft]] segments meet at 0.6 m",
        ),
        (format!("{spans}{}", coupling(1.0, flexible)), "1 m joins nothing"),
        (format!("{spans}{}", coupling(1.7, flexible)), "1.7 m joins nothing"),
        (format!("{spans}{}", coupling(0.55, "rigid = true")), "0.55 m joins nothing"),
        (coupling(0.5, flexible), "0.5 m joins nothing: the shaft is one segment"),
        (with(&coupling(0.6, flexible)), "the name \"C\" is used twice"),
        (with(&coupling(0.6, flexible).replace("\"C\"", "\"D\"")), "the coupling \"C\" is at the same place"),
        (only(""), "has no stiffness"),
        (only("lateral_stiffness_n_m = 4e7"), "angular_stiffness_n_m_rad is missing"),
        (only("angular_stiffness_n_m_rad = 3e4"), "lateral_stiffness_n_m is missing"),
        (only(&format!("rigid = true\n{flexible}")), "is rigid and has a stiffness"),
        (only(&flexible.replace("4e7", "-4e7")), "lateral_stiffness_n_m: -40000000 is outside"),
        (only(&flexible.replace("3e4", "0")), "angular_stiffness_n_m_rad: 0 is outside"),
        (only(&format!("{flexible}\nmass_kg = -3.0")), "mass_kg: -3 is outside"),
        (
            with("[[plane]]\nname = \"hub\"\nposition_m = 0.6\n"),
            "[[plane]] \"hub\" position_m: 0.6 m is where",
        ),
        (with("[physics]\nbasis = \"free_free\"\n"), "have no kink"),
    ] {
        let error = rotor_file::parse("rotor.toml", &machine(&example)).unwrap_err().to_string();
        assert!(error.contains(expected) && error.starts_with("rotor.toml"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let old = machine(&with("")).replace("schema = 2", "schema = 1");
    let error = rotor_file::parse("rotor.toml", &old).unwrap_err().to_string();
    assert!(error.contains("1 does not know [[coupling]], expected 2"), "{error}");
}

#[test]
fn schema_1_knows_no_laws_but_constants() {
    let text = machine("[[run]]\nname = \"a\"\n").replace("schema = 2", "schema = 1");
    assert_eq!(read(&text).schema, 1);
    let learned = bearing("A", 0.1, &format!("{CONSTANT}\nlearned = {{ reference_rpm = 5000 }}"));
    let text = machine(&learned).replace("schema = 2", "schema = 1");
    let error = rotor_file::parse("rotor.toml", &text).unwrap_err().to_string();
    assert!(error.contains("expected 2"), "{error}");
}

#[test]
fn slow_roll_is_subtracted_and_refused_without_every_probe() {
    let rotor = read(&machine("[[run]]\nname = \"up\"\n\n[[run]]\nname = \"slow\"\nslow_roll = true\n"));
    let head = "run,speed_rpm,AX_cos_um,AX_sin_um\n";
    let text = format!("{head}slow,200,1.0,2.0\nslow,210,3.0,2.0\nup,3000,10.0,-4.0\nup,3100,,\n");
    let readings = measurement::parse("measured.csv", &text, &rotor).unwrap();
    assert_eq!(readings.len(), 2);
    let y = readings[0].probes[0].unwrap() * 1e6;
    assert!((y.re - 8.0).abs() < 1e-9 && (-y.im - -6.0).abs() < 1e-9, "{y}");
    assert_eq!(readings[1].probes[0], None);
    let fast = format!("{head}slow,1600,1,1\nup,3000,10.0,-4.0\n");
    let error = measurement::parse("measured.csv", &fast, &rotor).unwrap_err().to_string();
    assert!(error.contains("1600 rpm of 3000") && error.contains("half the fastest"), "{error}");
    let lost = format!("{head}slow,200,,\nup,3000,10.0,-4.0\n");
    let error = measurement::parse("measured.csv", &lost, &rotor).unwrap_err().to_string();
    assert!(error.contains("no reading of probe AX"), "{error}");
    assert!(measurement::parse("measured.csv", &format!("{head}slow,200,1,1\n"), &rotor).is_err());
}

#[test]
fn reading_below_film_range_is_refused_with_speed_and_bearing() {
    let film = "film = { kind = \"plain\", diameter_m = 0.1, length_m = 0.05, radial_clearance_m = 1e-4, \
                viscosity_pa_s = 0.02, load_n = 3000.0 }";
    let rotor = read(&machine(&bearing("A", 0.1, film)));
    let text = |rpm: f64| format!("speed_rpm,AX_cos_um,AX_sin_um\n{rpm},1.0,2.0\n3000,1.0,2.0\n");
    assert!(measurement::parse("m.csv", &text(2000.0), &rotor).is_ok());
    let error = measurement::parse("m.csv", &text(3.0), &rotor).unwrap_err().to_string();
    assert!(error.contains("at 3 rpm, bearing \"A\"") && error.contains("0.95"), "{error}");
}

#[test]
fn gap_voltages_round_trip_and_invalid_ones_are_refused() {
    let rotor = read(&machine("[[run]]\nname = \"a\"\n"));
    let text =
        |gap: &str| format!("speed_rpm,AX_cos_um,AX_sin_um,AX_gap_v\n3000,1.0,2.0,{gap}\n3100,1.0,2.0,\n");
    let readings = measurement::parse("m.csv", &text("-9.25"), &rotor).unwrap();
    assert_eq!([&readings[0].gaps_v, &readings[1].gaps_v], [&vec![Some(-9.25)], &vec![None]]);
    let mut written = Vec::new();
    measurement::write(&mut written, &rotor, &readings).unwrap();
    let again = measurement::parse("m.csv", std::str::from_utf8(&written).unwrap(), &rotor).unwrap();
    assert_eq!(again, readings);
    let error = measurement::parse("m.csv", &text("9.25"), &rotor).unwrap_err().to_string();
    assert!(error.contains("row 2, column AX_gap_v: 9.25 is no gap voltage"), "{error}");
}

#[test]
fn machine_built_in_code_with_unknown_effect_is_refused() {
    let mut rotor = read(&machine("[[run]]\nname = \"a\"\n"));
    assert!(rotor.validate().is_ok());
    let kind = "gremlins".to_string();
    rotor.effect.push(EffectEntry { kind, at: None, parameters: Default::default() });
    let error = rotor.validate().unwrap_err().to_string();
    assert!(error.contains("there is no effect \"gremlins\""), "{error}");
}
