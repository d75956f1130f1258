//! Anything over time: curves, measured points, events and flags.

use super::chart::{Anchor, Axis, Chart, Column, Look, Panel};
use crate::scale::Scale;

const HEIGHT_PX: f64 = 260.0;
/// Words of events stand above the curves, each lower than the one before, in this many rows.
const WORD_ROWS: usize = 3;
/// Height of such a row, relative to the axis.
const WORD_ROW: f64 = 0.1;

/// Several quantities of one unit along one axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trend {
    /// Name and unit of the axis to the right, as in `time, days`.
    pub along: String,
    /// Name and unit of the axis upwards, from zero unless something is below.
    pub quantity: String,
    /// Measured values, drawn as circles, with their name; may be empty.
    pub measured: Option<(String, Vec<(f64, f64)>)>,
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
    /// Named bands, each around the curve of its number: place, lower and upper end.
    pub bands: Vec<(String, Vec<[f64; 3]>)>,
    /// Named values that must not be exceeded.
    pub limits: Vec<(String, f64)>,
    /// Vertical lines with a word each: what happened then.
    pub events: Vec<(f64, String)>,
    /// Marks on the lower axis: when a flag was raised.
    pub flags: Vec<f64>,
    /// The moment of zero in ISO 8601, where the axis to the right is days since then.
    pub begin: Option<String>,
    /// Whether both axes are logarithmic; then everything is positive.
    pub is_log: bool,
    /// Whether curves bend smoothly from point to point.
    pub is_curved: bool,
}

/// The axis upwards: its ends, and how much of its length at the top belongs to the words of events.
struct Upward {
    ends: [f64; 2],
    step: Option<f64>,
    words: f64,
    is_log: bool,
}

impl Upward {
    fn of(trend: &Trend, values: impl Iterator<Item = f64> + Clone) -> Self {
        let rows = WORD_ROW * trend.events.len().min(WORD_ROWS) as f64;
        if trend.is_log {
            let [low, high] = decades(values);
            let ends = [low, high * (high / low).powf(rows / (1.0 - rows))];
            return Self { ends, step: None, words: rows, is_log: true };
        }
        // angles and features go below zero; then the axis goes around them
        let y = match values.clone().any(|v| v < 0.0) {
            true => Scale::around(values, 4),
            false => Scale::from_zero(values, 4),
        };
        let room = y.from + (y.to - y.from) / (1.0 - rows);
        let step = y.step();
        let ends = [(y.from / step).floor() * step, (room / step).ceil() * step];
        Self { ends, step: Some(step), words: (ends[1] - y.to) / (ends[1] - ends[0]), is_log: false }
    }

    /// The value at a share of the length.
    fn at(&self, share: f64) -> f64 {
        let [low, high] = self.ends;
        if self.is_log { low * (high / low).powf(share) } else { low + share * (high - low) }
    }

    /// Where the word of this event of several stands.
    fn word_at(&self, event: usize, events: usize) -> f64 {
        let rows = events.min(WORD_ROWS) as f64;
        self.at(1.0 - self.words * ((event % WORD_ROWS) as f64 + 0.5) / rows)
    }
}

/// The nearest 1, 2 or 5 times a power of ten below and above everything.
fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = if low > 0.0 && low < high { (low, high) } else { (1.0, 10.0) };
    let steps = |value: f64| {
        let decade = 10_f64.powf(value.log10().floor());
        [1.0, 2.0, 5.0, 10.0].map(|step| step * decade)
    };
    let below = steps(low).into_iter().rfind(|step| *step <= low * (1.0 + 1e-9));
    let above = steps(high).into_iter().find(|step| *step >= high * (1.0 - 1e-9));
    [below.unwrap_or(low), above.unwrap_or(high)]
}

/// A time series with its events.
pub fn trend(trend: &Trend) -> Chart {
    let points = || {
        let measured = trend.measured.iter().flat_map(|(_, points)| points);
        measured.chain(trend.curves.iter().flat_map(|(_, points)| points))
    };
    let edges = || trend.bands.iter().flat_map(|(_, rows)| rows.iter().flat_map(|r| [r[1], r[2]]));
    let limits = || trend.limits.iter().map(|(_, limit)| *limit);
    let events = trend.events.iter().map(|(at, _)| *at);
    let places = points().map(|p| p.0).chain(events).chain(trend.flags.iter().copied());
    let (x, across) = match trend.is_log {
        true => {
            let [from, to] = decades(places);
            let axis = Axis { from: Some(from), to: Some(to), is_log: true, ..Axis::named(&trend.along) };
            (Scale { from: from.log10(), to: to.log10(), ticks: Vec::new() }, axis)
        }
        false => {
            let axis = Axis { begin: trend.begin.clone(), ..Axis::named(&trend.along) };
            (Scale::around(places, 6), axis)
        }
    };
    let up = Upward::of(trend, points().map(|p| p.1).chain(edges()).chain(limits()));
    let [bottom, top] = up.ends;
    let upward = Axis {
        from: Some(bottom),
        to: Some(top),
        step: up.step,
        is_log: trend.is_log,
        ..Axis::named(&trend.quantity)
    };
    let mut chart = Chart::of(Panel { x: across, y: upward, height_px: HEIGHT_PX, ..Panel::default() });
    for (i, (at, word, late)) in placed_words(trend, &x).into_iter().enumerate() {
        let word_at = up.word_at(i, trend.events.len());
        chart.ground(0, Look::Faint, [[at, bottom], [at, word_at]]);
        let anchor = if late { Anchor::Right } else { Anchor::Left };
        chart.write(0, anchor, [([at, word_at], word)]);
    }
    draw(&mut chart, trend, bottom);
    chart
}

/// Bands, measured values, curves, limits and flags.
fn draw(chart: &mut Chart, trend: &Trend, bottom: f64) {
    let columns = [Column::of_axis(&trend.along), Column::of_axis(&trend.quantity)];
    let pairs = |points: &[(f64, f64)]| points.iter().map(|(x, y)| [*x, *y]).collect::<Vec<_>>();
    for (i, (name, rows)) in trend.bands.iter().enumerate() {
        let columns = [columns[0].clone(), Column::new("from", ""), Column::new("to", "")];
        chart.draw(0, name, Look::Band(i), &columns, rows.iter().copied());
    }
    if let Some((label, points)) = &trend.measured {
        chart.draw(0, label, Look::Measured, &columns, pairs(points));
    }
    for (i, (label, points)) in trend.curves.iter().enumerate() {
        chart.draw(0, label, Look::Model(i), &columns, pairs(points));
        if let Some(series) = chart.series.last_mut() {
            series.is_curved = trend.is_curved;
        }
    }
    let all = || {
        let measured = trend.measured.iter().flat_map(|(_, points)| points);
        measured.chain(trend.curves.iter().flat_map(|(_, points)| points)).map(|p| p.0)
    };
    let ends = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
    for (name, limit) in &trend.limits {
        chart.draw(0, name, Look::Limit, &columns, ends.map(|at| [at, *limit]));
    }
    if !trend.flags.is_empty() {
        let columns = [columns[0].clone()];
        chart.draw(0, "flag", Look::Flags, &columns, trend.flags.iter().map(|at| [*at, bottom]));
    }
}

/// Events from the highest row down, and whether a word stands to the left of its line: in an order in
/// which a line, which ends at its own word, seldom crosses another's.
fn placed_words(trend: &Trend, x: &Scale) -> Vec<(f64, String, bool)> {
    let along = |at: f64| if trend.is_log { at.log10() } else { at };
    let is_late = |at: f64| along(at) > 0.5 * (x.from + x.to);
    let mut placed: Vec<_> =
        trend.events.iter().map(|(at, word)| (*at, word.clone(), is_late(*at))).collect();
    let rank = |(at, _, late): &(f64, String, bool)| {
        if *late { x.from - along(*at) } else { along(*at) - x.from }
    };
    placed.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_axes_end_at_round_numbers_around_everything() {
        let ends = decades([3.2e5, 7.1e9].into_iter());
        assert!((ends[0] / 2e5 - 1.0).abs() < 1e-9 && (ends[1] / 1e10 - 1.0).abs() < 1e-9, "{ends:?}");
        let curve = vec![(1e6, 900.0), (1e9, 12_000.0)];
        let drawn = Trend { curves: vec![("1.".into(), curve)], is_log: true, ..Trend::default() };
        let chart = trend(&drawn);
        let panel = &chart.panels[0];
        assert!(panel.x.is_log && panel.y.is_log, "{panel:?}");
        let (from, to) = (panel.y.from.unwrap(), panel.y.to.unwrap());
        assert!((from - 500.0).abs() < 1e-6 && (to - 20_000.0).abs() < 1e-6, "{from} {to}");
    }

    #[test]
    fn limit_is_on_the_axis_and_reaches_over_all_points() {
        let drawn = Trend {
            curves: vec![("U".into(), vec![(0.0, 1.0), (9.0, 2.0)])],
            limits: vec![("limit".into(), 40.0)],
            ..Trend::default()
        };
        let chart = trend(&drawn);
        assert!(chart.panels[0].y.to.unwrap() >= 40.0);
        let limit = chart.series.iter().find(|s| s.look == Look::Limit).unwrap();
        assert_eq!(limit.rows, [[0.0, 40.0], [9.0, 40.0]]);
    }
}
