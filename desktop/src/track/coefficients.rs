//! The bearing coefficients that change from day to day: the direct ones of two bearings.

pub use crate::bearing::law::PRIOR_LOG_SD;
use crate::error::Error;
use crate::machine::drawing::Rotor;

/// Direct bearing coefficients: k_xx k_yy of each bearing, then c_xx c_yy of each.
pub const COEFFICIENTS: usize = 8;

/// Bearing, axis (0 for x) of coefficient `i`, and whether it is damping.
pub fn coefficient(i: usize) -> (usize, usize, bool) {
    ((i / 2) % 2, i % 2, i >= COEFFICIENTS / 2)
}

/// A record can be followed on two bearings whose coefficients are stated as constants.
///
/// # Errors
/// If this machine has others.
pub fn two_constant_bearings(rotor: &Rotor) -> Result<(), Error> {
    let count = rotor.bearing.len();
    if count != 2 {
        return Err(Error::Unsuitable(format!(
            "a record is followed on two bearings, {count} are given; compare and diagnose take any number"
        )));
    }
    match rotor.bearing.iter().find(|b| b.law.as_law().follows_speed()) {
        Some(b) => Err(Error::Unsuitable(format!(
            "a record is followed on bearings with constant coefficients; state those of \"{}\" at the record's speed \
             as stiffness_n_m and damping_n_s_m",
            b.name
        ))),
        None => Ok(()),
    }
}
