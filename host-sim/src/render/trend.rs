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
    /// A named band around the first curve: place, lower and upper end.
    pub band: Option<(String, Vec<[f64; 3]>)>,
    /// Vertical lines with a word each: what happened then.
    pub events: Vec<(f64, String)>,
    /// Marks on the lower axis: when a flag was raised.
    pub flags: Vec<f64>,
}

/// A time series with its events.
pub fn trend(trend: &Trend) -> Chart {
    let points = || {
        let measured = trend.measured.iter().flat_map(|(_, points)| points);
        measured.chain(trend.curves.iter().flat_map(|(_, points)| points))
    };
    let edges = || trend.band.iter().flat_map(|(_, rows)| rows.iter().flat_map(|r| [r[1], r[2]]));
    let events = trend.events.iter().map(|(at, _)| *at);
    let x = Scale::around(points().map(|p| p.0).chain(events).chain(trend.flags.iter().copied()), 6);
    let values = || points().map(|p| p.1).chain(edges());
    // angles and features go below zero; then the axis goes around them
    let y = match values().any(|v| v < 0.0) {
        true => Scale::around(values(), 4),
        false => Scale::from_zero(values(), 4),
    };
    let rows = trend.events.len().min(WORD_ROWS);
    let room = y.from + (y.to - y.from) / (1.0 - WORD_ROW * rows as f64);
    let step = y.step();
    let (bottom, top) = ((y.from / step).floor() * step, (room / step).ceil() * step);
    let word_at = |i: usize| top - (top - y.to) * ((i % WORD_ROWS) as f64 + 0.5) / rows as f64;
    let upward = Axis { from: Some(bottom), to: Some(top), step: Some(step), ..Axis::named(&trend.quantity) };
    let mut chart = Chart::of(Panel {
        x: Axis::named(&trend.along),
        y: upward,
        height_px: HEIGHT_PX,
        ..Panel::default()
    });
    for (i, (at, word, late)) in placed_words(&trend.events, &x).into_iter().enumerate() {
        chart.ground(0, Look::Faint, [[at, bottom], [at, word_at(i)]]);
        let anchor = if late { Anchor::Right } else { Anchor::Left };
        chart.write(0, anchor, [([at, word_at(i)], word)]);
    }
    let columns = [Column::of_axis(&trend.along), Column::of_axis(&trend.quantity)];
    let pairs = |points: &[(f64, f64)]| points.iter().map(|(x, y)| [*x, *y]).collect::<Vec<_>>();
    if let Some((name, rows)) = &trend.band {
        let columns = [columns[0].clone(), Column::new("from", ""), Column::new("to", "")];
        chart.draw(0, name, Look::Band(0), &columns, rows.iter().copied());
    }
    if let Some((label, points)) = &trend.measured {
        chart.draw(0, label, Look::Measured, &columns, pairs(points));
    }
    for (i, (label, points)) in trend.curves.iter().enumerate() {
        chart.draw(0, label, Look::Model(i), &columns, pairs(points));
    }
    if !trend.flags.is_empty() {
        let columns = [columns[0].clone()];
        chart.draw(0, "flag", Look::Flags, &columns, trend.flags.iter().map(|at| [*at, bottom]));
    }
    chart
}

/// Events from the highest row down, and whether a word stands to the left of its line: in an order in
/// which a line, which ends at its own word, seldom crosses another's.
fn placed_words(events: &[(f64, String)], x: &Scale) -> Vec<(f64, String, bool)> {
    let is_late = |at: f64| at > 0.5 * (x.from + x.to);
    let mut placed: Vec<_> = events.iter().map(|(at, word)| (*at, word.clone(), is_late(*at))).collect();
    let rank = |(at, _, late): &(f64, String, bool)| if *late { x.from - at } else { *at - x.from };
    placed.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    placed
}
