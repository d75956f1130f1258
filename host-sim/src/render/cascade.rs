//! Cascade: spectra one above the other, over speed, or as a waterfall over time.

use super::chart::{Anchor, Axis, Chart, Column, Look, Panel};

const HEIGHT_PX: f64 = 440.0;
/// Height of the tallest peak, relative to the axis.
const TALLEST: f64 = 0.22;
/// What is lower than this beside the tallest peak is drawn as the foot of its line.
const VISIBLE: f64 = 0.004;

#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Where its foot stands on the axis upwards.
    pub at: f64,
    pub speed_rpm: f64,
    /// Frequency in cycles a minute, backward ones negative, and the amplitude, µm peak to peak.
    pub lines: Vec<(f64, f64)>,
}

/// The diagram; `up` names the axis upwards, with its unit, and `multiples` of the running speed are marked.
pub fn cascade(up: &str, traces: &[Trace], multiples: &[f64]) -> Chart {
    let tallest = tallest_um(traces);
    let feet = || traces.iter().map(|t| t.at);
    let (lowest, highest) = (feet().fold(f64::INFINITY, f64::min), feet().fold(f64::NEG_INFINITY, f64::max));
    let rise = if highest > lowest { (highest - lowest) * TALLEST / (1.0 - TALLEST) } else { 1.0 };
    let um = rise / tallest.max(f64::MIN_POSITIVE);
    let y = Axis { from: Some(lowest), to: Some(highest + 1.12 * rise), ..Axis::named(up) };
    let mut chart =
        Chart::of(Panel { x: Axis::named("frequency, cpm"), y, height_px: HEIGHT_PX, ..Panel::default() });
    for multiple in multiples {
        let along: Vec<_> = traces.iter().map(|t| [multiple * t.speed_rpm, t.at]).collect();
        let Some(top) = along.iter().copied().reduce(|a, b| if b[1] > a[1] { b } else { a }) else {
            continue;
        };
        let up = [top[0], highest + 1.04 * rise];
        chart.ground(0, Look::Faint, along);
        chart.ground(0, Look::Faint, [top, up]);
        chart.write(0, Anchor::Centre, [(up, named(*multiple))]);
    }
    let columns = [
        Column::new("frequency", "cpm"),
        Column::new("drawn at", ""),
        Column::new("amplitude", "µm pk-pk"),
        Column::new("speed", "rpm"),
    ];
    for trace in traces {
        let points = visible(&trace.lines, VISIBLE * tallest);
        let lifted = points.into_iter().map(|(cpm, high)| [cpm, trace.at + um * high, high, trace.speed_rpm]);
        chart.draw(0, "spectrum", Look::Model(0), &columns, lifted);
    }
    chart
}

/// The highest line of all, µm peak to peak.
pub fn tallest_um(traces: &[Trace]) -> f64 {
    traces.iter().flat_map(|t| &t.lines).map(|l| l.1).fold(0.0, f64::max)
}

fn named(multiple: f64) -> String {
    if multiple < 0.0 { format!("−{}x", -multiple) } else { format!("{multiple}x") }
}

/// Without the points that lie between feet: a figure of forty spectra is small then.
fn visible(lines: &[(f64, f64)], least: f64) -> Vec<(f64, f64)> {
    let is_foot = |i: usize| lines.get(i).is_none_or(|l| l.1 < least);
    let is_needed =
        |i: &usize| *i == 0 || *i + 1 == lines.len() || !(is_foot(*i - 1) && is_foot(*i) && is_foot(*i + 1));
    let shown = |i: usize| (lines[i].0, if is_foot(i) { 0.0 } else { lines[i].1 });
    (0..lines.len()).filter(is_needed).map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_between_peaks_are_left_out_of_cascade() {
        let lines: Vec<_> = [0.0, 0.1, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0]
            .into_iter()
            .enumerate()
            .map(|(i, high)| (i as f64, high))
            .collect();
        let kept = [(0.0, 0.0), (4.0, 0.0), (5.0, 9.0), (6.0, 0.0), (8.0, 0.0)];
        assert_eq!(visible(&lines, 0.5), kept);
    }
}
