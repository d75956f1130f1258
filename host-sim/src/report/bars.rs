//! Horizontal bars: anything ranked, such as the probabilities of candidates.

use plotters::prelude::Rectangle;
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{FAINT, GRID, INK, TEXT_PX, WIDTH_PX, anchored, line, model_colour, px, svg, write};

const ROW_PX: f64 = 38.0;
const SIDE_PX: f64 = 8.0;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// What it stands for.
    pub label: String,
    /// Its length, of the longest possible 1.
    pub share: f64,
    /// The value as it is written at the right, as in `97 %`.
    pub value: String,
    /// Drawn in full colour; others are faint.
    pub emphasised: bool,
}

/// Bars in the order given, each under its own label so that long names fit a phone.
pub fn bars(title: &str, bars: &[Bar]) -> String {
    let whole = WIDTH_PX - 2.0 * SIDE_PX;
    svg(title, ROW_PX * bars.len().max(1) as f64 + 4.0, |sheet| {
        for (row, bar) in bars.iter().enumerate() {
            let top = ROW_PX * row as f64 + 4.0;
            let text = |h| anchored(INK, h, VPos::Top);
            write(sheet, &bar.label, [SIDE_PX, top], text(HPos::Left))?;
            write(sheet, &bar.value, [WIDTH_PX - SIDE_PX, top], text(HPos::Right))?;
            let from = top + 1.35 * TEXT_PX;
            let corners = |share: f64| {
                let to = SIDE_PX + whole * share.clamp(0.0, 1.0);
                [(px(SIDE_PX), px(from)), (px(to), px(from + 11.0))]
            };
            sheet.draw(&Rectangle::new(corners(1.0), GRID.mix(0.5).filled()))?;
            let colour = if bar.emphasised { model_colour(0) } else { FAINT };
            sheet.draw(&Rectangle::new(corners(bar.share), colour.filled()))?;
            sheet.draw(&Rectangle::new(corners(1.0), line(FAINT, 0.5)))?;
        }
        Ok(())
    })
}
