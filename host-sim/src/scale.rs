//! Round numbers for axes, and numbers as people write them.

/// The range of an axis and its ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Where the axis begins: at the left or at the bottom.
    pub from: f64,
    pub to: f64,
    /// Labelled places, ascending.
    pub ticks: Vec<f64>,
}

impl Scale {
    /// From zero to the first tick above everything.
    pub fn from_zero(values: impl Iterator<Item = f64>, about_ticks: usize) -> Self {
        let largest = values.fold(0.0, f64::max);
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let step = round_step(largest / about_ticks as f64);
        let steps = (largest / step).ceil();
        Self { from: 0.0, to: steps * step, ticks: (0..=steps as usize).map(|i| i as f64 * step).collect() }
    }

    /// Around everything, with a little room at both ends.
    pub fn around(values: impl Iterator<Item = f64>, about_ticks: usize) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = match low < high {
            true => (low, high),
            false if low.is_finite() => (low - 1.0, high + 1.0),
            false => (0.0, 1.0),
        };
        let room = 0.03 * (high - low);
        let (from, to) = (low - room, high + room);
        let step = round_step((to - from) / about_ticks as f64);
        let first = (from / step).ceil() as i64;
        let last = (to / step).floor() as i64;
        Self { from, to, ticks: (first..=last).map(|i| i as f64 * step).collect() }
    }

    /// Distance between two ticks.
    pub fn step(&self) -> f64 {
        self.ticks.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min).min(self.to - self.from)
    }

    /// A tick, with as many decimals as tell it from the next.
    pub fn label(&self, tick: f64) -> String {
        let step = self.step();
        let decimals = (0..6).find(|d| {
            let scaled = step * 10_f64.powi(*d);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.abs()
        });
        number(tick, decimals.unwrap_or(0) as usize)
    }
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let decade = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|s| s * decade >= least * (1.0 - 1e-9));
    step.unwrap_or(10.0) * decade
}

/// A number with these decimals and its thousands apart.
pub fn number(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = digits.split_at(digits.find('.').unwrap_or(digits.len()));
    let mut text = String::new();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    let zero = digits.chars().all(|c| matches!(c, '0' | '.'));
    format!("{}{text}{fraction}", if value < 0.0 && !zero { "−" } else { "" })
}

/// A number with three significant digits, or fewer decimals where it is large.
pub fn three_digits(value: f64) -> String {
    let exponent = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    match exponent as i32 {
        ..-3 => format!("{value:.1e}").replace('-', "−"),
        e => number(value, (2 - e).max(0) as usize),
    }
}

/// A number with four significant digits, or fewer decimals where it is large.
pub fn four_digits(value: f64) -> String {
    let before = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    format!("{value:.*}", (3 - before).clamp(0, 6) as usize)
}

/// A number with so many digits at most; what is not finite is left as it is.
pub fn round_to(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let unit = 10_f64.powi(digits - 1 - value.abs().log10().floor() as i32);
    let rounded = (value * unit).round() / unit;
    if rounded.is_finite() { rounded } else { value }
}

/// A speed with its unit.
pub fn rpm(speed_rpm: f64) -> String {
    format!("{} rpm", number(speed_rpm, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_cover_what_they_show_with_round_ticks() {
        let s = Scale::from_zero([3.1, 7.2].into_iter(), 4);
        assert_eq!((s.to, s.ticks.as_slice()), (8.0, &[0.0, 2.0, 4.0, 6.0, 8.0][..]));
        let s = Scale::around([1500.0, 11_500.0].into_iter(), 5);
        assert!(s.from < 1500.0 && s.to > 11_500.0);
        assert_eq!(s.ticks, [2500.0, 5000.0, 7500.0, 10_000.0]);
        let s = Scale::around([-0.34, 0.34].into_iter(), 4);
        let labels: Vec<String> = s.ticks.iter().map(|t| s.label(*t)).collect();
        assert_eq!(labels, ["−0.2", "0.0", "0.2"]);
    }

    #[test]
    fn nothing_and_one_value_still_make_an_axis() {
        for s in [Scale::from_zero([].into_iter(), 4), Scale::around([].into_iter(), 4)] {
            assert!(s.from < s.to && !s.ticks.is_empty());
        }
        let s = Scale::around([11_000.0].into_iter(), 4);
        assert!(s.from < 11_000.0 && s.to > 11_000.0);
    }

    #[test]
    fn numbers_are_written_as_people_write_them() {
        assert_eq!(number(11_000.0, 0), "11,000");
        assert_eq!(number(-1_234_567.89, 1), "−1,234,567.9");
        assert_eq!(number(-0.0001, 2), "0.00");
        assert_eq!(number(999.0, 0), "999");
        assert_eq!(three_digits(0.01234), "0.0123");
        assert_eq!(three_digits(12_345.6), "12,346");
        assert_eq!(three_digits(1.2e-9), "1.2e−9");
        assert_eq!(three_digits(0.0), "0.00");
    }
}
