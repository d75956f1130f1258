//! What all figures share: the sheet, colours, line styles, axes and the legend.
//!
//! plotters rounds to whole units, so a pixel of the figure is `UNITS_PER_PX` of them.

use std::error::Error;
use std::ops::Range;

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::{Cartesian2d, Circle, DashedLineSeries, DrawingArea, LineSeries, PathElement, Text};
use plotters::prelude::{IntoDrawingArea, IntoFont, RGBColor, SVGBackend, ShapeStyle, TextStyle};
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::scale::Scale;

/// Width that every figure is drawn for, px of the style sheet.
pub const WIDTH_PX: f64 = 400.0;
/// Size of the text in a figure, px.
pub(super) const TEXT_PX: f64 = 12.5;
/// Height of a row of the legend, px.
const LEGEND_ROW_PX: f64 = 19.0;
/// Length of a line's sample in the legend, px.
const SAMPLE_PX: f64 = 26.0;
/// Margins around the axes, px.
const LEFT_PX: f64 = 4.0;
const RIGHT_PX: f64 = 14.0;
const TOP_PX: f64 = 8.0;
/// Least gap between neighbouring labels of an axis, px.
const BETWEEN_LABELS_PX: f64 = 3.0;
/// Room for the labels and the name of the axis below, px.
const NAMED_PX: f64 = 40.0;
/// Room around what a plane shows, relative to it.
const ROOM: f64 = 1.12;
const UNITS_PER_PX: f64 = 4.0;
/// plotters writes a font of size s as s / 1.24.
const PLOTTERS_FONT: f64 = 1.24;

pub(super) const INK: RGBColor = RGBColor(27, 27, 27);
pub(super) const FAINT: RGBColor = RGBColor(115, 115, 115);
pub(super) const GRID: RGBColor = RGBColor(222, 222, 222);

/// Curves of models, told apart without colour by their dashes. Colours by Okabe and Ito.
const LOOKS: [(RGBColor, Option<[f64; 2]>); 4] = [
    (RGBColor(0, 114, 178), None),
    (RGBColor(213, 94, 0), Some([7.0, 3.0])),
    (RGBColor(0, 128, 96), Some([2.5, 2.5])),
    (RGBColor(170, 80, 140), Some([12.0, 4.0])),
];

pub(super) type Sheet<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<Coordinate, Coordinate>>;
pub(super) type Drawn<T = ()> = Result<T, Box<dyn Error>>;

/// Draws on a white sheet; the SVG fills the width it is given and carries its title.
pub(super) fn svg(title: &str, height_px: f64, draw: impl FnOnce(&Sheet) -> Drawn) -> String {
    let (width, height) = (px(WIDTH_PX), px(height_px));
    let mut text = String::new();
    {
        let sheet = SVGBackend::with_string(&mut text, (width as u32, height as u32)).into_drawing_area();
        draw(&sheet).and_then(|()| Ok(sheet.present()?)).expect("a string takes any drawing");
    }
    let body = text.find("viewBox").and_then(|at| text[at..].find('>').map(|end| at + end + 1));
    let body = &text[body.expect("plotters opens with an svg element that has a viewBox")..];
    let title = maud::html! { title { (title) } }.into_string();
    format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" xmlns=\"http://www.w3.org/2000/svg\">{title}{body}"
    )
}

/// Pixels of the figure in units of the drawing.
pub(super) fn px(px: f64) -> i32 {
    (px * UNITS_PER_PX).round() as i32
}

/// A line of this colour and width.
pub(super) fn line(colour: RGBColor, width_px: f64) -> ShapeStyle {
    colour.stroke_width(px(width_px) as u32)
}

/// The style of the `index`-th model's curve.
pub(super) fn model_colour(index: usize) -> RGBColor {
    LOOKS[index % LOOKS.len()].0
}

/// Text in the figure's font.
pub(super) fn font(colour: RGBColor) -> TextStyle<'static> {
    ("sans-serif", TEXT_PX * UNITS_PER_PX * PLOTTERS_FONT).into_font().color(&colour)
}

/// Text placed by these edges of itself.
pub(super) fn anchored(colour: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
    font(colour).pos(Pos::new(h, v))
}

/// Writes text on the sheet.
pub(super) fn write(sheet: &Sheet, text: &str, at_px: [f64; 2], style: TextStyle) -> Drawn {
    Ok(sheet.draw(&Text::new(text, (px(at_px[0]), px(at_px[1])), style))?)
}

/// How wide a text is at most in a reader's font, px: as in the widest usual ones, Verdana and DejaVu Sans.
pub(super) fn text_width_px(text: &str) -> f64 {
    let width_em = |c: char| match c {
        'f' | 'i' | 'j' | 'l' | 't' | ' ' | '.' | ',' | ':' | ';' | '\'' | '|' | '/' => 0.40,
        'r' | 'I' | 's' | '(' | ')' | '-' | '°' | '·' => 0.55,
        'm' | 'w' | 'M' | 'W' | '%' | '–' => 1.08,
        'A'..='Z' | '−' | '+' | '=' | '<' | '>' => 0.84,
        _ => 0.65,
    };
    TEXT_PX * text.chars().map(width_em).sum::<f64>()
}

/// The ticks that carry their label where a unit is this long: all, or every second, …, so that labels stay apart.
pub(super) fn labelled(scale: &Scale, unit_px: f64) -> Vec<f64> {
    let half_px = |tick: f64| 0.5 * text_width_px(&scale.label(tick));
    let apart = |ticks: &[f64]| {
        ticks.windows(2).all(|t| (t[1] - t[0]) * unit_px >= half_px(t[0]) + half_px(t[1]) + BETWEEN_LABELS_PX)
    };
    let every = |n: usize| scale.ticks.iter().copied().step_by(n).collect::<Vec<_>>();
    (1..=scale.ticks.len()).map(every).find(|ticks| apart(ticks)).unwrap_or_default()
}

impl Axis<'_> {
    /// Room that the name and labels of an upward axis need.
    fn label_px(&self) -> f64 {
        let widths = self.scale.ticks.iter().map(|t| text_width_px(&self.scale.label(*t)));
        26.0 + widths.fold(22.0, f64::max)
    }

    /// Width over height of what [`axes`] leaves of a sheet of this size for the curves.
    pub fn aspect_beside(&self, [width_px, height_px]: [f64; 2]) -> f64 {
        self.width_beside_px(width_px) / (height_px - TOP_PX - NAMED_PX)
    }

    /// What an upward axis leaves of a sheet's width, px.
    fn width_beside_px(&self, width_px: f64) -> f64 {
        width_px - LEFT_PX - self.label_px() - RIGHT_PX
    }

    /// The axis with its name, and with these ticks labelled.
    fn coordinate(&self, labelled: Vec<f64>) -> Coordinate {
        Coordinate {
            scale: self.scale.clone(),
            labelled: if self.name.is_some() { labelled } else { Vec::new() },
        }
    }
}

/// A scale as plotters sees it.
pub(super) struct Coordinate {
    scale: Scale,
    /// Ticks that carry their label.
    labelled: Vec<f64>,
}

impl Ranged for Coordinate {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (value - self.scale.from) / (self.scale.to - self.scale.from);
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.scale.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.scale.from..self.scale.to
    }
}

impl ValueFormatter<f64> for Coordinate {
    fn format_ext(&self, value: &f64) -> String {
        if self.labelled.contains(value) { self.scale.label(*value) } else { String::new() }
    }
}

/// What an axis shows.
pub(super) struct Axis<'a> {
    pub scale: &'a Scale,
    /// Name and unit; `None` leaves its place and its ticks' labels empty.
    pub name: Option<&'a str>,
}

/// Axes with a grid on the whole of a sheet.
pub(super) fn axes<'a>(sheet: &Sheet<'a>, x: &Axis, y: &Axis) -> Drawn<Chart<'a>> {
    let width_px = f64::from(sheet.dim_in_pixel().0) / UNITS_PER_PX;
    let across = labelled(x.scale, y.width_beside_px(width_px) / (x.scale.to - x.scale.from));
    let mut chart = ChartBuilder::on(sheet)
        .margin_left(px(LEFT_PX))
        .margin_right(px(RIGHT_PX))
        .margin_top(px(TOP_PX))
        .x_label_area_size(px(if x.name.is_some() { NAMED_PX } else { 6.0 }))
        .y_label_area_size(px(y.label_px()))
        .build_cartesian_2d(x.coordinate(across), y.coordinate(y.scale.ticks.clone()))?;
    chart
        .configure_mesh()
        .bold_line_style(line(GRID, 0.75))
        .max_light_lines(0)
        .axis_style(line(FAINT, 1.0))
        .set_all_tick_mark_size(px(4.0))
        .label_style(font(INK))
        .axis_desc_style(font(INK))
        .x_desc(x.name.unwrap_or_default())
        .y_desc(y.name.unwrap_or_default())
        .draw()?;
    Ok(chart)
}

/// Axes along x and y in which a micrometre is as long to the right as upwards, with room for `reach_um` to every side, on a
/// sheet of this size.
pub(super) fn plane<'a>(sheet: &Sheet<'a>, reach_um: f64, size_px: [f64; 2]) -> Drawn<Chart<'a>> {
    let reach_um = ROOM * reach_um;
    let name = Some("y, µm");
    let aspect = Axis { scale: &Scale::symmetric(reach_um, 4), name }.aspect_beside(size_px);
    let stretch = (1.0 / aspect).max(1.0);
    let up = Scale::symmetric(reach_um * stretch, 5);
    let across = Scale::symmetric(reach_um * stretch * aspect, 4);
    axes(sheet, &Axis { scale: &across, name: Some("x, µm") }, &Axis { scale: &up, name })
}

/// Coordinates on the whole of a sheet, without axes.
pub(super) fn plain<'a>(sheet: &Sheet<'a>, x: &Scale, y: &Scale) -> Drawn<Chart<'a>> {
    let coordinate = |scale: &Scale| Coordinate { scale: scale.clone(), labelled: Vec::new() };
    Ok(ChartBuilder::on(sheet).build_cartesian_2d(coordinate(x), coordinate(y))?)
}

/// The `index`-th model's curve through these points.
pub(super) fn curve(chart: &mut Chart, index: usize, points: &[(f64, f64)]) -> Drawn {
    let (colour, dashes) = LOOKS[index % LOOKS.len()];
    if let [alone] = points {
        chart.draw_series([Circle::new(*alone, px(2.6), colour.filled())])?;
        return Ok(());
    }
    let (style, points) = (line(colour, 1.8), points.iter().copied());
    if let Some([dash, gap]) = dashes {
        chart.draw_series(DashedLineSeries::new(points, px(dash), px(gap), style))?;
    } else {
        chart.draw_series(LineSeries::new(points, style))?;
    }
    Ok(())
}

/// Measured values: open circles, so that a curve under them stays visible.
pub(super) fn measured(chart: &mut Chart, points: impl Iterator<Item = (f64, f64)>) -> Drawn {
    chart.draw_series(points.map(|at| Circle::new(at, px(2.6), line(INK, 1.0))))?;
    Ok(())
}

/// An entry of the legend.
pub(super) enum Entry<'a> {
    /// Open circles.
    Measured(&'a str),
    /// A solid line of measured motion.
    MeasuredLine(&'a str),
    /// The curve of the model with this index.
    Model(usize, &'a str),
}

/// A legend above the axes, in as many rows as its entries need.
pub(super) struct Legend<'a> {
    entries: Vec<(Entry<'a>, [f64; 2])>,
    /// Height of all rows, px.
    pub height_px: f64,
}

impl<'a> Legend<'a> {
    pub fn new(entries: impl IntoIterator<Item = Entry<'a>>) -> Self {
        let (mut x, mut row) = (8.0, 0.0);
        let mut placed = Vec::new();
        for entry in entries {
            let width = entry.sample_px() + 6.0 + text_width_px(entry.label()) + 14.0;
            if x > 8.0 && x + width > WIDTH_PX {
                (x, row) = (8.0, row + 1.0);
            }
            placed.push((entry, [x, (row + 0.5) * LEGEND_ROW_PX]));
            x += width;
        }
        Self { entries: placed, height_px: (row + 1.0) * LEGEND_ROW_PX }
    }

    pub fn draw(&self, sheet: &Sheet) -> Drawn {
        for (entry, [x, y]) in &self.entries {
            let sample = |style| {
                let ends = vec![(px(*x), px(*y)), (px(x + SAMPLE_PX), px(*y))];
                PathElement::new(ends, style)
            };
            match entry {
                Entry::Measured(_) => {
                    sheet.draw(&Circle::new(
                        (px(x + entry.sample_px() / 2.0), px(*y)),
                        px(2.6),
                        line(INK, 1.0),
                    ))?;
                }
                Entry::MeasuredLine(_) => sheet.draw(&sample(line(INK, 1.4)))?,
                Entry::Model(index, _) => {
                    let (colour, dashes) = LOOKS[index % LOOKS.len()];
                    let [dash, gap] = dashes.unwrap_or([SAMPLE_PX, 0.0]);
                    let mut from = 0.0;
                    while from < SAMPLE_PX {
                        let ends = [from, (from + dash).min(SAMPLE_PX)].map(|d| (px(x + d), px(*y)));
                        sheet.draw(&PathElement::new(ends.to_vec(), line(colour, 1.8)))?;
                        from += dash + gap;
                    }
                }
            }
            let style = anchored(INK, HPos::Left, VPos::Center);
            write(sheet, entry.label(), [x + entry.sample_px() + 6.0, *y], style)?;
        }
        Ok(())
    }
}

impl<'a> Entry<'a> {
    fn sample_px(&self) -> f64 {
        if matches!(self, Self::Measured(_)) { 8.0 } else { SAMPLE_PX }
    }

    fn label(&self) -> &'a str {
        match self {
            Self::Measured(label) | Self::MeasuredLine(label) | Self::Model(_, label) => label,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_an_axis_stay_apart_whatever_they_say_and_at_least_two_ticks_keep_theirs() {
        // of the minus sign, the point and a digit, from the tables of DejaVu Sans
        let milli_em = |c| match c {
            '−' => 838.0,
            '.' | ',' => 318.0,
            _ => 636.0,
        };
        let width_px = |label: &str| 1e-3 * TEXT_PX * label.chars().map(milli_em).sum::<f64>();
        for reach in (1..400).map(|i| 0.01 * 1.03_f64.powi(i)) {
            for (scale, length_px) in
                [(Scale::symmetric(reach, 4), 110.0), (Scale::around([0.0, reach].into_iter(), 6), 300.0)]
            {
                let ticks = labelled(&scale, length_px / (scale.to - scale.from));
                assert!(ticks.len() >= 2, "{reach}: {ticks:?}");
                let ends = |tick: f64| {
                    let half = 0.5 * width_px(&scale.label(tick));
                    let at = length_px * (tick - scale.from) / (scale.to - scale.from);
                    [at - half, at + half]
                };
                assert!(ticks.windows(2).all(|t| ends(t[0])[1] < ends(t[1])[0]), "{reach}: {ticks:?}");
            }
        }
    }
}
