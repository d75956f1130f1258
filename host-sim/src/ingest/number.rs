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

/// Digits of whole numbers that a double holds exactly, whatever they are.
const EXACT_DIGITS: usize = 15;
const POWERS_OF_TEN: [f64; EXACT_DIGITS + 1] =
    [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

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

/// A number of digits and at most one point, as most are.
struct PlainNumber {
    sign: f64,
    /// Of all digits, the point left out; modulo 2⁶⁴.
    whole: u64,
    digits: usize,
    /// Digits behind the point, if there is one.
    decimals: Option<usize>,
}

impl PlainNumber {
    #[inline]
    fn of(text: &str) -> Option<Self> {
        let (sign, digits) = match text.as_bytes() {
            [b'-', digits @ ..] => (-1.0, digits),
            digits => (1.0, digits),
        };
        let mut point = None;
        let mut whole: u64 = 0;
        for (i, b) in digits.iter().enumerate() {
            match b {
                b'0'..=b'9' => whole = whole.wrapping_mul(10).wrapping_add(u64::from(b - b'0')),
                b'.' if point.is_none() => point = Some(i),
                _ => return None,
            }
        }
        let decimals = point.map(|at| digits.len() - 1 - at);
        let digits = digits.len() - usize::from(point.is_some());
        (digits > 0).then_some(Self { sign, whole, digits, decimals })
    }
}

/// A number of digits and at most one point that stands before decimals.
#[inline]
pub fn plain(text: &str, decimal: Decimal) -> Option<f64> {
    let PlainNumber { sign, whole, digits, decimals } = PlainNumber::of(text)?;
    if decimals.is_some() && decimal == Decimal::Comma {
        return None;
    }
    // the quotient of two whole numbers that doubles hold exactly is the nearest double
    if digits <= EXACT_DIGITS {
        return Some(sign * (whole as i64 as f64 / POWERS_OF_TEN[decimals.unwrap_or(0)]));
    }
    text.parse().ok().filter(|value: &f64| value.is_finite())
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
        let begins = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '−' | '.' | ',');
        if !cell.starts_with(begins) {
            return;
        }
        // most numbers have a point, and nothing else
        if let Some(PlainNumber { digits, decimals, .. }) = PlainNumber::of(cell) {
            let Some(decimals) = decimals else { return };
            let before = digits - decimals;
            let is_zero = || cell.trim_start_matches('-').starts_with("0.");
            let may_be_thousands = decimals == 3 && (1..=3).contains(&before) && !is_zero();
            let shown = if may_be_thousands { &mut self.either } else { &mut self.point };
            *shown = true;
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

    /// What cells show that were seen here or there.
    pub fn or(self, other: Self) -> Self {
        Self {
            point: self.point || other.point,
            comma: self.comma || other.comma,
            either: self.either || other.either,
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
