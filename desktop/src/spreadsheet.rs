//! Names in CSV files that people open in a spreadsheet, which takes some of them for formulas.
//!
//! A name such as `=1+2` is written with an apostrophe before it, as people type it there, and read without.

use std::borrow::Cow;

/// What a formula begins with.
const FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// A name as a cell that no spreadsheet computes.
pub fn cell(name: &str) -> Cow<'_, str> {
    if name.starts_with(FORMULA) { Cow::Owned(format!("'{name}")) } else { Cow::Borrowed(name) }
}

/// The name that a cell holds.
pub fn name(cell: &str) -> &str {
    match cell.strip_prefix('\'') {
        Some(rest) if rest.starts_with(FORMULA) => rest,
        _ => cell,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_that_is_a_formula_is_written_as_text_and_comes_back() {
        for formula in ["=1+2", "+1", "-1+2", "@SUM(A1)", "\tx", "=cmd|' /C calc'!A0"] {
            assert_eq!(cell(formula), format!("'{formula}"));
            assert_eq!(name(&cell(formula)), formula);
        }
        for plain in ["trial", "run 1", "'quoted'", "a=b", ""] {
            assert_eq!((cell(plain).as_ref(), name(plain)), (plain, plain));
        }
    }
}
