//! Heat map of the residual: where, over speed and probe, the model fails.

use super::chart::{Axis, Chart, Column, Look, Panel};

const ROW_PX: f64 = 34.0;
/// Of the axis below, px.
const FOOT_PX: f64 = 54.0;

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

/// One cell for each probe and column, darker where the model is further off.
pub fn residual_map(map: &ResidualMap) -> Chart {
    let edges = edges(&map.columns);
    let ends = [edges.first(), edges.last()].map(|end| end.copied());
    let rows = map.probes.len() as f64;
    let across = Axis { from: ends[0], to: ends[1], ..Axis::named(&map.along) };
    let down = Axis { from: Some(-0.5), to: Some(rows - 0.5), rows: map.probes.clone(), ..Axis::default() };
    let mut chart =
        Chart::of(Panel { x: across, y: down, height_px: ROW_PX * rows + FOOT_PX, ..Panel::default() });
    let along = Column::of_axis(&map.along);
    let columns = [
        Column::new(format!("{} from", along.name), &along.unit),
        Column::new("to", &along.unit),
        Column::new("row", ""),
        Column::new("residual", "σ"),
    ];
    for (row, (probe, sigmas)) in map.probes.iter().zip(&map.sigmas).enumerate() {
        let cells = edges.windows(2).zip(sigmas);
        let cells = cells.map(|(ends, sigmas)| [ends[0], ends[1], row as f64, sigmas.unwrap_or(f64::NAN)]);
        chart.draw(0, probe, Look::Cells, &columns, cells);
    }
    chart
}

/// Edges of the columns: halfway between neighbours, so that gaps between speeds stay true.
fn edges(columns: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (columns.first(), columns.last()) else { return Vec::new() };
    let usual = if columns.len() > 1 { (last - first) / (columns.len() - 1) as f64 } else { 1.0 };
    let between = columns.windows(2).map(|w| 0.5 * (w[0] + w[1]));
    let ends = [first - 0.5 * usual, last + 0.5 * usual];
    std::iter::once(ends[0]).chain(between).chain([ends[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_meet_halfway_between_their_readings() {
        assert_eq!(edges(&[1.0, 2.0, 5.0]), [0.0, 1.5, 3.5, 6.0]);
        assert_eq!(edges(&[11_000.0]), [10_999.5, 11_000.5]);
        assert!(edges(&[]).is_empty());
    }
}
