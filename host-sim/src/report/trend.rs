//! Anything over time: curves, measured points, events and flags.

use plotters::prelude::{PathElement, Polygon, Text};
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Axis, Entry, FAINT, INK, Legend, anchored, axes, curve, line, measured as circles, px, svg,
};
use super::scale::Scale;

const HEIGHT_PX: f64 = 230.0;
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
    /// Named curves.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
    /// Vertical lines with a word each: what happened then.
    pub events: Vec<(f64, String)>,
    /// Marks on the lower axis: when a flag was raised.
    pub flags: Vec<f64>,
}

/// A time series with its events.
pub fn trend(title: &str, trend: &Trend) -> String {
    let circle_entry = trend.measured.iter().map(|(label, _)| Entry::Measured(label));
    let curve_entries = trend.curves.iter().enumerate().map(|(i, (label, _))| Entry::Model(i, label));
    let legend = Legend::new(circle_entry.chain(curve_entries));
    let points = || {
        let measured = trend.measured.iter().flat_map(|(_, points)| points);
        measured.chain(trend.curves.iter().flat_map(|(_, points)| points))
    };
    let events = trend.events.iter().map(|(at, _)| *at);
    let x = Scale::around(points().map(|p| p.0).chain(events).chain(trend.flags.iter().copied()), 6);
    let values = || points().map(|p| p.1);
    // angles and features go below zero; then the axis goes around them
    let mut y = match values().any(|v| v < 0.0) {
        true => Scale::around(values(), 4),
        false => Scale::from_zero(values(), 4),
    };
    let rows = trend.events.len().min(WORD_ROWS);
    let words_from = y.to;
    y.to = y.from + (y.to - y.from) / (1.0 - WORD_ROW * rows as f64);
    let word_at = |i: usize| y.to - (y.to - words_from) * (i % WORD_ROWS) as f64 / rows as f64;
    svg(title, legend.height_px + HEIGHT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let (along, quantity) = (Some(trend.along.as_str()), Some(trend.quantity.as_str()));
        let mut chart = axes(&below, &Axis { scale: &x, name: along }, &Axis { scale: &y, name: quantity })?;
        for (i, (at, word, late)) in placed_words(&trend.events, &x).into_iter().enumerate() {
            let up = word_at(i);
            chart.draw_series([PathElement::new(vec![(at, y.from), (at, up)], line(FAINT, 1.2))])?;
            let aside = 0.012 * (x.to - x.from);
            let (h, aside) = if late { (HPos::Right, -aside) } else { (HPos::Left, aside) };
            let style = anchored(INK, h, VPos::Top);
            chart.draw_series([Text::new(word, (at + aside, up), style)])?;
        }
        if let Some((_, points)) = &trend.measured {
            circles(&mut chart, points.iter().copied())?;
        }
        for (i, (_, points)) in trend.curves.iter().enumerate() {
            curve(&mut chart, i, points)?;
        }
        let (half, height) = (0.012 * (x.to - x.from), 0.055 * (y.to - y.from));
        for at in &trend.flags {
            let mark = vec![(*at, y.from + height), (at - half, y.from), (at + half, y.from)];
            chart.draw_series([Polygon::new(mark, INK.filled())])?;
        }
        Ok(())
    })
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
