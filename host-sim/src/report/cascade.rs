//! Cascade: spectra one above the other, over speed, or as a waterfall over time.

use plotters::prelude::{LineSeries, PathElement, Text};
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{Axis, FAINT, anchored, axes, line, model_colour, svg};
use super::scale::Scale;

const HEIGHT_PX: f64 = 420.0;
/// Height of the tallest peak, relative to the axis.
const TALLEST: f64 = 0.22;
/// What is lower than this beside the tallest peak is drawn as the foot of its line.
const VISIBLE: f64 = 0.004;

/// One spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Where its foot stands on the axis upwards.
    pub at: f64,
    /// Speed of rotation, rpm.
    pub speed_rpm: f64,
    /// Frequency in cycles a minute, backward ones negative, and the amplitude, µm peak to peak.
    pub lines: Vec<(f64, f64)>,
}

/// The diagram; `up` names the axis upwards, with its unit, and `multiples` of the running speed are marked.
pub fn cascade(title: &str, up: &str, traces: &[Trace], multiples: &[f64]) -> String {
    let tallest = tallest_um(traces);
    let frequencies = traces.iter().flat_map(|t| t.lines.first().into_iter().chain(t.lines.last()));
    let x = Scale::around(frequencies.map(|l| l.0), 6);
    let mut y = Scale::around(traces.iter().map(|t| t.at), 6);
    y.to += (y.to - y.from) * TALLEST / (1.0 - TALLEST);
    let um = TALLEST * (y.to - y.from) / tallest.max(f64::MIN_POSITIVE);
    svg(title, HEIGHT_PX, |sheet| {
        let frequency = Axis { scale: &x, name: Some("frequency, cpm") };
        let mut chart = axes(sheet, &frequency, &Axis { scale: &y, name: Some(up) })?;
        for multiple in multiples {
            let along: Vec<_> = traces.iter().map(|t| (multiple * t.speed_rpm, t.at)).collect();
            let Some(top) = along.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a }) else {
                continue;
            };
            let up = (top.0, y.to - 0.06 * (y.to - y.from));
            chart.draw_series([PathElement::new(vec![top, up], line(FAINT, 0.75))])?;
            chart.draw_series(LineSeries::new(along, line(FAINT, 0.75)))?;
            let label = anchored(FAINT, HPos::Center, VPos::Bottom);
            chart.draw_series([Text::new(named(*multiple), up, label)])?;
        }
        for trace in traces {
            let points = visible(&trace.lines, VISIBLE * tallest);
            let lifted = points.into_iter().map(|(frequency, high)| (frequency, trace.at + um * high));
            chart.draw_series(LineSeries::new(lifted, line(model_colour(0), 1.0)))?;
        }
        Ok(())
    })
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
    fn feet_between_peaks_are_left_out_and_peaks_keep_their_own_feet() {
        let lines: Vec<_> = [0.0, 0.1, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0]
            .into_iter()
            .enumerate()
            .map(|(i, high)| (i as f64, high))
            .collect();
        let kept = [(0.0, 0.0), (4.0, 0.0), (5.0, 9.0), (6.0, 0.0), (8.0, 0.0)];
        assert_eq!(visible(&lines, 0.5), kept);
    }
}
