//! What a figure shows: panels with axes, and what is drawn in them. The page's script draws it.
//!
//! A point carries more than its place: its other columns are what a reader sees who points at it, and
//! what is saved as CSV.

use maud::{Markup, PreEscaped, html};
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::scale::round_to;

/// Digits of a number that a figure keeps: more than a screen shows.
const DIGITS: i32 = 6;

/// Panels in rows, and what is drawn in them.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Chart {
    /// In reading order.
    pub panels: Vec<Panel>,
    pub columns: usize,
    /// Whether all panels run along the same quantity, as those of a Bode plot.
    pub shares_x: bool,
    /// Charts of one group point at the same reading together.
    pub group: Option<String>,
    pub series: Vec<ChartSeries>,
    /// What the first panel of orbits shows for each reading of the group; empty where it stays as it is.
    pub turns: Vec<Turn>,
}

/// The orbits of one reading.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Turn {
    /// What tells the reading from the others, as the key columns of the other figures do.
    pub key: f64,
    pub head: Vec<String>,
    /// How far the axes reach to every side.
    pub reach: f64,
    /// Real and imaginary part of the phasors along x and y, of every path in the order in which they are drawn.
    pub paths: Vec<[f64; 4]>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Panel {
    pub head: Vec<String>,
    pub x: Axis,
    pub y: Axis,
    /// Of everything with the names of the axes, px.
    pub height_px: f64,
    /// Whether a unit is as long to the right as upwards; then the axes reach as far as [`Axis::to`] to every side.
    pub is_plane: bool,
}

/// The range of a panel in one direction.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Axis {
    /// Name and unit; without one the axis has no labels.
    pub name: Option<String>,
    /// Where it begins, if not with what is shown.
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub step: Option<f64>,
    /// Whether zero is on it.
    #[serde(skip_serializing_if = "is_false")]
    pub from_zero: bool,
    /// Names of rows at 0, 1, 2, … in place of numbers.
    pub rows: Vec<String>,
    /// Whether it is left away.
    #[serde(skip_serializing_if = "is_false")]
    pub is_hidden: bool,
    /// Whether equal ratios are equally long; then [`Axis::from`] and [`Axis::to`] are stated and positive.
    #[serde(skip_serializing_if = "is_false")]
    pub is_log: bool,
    /// The moment of zero in ISO 8601, of an axis of days; its labels are then dates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub begin: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChartSeries {
    /// As the legend says; `None` for what belongs to the paper, such as circles of a polar plot.
    pub name: Option<String>,
    /// The panel that it is drawn in.
    pub panel: usize,
    pub look: Look,
    /// What the numbers of a point are; the first two are its place.
    pub columns: Vec<Column>,
    #[serde(serialize_with = "whole_numbers_short")]
    pub rows: Vec<Vec<f64>>,
    /// In place of rows: a part of a turn, whose points the page's script computes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc: Option<Arc>,
    /// What is written at each point, of [`Look::Words`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
    /// Whether a line is drawn as a curve through its points, as a bent shaft is.
    #[serde(skip_serializing_if = "is_false")]
    pub is_curved: bool,
}

/// A part of a circle or an ellipse; the columns of its points are x, y and the angle turned, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Arc {
    /// Real and imaginary part of the phasors along x and y.
    pub path: [f64; 4],
    pub from_deg: f64,
    pub to_deg: f64,
    pub step_deg: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", content = "index", rename_all = "snake_case")]
pub enum Look {
    /// Open circles, so that a curve under them stays visible.
    Measured,
    /// A solid line of measured motion.
    MeasuredLine,
    /// The line of the model with this index, told from the others by its dashes too.
    Model(usize),
    /// A filled band of this colour; columns: place, lower edge, upper edge.
    Band(usize),
    /// Full circles of this colour.
    Dots(usize),
    /// Large open circles of this colour.
    Rings(usize),
    /// Arrow heads of this colour, or measured; third column: direction in degrees, counter-clockwise from the right.
    Arrows(Option<usize>),
    /// Full small circles of measured things.
    Marks,
    /// A faint line that nobody points at.
    Faint,
    /// A line that must not be crossed.
    Limit,
    /// Triangles that stand on the lower axis.
    Flags,
    /// Words at points, faint or not, beginning, ending or centred there.
    Words(Anchor),
    /// Cells; columns: left edge, right edge, row, value.
    Cells,
}

/// A page holds thousands of settings that are the usual ones: these are left away, and the script takes what is not there for no.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_false(value: &bool) -> bool {
    !value
}

/// Whole numbers without ".0": a page holds tens of thousands of them.
fn whole_numbers_short<S: Serializer>(rows: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let number = |value: &f64| match *value {
        value if value.fract() == 0.0 => Value::from(value as i64),
        value => Value::from(value),
    };
    serializer.collect_seq(rows.iter().map(|row| row.iter().map(number).collect::<Vec<Value>>()))
}

/// Which part of a word stands at its point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Anchor {
    Left,
    Centre,
    Right,
}

/// One number of every point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Such as "amplitude".
    pub name: String,
    /// Such as "µm pk-pk".
    pub unit: String,
    /// Whether charts of one group meet at equal values of it.
    #[serde(skip_serializing_if = "is_false")]
    pub is_key: bool,
}

impl Column {
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), is_key: false }
    }

    /// What tells readings from each other, such as their speed.
    pub fn key(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { is_key: true, ..Self::new(name, unit) }
    }

    /// Of the name of an axis, such as "time, days".
    pub fn of_axis(name: &str) -> Self {
        let (name, unit) = name.split_once(", ").unwrap_or((name, ""));
        Self::new(name, unit)
    }
}

impl Arc {
    /// Of a circle around the origin, counter-clockwise from the right.
    pub fn of_circle(radius: f64, from_deg: f64, to_deg: f64) -> Self {
        Self { path: [radius, 0.0, 0.0, -radius], from_deg, to_deg, step_deg: 3.0 }
    }
}

impl Axis {
    /// Limits follow the data.
    pub fn named(name: impl Into<String>) -> Self {
        Self { name: Some(name.into()), ..Self::default() }
    }

    /// Limits include zero.
    pub fn from_zero(name: impl Into<String>) -> Self {
        Self { from_zero: true, ..Self::named(name) }
    }
}

impl Panel {
    /// Axes along x and y of equal units, with room for `reach` to every side.
    pub fn plane(names: [&str; 2], reach: f64, height_px: f64) -> Self {
        let axis = |name: &str| Axis { to: Some(reach), ..Axis::named(name) };
        Self { x: axis(names[0]), y: axis(names[1]), height_px, is_plane: true, ..Self::default() }
    }
}

impl Chart {
    pub fn of(panel: Panel) -> Self {
        Self { panels: vec![panel], columns: 1, ..Self::default() }
    }

    pub fn draw<R: Into<Vec<f64>>>(
        &mut self,
        panel: usize,
        name: &str,
        look: Look,
        columns: &[Column],
        rows: impl IntoIterator<Item = R>,
    ) {
        self.put(panel, Some(name.into()), look, columns.to_vec(), rows);
    }

    /// Draws what belongs to the paper.
    pub fn ground<R: Into<Vec<f64>>>(&mut self, panel: usize, look: Look, rows: impl IntoIterator<Item = R>) {
        self.put(panel, None, look, Vec::new(), rows);
    }

    /// Draws a part of a turn; without a name it belongs to the paper.
    pub fn turn(&mut self, panel: usize, name: Option<&str>, look: Look, columns: &[Column], arc: Arc) {
        self.put(panel, name.map(Into::into), look, columns.to_vec(), [[0.0; 0]; 0]);
        if let Some(series) = self.series.last_mut() {
            series.arc = Some(arc);
        }
    }

    pub fn write(
        &mut self,
        panel: usize,
        anchor: Anchor,
        words: impl IntoIterator<Item = ([f64; 2], String)>,
    ) {
        let (at, words): (Vec<_>, Vec<_>) = words.into_iter().unzip();
        self.ground(panel, Look::Words(anchor), at);
        if let Some(series) = self.series.last_mut() {
            series.words = words;
        }
    }

    fn put<R: Into<Vec<f64>>>(
        &mut self,
        panel: usize,
        name: Option<String>,
        look: Look,
        columns: Vec<Column>,
        rows: impl IntoIterator<Item = R>,
    ) {
        let round = |row: R| row.into().into_iter().map(|value| round_to(value, DIGITS)).collect();
        let rows = rows.into_iter().map(round).collect();
        self.series.push(ChartSeries {
            name,
            panel,
            look,
            columns,
            rows,
            arc: None,
            words: Vec::new(),
            is_curved: false,
        });
    }

    /// The place where the page's script draws it, with the numbers.
    pub(super) fn markup(&self, title: &str) -> Markup {
        // a "<" would let a name from a file end the element
        let numbers = serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c");
        let height = format!("height:{:.0}px", self.height_px());
        html! {
            ul class="legend" {}
            div class="chart" style=(height) tabindex="0" role="group" aria-label=(title) {
                noscript { "The figure is drawn by a script of this page." }
            }
            p class="said" aria-live="polite" {}
            div class="tools" {}
            script type="application/json" { (PreEscaped(numbers)) }
        }
    }

    /// Height of all rows of panels, px.
    pub fn height_px(&self) -> f64 {
        let tallest = |row: &[Panel]| row.iter().map(|p| p.height_px).fold(0.0, f64::max);
        self.panels.chunks(self.columns.max(1)).map(tallest).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_keeps_six_digits_and_a_lost_one_is_null() {
        let mut chart = Chart::of(Panel::default());
        let columns = [Column::key("speed", "rpm"), Column::new("amplitude", "µm pk-pk")];
        chart.draw(0, "measured", Look::Measured, &columns, [[11_234.567_8, 0.123_456_78], [1.0, f64::NAN]]);
        let rows = serde_json::to_value(&chart).unwrap()["series"][0]["rows"].to_string();
        assert_eq!(rows, "[[11234.6,0.123457],[1,null]]");
    }

    #[test]
    fn rows_of_panels_are_as_high_as_their_highest() {
        let panel = |height_px| Panel { height_px, ..Panel::default() };
        let chart =
            Chart { panels: vec![panel(10.0), panel(30.0), panel(20.0)], columns: 2, ..Chart::default() };
        assert_eq!(chart.height_px(), 50.0);
    }
}
