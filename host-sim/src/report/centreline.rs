//! Centreline: where the shaft runs in its bearing, over speed.

use plotters::prelude::Circle;
use plotters::style::Color;

use super::canvas::{Entry, Legend, WIDTH_PX, curve, model_colour, plane, px, svg};

const HEIGHT_PX: f64 = 330.0;

/// Where the shaft's centre was, one run after another: `name` and places along x and y in µm from the first.
pub fn centreline(title: &str, runs: &[(String, Vec<(f64, f64)>)]) -> String {
    let legend = Legend::new(runs.iter().enumerate().map(|(i, (name, _))| Entry::Model(i, name)));
    let places = runs.iter().flat_map(|(_, places)| places);
    let reach_um = places.flat_map(|(x, y)| [x.abs(), y.abs()]).fold(1.0, f64::max);
    svg(title, legend.height_px + HEIGHT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let mut chart = plane(&below, reach_um, [WIDTH_PX, HEIGHT_PX])?;
        for (i, (_, places)) in runs.iter().enumerate() {
            curve(&mut chart, i, places)?;
            let first = places.iter().take(1).map(|at| Circle::new(*at, px(3.4), model_colour(i).filled()));
            chart.draw_series(first)?;
        }
        Ok(())
    })
}
