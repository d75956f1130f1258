//! What a row of a table holds: numbers of a reading, a header again, or another machine.

use std::ops::ControlFlow;

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge_desktop::measurement::{LARGEST_UM, LOWEST_GAP_V};

use super::cells::Cells;
use super::mapping::Mapping;
use super::plan::Column;
use crate::ingest::sheet::{Cell, SheetRow};
use crate::ingest::table::ReadingTable;
use crate::ingest::target::Quantity;
use crate::ingest::unit::Vibration;

/// Numbers of nines alone, up to the largest number that may be one.
const NINES: [f64; 4] = [999.0, 9_999.0, 99_999.0, 999_999.0];

/// Whether a number means that there is none: nines alone, the ends of a 16-bit register, a number beyond all reason.
fn is_no_measurement(raw: f64) -> bool {
    let is_nines = NINES.contains(&raw.abs()) && raw != 999.0;
    is_nines || [-999.25, -32_768.0, 32_767.0].contains(&raw) || raw.abs() > 1e6
}

/// The phasor `cos − i sin` of a row, µm zero-to-peak, and whether a number says that there is none.
pub fn phasor_um(
    cells: &Cells,
    row: &SheetRow,
    speed_rpm: f64,
    a: &Column,
    b: &Column,
) -> Result<(Option<Complex<f64>>, bool)> {
    let (Some(x), Some(y)) = (cells.raw(row, a)?, cells.raw(row, b)?) else { return Ok((None, false)) };
    if is_no_measurement(x) || is_no_measurement(y) {
        return Ok((None, true));
    }
    let phasor = if a.target.quantity == Quantity::Amplitude {
        Complex::from_polar(amplitude(cells, row, a, x)?, -y * b.factor)
    } else {
        Complex::new(x * a.factor, -y * b.factor)
    };
    Ok((Some(displacement_um(cells, row, speed_rpm, a, phasor)?), false))
}

/// The amplitude of a row without phase, µm zero-to-peak; none where the cell is empty or says that there is none.
pub fn amplitude_um(cells: &Cells, row: &SheetRow, speed_rpm: f64, a: &Column) -> Result<Option<f64>> {
    let Some(x) = cells.raw(row, a)?.filter(|x| !is_no_measurement(*x)) else { return Ok(None) };
    let phasor = Complex::from(amplitude(cells, row, a, x)?);
    Ok(Some(displacement_um(cells, row, speed_rpm, a, phasor)?.norm()))
}

/// A number of a column of amplitudes, µm or a derivative of it, zero-to-peak.
fn amplitude(cells: &Cells, row: &SheetRow, a: &Column, x: f64) -> Result<f64> {
    if x < 0.0 {
        bail!("{}: {x} is no amplitude, expected zero or more", cells.place(row, a));
    }
    Ok(x * a.factor)
}

/// Integrated as often as the column's unit says.
fn displacement_um(
    cells: &Cells,
    row: &SheetRow,
    speed_rpm: f64,
    a: &Column,
    phasor: Complex<f64>,
) -> Result<Complex<f64>> {
    let phasor = phasor * Vibration { size: 1.0, derivative: a.derivative }.displacement(speed_rpm);
    if phasor.norm_sqr() > LARGEST_UM * LARGEST_UM {
        let um = phasor.norm();
        bail!("{}: {um:.0} µm is more than a probe can see, expected another unit", cells.place(row, a));
    }
    Ok(phasor)
}

pub fn gap_v(cells: &Cells, row: &SheetRow, column: &Column) -> Result<Option<f64>> {
    let gap_v = cells.raw(row, column)?.filter(|raw| !is_no_measurement(*raw) || column.factor < 1.0);
    let gap_v = gap_v.map(|raw| raw * column.factor);
    match gap_v.filter(|v| !(LOWEST_GAP_V..=0.0).contains(v)) {
        Some(v) => bail!(
            "{}: {v} is no gap voltage, expected {LOWEST_GAP_V} to 0 V, or --column \"{}=left\"",
            cells.place(row, column),
            column.header
        ),
        None => Ok(gap_v),
    }
}

/// The value of a condition of operation, in the unit that it becomes.
pub fn condition(cells: &Cells, row: &SheetRow, column: &Column) -> Result<Option<f64>> {
    let raw = match cells.raw(row, column) {
        Err(why) => bail!("{why}, or --column \"{}=left\" leaves the column out", column.header),
        Ok(raw) => raw.filter(|raw| !is_no_measurement(*raw)),
    };
    Ok(raw.zip(column.target.stated.condition).map(|(raw, unit)| unit.converted(raw)))
}

pub fn speed_rpm(cells: &Cells, mapping: &Mapping, row: &SheetRow) -> Result<Option<f64>> {
    let Some(column) = cells.plan.column(Quantity::Speed) else { return Ok(mapping.speed_rpm) };
    // 9999 rpm is a speed
    let raw = cells.raw(row, column)?.filter(|raw| (0.0..=1e6).contains(raw) || !is_no_measurement(*raw));
    let speed_rpm = raw.map(|raw| raw * column.factor);
    match speed_rpm {
        Some(speed_rpm) if speed_rpm < 0.0 => {
            bail!("{}: {speed_rpm} rpm, expected a positive speed", cells.place(row, column))
        }
        other => Ok(other),
    }
}

/// Whether a row holds a number where numbers are expected; what comes after the last such row is no data.
pub fn is_data(cells: &Cells, row: &SheetRow) -> bool {
    let needed = |q: Quantity| q == Quantity::Speed || q.is_vibration();
    let number = |c: &Column| cells.raw(row, c).is_ok_and(|value| value.is_some());
    cells.plan.columns.iter().any(|c| needed(c.target.quantity) && number(c))
}

pub fn is_header(table: &ReadingTable, row: &SheetRow) -> bool {
    let filled =
        |row: &SheetRow| row.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let width = filled(row);
    table.head.iter().any(|head| filled(head) == width && head.cells[..width] == row.cells[..width])
}

/// A row of text with more cells than the header has been cut in the wrong places.
pub fn in_table(table: &ReadingTable, row: &SheetRow) -> Result<()> {
    let width = table.columns.last().map_or(0, |c| c.index + 1);
    let beyond = row.cells.iter().skip(width).any(|c| matches!(c, Cell::Text(_)));
    let Some(separator) = table.sheet.separator.filter(|_| beyond) else { return Ok(()) };
    let why =
        if separator == ',' { "; a decimal comma is cut where commas stand between the cells" } else { "" };
    bail!(
        "{}: row {} has {} cells, the header has {width}{why}",
        table.sheet.place(),
        row.number,
        row.cells.len()
    )
}

pub fn one_machine(cells: &Cells, mapping: &Mapping) -> Result<()> {
    let (Some(column), None) = (cells.plan.column(Quantity::Machine), &mapping.machine) else {
        return Ok(());
    };
    let mut first: Option<String> = None;
    cells.table.rows.each(|row| {
        if let Some(name) = cells.name(row, column).filter(|_| is_data(cells, row)) {
            let first = first.get_or_insert_with(|| name.clone());
            if *first != name {
                bail!(
                    "{}: is of \"{name}\", the rows before of \"{first}\", expected one machine, --machine \"{first}\" or --machine \"{name}\"",
                    cells.place(row, column)
                );
            }
        }
        Ok(ControlFlow::Continue(()))
    })
}
