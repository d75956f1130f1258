//! Conversions between the units of files and pages and those of equations.

pub const SECONDS_A_DAY: f64 = 86_400.0;

pub fn rad_s(speed_rpm: f64) -> f64 {
    speed_rpm * std::f64::consts::PI / 30.0
}

pub fn rpm(speed_rad_s: f64) -> f64 {
    speed_rad_s * 30.0 / std::f64::consts::PI
}
