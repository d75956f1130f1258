//! Quantities in the units of the trade, with their 95 % intervals, as people write them.

use crate::scale::{number, round_to, three_digits};

/// Digits of a value whose uncertainty is not known.
const DIGITS: i32 = 4;
/// Digits of the half-width of an interval.
const HALF_DIGITS: i32 = 2;
/// A value this near to the middle of its interval, in half-widths, is written with ±: the two digits of the half-width say no more.
const MIDDLE: f64 = 0.05;

/// A value with its 95 % interval, such as "16.8 ± 1.1 MN/m", or "17 MN/m (4.7 to 61 with 95 %)" where the value is not in the
/// middle: lengths in µm, unbalances in g·mm, angles in degrees, others with a prefix.
pub fn quantity(value: f64, interval_95: Option<[f64; 2]>, unit: &str) -> String {
    let (factor, unit) = in_trade(value, unit);
    let value = value * factor;
    let known = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low < high;
    let interval = interval_95.map(|ends| ends.map(|end| end * factor)).filter(known);
    let exponent = |v: f64| if v == 0.0 { 0 } else { v.abs().log10().floor() as i32 };
    let half = |[low, high]: [f64; 2]| 0.5 * (high - low);
    let decimals = match interval {
        Some(interval) => HALF_DIGITS - 1 - exponent(half(interval)),
        None => DIGITS - 1 - exponent(value),
    };
    let written = |v: f64| number(v, decimals.clamp(0, 9) as usize);
    let space = if unit.is_empty() { "" } else { " " };
    match interval {
        Some([low, high]) if (0.5 * (low + high) - value).abs() < MIDDLE * half([low, high]) => {
            format!("{} ± {}{space}{unit}", written(value), written(half([low, high])))
        }
        Some([low, high]) => {
            format!("{}{space}{unit} ({} to {} with 95 %)", written(value), written(low), written(high))
        }
        None => format!("{}{space}{unit}", written(value)),
    }
}

/// A value to three digits, such as "16.8 MN/m".
pub fn about(value: f64, unit: &str) -> String {
    let (factor, unit) = in_trade(value, unit);
    let space = if unit.is_empty() { "" } else { " " };
    format!("{}{space}{unit}", three_digits(round_to(value * factor, 3)))
}

/// The factor to the unit of the trade, and that unit.
fn in_trade(value: f64, unit: &str) -> (f64, String) {
    match unit {
        "m" => (1e6, "µm".to_string()),
        "kg·m" => (1e6, "g·mm".into()),
        "rad" => (180.0 / std::f64::consts::PI, "°".into()),
        "N" | "N/m" | "N·s/m" | "Pa·s" | "s" => prefixed(value, unit),
        _ => (1.0, unit.to_string()),
    }
}

/// The prefix with which a value has one to three digits before its point.
fn prefixed(value: f64, unit: &str) -> (f64, String) {
    const PREFIXES: [(i32, &str); 6] = [(9, "G"), (6, "M"), (3, "k"), (0, ""), (-3, "m"), (-6, "µ")];
    let size = value.abs();
    let fits = PREFIXES.iter().find(|(power, _)| size >= 10_f64.powi(*power));
    let (power, prefix) = fits.filter(|_| size > 0.0).copied().unwrap_or((0, ""));
    (10_f64.powi(-power), format!("{prefix}{unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_trade_units_and_digits_of_half_width() {
        let written = |value: f64, half: Option<f64>, unit| {
            quantity(value, half.map(|half| [value - half, value + half]), unit)
        };
        assert_eq!(written(1.6807e7, Some(1.1e7), "N/m"), "17 ± 11 MN/m");
        assert_eq!(written(1.1058e4, Some(3.6e3), "N·s/m"), "11.1 ± 3.6 kN·s/m");
        assert_eq!(written(-2.5e-5, Some(1.2e-7), "m"), "−25.00 ± 0.12 µm");
        assert_eq!(written(5.4e-4, None, "kg·m"), "540.0 g·mm");
        assert_eq!(written(0.5, Some(0.0), "rad"), "28.65 °");
        assert_eq!(written(1.25, Some(0.031), ""), "1.250 ± 0.031");
        assert_eq!(written(0.0, None, "N/m"), "0.000 N/m");
        assert_eq!(
            (about(1.6807e7, "N/m").as_str(), about(1.234e-6, "m").as_str()),
            ("16.8 MN/m", "1.23 µm")
        );
        assert_eq!(quantity(1.7e7, Some([4.7e6, 6.1e7]), "N/m"), "17 MN/m (5 to 61 with 95 %)");
    }
}
