//! Numbers as they are written in exports: decimal comma or point, thousands apart, a unit behind.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Decimal separator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decimal {
    Point,
    Comma,
}

impl Decimal {
    fn sign(self) -> char {
        if self == Self::Point { '.' } else { ',' }
    }

    fn thousands(self) -> char {
        if self == Self::Point { ',' } else { '.' }
    }
}

/// Words for a reading that is not there.
const LOST: [&str; 28] = [
    "-",
    "--",
    "---",
    "----",
    "*",
    "**",
    "***",
    "****",
    "?",
    "nan",
    "n/a",
    "na",
    "#n/a",
    "#nv",
    "null",
    "none",
    "nil",
    "invalid",
    "bad",
    "bad input",
    "no data",
    "not available",
    "ungültig",
    "keine daten",
    "i/o timeout",
    "fault",
    "off-line",
    "inf",
];

/// Whether a cell says that there is no value.
pub fn is_lost(text: &str) -> bool {
    // most cells are numbers
    if text.starts_with(|c: char| c.is_ascii_digit()) {
        return false;
    }
    let lower = text.to_lowercase();
    LOST.contains(&lower.as_str()) || lower.starts_with("#div/0") || lower.starts_with("#err")
}

/// The number at the start of a cell, and the unit behind it; nothing if it does not start with one.
pub fn number(text: &str, decimal: Decimal) -> Option<(f64, &str)> {
    let text = text.trim();
    if let Some(value) = plain(text, decimal) {
        return Some((value, ""));
    }
    let in_number = |(i, c): (usize, char)| {
        let exponent = |c: char| matches!(c, 'e' | 'E');
        let before = text[..i].chars().next_back();
        let digit_before = before.is_some_and(|b| b.is_ascii_digit() || b == decimal.sign());
        let after = text[i + c.len_utf8()..].chars().next();
        match c {
            '0'..='9' | '.' | ',' | '\'' | '’' => true,
            '+' | '-' | '−' => i == 0 || before.is_some_and(exponent),
            ' ' | '\u{a0}' | '\u{202f}' => digit_before && after.is_some_and(|a| a.is_ascii_digit()),
            'e' | 'E' => digit_before && after.is_some_and(|a| a.is_ascii_digit() || "+-".contains(a)),
            _ => false,
        }
    };
    let end = text.char_indices().find(|at| !in_number(*at)).map_or(text.len(), |(i, _)| i);
    let (digits, unit) = text.split_at(end);
    let (whole, fraction) = digits.split_once(decimal.sign()).unwrap_or((digits, ""));
    let apart = |c: char| c == decimal.thousands() || " \u{a0}\u{202f}'’".contains(c);
    let mut groups = whole.split(apart);
    let first = groups.next()?;
    let rest: Vec<&str> = groups.collect();
    let leading = first.trim_start_matches(['+', '-', '−']);
    let grouped = (1..=3).contains(&leading.len()) && leading != "0" && rest.iter().all(|g| g.len() == 3);
    if !rest.is_empty() && !grouped {
        return None;
    }
    let plain = format!("{}{}.{}", first.replace('−', "-"), rest.concat(), fraction);
    let plain = if fraction.is_empty() { plain.trim_end_matches('.') } else { &plain };
    let value = plain.parse::<f64>().ok().filter(|v| v.is_finite())?;
    Some((value, unit.trim()))
}

/// A number of digits and at most one point that stands before decimals, as most are.
fn plain(text: &str, decimal: Decimal) -> Option<f64> {
    let points = text.bytes().filter(|b| *b == b'.').count();
    let is_plain =
        text.bytes().enumerate().all(|(i, b)| matches!(b, b'0'..=b'9' | b'.') || (b == b'-' && i == 0));
    let is_decimal = points == 0 || (points == 1 && decimal == Decimal::Point);
    if is_plain && is_decimal { text.parse().ok().filter(|value: &f64| value.is_finite()) } else { None }
}

/// A finite number without a unit, where a point may stand before the decimals in both customs.
pub fn sample(text: &str, decimal: Decimal) -> Option<f64> {
    let text = text.trim();
    let grouped = || number(text, decimal).filter(|(_, unit)| unit.is_empty()).map(|(value, _)| value);
    text.parse().ok().or_else(grouped).filter(|value: &f64| value.is_finite())
}

/// What the cells of a file show of their decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecimalEvidence {
    Surely(Decimal),
    /// `11,234` and the like alone: eleven, or eleven thousand.
    Either,
    Both,
}

/// What cells that were seen show of the decimals.
#[derive(Debug, Clone, Copy, Default)]
pub struct DecimalMarks {
    point: bool,
    comma: bool,
    either: bool,
}

impl DecimalMarks {
    pub fn add(&mut self, cell: &str) {
        if !cell.starts_with(|c: char| c.is_ascii_digit() || "+-−.,".contains(c)) {
            return;
        }
        // most numbers have a point that stands before other than three decimals
        let fraction = cell.split_once('.').map(|(_, fraction)| fraction);
        if fraction.is_none_or(|f| f.len() != 3) && plain(cell, Decimal::Point).is_some() {
            self.point |= fraction.is_some();
            return;
        }
        let is = |decimal: Decimal| {
            let (_, unit) = number(cell, decimal)?;
            // dates and times start like numbers
            (!unit.starts_with([':', '-', '/', '.', 'T'])).then_some(())
        };
        let marks = |mark: char| cell.matches(mark).count();
        match (is(Decimal::Point).is_some(), is(Decimal::Comma).is_some()) {
            (true, false) => self.point = true,
            (false, true) => self.comma = true,
            (true, true) if marks('.') + marks(',') > 0 => self.either = true,
            _ => (),
        }
    }

    /// A point if nothing shows.
    pub fn shows(self) -> DecimalEvidence {
        match (self.point, self.comma, self.either) {
            (true, true, _) => DecimalEvidence::Both,
            (_, true, _) => DecimalEvidence::Surely(Decimal::Comma),
            (false, false, true) => DecimalEvidence::Either,
            _ => DecimalEvidence::Surely(Decimal::Point),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_both_customs_with_thousands_and_units() {
        for (text, decimal, expected) in [
            ("12.5", Decimal::Point, Some((12.5, ""))),
            ("-1,234.5", Decimal::Point, Some((-1234.5, ""))),
            ("1.234,5", Decimal::Comma, Some((1234.5, ""))),
            ("11 000,25", Decimal::Comma, Some((11000.25, ""))),
            ("11'000", Decimal::Point, Some((11000.0, ""))),
            ("1.5e-3", Decimal::Point, Some((0.0015, ""))),
            ("2,5E+02 µm pp", Decimal::Comma, Some((250.0, "µm pp"))),
            ("−9.8V", Decimal::Point, Some((-9.8, "V"))),
            (".5", Decimal::Point, Some((0.5, ""))),
            ("12,5", Decimal::Point, None),
            ("1,2,3", Decimal::Point, None),
            ("stopped", Decimal::Point, None),
        ] {
            assert_eq!(number(text, decimal), expected, "{text}");
        }
    }

    #[test]
    fn decimals_are_told_from_all_cells_and_doubt_is_told() {
        let of = |cells: &[&str]| {
            let mut seen = DecimalMarks::default();
            cells.iter().for_each(|cell| seen.add(cell));
            seen.shows()
        };
        assert_eq!(of(&["12,5", "11.000", "2024-03-01"]), DecimalEvidence::Surely(Decimal::Comma));
        assert_eq!(of(&["12.5", "11,000", "01.02.2024 10:00"]), DecimalEvidence::Surely(Decimal::Point));
        assert_eq!(of(&["11,000", "12"]), DecimalEvidence::Either);
        assert_eq!(of(&["12,5", "12.5"]), DecimalEvidence::Both);
        assert_eq!(of(&["7", "abc"]), DecimalEvidence::Surely(Decimal::Point));
    }
}
