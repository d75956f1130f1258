//! Trial weights as a table: `run,plane,magnitude_g_mm,angle_deg`, a row a weight.

use std::path::Path;

use nalgebra::Complex;

use crate::error::Error;
use crate::measurement::{ragged, text_of};
use crate::spreadsheet;

type C = Complex<f64>;

const COLUMNS: [&str; 4] = ["run", "plane", "magnitude_g_mm", "angle_deg"];

/// The full set of weights of every run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Weights {
    pub file: String,
    /// Planes, in the order in which they are named.
    pub planes: Vec<String>,
    /// Each row: run, number of the plane, unbalance in g·mm.
    pub rows: Vec<(String, usize, C)>,
}

impl Weights {
    /// Reads a file; angles are from the keyphasor mark, with the rotation unless `against_rotation`.
    ///
    /// # Errors
    /// One sentence with the file, row and column, and what was expected.
    pub fn read(path: &Path, against_rotation: bool) -> Result<Self, Error> {
        let (file, text) = text_of(path)?;
        Self::parse(&file, &text, against_rotation)
    }

    /// Parses the text of a file; `file` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(file: &str, text: &str, against_rotation: bool) -> Result<Self, Error> {
        let wrong = |place: String, what: String| Err(Error::measurement(file, place, what));
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let headers =
            reader.headers().map_err(|e| Error::measurement(file, "header", e.to_string()))?.clone();
        let mut at = [0; 4];
        for (at, name) in at.iter_mut().zip(COLUMNS) {
            let Some(found) = headers.iter().position(|h| h == name) else {
                return wrong(
                    "header".into(),
                    format!("the column {name} is missing, expected {}", COLUMNS.join(",")),
                );
            };
            *at = found;
        }
        if let Some(other) = headers.iter().find(|h| !COLUMNS.contains(h)) {
            return wrong(
                "header".into(),
                format!("the column {other} is unknown, expected {}", COLUMNS.join(",")),
            );
        }
        let mut all = Self { file: file.into(), ..Self::default() };
        for record in reader.records() {
            let record = record.map_err(|e| ragged(file, 0, &e))?;
            let line = record.position().map_or(0, csv::Position::line);
            let place = |column: usize| format!("row {line}, column {}", COLUMNS[column]);
            let cell = |column: usize| spreadsheet::name(record.get(at[column]).unwrap_or(""));
            if let Some(empty) = (0..2).find(|c| cell(*c).is_empty()) {
                return wrong(place(empty), "is empty, expected a name".into());
            }
            let mut numbers = [0.0; 2];
            for (number, column) in numbers.iter_mut().zip([2, 3]) {
                let Some(value) = cell(column).parse().ok().filter(|v: &f64| v.is_finite()) else {
                    return wrong(place(column), format!("\"{}\" is not a number", cell(column)));
                };
                *number = value;
            }
            let [magnitude_g_mm, angle_deg] = numbers;
            if magnitude_g_mm < 0.0 {
                return wrong(
                    place(2),
                    format!(
                        "{magnitude_g_mm} is negative, expected g·mm from 0 on and the angle that it is at"
                    ),
                );
            }
            let plane = all.planes.iter().position(|p| p == cell(1)).unwrap_or_else(|| {
                all.planes.push(cell(1).into());
                all.planes.len() - 1
            });
            let angle_deg = if against_rotation { -angle_deg } else { angle_deg };
            let weight = C::from_polar(magnitude_g_mm, angle_deg.to_radians());
            all.rows.push((cell(0).into(), plane, weight));
        }
        if all.rows.is_empty() {
            return wrong("row 2".into(), "there is no weight, expected at least one".into());
        }
        Ok(all)
    }

    /// Weights of a run in each plane, g·mm.
    pub fn of(&self, run: &str) -> Vec<C> {
        let mut all = vec![C::from(0.0); self.planes.len()];
        self.rows.iter().filter(|(name, ..)| name == run).for_each(|(_, plane, u)| all[*plane] += u);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_one_run_and_plane_are_summed() {
        let text = "run,plane,magnitude_g_mm,angle_deg\nT1,A,10,0\nT1, A,10,90\nT2,B,5,30\n";
        let with = Weights::parse("w.csv", text, false).unwrap();
        assert!((with.of("T1")[0] - C::new(10.0, 10.0)).norm() < 1e-12);
        assert_eq!((with.of("T1")[1], with.of("base")), (C::from(0.0), vec![C::from(0.0); 2]));
        let against = Weights::parse("w.csv", text, true).unwrap();
        assert!((against.of("T2")[1] - with.of("T2")[1].conj()).norm() < 1e-12);
    }

    #[test]
    fn what_cannot_be_read_is_named_with_row_and_column() {
        let said = |text: &str| Weights::parse("w.csv", text, false).unwrap_err().to_string();
        let header = "run,plane,magnitude_g_mm,angle_deg\n";
        assert_eq!(
            said(&format!("{header}T,A,ten,0")),
            "w.csv: row 2, column magnitude_g_mm: \"ten\" is not a number"
        );
        assert!(said(&format!("{header}T,A,-1,0")).contains("row 2, column magnitude_g_mm: -1 is negative"));
        assert!(said(&format!("{header}T,,1,0")).contains("row 2, column plane: is empty"));
        assert!(said(&format!("{header}T,A,1")).contains("row 2: 3 cells, expected 4"));
        assert!(said(header).contains("there is no weight"));
        assert!(said("run,plane,mass,angle_deg\n").contains("the column magnitude_g_mm is missing"));
    }
}
