//! Faults that raw readings show before they are averaged: stale data, scatter, phases without a reference.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::model::tests::rigid_rotor;
use crate::reading::{ProbeVector, Reading};
use crate::testing::Random;

/// That of the model.
const NOISE_UM: f32 = 0.1;
const HOUR_US: u64 = 3600 * SECOND_US;

/// A node and its sender of readings as they are.
struct Line {
    node: TestNode,
    random: Random,
    period_us: u64,
    time_us: u64,
    sequence: u16,
}

impl Line {
    /// After a time in order: seven hundred readings at full rate, else a hundred.
    fn tracking(period_us: u64) -> Self {
        let mut config = config();
        // Evidence lasts for a period and a half at least.
        config.thresholds.age_limit_s = (1.5e-6 * period_us as f32).max(10.0);
        let mut node = Node::new(config).unwrap();
        node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
        let mut line = Self { node, random: Random::new(31), period_us, time_us: 0, sequence: 0 };
        for _ in 0..if period_us == PERIOD_US { 750 } else { 100 } {
            line.send_noisy(&reading(1.0), NOISE_UM);
        }
        assert_eq!(line.status(), (NodeState::Tracking, Reason::None, 0));
        line
    }

    fn send(&mut self, reading: &Reading) {
        self.time_us += self.period_us;
        self.sequence = self.sequence.wrapping_add(1);
        self.node.poll(self.time_us);
        send_exactly(&mut self.node, self.time_us, self.sequence, reading);
        sent(&mut self.node);
    }

    fn send_noisy(&mut self, reading: &Reading, sigma_um: f32) {
        let reading = noisy(reading, sigma_um, &mut self.random);
        self.send(&reading);
    }

    fn status(&self) -> (NodeState, Reason, u8) {
        now(&self.node, self.time_us)
    }

    /// How many of these readings it takes to leave `tracking: none`.
    fn readings_to_notice(&mut self, readings: impl IntoIterator<Item = Reading>) -> Option<usize> {
        readings.into_iter().position(|reading| {
            self.send(&reading);
            self.status() != (NodeState::Tracking, Reason::None, 0)
        })
    }

    /// After healthy readings again, the state is that of a machine in order.
    fn recovers(&mut self, readings: usize) {
        for _ in 0..readings {
            self.send_noisy(&reading(1.0), NOISE_UM);
        }
        assert_eq!(self.status(), (NodeState::Tracking, Reason::None, 0));
    }
}

fn turned(reading: &Reading, angle_deg: f32) -> Reading {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let turn = |p: &ProbeVector| ProbeVector {
        cos_um: cos * p.cos_um - sin * p.sin_um,
        sin_um: sin * p.cos_um + cos * p.sin_um,
    };
    let vectors: Vec<_> = reading.probes().iter().map(turn).collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap()
}

#[test]
fn identical_readings_are_blind_then_stale_at_any_pace() {
    for (period_us, repeats) in [(PERIOD_US, 3), (HOUR_US, 5), (DAY_US, 5)] {
        let mut line = Line::tracking(period_us);
        let stale = noisy(&reading(1.0), NOISE_UM, &mut line.random);
        assert_eq!(line.readings_to_notice([stale; 1800]), Some(repeats), "{period_us}");
        assert_eq!(line.status(), (NodeState::Blind, Reason::Repeated, 0b1111));
        for _ in 0..1800 {
            line.send(&stale);
            assert!(matches!(line.status().0, NodeState::Blind | NodeState::Stale));
        }
        assert_eq!(line.status(), (NodeState::Stale, Reason::Repeated, 0b1111));
        line.recovers(2);
    }
}

#[test]
fn identical_readings_from_the_start_are_noticed_too() {
    let mut node = node();
    let stale = reading(1.0);
    for step in 0..720 {
        send_exactly(&mut node, step * HOUR_US, step as u16, &stale);
        let is_noticed = now(&node, step * HOUR_US).1 == Reason::Repeated;
        assert_eq!(is_noticed, step >= 68, "{step}");
    }
}

#[test]
fn a_loop_of_ten_readings_is_noticed_in_its_second_round() {
    for period_us in [PERIOD_US, HOUR_US] {
        let mut line = Line::tracking(period_us);
        let ten: Vec<_> = (0..10).map(|_| noisy(&reading(1.0), NOISE_UM, &mut line.random)).collect();
        let noticed = line.readings_to_notice(ten.iter().copied().cycle().take(1800));
        assert!(noticed.is_some_and(|readings| (10..20).contains(&readings)), "{noticed:?}");
        assert_eq!(line.status(), (NodeState::Blind, Reason::Repeated, 0b1111));
        line.recovers(2);
    }
}

#[test]
fn one_frozen_probe_is_lost_and_named_until_it_moves() {
    let mut line = Line::tracking(PERIOD_US);
    let frozen = noisy(&reading(1.0), NOISE_UM, &mut line.random).probes()[2];
    for step in 0..1800 {
        let mut vectors = noisy(&reading(1.0), NOISE_UM, &mut line.random).probes().to_vec();
        vectors[2] = frozen;
        line.send(&Reading::new(SPEED_RPM, &vectors).unwrap());
        let expected = if step < 3 { (Reason::None, 0) } else { (Reason::Repeated, 0b0100) };
        let (_, reason, mask) = line.status();
        assert_eq!((reason, mask), expected, "{step}");
    }
    assert_eq!(line.status().0, NodeState::Tracking);
    line.recovers(1);
}

#[test]
fn vectors_of_exactly_nothing_are_lost_at_once() {
    let mut line = Line::tracking(PERIOD_US);
    let nothing = Reading::new(SPEED_RPM, &[ProbeVector { cos_um: 0.0, sin_um: -0.0 }; 4]).unwrap();
    assert_eq!(line.readings_to_notice([nothing]), Some(0));
    assert_eq!(line.status(), (NodeState::Blind, Reason::Probes, 0b1111));
    line.recovers(1);
}

#[test]
fn random_angles_are_suspicious_then_blind_within_ten_seconds() {
    for period_us in [PERIOD_US, HOUR_US] {
        let mut line = Line::tracking(period_us);
        let mut noticed = None;
        let before = line.node.counters().skipped;
        for step in 0..115 {
            let angle_deg = 180.0 * line.random.signed();
            line.send_noisy(&turned(&reading(1.0), angle_deg), NOISE_UM);
            let (state, reason, _) = line.status();
            if reason == Reason::Scatter {
                noticed = noticed.or(Some(step));
            }
            assert!(noticed.is_none() || state != NodeState::Tracking, "{step}");
        }
        assert!(noticed.is_some_and(|step| step < 10), "{noticed:?}");
        assert_eq!(line.status().1, Reason::Scatter);
        let blind = line.node.counters().skipped - before;
        assert!(blind > 60, "{blind}");
    }
}

#[test]
fn jumps_between_two_marks_are_suspicious() {
    let mut line = Line::tracking(PERIOD_US);
    let mut tracking = 0;
    for _ in 0..230 {
        let angle_deg = if line.random.signed() > 0.0 { 90.0 } else { 0.0 };
        line.send_noisy(&turned(&reading(1.0), angle_deg), NOISE_UM);
        tracking += u32::from(line.status().0 == NodeState::Tracking);
    }
    assert!(tracking < 25, "{tracking}");
}

#[test]
fn greater_noise_is_noticed_within_30_readings() {
    let amplitude_um = reading(1.0).probes()[0].amplitude_um();
    for period_us in [PERIOD_US, HOUR_US] {
        for sigma_um in [5.0 * NOISE_UM, amplitude_um] {
            let mut line = Line::tracking(period_us);
            let faulty: Vec<_> = (0..230).map(|_| noisy(&reading(1.0), sigma_um, &mut line.random)).collect();
            let noticed = line.readings_to_notice(faulty.iter().copied());
            assert!(noticed.is_some_and(|readings| readings < 30), "{sigma_um} um: {noticed:?}");
            for reading in &faulty[noticed.unwrap()..] {
                line.send(reading);
                assert_ne!(line.status(), (NodeState::Tracking, Reason::None, 0));
            }
        }
    }
}

#[test]
fn healthy_steps_of_15_per_cent_and_speeds_do_not_scatter() {
    for period_us in [PERIOD_US, HOUR_US, DAY_US] {
        let mut line = Line::tracking(period_us);
        for step in 0..5000_u16 {
            let speed_rpm = [9000.0, 9000.0, 7000.0, 9020.0][usize::from(step / 200 % 4)];
            let factor = [1.0, 1.15][usize::from(step / 50 % 2)];
            line.send_noisy(&shown(&rigid_rotor(), speed_rpm, factor), NOISE_UM);
            let (_, reason, mask) = line.status();
            assert!(!matches!(reason, Reason::Scatter | Reason::Repeated) && mask == 0, "{step}: {reason:?}");
        }
    }
}
