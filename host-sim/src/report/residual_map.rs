//! Heat map of the residual: where, over speed and probe, the model fails.

use plotters::prelude::{PathElement, Rectangle};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::canvas::{
    Drawn, FAINT, INK, Sheet, TEXT_PX, WIDTH_PX, anchored, labelled, line, px, svg, text_width_px, write,
};
use super::scale::Scale;

const ROW_PX: f64 = 34.0;
const BAR_PX: f64 = 14.0;
const RIGHT_PX: f64 = 14.0;

/// Lower ends of the classes in standard deviations, and their colours: darker is worse, in grey too.
const CLASSES: [(f64, RGBColor); 6] = [
    (0.0, RGBColor(247, 250, 252)),
    (1.5, RGBColor(206, 222, 236)),
    (2.5, RGBColor(244, 178, 96)),
    (4.0, RGBColor(222, 105, 36)),
    (8.0, RGBColor(158, 38, 26)),
    (16.0, RGBColor(64, 6, 22)),
];

/// Residuals of all probes along speed or time.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualMap {
    /// Name and unit of what runs to the right.
    pub along: String,
    /// Its value in each column, ascending.
    pub columns: Vec<f64>,
    /// Name of each row.
    pub probes: Vec<String>,
    /// By probe and column: residual in standard deviations, `None` where the reading was lost.
    pub sigmas: Vec<Vec<Option<f64>>>,
}

/// One cell for each probe and column, and the meaning of the colours below.
pub fn residual_map(title: &str, map: &ResidualMap) -> String {
    let left = 16.0 + map.probes.iter().map(|p| text_width_px(p)).fold(0.0, f64::max);
    let frame =
        Frame { left, width: WIDTH_PX - left - RIGHT_PX, bottom: 8.0 + ROW_PX * map.probes.len() as f64 };
    svg(title, frame.bottom + 3.4 * TEXT_PX + BAR_PX + 4.6 * TEXT_PX, |sheet| {
        frame.cells(sheet, map)?;
        frame.axis(sheet, map)?;
        legend(sheet, frame.bottom + 3.6 * TEXT_PX)
    })
}

struct Frame {
    left: f64,
    width: f64,
    bottom: f64,
}

impl Frame {
    /// Edges of the columns: halfway between neighbours, so that gaps between speeds stay true.
    fn edges(&self, columns: &[f64]) -> Vec<f64> {
        let (Some(first), Some(last)) = (columns.first(), columns.last()) else { return Vec::new() };
        let usual = if columns.len() > 1 { (last - first) / (columns.len() - 1) as f64 } else { 1.0 };
        let between = columns.windows(2).map(|w| 0.5 * (w[0] + w[1]));
        let ends = [first - 0.5 * usual, last + 0.5 * usual];
        std::iter::once(ends[0]).chain(between).chain([ends[1]]).collect()
    }

    fn place(&self, edges: &[f64], value: f64) -> f64 {
        let (from, to) = (edges[0], edges[edges.len() - 1]);
        self.left + self.width * (value - from) / (to - from)
    }

    fn cells(&self, sheet: &Sheet, map: &ResidualMap) -> Drawn {
        let edges = self.edges(&map.columns);
        for (row, (probe, sigmas)) in map.probes.iter().zip(&map.sigmas).enumerate() {
            let top = 8.0 + ROW_PX * row as f64;
            let style = anchored(INK, HPos::Right, VPos::Center);
            write(sheet, probe, [self.left - 7.0, top + 0.5 * ROW_PX], style)?;
            for (ends, value) in edges.windows(2).zip(sigmas) {
                let [from, to] = [ends[0], ends[1]].map(|e| px(self.place(&edges, e)));
                let corners = [(from, px(top)), (to, px(top + ROW_PX - 3.0))];
                match value {
                    Some(sigmas) => sheet.draw(&Rectangle::new(corners, class(*sigmas).filled()))?,
                    None => sheet.draw(&PathElement::new(corners.to_vec(), line(FAINT, 1.0)))?,
                }
            }
            let outline = [(px(self.left), px(top)), (px(self.left + self.width), px(top + ROW_PX - 3.0))];
            sheet.draw(&Rectangle::new(outline, line(FAINT, 0.75)))?;
        }
        Ok(())
    }

    fn axis(&self, sheet: &Sheet, map: &ResidualMap) -> Drawn {
        let edges = self.edges(&map.columns);
        if edges.is_empty() {
            return Ok(());
        }
        let scale = Scale::around(map.columns.iter().copied(), 6);
        let unit_px = self.width / (edges[edges.len() - 1] - edges[0]);
        for tick in labelled(&scale, unit_px) {
            let x = self.place(&edges, tick);
            if !(self.left..=self.left + self.width).contains(&x) {
                continue;
            }
            let ends = vec![(px(x), px(self.bottom)), (px(x), px(self.bottom + 4.0))];
            sheet.draw(&PathElement::new(ends, line(FAINT, 1.0)))?;
            let style = anchored(INK, HPos::Center, VPos::Top);
            write(sheet, &scale.label(tick), [x, self.bottom + 6.0], style)?;
        }
        let style = anchored(INK, HPos::Center, VPos::Top);
        let middle = self.left + 0.5 * self.width;
        write(sheet, &map.along, [middle, self.bottom + 6.0 + 1.25 * TEXT_PX], style)
    }
}

/// The colour of a residual.
fn class(sigmas: f64) -> RGBColor {
    let below = CLASSES.iter().rev().find(|(least, _)| sigmas >= *least);
    below.map_or(CLASSES[0].1, |(_, colour)| *colour)
}

fn legend(sheet: &Sheet, top: f64) -> Drawn {
    let width = (WIDTH_PX - 2.0 * RIGHT_PX) / CLASSES.len() as f64;
    for (i, (least, colour)) in CLASSES.iter().enumerate() {
        let from = RIGHT_PX + width * i as f64;
        let corners = [(px(from), px(top)), (px(from + width), px(top + BAR_PX))];
        sheet.draw(&Rectangle::new(corners, colour.filled()))?;
        sheet.draw(&Rectangle::new(corners, line(FAINT, 0.75)))?;
        let h = if i == 0 { HPos::Left } else { HPos::Center };
        let style = anchored(INK, h, VPos::Top);
        write(sheet, &format!("{least} σ"), [from, top + BAR_PX + 4.0], style)?;
    }
    let style = || anchored(FAINT, HPos::Left, VPos::Top);
    let row = |i: f64| top + BAR_PX + 4.0 + 1.3 * TEXT_PX * i;
    write(sheet, "up to 2.5 σ: noise; a stroke: reading lost", [RIGHT_PX, row(1.0)], style())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_grow_darker_so_that_the_map_reads_in_grey() {
        let grey = |c: RGBColor| 0.299 * f64::from(c.0) + 0.587 * f64::from(c.1) + 0.114 * f64::from(c.2);
        let greys: Vec<f64> = CLASSES.iter().map(|(_, c)| grey(*c)).collect();
        assert!(greys.windows(2).all(|w| w[0] - w[1] > 15.0), "{greys:?}");
        assert_eq!((class(0.3), class(5.0), class(1e9)), (CLASSES[0].1, CLASSES[3].1, CLASSES[5].1));
    }

    #[test]
    fn a_map_without_readings_and_one_with_a_single_speed_can_be_drawn() {
        for columns in [vec![], vec![11_000.0]] {
            let sigmas = vec![vec![None; columns.len()]];
            let map = ResidualMap { along: "speed, rpm".into(), columns, probes: vec!["1X".into()], sigmas };
            assert!(residual_map("map", &map).ends_with("</svg>\n"));
        }
    }
}
