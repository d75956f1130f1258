//! Trial weights as a table: `run,plane,magnitude_g_mm,angle_deg`, a row a weight.

use nalgebra::Complex;

use super::weight_unit::WeightUnit;
use crate::error::Error;
use crate::measurement::ragged;
use crate::spreadsheet;

type C = Complex<f64>;

/// Columns of a table; the unit of the weights stands in the name of the third.
const COLUMNS: [&str; 4] = ["run", "plane", "magnitude_g_mm", "angle_deg"];

/// The full set of weights of every run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Weights {
    pub file: String,
    /// Planes, in the order in which they are named.
    pub planes: Vec<String>,
    /// Each row: run, number of the plane, unbalance in g·mm, or mass in its unit where that is one of mass.
    pub rows: Vec<(String, usize, C)>,
    /// Unit in which the file states them.
    pub unit: WeightUnit,
}

/// What a column of a table of weights holds: its place among [`COLUMNS`], and the unit of the weights.
fn column(header: &str) -> Option<(usize, Option<WeightUnit>)> {
    let header = header.trim().to_lowercase();
    let (name, unit) = match header.find(['[', '(']) {
        Some(at) => (header[..at].trim_end(), header[at + 1..].trim_end_matches([']', ')', ' '])),
        None => header.split_once('_').unwrap_or((&header, "")),
    };
    match (name, unit) {
        ("run", "") => Some((0, None)),
        ("plane", "") => Some((1, None)),
        ("magnitude", unit) => Some((2, Some(WeightUnit::of(unit)?))),
        ("angle", "deg" | "degrees" | "°") => Some((3, None)),
        _ => None,
    }
}

impl Weights {
    /// Parses CSV text; `file` is for messages. Angles are from the keyphasor mark, with the rotation unless `against_rotation`.
    ///
    /// # Errors
    /// As [`of_table`](Self::of_table).
    pub fn parse(file: &str, text: &str, against_rotation: bool) -> Result<Self, Error> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).has_headers(false).from_reader(text.as_bytes());
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| ragged(file, 0, &e))?;
            let line = record.position().map_or(0, csv::Position::line);
            rows.push((line as usize, record.iter().map(str::to_string).collect()));
        }
        Self::of_table(file, &rows, against_rotation)
    }

    /// Of the rows of a table with their numbers in the file, the header first; numbers have a decimal point.
    ///
    /// # Errors
    /// One sentence with the file, row and column, and what was expected.
    pub fn of_table(
        file: &str,
        rows: &[(usize, Vec<String>)],
        against_rotation: bool,
    ) -> Result<Self, Error> {
        let wrong = |place: String, what: String| Err(Error::measurement(file, place, what));
        let (_, headers) = rows.first().cloned().unwrap_or_default();
        let (mut at, mut unit) = ([None; 4], WeightUnit::default());
        for (k, header) in headers.iter().enumerate().filter(|(_, h)| !h.is_empty()) {
            let Some((which, stated)) = column(header) else {
                let what = match header.to_lowercase().starts_with("magnitude") {
                    true => format!(
                        "the column {header} has no known unit, expected one of {}",
                        WeightUnit::names()
                    ),
                    false => format!("the column {header} is unknown, expected {}", COLUMNS.join(",")),
                };
                return wrong("header".into(), what);
            };
            at[which] = Some(k);
            unit = stated.unwrap_or(unit);
        }
        if let Some(missing) = (0..4).find(|which| at[*which].is_none()) {
            let what = format!("the column {} is missing, expected {}", COLUMNS[missing], COLUMNS.join(","));
            return wrong("header".into(), what);
        }
        let at = at.map(Option::unwrap_or_default);
        let mut all = Self { file: file.into(), unit, ..Self::default() };
        for (line, cells) in &rows[1..] {
            let place = |column: usize| format!("row {line}, column {}", headers[at[column]]);
            let cell =
                |column: usize| spreadsheet::name(cells.get(at[column]).map_or("", |cell| cell.trim()));
            if cells.len() > headers.len() {
                let what = format!("{} cells, expected {}", cells.len(), headers.len());
                return wrong(format!("row {line}"), what);
            }
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
            let [magnitude, angle_deg] = numbers;
            if magnitude < 0.0 {
                let what = format!(
                    "{magnitude} is negative, expected {} from 0 on and the angle that it is at",
                    unit.symbol
                );
                return wrong(place(2), what);
            }
            let plane = all.planes.iter().position(|p| p == cell(1)).unwrap_or_else(|| {
                all.planes.push(cell(1).into());
                all.planes.len() - 1
            });
            let angle_deg = if against_rotation { -angle_deg } else { angle_deg };
            let weight = C::from_polar(magnitude * unit.scale(), angle_deg.to_radians());
            all.rows.push((cell(0).into(), plane, weight));
        }
        match all.rows.is_empty() {
            true => wrong("row 2".into(), "there is no weight, expected at least one".into()),
            false => Ok(all),
        }
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
    fn weights_are_in_the_unit_that_their_column_names() {
        let of = |header: &str| {
            Weights::parse("w.csv", &format!("run,plane,{header},angle_deg\nT1,A,2,0\n"), false).unwrap()
        };
        for (header, g_mm) in
            [("magnitude_kg_mm", 2e3), ("Magnitude [oz-in]", 1_440.155_774_75), ("magnitude_g", 2.0)]
        {
            assert!((of(header).of("T1")[0].re - g_mm).abs() < 1e-9 * g_mm, "{header}");
        }
        assert!(of("magnitude (g)").unit.is_mass() && !of("magnitude_g_cm").unit.is_mass());
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
        assert!(said("run,plane,angle_deg\n").contains("the column magnitude_g_mm is missing"));
        assert!(said("run,plane,mass,angle_deg\n").contains("the column mass is unknown"));
        assert!(
            said("run,plane,magnitude_gm,angle_deg\n").contains("magnitude_gm has no known unit, expected")
        );
    }
}
