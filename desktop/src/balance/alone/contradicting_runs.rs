//! Runs that contradict each other, drawn at random: which run is named, how often a sound one is, and whether intervals hold.

use nalgebra::Complex;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::stated::Weights;
use super::{Correction, CorrectionRequest, correct, runs};
use crate::error::Error;
use crate::measurement::{ProbeRecord, Reading};

type C = Complex<f64>;

const PROBES: usize = 4;

/// Runs of a machine of one plane, R0 without a weight, and what is stated of them.
struct Rig {
    random: StdRng,
    influence: Vec<C>,
    own: C,
    /// What sits in each run, g·mm.
    weights: Vec<C>,
}

impl Rig {
    fn new(runs: usize, seed: u64) -> Self {
        let mut random = StdRng::seed_from_u64(seed);
        let influence = (0..PROBES).map(|_| C::new(normal(&mut random), normal(&mut random))).collect();
        let own = C::from_polar(40.0, random.random_range(0.0..6.3));
        let weights =
            (0..runs).map(|r| C::from_polar(if r == 0 { 0.0 } else { 30.0 }, 2.1 * r as f64)).collect();
        Self { random, influence, own, weights }
    }

    /// Readings with noise relative to the run without weights: of each probe, and shared by all of a run.
    fn measured(&mut self, of_probe: f64, of_run: f64, seen: impl Fn(C) -> C) -> ProbeRecord {
        let mut readings = Vec::new();
        for (r, weight) in self.weights.iter().enumerate() {
            let shared = C::new(normal(&mut self.random), normal(&mut self.random)) * of_run;
            let probe = |a: &C| {
                let own = C::new(normal(&mut self.random), normal(&mut self.random)) * of_probe;
                Some(seen(a * (self.own * (1.0 + shared + own) + weight)) * 1e-6)
            };
            readings.push(Reading {
                run: Some(format!("R{r}")),
                speed_rpm: 1800.0,
                probes: self.influence.iter().map(probe).collect(),
                ..Reading::default()
            });
        }
        ProbeRecord {
            unit: "um".into(),
            conditions: Vec::new(),
            probes: (0..PROBES).map(|p| format!("P{p}")).collect(),
            readings,
        }
    }

    fn stated(&self) -> Weights {
        let rows = self.weights.iter().enumerate().skip(1).map(|(r, w)| (format!("R{r}"), 0, *w)).collect();
        Weights { planes: vec!["A".into()], rows, ..Weights::default() }
    }
}

fn normal(random: &mut StdRng) -> f64 {
    random.sample(StandardNormal)
}

fn solved(series: &ProbeRecord, weights: &Weights) -> Result<Correction, Error> {
    let request = CorrectionRequest { same_speed: 0.01, ..CorrectionRequest::default() };
    correct(&runs::machine(series, weights, &request)?, &request)
}

#[test]
fn weight_50_degrees_off_is_named_left_out_and_measured() {
    for seed in 0..40 {
        let mut rig = Rig::new(6, seed);
        let series = rig.measured(0.01, 0.0, |y| y);
        let wrong = 1 + seed as usize % 5;
        let mut stated = rig.stated();
        stated.rows[wrong - 1].2 *= C::from_polar(1.0, -50_f64.to_radians());
        let found = solved(&series, &stated).unwrap();
        let told = found.doubts.join(" ");
        assert!(told.contains(&format!("The run \"R{wrong}\" contradicts the other runs")), "{seed}: {told}");
        assert!(told.contains("times its weight, ") && told.contains("° from the stated angle in"), "{told}");
        let off = (found.weights[0].wanted_g_mm + rig.own).norm() / rig.own.norm();
        assert!(off < 0.05, "{seed}: {off}");
        let why = solved(&rig.measured(0.01, 0.0, |y| y.conj()), &stated).unwrap_err().to_string();
        assert!(why.starts_with("the phases of all probes are reversed"), "{seed}: {why}");
        assert!(why.contains(&format!("the run \"R{wrong}\" contradicts the others")), "{seed}: {why}");
    }
}

#[test]
fn sound_run_is_left_out_in_at_most_one_case_of_fifty() {
    const DRAWS: u64 = 300;
    for (of_probe, of_run) in [(0.03, 0.0), (0.001, 0.03)] {
        for count in [4, 5, 7] {
            let left_out = (0..DRAWS).filter(|seed| {
                let mut rig = Rig::new(count, *seed);
                let found = solved(&rig.measured(of_probe, of_run, |y| y), &rig.stated()).unwrap();
                found.doubts.iter().any(|d| d.contains("left out"))
            });
            let share = left_out.count() as f64 / DRAWS as f64;
            assert!(share <= 0.02, "{count} runs, noise {of_probe} {of_run}: {share}");
        }
    }
}

#[test]
fn intervals_hold_where_runs_share_an_error_over_probes() {
    const DRAWS: u64 = 300;
    for count in [3, 4, 6] {
        let (mut size, mut angle) = (0, 0);
        for seed in 0..DRAWS {
            let mut rig = Rig::new(count, seed);
            let found = solved(&rig.measured(0.001, 0.05, |y| y), &rig.stated()).unwrap();
            let weight = &found.weights[0];
            let ([from, to], half_deg) = weight.interval_95.unwrap();
            size += u32::from((from..=to).contains(&rig.own.norm()));
            angle += u32::from((weight.wanted_g_mm / -rig.own).arg().to_degrees().abs() <= half_deg);
        }
        let [size, angle] = [size, angle].map(|n| f64::from(n) / DRAWS as f64);
        println!("{count} runs: size {size:.3}, angle {angle:.3}");
        assert!(size >= 0.90 && angle >= 0.90, "{count} runs: {size} {angle}");
    }
}

#[test]
fn too_small_stated_noise_gives_way_to_the_scatter_of_the_runs() {
    let mut rig = Rig::new(6, 1);
    let series = rig.measured(0.0, 0.05, |y| y);
    let machine = |noise| {
        let request = CorrectionRequest { noise, same_speed: 0.01, ..CorrectionRequest::default() };
        correct(&runs::machine(&series, &rig.stated(), &request).unwrap(), &request).unwrap()
    };
    let (stated, own) = (machine(Some([0.001, 0.0])), machine(None));
    assert!(stated.doubts.iter().any(|d| d.contains("more than the stated noise")), "{:?}", stated.doubts);
    assert_eq!(stated.weights[0].interval_95, own.weights[0].interval_95);
    let fitting = machine(Some([0.05, 0.0]));
    assert!(!fitting.doubts.iter().any(|d| d.contains("stated noise")), "{:?}", fitting.doubts);
}
