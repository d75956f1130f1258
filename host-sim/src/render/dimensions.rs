//! The dimensions of the drawing that the data determine, as a table.

use super::quantity::{about, quantity};
use super::{PageTable, text};
use crate::answers::dimensions::DimensionAnswer;

const COLUMNS: [&str; 3] = ["dimension", "fitted minus drawn", "tolerance"];

const CAPTION: &str = "Dimensions that the data determine (± is a 95 % half-width)";

/// One row for each dimension that the data know better than the drawing; none of a model that does not describe the data, which bends
/// its drawing to make up for what it lacks.
fn rows(dimensions: &[DimensionAnswer], model_adequate: bool) -> Vec<[String; 3]> {
    let row = |d: &DimensionAnswer| {
        let (factor, unit) = if d.unit.is_empty() { (1e2, "%") } else { (1e3, "mm") };
        let interval = d.interval_95.map(|end| factor * end);
        let tolerance = about(factor * d.tolerance_95, unit);
        [d.name.clone(), quantity(factor * d.difference, Some(interval), unit), format!("± {tolerance}")]
    };
    dimensions.iter().filter(|d| d.identified && model_adequate).map(row).collect()
}

/// The table under its heading; nothing where the data determine no dimension.
pub fn in_text(dimensions: &[DimensionAnswer], model_adequate: bool) -> String {
    let rows = rows(dimensions, model_adequate);
    if rows.is_empty() {
        return String::new();
    }
    format!("\n{CAPTION}\n{}", text::table(&COLUMNS, &rows))
}

/// The same as a table of a page.
pub fn in_page(dimensions: &[DimensionAnswer], model_adequate: bool) -> Option<PageTable> {
    let rows: Vec<Vec<String>> = rows(dimensions, model_adequate).into_iter().map(Vec::from).collect();
    (!rows.is_empty()).then(|| PageTable {
        caption: CAPTION.into(),
        columns: COLUMNS.map(String::from).to_vec(),
        rows,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dimension(
        name: &str,
        unit: &'static str,
        difference: f64,
        half: f64,
        identified: bool,
    ) -> DimensionAnswer {
        DimensionAnswer {
            name: name.into(),
            unit,
            difference,
            interval_95: [difference - half, difference + half],
            tolerance_95: 3.0 * half,
            identified,
        }
    }

    #[test]
    fn dimensions_that_data_determine_are_shown_in_percent_and_mm() {
        let all = [
            dimension("shaft youngs_modulus", "", 0.012, 0.004, true),
            dimension("probe A position_m", "m", -0.0021, 0.0005, true),
            dimension("disk mass", "", 0.03, 0.02, false),
        ];
        let text = in_text(&all, true);
        for shown in ["1.20 ± 0.40 %", "± 1.20 %", "-2.10 ± 0.50 mm"] {
            assert!(text.replace('−', "-").contains(shown), "{shown}: {text}");
        }
        assert!(!text.contains("disk mass"), "{text}");
        assert!(in_text(&all, false).is_empty() && in_page(&all, false).is_none());
        assert!(in_text(&all[2..], true).is_empty() && in_page(&all[2..], true).is_none());
    }
}
