//! Centreline: where the shaft runs in its bearing, over speed.

use super::chart::{Chart, Column, Look, Panel};

const HEIGHT_PX: f64 = 340.0;

/// Where the shaft's centre was, one run after another: `name` and places along x and y in µm from the first.
pub fn centreline(runs: &[(String, Vec<(f64, f64)>)]) -> Chart {
    let places = runs.iter().flat_map(|(_, places)| places);
    let reach_um = places.flat_map(|(x, y)| [x.abs(), y.abs()]).fold(1.0, f64::max);
    let mut chart = Chart::of(Panel::plane(["x, µm", "y, µm"], 1.12 * reach_um, HEIGHT_PX));
    let columns = [Column::new("x", "µm"), Column::new("y", "µm")];
    for (i, (name, places)) in runs.iter().enumerate() {
        let rows = || places.iter().map(|(x, y)| [*x, *y]);
        chart.draw(0, name, Look::Model(i), &columns, rows());
        chart.draw(0, name, Look::Dots(i), &columns, rows().take(1));
    }
    chart
}
