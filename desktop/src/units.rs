//! Conversions between the units of files and pages and those of equations; and when two positions or speeds are one.

pub const SECONDS_A_DAY: f64 = 86_400.0;

/// Positions closer than this are one place, m: far below what a drawing states.
const SAME_PLACE_M: f64 = 1e-6;
/// Marks closer than this are one node of a mesh, m: beyond rounding.
pub(crate) const SAME_NODE_M: f64 = 1e-9;
/// Speeds that differ by no more than this, relative, are one operating point: no machine is held to the last rpm.
pub const SAME_SPEED: f64 = 0.01;

pub(crate) fn same_place(one_m: f64, other_m: f64) -> bool {
    (one_m - other_m).abs() < SAME_PLACE_M
}

/// Whether a speed, in any unit, is that of an operating point at `one`.
pub(crate) fn same_speed(one: f64, other: f64) -> bool {
    (one - other).abs() <= SAME_SPEED * one.abs()
}

pub fn rad_s(speed_rpm: f64) -> f64 {
    speed_rpm * std::f64::consts::PI / 30.0
}

pub fn rpm(speed_rad_s: f64) -> f64 {
    speed_rad_s * 30.0 / std::f64::consts::PI
}

/// A number as it would be written in the file, to four digits.
pub(crate) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let digits =
        if magnitude < 1e-12 { 0 } else { (3 - magnitude.log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
