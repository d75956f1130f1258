//! Effects hidden in a simulated machine are found, or stand in the group that its data cannot tell apart.

use nalgebra::DVector;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use rotor_edge_desktop::diagnose::{Candidate, Verdict, diagnose};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::machine::rotor_file;
use rotor_edge_desktop::measurement::{Reading, rad_s};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::unbalance::phasor_kg_m;

/// Readings of a run.
const SPEEDS: u32 = 36;

type C = nalgebra::Complex<f64>;

/// A flexible shaft with two wheels between bearings that differ, and one outside of them; a run as found and one with a
/// trial weight.
const MACHINE: &str = r#"
schema = 1
name = "three wheels"
noise = { relative = 0.01, floor_um = 0.05 }
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

fn with(effect: &str) -> Rotor {
    rotor_file::parse("rotor.toml", &format!("{MACHINE}{effect}")).unwrap()
}

/// Both runs up to 9,000 rpm, through the bending resonance: run and speed.
fn runs() -> Vec<(&'static str, f64)> {
    let run_up = |run| (0..SPEEDS).map(move |k| (run, 2000.0 + 200.0 * f64::from(k)));
    ["as found", "trial"].into_iter().flat_map(run_up).collect()
}

/// What the probes show on the machine with an effect.
fn shown(effect: &str) -> Vec<DVector<C>> {
    let model = Model::finite_elements(&with(effect));
    let at = |(run, speed_rpm): (&str, f64)| {
        let mut unbalance = DVector::from_vec(vec![phasor_kg_m(900.0, 30.0), phasor_kg_m(700.0, -80.0)]);
        if run == "trial" {
            unbalance[0] += phasor_kg_m(500.0, 70.0);
        }
        model.response_under(rad_s(speed_rpm), &unbalance).unwrap().at(&unbalance)
    };
    runs().into_iter().map(at).collect()
}

/// Readings of that with noise.
fn measured(shown: &[DVector<C>], seed: u64) -> Vec<Reading> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut noisy = |y: &C| {
        let sigma = 0.01 * y.norm() + 0.05e-6;
        let mut part = || sigma * Distribution::<f64>::sample(&StandardNormal, &mut random);
        Some(y + C::new(part(), part()))
    };
    let rows = runs().into_iter().zip(shown);
    rows.map(|((run, speed_rpm), y)| Reading {
        run: Some(run.into()),
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
        found.verdict != Verdict::Adequate && named,
        "{label}: {} Group: {group:?}, first {first:?}",
        found.summary
    );
}

/// Hides an effect, and asks.
#[track_caller]
fn is_found(kind: &str, at: Option<&str>, parameters: &str) {
    let place = at.map_or(String::new(), |at| format!("at = \"{at}\"\n"));
    let stated = format!("[[effect]]\nkind = \"{kind}\"\n{place}parameters = {{ {parameters} }}");
    let label = at.map_or(kind.to_string(), |at| format!("{kind}@{at}"));
    names(&label, &measured(&shown(&stated), 5));
}

#[test]
fn a_machine_that_hides_nothing_is_adequate() {
    for seed in 1..=4 {
        let found = diagnose(&with(""), &measured(&shown(""), seed)).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate, "{}", found.summary);
    }
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
fn a_bent_shaft_turned_slowly_shows_its_sines_between_the_bearings() {
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
fn without_a_trial_weight_a_phase_reference_elsewhere_is_not_sought() {
    let mut rotor = with("");
    rotor.run.pop();
    let mut readings = measured(&shown(""), 3);
    readings.truncate(SPEEDS as usize);
    let found = diagnose(&rotor, &readings).unwrap();
    assert!(found.candidates.iter().all(|c| c.effect != "keyphasor_offset"));
}
