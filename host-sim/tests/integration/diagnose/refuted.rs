//! A stated weight that is not true, as a user is told of it.

use nalgebra::{Complex, DVector};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge::sample;
use rotor_edge_desktop::diagnose::best_fit;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::phasor_kg_m;

use super::{Case, assert_keys, json};
use crate::program::{assert_says, rotor_edge};

/// The sample before the event, as found and with two trial weights, the second of which was never put in.
fn with_a_weight_left_off() -> Case {
    const DAY_0: &str = include_str!("../../../sample/turbine/runup-day000.csv");
    let weight = |plane: &str, z: f64, angle: f64| {
        format!(
            "[[run]]\nname = \"in {plane}\"\nadded_unbalance = [{{ position_m = {z}, magnitude_g_mm = 400, angle_deg = {angle} }}]\n"
        )
    };
    let bare = rotor_file::parse("rotor.toml", sample::ROTOR).unwrap();
    let found = measurement::parse("data.csv", DAY_0, &bare).unwrap();
    let fitted = best_fit(&bare, &found).unwrap();
    let model = Model::finite_elements(&fitted.rotor);
    let noise = bare.noise.unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(16);
    // twelve equal shares add up to a normal law of unit spread
    let mut normal =
        || (0..12).map(|_| f64::from(random.next_u32()) / f64::from(u32::MAX)).sum::<f64>() - 6.0;
    let mut carrying = |run: &str, unbalance: [f64; 2]| -> Vec<Reading> {
        let added = DVector::from_iterator(2, unbalance.map(|g_mm| phasor_kg_m(g_mm, 40.0)));
        let unbalance = DVector::from_column_slice(&fitted.unbalance_kg_m) + added;
        let mut of = |r: &Reading| {
            let shown = model.response(r.speed_rad_s()).unwrap().at(&unbalance);
            let mut noisy = |y: &Complex<f64>| {
                let sigma_m = noise.sigma_m(*y);
                Some(y + Complex::new(normal(), normal()) * sigma_m)
            };
            Reading { run: Some(run.into()), probes: shown.iter().map(&mut noisy).collect(), ..r.clone() }
        };
        found.iter().map(&mut of).collect()
    };
    let all =
        [carrying("as found", [0.0, 0.0]), carrying("in 15", [400.0, 0.0]), carrying("in 16", [0.0, 0.0])];
    let stated = format!(
        "{}\n[[run]]\nname = \"as found\"\n{}{}",
        sample::ROTOR,
        weight("15", 0.12, 40.0),
        weight("16", 0.92, 100.0)
    );
    let rotor = rotor_file::parse("rotor.toml", &stated).unwrap();
    let mut data = Vec::new();
    measurement::write(&mut data, &rotor, &all.concat()).unwrap();
    Case::new(&stated, std::str::from_utf8(&data).unwrap())
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn omitted_trial_weight_is_refuted_in_text_and_json() {
        let case = with_a_weight_left_off();
        let text = String::from_utf8(rotor_edge(&case.diagnose()).stdout).unwrap();
        let says = ["unbalance_of_run@in 16", "stated weights of run in 16 are wrong", "missing altogether"];
        assert_says(&text, &says);
        let (diagnosed, improved) = (json(&case.diagnose()), json(&case.improve()));
        for answer in [&diagnosed, &improved] {
            let [refuted] = &answer["refuted_runs"].as_array().unwrap()[..] else { panic!("{answer}") };
            assert_eq!(refuted["run"], "in 16");
            assert!(refuted["probability"].as_f64().unwrap() > 0.95, "{refuted}");
            let (stated, found) = (&refuted["stated"][1], &refuted["found"][1]);
            assert_eq!([&stated["plane"], &found["plane"]], ["16", "16"]);
            for (key, expected) in [("magnitude_g_mm", 400.0), ("angle_deg", 100.0)] {
                assert!((stated[key].as_f64().unwrap() - expected).abs() < 1e-6, "{stated}");
            }
            assert!(found["magnitude_g_mm"].as_f64().unwrap() < 20.0, "{found}");
            assert_keys(found, &["angle_deg", "interval_95", "angle_95_deg"]);
            assert_says(found["account"].as_str().unwrap(), &["missing"]);
        }
        assert_eq!(improved["verdict"], "adequate", "{improved}");
        let better = std::fs::read_to_string(&case.new).unwrap();
        assert_says(&better, &["kind = \"unbalance_of_run\"", "at = \"in 16\""]);
        assert_eq!(json(&["compare", &case.new, &case.data])["verdict"], "adequate");
    }
}
