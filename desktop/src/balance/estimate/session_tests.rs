//! Sessions between which base and scale of a simulated machine shift.

use nalgebra::{Complex, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::{EstimateOptions, RunEstimates, estimate};
use crate::machine::drawing::{AddedUnbalance, Rotor, Run};
use crate::measurement::Reading;
use crate::model::Model;
use crate::testing::sample_rotor;
use crate::unbalance::region::UnbalanceRegion;
use crate::unbalance::{G_MM, phasor_kg_m};
use crate::units::rad_s;

type C = Complex<f64>;

/// Speeds of the dwells, rpm.
const SPEEDS_RPM: [f64; 2] = [3000.0, 4500.0];
/// The machine's own unbalance, g·mm.
const OWN_G_MM: f64 = 200.0;
/// Largest weight, g·mm.
const LARGEST_G_MM: f64 = 200.0;
/// Scatter of a probe between mountings, relative to its reading, by component.
const NOISE: f64 = 0.01;
/// Machines of each test.
const SEEDS: u64 = 80;

/// A machine that is measured in sessions; each is another machine by its shift.
struct Rig {
    rotor: Rotor,
    influence: Vec<DMatrix<C>>,
    random: StdRng,
    truths: Vec<(String, [C; 2])>,
    readings: Vec<Reading>,
}

/// How far sessions differ, standard deviations of components.
#[derive(Clone, Copy)]
struct Shift {
    /// Of the own unbalance of each plane, g·mm.
    base_g_mm: f64,
    /// Of the effect of each plane, relative.
    scale: f64,
}

impl Rig {
    fn new(influence: &[DMatrix<C>], seed: u64) -> Self {
        let random = StdRng::seed_from_u64(seed);
        Self {
            rotor: sample_rotor(),
            influence: influence.to_vec(),
            random,
            truths: Vec::new(),
            readings: Vec::new(),
        }
    }

    fn normal(&mut self) -> C {
        C::new(self.random.sample(StandardNormal), self.random.sample(StandardNormal))
    }

    /// Measures runs with random weights in a session of its own; the first of all is the base.
    fn session(&mut self, name: &str, runs: usize, stated: bool, shift: Shift) {
        let own = [0, 1].map(|_| phasor_kg_m(OWN_G_MM, 50.0) * G_MM + self.normal() * shift.base_g_mm);
        let scale = [0, 1].map(|_| C::from(1.0) + self.normal() * shift.scale);
        for k in 0..runs {
            let weight = |_| C::from_polar(LARGEST_G_MM, 0.0) * self.random.random_range(0.2..1.0);
            let mut weights = [0, 1].map(weight);
            weights
                .iter_mut()
                .for_each(|w| *w *= C::from_polar(1.0, self.random.random_range(0.0..std::f64::consts::TAU)));
            if self.truths.is_empty() {
                weights = [C::from(0.0); 2];
            }
            let run = format!("{name} {k}");
            for (s, speed_rpm) in SPEEDS_RPM.into_iter().enumerate() {
                let all = DVector::from_fn(2, |j, _| (own[j] + weights[j] * scale[j]) / G_MM);
                let y = &self.influence[s] * all;
                let probes = y.iter().map(|y| Some(y * (C::from(1.0) + self.normal() * NOISE))).collect();
                let (run, session) = (Some(run.clone()), Some(name.into()));
                self.readings.push(Reading { run, session, speed_rpm, probes, ..Reading::default() });
            }
            if stated {
                self.state(&run, weights);
            }
            self.truths.push((run, weights));
        }
    }

    /// States the weights of a run.
    fn state(&mut self, run: &str, weights: [C; 2]) {
        let placed = |j: usize| AddedUnbalance {
            position_m: self.rotor.plane[j].position_m,
            magnitude_g_mm: weights[j].norm(),
            angle_deg: weights[j].arg().to_degrees(),
        };
        let added_unbalance = [0, 1].map(placed).into_iter().filter(|a| a.magnitude_g_mm > 0.0).collect();
        self.rotor.run.push(Run { name: run.into(), added_unbalance, slow_roll: false });
    }

    fn estimate(&self) -> RunEstimates {
        estimate(
            &self.rotor,
            &self.readings,
            &EstimateOptions { trust_weights: true, ..EstimateOptions::default() },
        )
        .unwrap()
    }

    /// Intervals of the runs of this session: how many hold the magnitude, and how many there are.
    fn held(&self, found: &RunEstimates, session: &str) -> [usize; 2] {
        let mut count = [0, 0];
        for e in found.runs.iter().filter(|e| e.run.starts_with(session)) {
            let truth = self.truths.iter().find(|(run, _)| *run == e.run).unwrap().1;
            for (p, t) in e.planes.iter().zip(truth) {
                let [low, high] = p.magnitude_95_g_mm();
                count[0] += usize::from((low..=high).contains(&t.norm()));
                count[1] += 1;
            }
        }
        count
    }

    /// All runs in one session.
    fn in_one_session(mut self) -> Self {
        self.readings.iter_mut().for_each(|r| r.session = Some("one".into()));
        self
    }
}

fn influence() -> Vec<DMatrix<C>> {
    let model = Model::finite_elements(&sample_rotor());
    SPEEDS_RPM.map(|rpm| model.response(rad_s(rpm)).unwrap().per_unbalance).to_vec()
}

/// Standard deviations between sessions beside a scatter between mountings of 1 %: base 3 % of the own unbalance, scale 5 %.
const SHIFT: Shift = Shift { base_g_mm: 6.0, scale: 0.05 };

/// Shares of the intervals of a later session that hold, where so many sessions with stated weights came before it: with the
/// sessions stated, and as if all were one.
fn shares_held(sessions: usize) -> [f64; 2] {
    let influence = influence();
    let mut held = [[0, 0]; 2];
    for seed in 0..SEEDS {
        let mut rig = Rig::new(&influence, seed);
        (0..sessions).for_each(|s| rig.session(&format!("day {s}"), 6, true, SHIFT));
        rig.session("later", 2, false, SHIFT);
        let stated = rig.held(&rig.estimate(), "later");
        let rig = rig.in_one_session();
        for (sum, of) in held.iter_mut().zip([stated, rig.held(&rig.estimate(), "later")]) {
            (0..2).for_each(|i| sum[i] += of[i]);
        }
    }
    held.map(|[held, all]| held as f64 / all as f64)
}

#[test]
fn intervals_of_later_session_hold_only_with_its_shift() {
    let [with, without] = shares_held(2);
    println!("intervals hold {with:.3} with sessions, {without:.3} without");
    assert!((0.90..=0.98).contains(&with), "{with}");
    assert!(without < 0.85, "{without}");
}

#[test]
fn one_stated_run_in_the_new_session_narrows_its_intervals() {
    let influence = influence();
    let mut rig = Rig::new(&influence, 3);
    (0..3).for_each(|s| rig.session(&format!("day {s}"), 6, true, SHIFT));
    rig.session("later", 4, false, SHIFT);
    let width = |rig: &Rig| -> f64 {
        let found = rig.estimate();
        let later = found.runs.iter().filter(|e| ["later 1", "later 2", "later 3"].contains(&e.run.as_str()));
        later.flat_map(|e| &e.planes).map(UnbalanceRegion::half_width_95_g_mm).sum()
    };
    let before = width(&rig);
    let first = rig.truths.iter().find(|(run, _)| run == "later 0").unwrap().clone();
    rig.state(&first.0, first.1);
    assert!(width(&rig) < 0.8 * before, "{} of {before}", width(&rig));
}

#[test]
fn one_labelled_session_says_that_the_shift_is_assumed() {
    let mut rig = Rig::new(&influence(), 1);
    rig.session("first", 6, true, SHIFT);
    rig.session("later", 1, false, SHIFT);
    let words = rig.estimate().sessions.words;
    assert_eq!(words.len(), 4, "{words:?}");
    let said =
        ["Session later has no run", "Run later 0 counts as a new session", "is assumed", "Measure one run"];
    assert!(words.iter().zip(said).all(|(word, said)| word.contains(said)), "{words:?}");
    let rig = rig.in_one_session();
    assert!(rig.estimate().sessions.words.is_empty());
}

#[test]
fn one_probe_at_one_speed_learns_the_shift_it_can_show() {
    let mut rig = Rig::new(&influence(), 2);
    (0..2).for_each(|s| rig.session(&format!("day {s}"), 6, true, SHIFT));
    rig.session("later", 1, false, SHIFT);
    rig.rotor.probe.truncate(1);
    rig.readings.retain(|r| r.speed_rpm == SPEEDS_RPM[0]);
    rig.readings.iter_mut().for_each(|r| r.probes.truncate(1));
    let between = rig.estimate().sessions.between;
    assert!(between.base.is_finite() && between.base > 0.0 && between.sessions == 2, "{between:?}");
}
