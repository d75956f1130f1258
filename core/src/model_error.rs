//! Why a model is refused.

use core::error::Error;
use core::fmt;

/// Why a model was refused. The numbers travel in a node's answer to a deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum ModelError {
    /// A number is infinite or not a number.
    NotFinite = 1,
    /// No plane, more than the firmware holds, or another number of initial unbalances.
    Planes = 2,
    /// Fewer than two supports, fewer than nominal springs, or more than the firmware holds.
    Supports = 3,
    /// Stiffness, mass or polar inertia is not symmetric within 1e-4 of its largest entry: of firmware for model schema 3.
    Asymmetric = 4,
    /// A mode of backward whirl has no positive mass, or a pedestal a negative mass, stiffness or damping.
    Mass = 5,
    /// The speed range is not positive and ascending.
    SpeedRange = 6,
    /// The unbalance floor is negative.
    UnbalanceFloor = 7,
    /// The response is not finite at an end or the middle of the speed range.
    Response = 8,
    /// Encoded with another schema.
    Schema = 9,
    /// Encoded for another number of basis shapes.
    BasisSize = 10,
    /// The bytes are cut short, damaged (CRC-32) or not a model.
    Encoding = 11,
    /// The buffer for encoding is too small; see [`Model::max_size_bytes`](crate::model::Model::max_size_bytes).
    Space = 12,
    /// A change of speed by a millionth moves the response by over a hundredth: rounding decides what it says.
    IllConditioned = 13,
    /// No probe in use, or more probes than the firmware holds.
    Probes = 14,
    /// A speed table with fewer than two knots, with knots that are not there or not in ascending order of speed; or more
    /// knots than the firmware holds.
    Knots = 15,
    /// A probe on the housing of a support that is not there or has no pedestal.
    Mount = 16,
    /// The noise is negative, or as large as what it is relative to.
    Noise = 17,
    /// A probe with a gain of zero, or a direction that is not of length one within 1 %.
    ProbeGain = 18,
    /// A probe stands at a bearing beyond [`MAX_BEARINGS`](crate::model::MAX_BEARINGS), which no message can name.
    Bearing = 19,
    /// Springs of the supports, the mean of x and y, that push the shaft away instead of holding it.
    NotHeld = 20,
    /// More forcings than the firmware holds.
    Forcings = 21,
}

impl ModelError {
    const ALL: [Self; 21] = [
        Self::NotFinite,
        Self::Planes,
        Self::Supports,
        Self::Asymmetric,
        Self::Mass,
        Self::SpeedRange,
        Self::UnbalanceFloor,
        Self::Response,
        Self::Schema,
        Self::BasisSize,
        Self::Encoding,
        Self::Space,
        Self::IllConditioned,
        Self::Probes,
        Self::Knots,
        Self::Mount,
        Self::Noise,
        Self::ProbeGain,
        Self::Bearing,
        Self::NotHeld,
        Self::Forcings,
    ];

    /// The error of a number on the wire.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|error| *error as u8 == code)
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NotFinite => "a number in the model is infinite or not a number",
            Self::Planes => {
                "the planes are none or more than the firmware holds, or not as many as the initial unbalances"
            }
            Self::Supports => {
                "the model has fewer than two supports, fewer than nominal springs, or more than the firmware holds"
            }
            Self::Asymmetric => {
                "stiffness, mass or polar inertia is not symmetric within 0.01 % of its largest entry"
            }
            Self::Mass => {
                "the mass of a mode is not above 0 kg, or a pedestal's mass, stiffness or damping is below 0"
            }
            Self::SpeedRange => "the lowest speed is not above 0 rpm, or it is above the highest speed",
            Self::UnbalanceFloor => "the unbalance floor is below 0 g·mm",
            Self::Response => "the response is not finite at an end or in the middle of the speed range",
            Self::Schema => "the bytes are in another schema than this firmware reads",
            Self::BasisSize => "the number of basis shapes differs from that of the firmware",
            Self::Encoding => "the bytes are cut short, damaged (CRC-32) or not a model",
            Self::Space => {
                "the buffer is too small for the encoded model; the largest needs Model::max_size_bytes()"
            }
            Self::IllConditioned => {
                "a change of speed by 0.0001 % moves the response by over 1 %: rounding errors decide it"
            }
            Self::Probes => "the model has no probe in use, or more probes than the firmware holds",
            Self::Knots => {
                "a speed table needs at least two knots in ascending order of speed, and no more than the firmware holds"
            }
            Self::Mount => "a probe is mounted on a support that does not exist or has no pedestal",
            Self::Noise => "the relative noise is not from 0 to below 1, or the noise floor is below 0 µm",
            Self::ProbeGain => "a probe has a gain of zero, or its direction is not of length one within 1 %",
            Self::Bearing => "a probe stands at a bearing beyond the seventh, which no message can name",
            Self::NotHeld => "the supports push the shaft away instead of holding it",
            Self::Forcings => "the model has more forcings than the firmware holds",
        })
    }
}

impl Error for ModelError {}
