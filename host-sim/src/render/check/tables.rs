//! Tables and sentences of an answer of `check`, for terminal and page.

use crate::answers::check::{CheckAnswer, CheckedBearing, ModeAnswer, TrialResponse};
use crate::scale::{number, three_digits};

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

fn absent() -> String {
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

/// Why there is none, if there is none.
pub fn no_critical_speed(answer: &CheckAnswer) -> Option<&'static str> {
    answer.critical_speeds_rpm.is_empty().then_some(
        "None: without damping and without what does work on a closed orbit, the bearings would not hold the shaft, as \
         films that push it out across the load; look at the damped modes.",
    )
}

/// One row an undamped critical speed.
pub fn critical_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let forward = answer.critical_speeds_forward.iter();
    let row = |(rpm, forward): (&f64, &f64)| vec![number(*rpm, 0), format!("{:.0} %", forward * 100.0)];
    answer.critical_speeds_rpm.iter().zip(forward).map(row).collect()
}

pub const DAMPED_COLUMNS: [&str; 3] = ["critical speed rpm", "log decrement", "whirl"];

/// Why the range has no damped critical speed, if it has none.
pub fn no_damped_critical_speed(answer: &CheckAnswer) -> Option<String> {
    let [from, to] = answer.range_rpm.map(|s| number(s, 0));
    answer.damped_critical_speeds.is_empty().then(|| format!("None from {from} to {to} rpm."))
}

/// One row a damped critical speed.
pub fn damped_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let row = |m: &ModeAnswer| vec![number(m.speed_rpm, 0), three_digits(m.log_decrement), m.whirl.into()];
    answer.damped_critical_speeds.iter().map(row).collect()
}

pub const MODE_COLUMNS: [&str; 4] = ["frequency rpm", "of the speed", "log decrement", "whirl"];

/// One row a damped mode at the fastest speed.
pub fn mode_rows(answer: &CheckAnswer) -> Vec<Vec<String>> {
    let row = |m: &ModeAnswer| {
        vec![
            number(m.frequency_rpm, 0),
            format!("{:.2}", m.frequency_rpm / m.speed_rpm),
            three_digits(m.log_decrement),
            m.whirl.into(),
        ]
    };
    answer.fastest_modes().map(row).collect()
}

pub fn stability(answer: &CheckAnswer) -> String {
    let [from, to] = answer.range_rpm.map(|s| number(s, 0));
    match &answer.stability_threshold {
        None => format!("Stable from {from} to {to} rpm: every log decrement is positive."),
        Some(t) if t.from_the_first => {
            format!("Unstable at {from} rpm already: it whirls at {} rpm.", number(t.frequency_rpm, 0))
        }
        Some(t) => format!(
            "Unstable from {} rpm on: there it begins to whirl at {} rpm.",
            number(t.speed_rpm, 0),
            number(t.frequency_rpm, 0)
        ),
    }
}

pub const PEAK_COLUMNS: [&str; 6] =
    ["probe", "peak at rpm", "µm pk-pk", "amplification", "margin %", "needed %"];

/// One row a maximum of a probe.
pub fn peak_rows(response: &TrialResponse) -> Vec<Vec<String>> {
    let percent = |p: Option<f64>| p.map_or_else(absent, |p| format!("{p:.0}").replace('-', "−"));
    let mut rows = Vec::new();
    for probe in &response.probes {
        rows.extend(probe.peaks.iter().map(|p| {
            vec![
                probe.name.clone(),
                number(p.speed_rpm, 0),
                three_digits(p.amplitude_um * 2.0),
                p.amplification.map_or_else(absent, |a| format!("{a:.1}")),
                percent(p.margin_percent),
                percent(p.needed_percent),
            ]
        }));
    }
    rows
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
