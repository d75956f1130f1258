//! The record's days as the controller's clock.

use rotor_edge_core::can::{NumberedReading, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::config::ReplayConfig;
use crate::bus::frame_bits;
use crate::edge::Deployment;

const DAY_US: f64 = 86_400e6;
/// Readings of a record follow each other at this distance at least: a reading, its result and a heartbeat take half of it.
const LEAST_SPACING_US: u64 = 20_000;
/// Age limit in median intervals of the record: one reading may be missing, two are too many.
const AGE_LIMIT_INTERVALS: f64 = 2.5;
/// Heartbeats come so many median intervals apart, lest a record of years is nothing but heartbeats.
const HEARTBEAT_INTERVALS: f64 = 10.0;
/// And this part of the record's duration, lest a long gap is nothing but heartbeats.
const HEARTBEATS: f64 = 1e5;
/// Days are told to this part: a tenth of a second, within which a reading and its answer travel.
const DAYS_TOLD: f64 = 1e6;

/// Day of a row; its number where the record has no days.
pub fn day(record: &[Reading], row: usize) -> f64 {
    record[row].time_d.unwrap_or(row as f64)
}

/// When each reading of a record is sent and judged by the controller's clock, µs.
#[derive(Debug, Clone)]
pub struct Timing {
    first_d: f64,
    listen_us: u64,
    sent_us: Vec<u64>,
    travel_us: u64,
}

impl Timing {
    /// The first reading comes when the controller has listened long enough to answer.
    pub fn of(deployment: &Deployment, record: &[Reading], config: &ReplayConfig) -> Self {
        let listen_us = config.node.listen_us;
        let first_d = if record.is_empty() { 0.0 } else { day(record, 0) };
        let mut timing = Self { first_d, listen_us, sent_us: Vec::new(), travel_us: 0 };
        for row in 0..record.len() {
            let after = timing.sent_us.last().map_or(0, |last_us| last_us.saturating_add(LEAST_SPACING_US));
            timing.sent_us.push(timing.at(day(record, row)).max(after));
        }
        if let Some(first) = record.first() {
            let frames =
                reading_frames(config.node.node, &NumberedReading::new(0, deployment.reading(first)));
            let bits: u64 = frames.iter().map(|frame| u64::from(frame_bits(frame))).sum();
            timing.travel_us = bits * 1_000_000 / u64::from(config.bus.bit_rate);
        }
        timing
    }

    /// When the row is sent.
    pub fn sent_us(&self, row: usize) -> u64 {
        self.sent_us[row]
    }

    /// When it has arrived over a bus that is idle, and is judged.
    pub fn judged_us(&self, row: usize) -> u64 {
        self.sent_us[row].saturating_add(self.travel_us)
    }

    /// A day of the record by the controller's clock; days before its first are its first.
    pub fn at(&self, day: f64) -> u64 {
        self.listen_us.saturating_add(((day - self.first_d).max(0.0) * DAY_US).round() as u64)
    }

    /// A time of the controller's clock as a day of the record.
    pub fn day(&self, time_us: u64) -> f64 {
        let since_us = time_us.saturating_sub(self.listen_us);
        ((self.first_d + since_us as f64 / DAY_US) * DAYS_TOLD).round() / DAYS_TOLD
    }
}

/// Median time between two readings, s; a day where there are no two.
fn median_interval_s(record: &[Reading]) -> f64 {
    let mut intervals: Vec<f64> =
        (1..record.len()).map(|row| day(record, row) - day(record, row - 1)).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).copied().unwrap_or(1.0) * DAY_US * 1e-6
}

/// The controller's settings for a record: how old a verdict may become, and how often it gives a sign of life.
pub fn settings(config: &ReplayConfig, record: &[Reading]) -> NodeConfig {
    let interval_s = median_interval_s(record);
    let mut node = config.node;
    node.thresholds.age_limit_s = age_limit_s(config, record);
    let duration_s = match record.len().checked_sub(1) {
        Some(last) => (day(record, last) - day(record, 0)).max(0.0) * SECONDS_A_DAY,
        None => 0.0,
    };
    let apart_s = (HEARTBEAT_INTERVALS * interval_s).max(duration_s / HEARTBEATS);
    node.heartbeat_period_us = node.heartbeat_period_us.max((apart_s * 1e6).round() as u64);
    node
}

/// As asked for, or two and a half times the median interval of the record, within what a controller takes.
pub fn age_limit_s(config: &ReplayConfig, record: &[Reading]) -> f32 {
    let usual = || (AGE_LIMIT_INTERVALS * median_interval_s(record)).clamp(0.1, 10.0 * 365.0 * SECONDS_A_DAY);
    config.age_limit_s.unwrap_or_else(|| usual() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(days: &[f64]) -> Vec<Reading> {
        let row = |day: &f64| Reading { time_d: Some(*day), speed_rpm: 3000.0, ..Reading::default() };
        days.iter().map(row).collect()
    }

    #[test]
    fn age_limit_is_two_and_a_half_median_intervals_by_default() {
        let config = ReplayConfig::default();
        let daily = record(&[0.0, 1.0, 2.0, 30.0, 31.0]);
        assert_eq!(age_limit_s(&config, &daily), 2.5 * 86_400.0);
        assert_eq!(age_limit_s(&ReplayConfig { age_limit_s: Some(60.0), ..config.clone() }, &daily), 60.0);
        assert_eq!(age_limit_s(&config, &record(&[5.0])), 2.5 * 86_400.0);
        assert_eq!(age_limit_s(&config, &record(&[0.0, 0.0, 0.0])), 0.1);
        let no_days: Vec<Reading> = daily.iter().map(|r| Reading { time_d: None, ..r.clone() }).collect();
        assert_eq!(age_limit_s(&config, &no_days), 2.5 * 86_400.0);
    }

    #[test]
    fn clock_of_a_gap_beyond_all_time_stands_at_its_end() {
        let timing = Timing { first_d: 0.0, listen_us: 100_000, sent_us: vec![u64::MAX], travel_us: 1 };
        assert_eq!((timing.at(3e8), timing.judged_us(0)), (u64::MAX, u64::MAX));
    }

    #[test]
    fn long_gap_in_fast_record_has_few_heartbeats() {
        let second_d = 1.0 / SECONDS_A_DAY;
        let days = [0.0, second_d, 2.0 * second_d, 3650.0];
        let period_us = settings(&ReplayConfig::default(), &record(&days)).heartbeat_period_us;
        assert_eq!(period_us, (3650.0 * DAY_US / 1e5) as u64);
    }

    #[test]
    fn days_and_clock_are_inverse_to_each_other() {
        let timing = Timing { first_d: 3.5, listen_us: 100_000, sent_us: vec![], travel_us: 0 };
        assert_eq!(timing.at(3.5), 100_000);
        assert_eq!(timing.at(0.0), 100_000);
        assert_eq!(timing.at(5.5), 100_000 + 2 * 86_400_000_000);
        for day in [3.5, 4.0, 127.25, 20_000.0] {
            assert_eq!(timing.day(timing.at(day) + 10_000), day);
        }
        assert_eq!(timing.day(0), 3.5);
    }
}
