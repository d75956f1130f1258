//! The sensitivity of a transducer as texts state it, such as `100 mV/g` or `200 mV/mil`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::unit::{Sensitivity, Unit};
use super::words::{Part, Word, parts};

/// The sensitivity that a text states, and the text without it.
pub fn cut(text: &str) -> (String, Option<Sensitivity>) {
    // one sign, so that places in both texts are the same
    let plain: String = text.chars().map(|c| if c == 'μ' { 'µ' } else { c.to_ascii_lowercase() }).collect();
    for (slash, _) in plain.match_indices('/') {
        let volts = plain[..slash].trim_end();
        let Some(number) = volts.strip_suffix('v') else { continue };
        let (number, mv) = number.strip_suffix('m').map_or((number, 1e3), |number| (number, 1.0));
        let is_digit = |c: char| c.is_ascii_digit() || ".,".contains(c);
        let digits_end = number.trim_end().len();
        let start = number[..digits_end]
            .rfind(|c: char| !is_digit(c))
            .map_or(0, |i| i + number[i..].chars().next().map_or(1, char::len_utf8));
        let behind = &plain[slash + 1..];
        let unit_from = slash + 1 + (behind.len() - behind.trim_start().len());
        let length = unit_length(&plain[unit_from..]);
        let per = unit(&text[unit_from..unit_from + length]);
        let value = per.and_then(|per| value(&number[start..digits_end], per));
        if let (Some(per), Some(value)) = (per, value) {
            let rest = format!("{} {}", &text[..start], &text[unit_from + length..]);
            return (rest, Some(Sensitivity { mv: value * mv, per }));
        }
    }
    (text.into(), None)
}

/// Bytes of the unit that a text begins with, which may stand in brackets.
fn unit_length(text: &str) -> usize {
    if text.starts_with('(') {
        return text.find(')').map_or(text.len(), |end| end + 1);
    }
    text.find(|c: char| c.is_whitespace() || ",;)]".contains(c)).unwrap_or(text.len())
}

/// The one unit of a vibration that a text is.
fn unit(text: &str) -> Option<Unit> {
    match parts(text, |_| false)[..] {
        [Part::Says(Word::Unit(unit))] if !unit.is_voltage() => Some(unit),
        _ => None,
    }
}

fn value(digits: &str, per: Unit) -> Option<f64> {
    // 1,000 mV/g, and 7,874 mV/µm
    let is_thousands = per.is_derivative() && digits.split_once(',').is_some_and(|(_, rest)| rest.len() == 3);
    let plain = if is_thousands { digits.replace(',', "") } else { digits.replace(',', ".") };
    plain.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite())
}

impl FromStr for Sensitivity {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (rest, sensitivity) = cut(text);
        sensitivity.filter(|_| rest.trim().is_empty()).ok_or_else(|| {
            format!("\"{text}\": expected a sensitivity such as \"100 mV/g\" or \"7.87 mV/um\"")
        })
    }
}

impl fmt::Display for Sensitivity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} mV/({})", self.mv, self.per.symbol())
    }
}

impl Serialize for Sensitivity {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Sensitivity {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensitivities_are_read_as_transducers_state_them() {
        for (text, mv, per, rest) in [
            ("Sensitivity: 200 mV/mil", 200.0, Unit::Mil, "Sensitivity:  "),
            ("7,87 mV/µm", 7.87, Unit::Micrometre, " "),
            ("100mV/g", 100.0, Unit::G, " "),
            ("1,000 mV/g", 1000.0, Unit::G, " "),
            ("0.1 V/g", 100.0, Unit::G, " "),
            ("10.2 mV/(m/s²)", 10.2, Unit::MetrePerSecondSquared, " "),
            ("4 mV/mm/s", 4.0, Unit::MillimetrePerSecond, " "),
            ("100 mV / in/s", 100.0, Unit::InchPerSecond, " "),
            ("DE 1X Amp [mV pk] (100 mV/g)", 100.0, Unit::G, "DE 1X Amp [mV pk] ( )"),
        ] {
            let (without, sensitivity) = cut(text);
            let sensitivity = sensitivity.unwrap_or_else(|| panic!("{text}"));
            assert!((sensitivity.mv - mv).abs() < 1e-9 && sensitivity.per == per, "{text}: {sensitivity:?}");
            assert_eq!(without, rest);
            assert_eq!(sensitivity.to_string().parse(), Ok(sensitivity), "{text}");
        }
        for text in ["mV/g", "100 mV", "100 mV/furlong", "15X [V]", "-9.8 V/2"] {
            assert_eq!(cut(text), (text.to_string(), None));
        }
    }
}
