//! Effects hidden in a simulated machine are found, or stand in the group that its data cannot tell apart.

use nalgebra::DVector;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use rotor_edge_desktop::diagnose::{
    Account, Candidate, Diagnosis, DiagnosisVerdict, best_fit, diagnose, improve, judged_fit,
};
use rotor_edge_desktop::machine::drawing::{ParameterValue, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_desktop::units::rad_s;

/// Readings of a run.
const SPEEDS: u32 = 36;

type C = nalgebra::Complex<f64>;

/// A flexible shaft with two wheels between bearings that differ, and one outside of them; a run as found and one with a
/// trial weight.
pub const MACHINE: &str = r#"
schema = 2
name = "three wheels"
noise = { relative = 0.01, floor_um = 0.05 }
tolerance = { exact = true }
shaft = [{ length_m = 1.4, outer_diameter_m = 0.09 }]
disk = [
  { name = "wheel 1", position_m = 0.45, mass_kg = 30.0, diametral_inertia_kg_m2 = 0.3, polar_inertia_kg_m2 = 0.55 },
  { name = "wheel 2", position_m = 0.75, mass_kg = 25.0, diametral_inertia_kg_m2 = 0.25, polar_inertia_kg_m2 = 0.45 },
  { name = "hub", position_m = 1.3, mass_kg = 12.0, diametral_inertia_kg_m2 = 0.05, polar_inertia_kg_m2 = 0.09 },
]
bearing = [
  { name = "A", position_m = 0.1, stiffness_n_m = { xx = 4e7, yy = 6e7 }, damping_n_s_m = { xx = 3e4, yy = 4e4 } },
  { name = "B", position_m = 1.1, stiffness_n_m = { xx = 5e7, yy = 7e7 }, damping_n_s_m = { xx = 4e4, yy = 3e4 } },
]
probe = [
  { name = "AX", bearing = "A", position_m = 0.16, angle_deg = 45 },
  { name = "AY", bearing = "A", position_m = 0.16, angle_deg = 135 },
  { name = "BX", bearing = "B", position_m = 1.04, angle_deg = 45 },
  { name = "BY", bearing = "B", position_m = 1.04, angle_deg = 135 },
]
plane = [{ name = "left", position_m = 0.45 }, { name = "right", position_m = 0.75 }]
run = [
  { name = "as found" },
  { name = "trial", added_unbalance = [{ position_m = 0.45, magnitude_g_mm = 500, angle_deg = 70 }] },
]
"#;

pub fn with(effect: &str) -> Rotor {
    rotor_file::parse("rotor.toml", &format!("{MACHINE}{effect}")).unwrap()
}

/// Speeds of a run, up to 9,000 rpm, through the bending resonance.
pub fn run_up() -> impl Iterator<Item = f64> {
    (0..SPEEDS).map(|k| 2000.0 + 200.0 * f64::from(k))
}

pub fn own_unbalance() -> [C; 2] {
    [phasor_kg_m(900.0, 30.0), phasor_kg_m(700.0, -80.0)]
}

/// What the probes show on the machine in a run with these unbalances in its planes.
pub fn shown_with(
    rotor: &Rotor,
    unbalance: [C; 2],
    speeds_rpm: impl Iterator<Item = f64>,
) -> Vec<DVector<C>> {
    let model = Model::finite_elements(rotor);
    let unbalance = DVector::from_column_slice(&unbalance);
    speeds_rpm.map(|rpm| model.response_under(rad_s(rpm), &unbalance).unwrap().at(&unbalance)).collect()
}

/// What the probes show on the machine with an effect.
fn shown(effect: &str) -> Vec<DVector<C>> {
    let own = own_unbalance();
    let trial = [own[0] + phasor_kg_m(500.0, 70.0), own[1]];
    [own, trial].into_iter().flat_map(|u| shown_with(&with(effect), u, run_up())).collect()
}

/// Readings of that in both runs, with noise.
pub fn measured(shown: &[DVector<C>], seed: u64) -> Vec<Reading> {
    measured_in(&["as found", "trial"], shown, seed)
}

/// The same in these runs, one after the other.
fn measured_in(runs: &[&str], shown: &[DVector<C>], seed: u64) -> Vec<Reading> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut noisy = |y: &C| {
        let sigma = 0.01 * y.norm() + 0.05e-6;
        let mut part = || sigma * Distribution::<f64>::sample(&StandardNormal, &mut random);
        Some(y + C::new(part(), part()))
    };
    let rows = runs.iter().flat_map(|run| run_up().map(move |speed_rpm| (run, speed_rpm))).zip(shown);
    rows.map(|((run, speed_rpm), y)| Reading {
        run: Some(run.to_string()),
        speed_rpm,
        probes: y.iter().map(&mut noisy).collect(),
        ..Reading::default()
    })
    .collect()
}

/// Asks what is missing in the machine as drawn.
#[track_caller]
fn names(label: &str, readings: &[Reading]) {
    let found = diagnose(&with(""), readings).unwrap();
    let first = found.candidates.first().map(Candidate::label);
    let group = found.indistinguishable.first().cloned().unwrap_or_default();
    let named = first.as_deref() == Some(label) || group.iter().any(|other| other == label);
    assert!(
        found.verdict != DiagnosisVerdict::Adequate && named,
        "{label}: {} Group: {group:?}, first {first:?}",
        found.summary
    );
}

/// Hides an effect, and asks.
#[track_caller]
pub fn is_found(kind: &str, at: Option<&str>, parameters: &str) {
    let place = at.map_or(String::new(), |at| format!("at = \"{at}\"\n"));
    let stated = format!("[[effect]]\nkind = \"{kind}\"\n{place}parameters = {{ {parameters} }}");
    let label = at.map_or(kind.to_string(), |at| format!("{kind}@{at}"));
    names(&label, &measured(&shown(&stated), 5));
}

#[test]
fn a_machine_that_hides_nothing_is_adequate() {
    for seed in 1..=4 {
        let found = diagnose(&with(""), &measured(&shown(""), seed)).unwrap();
        assert_eq!(found.verdict, DiagnosisVerdict::Adequate, "{}", found.summary);
    }
}

#[test]
fn judged_fit_agrees_with_diagnosis_or_bounds_it() {
    let both = |effect: &str| {
        let readings = measured(&shown(effect), 3);
        let judged = judged_fit(&with(""), &readings).unwrap().1;
        (judged, diagnose(&with(""), &readings).unwrap().nothing_missing)
    };
    let (judged, diagnosed) = both("");
    assert!((judged - diagnosed).abs() < 1e-9 && judged > 0.5, "{judged} {diagnosed}");
    let (judged, diagnosed) = both("[[effect]]\nkind = \"shaft_bow\"\nparameters = { m = [2e-5, 0.0] }");
    assert!(diagnosed <= judged && judged < 1e-6, "{judged} {diagnosed}");
}

#[test]
fn probes_that_are_exchanged_or_reversed_are_found() {
    is_found("probes_swapped", Some("B"), "");
    is_found("probe_reversed", Some("AY"), "");
}

#[test]
fn a_housing_looser_in_one_direction_is_found() {
    is_found("pedestal_by_direction", Some("A"), "kx = 4e7, ky = 2e8, m = 120.0, c = 2e4");
}

#[test]
fn a_magnetic_pull_is_found() {
    is_found("magnetic_pull", Some("wheel 2"), "k = -2e6");
}

#[test]
fn a_coupling_that_pushes_and_bends_the_shaft_is_found() {
    is_found("coupling_misaligned", None, "n = [60.0, 20.0], nm = [-10.0, 25.0]");
}

#[test]
fn a_coupling_at_the_left_end_is_found_there() {
    is_found("coupling_force", Some("left end"), "n = [50.0, 20.0]");
}

#[test]
fn a_bow_with_a_kink_is_found() {
    is_found("bow_kink", None, "half = [4e-6, 3e-6], full = [2e-6, 2e-6]");
}

#[test]
fn bent_shaft_at_slow_roll_shows_sines_between_bearings() {
    let bent = "[[effect]]\nkind = \"bow_kink\"\nparameters = { half = [1e-5, 0.0], full = [0.0, 4e-6] }";
    let none = DVector::from_element(2, C::from(0.0));
    let y = Model::finite_elements(&with(bent)).response_under(rad_s(1.0), &none).unwrap().at(&none);
    // probes at 45° and 135°, 0.06 m inside bearings 1 m apart
    for (probe, z) in [(0, 0.06), (2, 0.94)] {
        let wave = |count: f64| (count * std::f64::consts::PI * z).sin();
        let height = C::new(1e-5 * wave(1.0), 4e-6 * wave(2.0));
        for (probe, angle_deg) in [(probe, 45.0_f64), (probe + 1, 135.0)] {
            let shown = height * C::from_polar(1.0, -angle_deg.to_radians());
            assert!((y[probe] - shown).norm() < 1e-3 * shown.norm(), "{} {shown}", y[probe]);
        }
    }
}

#[test]
fn a_phase_reference_elsewhere_is_found_beside_a_trial_weight() {
    is_found("keyphasor_offset", None, "phase = 0.5");
}

#[test]
fn speeds_off_by_a_few_percent_are_found() {
    is_found("speed_factor", None, "factor = 0.93");
    is_found("speed_factor", None, "factor = 1.04");
}

#[test]
fn a_bow_that_grows_while_a_run_lasts_is_found() {
    let bow = |m: &str| shown(&format!("[[effect]]\nkind = \"shaft_bow\"\nparameters = {{ m = {m} }}"));
    let (cold, warm) = (bow("[2e-6, 0.0]"), bow("[2e-6, 6e-6]"));
    let grown = |(i, (cold, warm)): (usize, (&DVector<C>, &DVector<C>))| {
        let share = (i as u32 % SPEEDS) as f64 / f64::from(SPEEDS - 1);
        cold + (warm - cold) * C::from(share)
    };
    let grown: Vec<_> = cold.iter().zip(&warm).enumerate().map(grown).collect();
    names("thermal_bow", &measured(&grown, 6));
}

#[test]
fn a_disk_that_rubs_near_the_resonance_is_found() {
    is_found("rub", Some("wheel 2"), "k = 4e6, clearance = 6e-5, mu = 0.15");
}

#[test]
fn keyphasor_offset_without_trial_weight_is_not_tried() {
    let mut rotor = with("");
    rotor.run.pop();
    let mut readings = measured(&shown(""), 3);
    readings.truncate(SPEEDS as usize);
    let found = diagnose(&rotor, &readings).unwrap();
    assert!(found.candidates.iter().all(|c| c.effect != "keyphasor_offset"));
}

/// The machine with these runs in its file instead.
fn with_runs(runs: &str) -> Rotor {
    let (head, _) = MACHINE.split_once("run = [").unwrap();
    rotor_file::parse("rotor.toml", &format!("{head}run = [{runs}]")).unwrap()
}

/// The machine as found, and with two trial weights that its file states.
fn trials() -> Rotor {
    with_runs(
        r#"{ name = "as found" },
        { name = "first", added_unbalance = [{ position_m = 0.45, magnitude_g_mm = 500, angle_deg = 70 }] },
        { name = "second", added_unbalance = [{ position_m = 0.75, magnitude_g_mm = 600, angle_deg = -120 }] }"#,
    )
}

/// What is said of that machine where the second weight is this one.
fn with_second_weight(second: C, seed: u64) -> Diagnosis {
    let own = own_unbalance();
    let carried = [own, [own[0] + phasor_kg_m(500.0, 70.0), own[1]], [own[0], own[1] + second]];
    let shown: Vec<_> = carried.into_iter().flat_map(|u| shown_with(&trials(), u, run_up())).collect();
    diagnose(&trials(), &measured_in(&["as found", "first", "second"], &shown, seed)).unwrap()
}

#[track_caller]
fn is_refuted(second: C, expected: impl Fn(Account) -> bool) {
    let found = with_second_weight(second, 11);
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    assert_eq!(found.candidates[0].label(), "unbalance_of_run@second");
    let [refuted] = &found.refuted[..] else { panic!("{:?}", found.refuted) };
    assert!(refuted.run == "second" && refuted.probability > 0.95, "{refuted:?}");
    let [left, right] = [0, 1].map(|plane| &refuted.weights[plane]);
    assert_eq!(left.account, Some(Account::AsStated), "{}", refuted.words());
    assert!(
        right.account.is_some_and(expected) && right.found.region.holds(second * 1e6),
        "{}",
        refuted.words()
    );
}

#[test]
fn missing_or_reversed_stated_weight_is_named() {
    let stated = phasor_kg_m(600.0, -120.0);
    is_refuted(C::from(0.0), |account| account == Account::Missing);
    is_refuted(stated.conj(), |account| account == Account::OtherSense);
}

#[test]
fn stated_weight_in_other_hole_or_of_other_size_is_named() {
    let stated = phasor_kg_m(600.0, -120.0);
    is_refuted(
        stated * C::from_polar(1.0, 0.5),
        |account| matches!(account, Account::OtherHole(turned) if (turned - 0.5_f64.to_degrees()).abs() < 2.0),
    );
    is_refuted(
        stated * 1.5,
        |account| matches!(account, Account::Scaled(factor) if (factor - 1.5).abs() < 0.05),
    );
}

#[test]
fn runs_that_are_the_same_with_weights_as_stated_give_no_claim() {
    for seed in 1..=3 {
        let found = with_second_weight(phasor_kg_m(600.0, -120.0), seed);
        assert_eq!(found.verdict, DiagnosisVerdict::Adequate, "{}", found.summary);
        assert!(found.refuted.is_empty() && found.remarks.is_empty(), "{:?}", found.remarks);
    }
}

#[test]
fn with_two_runs_it_is_not_told_which_of_them_is_not_as_stated() {
    let own = own_unbalance();
    let shown: Vec<_> = [own, own].into_iter().flat_map(|u| shown_with(&with(""), u, run_up())).collect();
    let found = diagnose(&with(""), &measured(&shown, 4)).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Undecided, "{}", found.summary);
    for label in ["unbalance_of_run@trial", "unbalance_of_run@as found"] {
        assert!(found.indistinguishable[0].iter().any(|l| l == label), "{:?}", found.indistinguishable);
    }
    assert!(
        found.refuted.is_empty() && found.remarks[0].contains("With unbalance_of_run@"),
        "{:?}",
        found.remarks
    );
}

#[test]
fn run_ups_with_different_unbalance_are_found_and_corrected() {
    let rotor = with_runs(r#"{ name = "cold" }, { name = "hot" }"#);
    let own = own_unbalance();
    let turn = C::from_polar(1.1, 10.0_f64.to_radians());
    let carried = [own, own.map(|u| u * turn)];
    let shown: Vec<_> = carried.into_iter().flat_map(|u| shown_with(&rotor, u, run_up())).collect();
    let readings = measured_in(&["cold", "hot"], &shown, 8);
    let found = diagnose(&rotor, &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    let first = &found.candidates[0];
    assert_eq!(first.label(), "unbalance_of_run@hot");
    let values = (2 * 4 * readings.len()) as f64;
    assert!((first.chi2_per_value - 1.0).abs() < 3.0 * (2.0 / values).sqrt(), "{}", first.chi2_per_value);
    assert!(found.refuted.is_empty(), "no weight is stated");
    let told = |r: &String| r.starts_with("Run hot carries") && r.ends_with("more than run cold.");
    assert!(found.remarks.iter().any(told), "{:?}", found.remarks);

    let better = improve(&rotor, &readings, |_| ()).unwrap();
    assert_eq!(better.verdict, DiagnosisVerdict::Adequate, "{}", better.summary);
    assert!(better.remarks.iter().any(told), "{:?}", better.remarks);
    let [entry] = &better.rotor.effect[..] else { panic!("{:?}", better.rotor.effect) };
    let Some(ParameterValue::Phasors(u)) = entry.parameters.get("u") else { panic!("{entry:?}") };
    for (u, own) in u.iter().zip(own) {
        let change = own * (turn - 1.0);
        assert!((C::new(u[0], u[1]) - change).norm() < 0.1 * change.norm(), "{u:?} {change}");
    }
    let compared = best_fit(&better.rotor, &readings).unwrap();
    assert!((compared.chi2_per_value - 1.0).abs() < 3.0 * (2.0 / values).sqrt());
    // without the run that differs the rest is as it was, and what the file says of that run stays
    let cold: Vec<Reading> = readings.into_iter().filter(|r| r.run.as_deref() == Some("cold")).collect();
    assert_eq!(best_fit(&better.rotor, &cold).unwrap().rotor.effect, better.rotor.effect);
}

#[test]
fn one_different_run_of_eight_is_found_with_left_out_speeds() {
    let names = ["a", "b", "c", "d", "e", "f", "g", "h"];
    let rotor = with_runs(&names.map(|name| format!("{{ name = \"{name}\" }}")).join(", "));
    let own = own_unbalance();
    let carried = names.map(|name| if name == "c" { own.map(|u| u * 1.2) } else { own });
    let shown: Vec<_> = carried.into_iter().flat_map(|u| shown_with(&rotor, u, run_up())).collect();
    let found = diagnose(&rotor, &measured_in(&names, &shown, 9)).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    assert_eq!(found.candidates[0].label(), "unbalance_of_run@c");
    assert!(found.remarks.iter().any(|r| r.ends_with("more than the other runs.")), "{:?}", found.remarks);
}
