//! Tables of amplitudes without phase, as runs of the four-run method are.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge_desktop::measurement::{ProbeRecord, Reading};

use super::cells::Cells;
use super::mapping::Mapping;
use super::plan::{Column, plan};
use super::row;
use crate::ingest::format;
use crate::ingest::probes::Probes;
use crate::ingest::table;
use crate::ingest::target::Quantity;

/// The table of a file whose probes have amplitudes and nothing else, as real phasors; none of another kind of file.
///
/// # Errors
/// One sentence with file, row and column, where such a table leaves something open or a cell is no number.
pub fn read(path: &Path) -> Result<Option<ProbeRecord>> {
    let Ok(sheets) = format::sheets(path, table::score) else { return Ok(None) };
    let mapping = Mapping { amplitudes_alone: true, ..Mapping::default() };
    let Ok(table) = super::only_table(path, &sheets, &mapping) else { return Ok(None) };
    let probes = Probes::new(None, &table);
    // a table with other columns is none of amplitudes alone
    let Ok((assigned, _)) = super::assign::assign(&table, &probes, &mapping) else { return Ok(None) };
    let mut vibration = assigned.iter().map(|c| c.target.quantity).filter(|q| q.is_vibration()).peekable();
    if vibration.peek().is_none() || vibration.any(|quantity| quantity != Quantity::Amplitude) {
        return Ok(None);
    }
    let plan = plan(&table, None, &mapping)?;
    let amplitudes: Vec<_> =
        plan.columns.iter().filter(|c| c.target.quantity == Quantity::Amplitude).collect();
    let cells = Cells { table: &table, plan: &plan };
    let mut readings = Vec::new();
    let run = plan.column(Quantity::Run);
    table.rows.each(|row| {
        let Some(speed_rpm) = row::speed_rpm(&cells, &mapping, row)? else {
            return Ok(ControlFlow::Continue(()));
        };
        // µm to m, as phasors of a record are
        let of_row = |column: &&Column| {
            Ok(row::amplitude_um(&cells, row, speed_rpm, column)?.map(|um| Complex::from(1e-6 * um)))
        };
        let probes = amplitudes.iter().map(of_row).collect::<Result<_>>()?;
        let run = run.and_then(|column| cells.name(row, column));
        readings.push(Reading { row: Some(row.number), run, speed_rpm, probes, ..Reading::default() });
        Ok(ControlFlow::Continue(()))
    })?;
    let names = amplitudes.iter().map(|c| c.target.probe.clone().unwrap_or_default()).collect();
    Ok(Some(ProbeRecord { unit: "um".into(), conditions: Vec::new(), probes: names, readings }))
}
