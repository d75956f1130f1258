use nalgebra::Complex;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::library::Library;
use super::stated::Weights;
use super::*;
use crate::balance::optimum::Criterion;
use crate::measurement::{ProbeRecord, Reading};
use crate::units::SAME_SPEED;

type C = Complex<f64>;

const TABLE: &str = "run,plane,magnitude_g_mm,angle_deg\nT1,A,25,0\nT2,B,25,90\nT3,A,25,90\nT3,B,20,180\n";
const RUNS: [&str; 4] = ["base", "T1", "T2", "T3"];
/// Influence of planes A and B at four probes, µm per g·mm.
const INFLUENCE: [[[f64; 2]; 2]; 4] = [
    [[1.2, -0.4], [0.3, 0.8]],
    [[0.5, 1.1], [-0.6, 0.2]],
    [[0.2, 0.3], [1.1, -0.2]],
    [[-0.4, 0.1], [0.3, 1.0]],
];

fn influence(probe: usize) -> [C; 2] {
    INFLUENCE[probe].map(|[re, im]| C::new(re, im))
}

fn own() -> [C; 2] {
    [C::from_polar(30.0, 0.7), C::from_polar(20.0, -1.7)]
}

fn weights() -> Weights {
    Weights::parse("w.csv", TABLE, false).unwrap()
}

fn request() -> CorrectionRequest {
    CorrectionRequest { same_speed: SAME_SPEED, ..CorrectionRequest::default() }
}

/// Runs with noise relative to each reading; `seen` is what becomes of a phasor before it is written down.
fn measured(runs: &[&str], relative: f64, seed: u64, seen: impl Fn(usize, C) -> C) -> ProbeRecord {
    let mut random = StdRng::seed_from_u64(seed);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let reading = |(k, run): (usize, &&str)| {
        let added = weights().of(run);
        let at = |p: usize| {
            let clean: C =
                influence(p).iter().zip(own().iter().zip(&added)).map(|(a, (u, w))| a * (u + w)).sum();
            Some(seen(p, clean * (1.0 + relative * C::new(normal(), normal()))) * 1e-6)
        };
        Reading {
            run: Some((*run).to_string()),
            speed_rpm: 1445.7 + 2.7 * k as f64,
            probes: (0..4).map(at).collect(),
            ..Reading::default()
        }
    };
    ProbeRecord {
        unit: "um".into(),
        conditions: Vec::new(),
        probes: ["1X", "1Y", "2X", "2Y"].map(String::from).to_vec(),
        readings: runs.iter().enumerate().map(reading).collect(),
    }
}

fn solved(series: &ProbeRecord, request: &CorrectionRequest) -> Result<Correction, Error> {
    correct(&runs::machine(series, &weights(), request)?, request)
}

fn said(series: &ProbeRecord, request: &CorrectionRequest) -> String {
    solved(series, request).unwrap_err().to_string()
}

#[test]
fn speeds_within_same_speed_limit_are_grouped_with_a_remark() {
    let series = measured(&RUNS, 0.0, 0, |_, y| y);
    let found = solved(&series, &request()).unwrap();
    for (w, own) in found.weights.iter().zip(own()) {
        assert!((w.wanted_g_mm + own).norm() < 1e-9);
    }
    assert!(found.doubts.iter().any(|d| d.contains("from 1445.7 to 1453.8")), "{:?}", found.doubts);
    let why = said(&series, &CorrectionRequest { same_speed: 0.001, ..request() });
    assert!(why.contains("differ by 0.19 %") && why.contains("--same-speed"), "{why}");
}

#[test]
fn weight_intervals_and_residual_bounds_cover_95_percent() {
    const DRAWS: u64 = 300;
    let min_max = CorrectionRequest {
        wanted: Wanted { criterion: Criterion::MinMax, ..Wanted::default() },
        ..request()
    };
    for (name, request, draws) in [
        ("least squares", request(), DRAWS),
        ("stated noise", CorrectionRequest { noise: Some([0.02, 0.0]), ..request() }, DRAWS),
        ("min-max", min_max, 60),
    ] {
        let (mut inside, mut turned, mut below, mut count) = (0, 0, 0, 0);
        for seed in 0..draws {
            let found = solved(&measured(&RUNS, 0.02, seed, |_, y| y), &request).unwrap();
            let placed: Vec<C> = found.weights.iter().map(|w| w.filling.sum_g_mm()).collect();
            for (w, own) in found.weights.iter().zip(own()) {
                let ([from, to], half_deg) = w.interval_95.unwrap();
                inside += u32::from((from..=to).contains(&own.norm()));
                turned += u32::from((w.wanted_g_mm / -own).arg().to_degrees().abs() <= half_deg);
            }
            for (p, l) in found.left.iter().enumerate() {
                let truly: C =
                    influence(p).iter().zip(own().iter().zip(&placed)).map(|(a, (u, w))| a * (u + w)).sum();
                below += u32::from(truly.norm() <= l.after_at_most.unwrap());
            }
            count += 2;
        }
        let share = |n: u32, of: u32| f64::from(n) / f64::from(of);
        let [inside, turned, below] = [share(inside, count), share(turned, count), share(below, 2 * count)];
        println!("{name}: magnitude {inside:.3}, angle {turned:.3}, vibration left {below:.3}");
        assert!(
            (0.90..=0.99).contains(&inside) && (0.90..=0.99).contains(&turned),
            "{name}: {inside} {turned}"
        );
        assert!(below >= 0.95, "{name}: {below}");
    }
}

#[test]
fn reversed_phases_are_refused_or_doubted_without_redundancy() {
    let why = said(&measured(&RUNS, 0.005, 1, |_, y| y.conj()), &request());
    assert!(why.starts_with("the phases of all probes are reversed, lag entered as lead"), "{why}");
    let one = said(&measured(&RUNS, 0.005, 1, |p, y| if p == 2 { y.conj() } else { y }), &request());
    assert!(one.starts_with("the phases of 2X are reversed"), "{one}");
    // no redundancy: the answer is wrong, and that it may be is said
    let cannot = Weights { rows: weights().rows[..2].to_vec(), ..weights() };
    let series = measured(&RUNS[..3], 0.005, 1, |_, y| y.conj());
    let machine = runs::machine(&series, &cannot, &request()).unwrap();
    assert!(machine.doubts.iter().any(|d| d.contains("lag as lead")), "{:?}", machine.doubts);
    for seed in 0..200 {
        let right = measured(&RUNS, 0.05, seed, |_, y| y);
        assert!(solved(&right, &request()).is_ok(), "{seed}");
    }
}

#[test]
fn refusal_names_noise_or_planes_with_same_effect() {
    let noise = CorrectionRequest { noise: Some([0.0, 60.0]), ..request() };
    let why = said(&measured(&RUNS, 0.0, 0, |_, y| y), &noise);
    assert!(why.contains("is below the noise") && !why.contains("same effect"), "{why}");
    let mut machine = runs::machine(&measured(&RUNS, 0.001, 0, |_, y| y), &weights(), &request()).unwrap();
    for c in &mut machine.coefficients {
        c.per_weight[1] = 2.0 * c.per_weight[0];
    }
    let why = correct(&machine, &request()).unwrap_err().to_string();
    assert!(why.contains("have the same effect"), "{why}");
}

#[test]
fn kept_coefficients_round_trip_and_solve_one_run() {
    let machine = runs::machine(&measured(&RUNS, 0.01, 3, |_, y| y), &weights(), &request()).unwrap();
    let kept = Library::of(&machine, vec!["trial.csv".into()]);
    let text = kept.text().unwrap();
    let library = Library::parse("c.toml", &text).unwrap();
    assert_eq!(kept, library);
    // later, the base run twice: its noise is known, and the intervals hold both
    let now = measured(&["base"; 2], 0.01, 4, |_, y| y);
    let once = CorrectionRequest { same_speed: 0.01, ..request() };
    let found = correct(&library.machine(&now, &once).unwrap(), &once).unwrap();
    for (w, own) in found.weights.iter().zip(own()) {
        assert!((w.wanted_g_mm + own).norm() < 0.05 * own.norm(), "{}", w.wanted_g_mm);
    }
    let other = ProbeRecord { unit: "mil".into(), ..now.clone() };
    let why = library.machine(&other, &once).unwrap_err().to_string();
    assert!(why.contains("in mil and the coefficients are in um"), "{why}");
    let broken = text.replacen("per_g_mm = [[", "per_g_mm = [[1.0, 1.0], [", 1);
    assert!(Library::parse("c.toml", &broken).unwrap_err().to_string().contains("a coefficient for each"));
}

#[test]
fn trim_weights_add_to_run_and_unused_planes_stay_unchanged() {
    let series = measured(&RUNS, 0.0, 0, |_, y| y);
    let found = solved(&series, &CorrectionRequest { onto: Some("T3".into()), ..request() }).unwrap();
    for (j, w) in found.weights.iter().enumerate() {
        assert!((w.wanted_g_mm + own()[j] + weights().of("T3")[j]).norm() < 1e-9);
    }
    let one = solved(&series, &CorrectionRequest { planes: vec!["B".into()], ..request() }).unwrap();
    assert_eq!(one.weights.len(), 1);
    let cost = |w: C| -> f64 {
        (0..4).map(|p| (influence(p)[0] * own()[0] + influence(p)[1] * (own()[1] + w)).norm_sqr()).sum()
    };
    let best = one.weights[0].wanted_g_mm;
    for step in [C::new(0.1, 0.0), C::new(0.0, 0.1)] {
        assert!(cost(best) < cost(best + step) && cost(best) < cost(best - step));
    }
    let why = said(&series, &CorrectionRequest { planes: vec!["C".into()], ..request() });
    assert!(why.contains("there is no plane \"C\", expected one of \"A\", \"B\""), "{why}");
    let why = said(&series, &CorrectionRequest { onto: Some("T9".into()), ..request() });
    assert!(why.contains("there is no run \"T9\""), "{why}");
}

#[test]
fn runs_that_contradict_each_other_are_doubted() {
    let mut series = measured(&RUNS, 0.0, 0, |_, y| y);
    series.readings[3].probes.iter_mut().flatten().for_each(|y| *y *= C::from_polar(1.6, 0.5));
    let found = solved(&series, &request()).unwrap();
    assert!(found.doubts.iter().any(|d| d.contains("contradict each other")), "{:?}", found.doubts);
}
