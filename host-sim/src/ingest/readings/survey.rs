//! What the cells of all columns show together, in one pass through the rows: those of a text are cut anew in each pass.

use std::collections::HashMap;

use super::assign::AssignedColumn;
use crate::ingest::number::{Decimal, number};
use crate::ingest::sheet::Cell;
use crate::ingest::table::ReadingTable;
use crate::ingest::target::Quantity;

/// The unit behind the first number of each column that has numbers, for all columns in one pass through the rows.
pub fn units_of_cells(
    table: &ReadingTable,
    assigned: &[AssignedColumn],
    decimal: Decimal,
) -> HashMap<usize, Option<String>> {
    let has_number = |q: Quantity| q.is_of_probe() || matches!(q, Quantity::Speed | Quantity::Condition);
    let mut units: HashMap<usize, Option<String>> = assigned.iter().map(|c| (c.header.index, None)).collect();
    let mut open: Vec<usize> =
        assigned.iter().filter(|c| has_number(c.target.quantity)).map(|c| c.header.index).collect();
    table.rows.find_map(|row| {
        open.retain(|index| {
            let found = row.cell(*index).as_text().and_then(|text| number(text, decimal));
            let is_found = found.is_some() || matches!(row.cell(*index), Cell::Number(_));
            if let Some((_, unit)) = found {
                units.insert(*index, Some(unit.to_string()));
            }
            !is_found
        });
        open.is_empty().then_some(())
    });
    units
}

/// The largest number of each column.
pub fn largest_of(table: &ReadingTable, decimal: Decimal) -> Vec<f64> {
    let of_blocks = table.rows.of_blocks(|rows| {
        let mut largest: Vec<f64> = Vec::new();
        rows.for_each(|row| {
            largest.resize(largest.len().max(row.cells.len()), 0.0);
            for (largest, cell) in largest.iter_mut().zip(&row.cells) {
                let value = match cell {
                    Cell::Number(x) => Some(*x),
                    Cell::Text(text) => number(text, decimal).map(|(x, _)| x),
                    _ => None,
                };
                *largest = value.map_or(*largest, |x| (*largest).max(x.abs()));
            }
        });
        largest
    });
    let mut largest: Vec<f64> = Vec::new();
    for block in of_blocks {
        largest.resize(largest.len().max(block.len()), 0.0);
        largest.iter_mut().zip(block).for_each(|(largest, x)| *largest = largest.max(x));
    }
    largest
}
