//! Tables of an answer of `check`, for terminal and page.

use rotor_edge_desktop::check::modes::STRONG_LOG_DECREMENT;

use crate::answers::check::{CheckAnswer, CheckedBearing, ModeAnswer, TrialResponse, WithoutAmplitude};
use crate::scale::{number, three_digits};

/// Whether a mode has a resonance peak.
pub fn resonates(m: &ModeAnswer) -> bool {
    m.log_decrement < STRONG_LOG_DECREMENT
}

pub const BEARING_COLUMNS: [&str; 12] =
    ["bearing", "load N", "ε", "attitude °", "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"];

/// One row a bearing, at the fastest speed.
pub fn bearing_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let of = |b: &CheckedBearing| {
        let mut row = vec![b.name.clone(), b.load_n.map_or_else(absent, |l| number(l, 0))];
        let Some(at) = b.coefficients.last() else { return row };
        row.push(b.eccentricity_ratio.map_or_else(absent, |e| format!("{e:.3}")));
        // no −0.0 under a film that gives way straight down
        row.push(b.attitude_deg.map_or_else(absent, |a| format!("{:.1}", (10.0 * a).round() / 10.0 + 0.0)));
        for four in [[at.kxx, at.kxy, at.kyx, at.kyy], [at.cxx, at.cxy, at.cyx, at.cyy]] {
            row.extend(without_rounding(four).map(scientific));
        }
        row
    };
    answer.bearings.iter().map(of).collect()
}

/// A part of a table: the first column and these.
pub fn part<'a>(
    columns: &[&'a str],
    rows: &[Vec<String>],
    range: std::ops::Range<usize>,
) -> (Vec<&'a str>, Vec<Vec<String>>) {
    let names = std::iter::once(columns[0]).chain(columns[range.clone()].iter().copied()).collect();
    let one = |r: &Vec<String>| std::iter::once(r[0].clone()).chain(r[range.clone()].to_vec()).collect();
    (names, rows.iter().map(one).collect())
}

pub fn absent() -> String {
    "–".to_string()
}

/// What rounding leaves of terms that cancel, next to their neighbours, is nothing.
fn without_rounding(values: [f64; 4]) -> [f64; 4] {
    let largest = values.iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
    values.map(|v| if v.abs() < 1e-12 * largest { 0.0 } else { v })
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.2e}").replace('-', "−") }
}

pub const CRITICAL_COLUMNS: [&str; 2] = ["critical speed rpm", "turns forward"];

/// One row an undamped critical speed.
pub fn critical_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let forward = answer.critical_speeds_forward.iter();
    let row = |(rpm, forward): (&f64, &f64)| vec![number(*rpm, 0), format!("{:.0} %", forward * 100.0)];
    answer.critical_speeds_rpm.iter().zip(forward).map(row).collect()
}

pub const DAMPED_COLUMNS: [&str; 4] = ["critical speed rpm", "log decrement", "whirl", "range"];

/// Damped critical speeds inside and outside of the range, ascending.
pub fn damped_critical(answer: &CheckAnswer) -> Vec<&ModeAnswer> {
    let mut all: Vec<&ModeAnswer> =
        answer.damped_critical_speeds.iter().chain(&answer.damped_critical_speeds_outside).collect();
    all.sort_by(|a, b| a.speed_rpm.total_cmp(&b.speed_rpm));
    all
}

/// One row a damped critical speed that has a resonance peak.
pub fn damped_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let [from, to] = answer.range_rpm;
    let place = |speed_rpm: f64| match speed_rpm {
        s if s < from => "below",
        s if s > to => "above",
        _ => "inside",
    };
    let row = |m: &ModeAnswer| {
        vec![number(m.speed_rpm, 0), decrement(m), m.whirl.into(), place(m.speed_rpm).into()]
    };
    damped_critical(answer).into_iter().filter(|m| resonates(m)).map(row).collect()
}

/// A log decrement, or that there is none.
pub fn decrement(m: &ModeAnswer) -> String {
    if m.log_decrement == 0.0 { "undamped".into() } else { three_digits(m.log_decrement) }
}

pub const MODE_COLUMNS: [&str; 4] = ["frequency rpm", "of the speed", "log decrement", "whirl"];

/// One row a damped mode at the fastest speed, of those that have a resonance peak or of the others.
pub fn mode_rows(answer: &CheckAnswer, resonant: bool) -> Vec<Vec<String>> {
    let row = |m: &ModeAnswer| {
        let of_speed = match m.speed_rpm {
            0.0 => absent(),
            speed_rpm => format!("{:.2}", m.frequency_rpm / speed_rpm),
        };
        vec![number(m.frequency_rpm, 0), of_speed, decrement(m), m.whirl.into()]
    };
    answer.fastest_modes().filter(|m| resonates(m) == resonant).map(row).collect()
}

pub const REAL_COLUMNS: [&str; 2] = ["time constant s", "motion"];

/// One row a root that does not oscillate.
pub fn real_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let row = |rate: &f64| {
        let motion = if *rate > 0.0 { "grows" } else { "decays" };
        vec![three_digits(rate.abs().recip()), motion.into()]
    };
    answer.overdamped_roots_rad_s.iter().map(row).collect()
}

pub const PEAK_COLUMNS: [&str; 8] =
    ["probe", "peak rpm", "µm pk-pk", "amplification", "critical", "margin %", "needed %", "kept"];
/// How many of them do not need a running range.
pub const WITHOUT_RANGE: usize = 5;

/// One row a maximum of a probe.
pub fn peak_rows(response: &TrialResponse) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    for probe in &response.probes {
        rows.extend(probe.peaks.iter().map(|p| {
            vec![
                probe.name.clone(),
                number(p.speed_rpm, 0),
                three_digits(p.amplitude_um_pk_pk),
                p.amplification.map_or_else(absent, |a| number(a, 1)),
                p.critical_speed_rpm.map_or_else(absent, |s| number(s, 0)),
                percent(p.margin_percent),
                percent(p.needed_percent),
                kept(p.margin_kept),
            ]
        }));
    }
    rows
}

pub const WITHOUT_COLUMNS: [&str; 5] = ["critical speed rpm", "unbalance", "margin %", "needed %", "kept"];

/// One row a critical speed that has no amplitude.
pub fn without_amplitude_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let row = |c: &WithoutAmplitude| {
        vec![
            number(c.speed_rpm, 0),
            if c.excited { "excites it" } else { "does not excite it" }.into(),
            percent(c.margin_percent),
            percent(c.needed_percent),
            kept(c.margin_kept),
        ]
    };
    answer.critical_speeds_without_amplitude.iter().map(row).collect()
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(absent, |p| number(p, 0))
}

fn kept(value: Option<bool>) -> String {
    value.map_or_else(absent, |kept| if kept { "yes" } else { "no" }.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_residue_is_hidden_and_small_terms_are_shown() {
        assert_eq!(without_rounding([3e7, 1.7e-7, -1.7e-7, 2e7]), [3e7, 0.0, 0.0, 2e7]);
        assert_eq!(without_rounding([3e7, 5.0, 0.0, 2e7]), [3e7, 5.0, 0.0, 2e7]);
    }
}
