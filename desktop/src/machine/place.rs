//! Where something sits on a machine, and the rotating patterns that can act there.

use std::borrow::Cow;

use crate::machine::drawing::Rotor;
use crate::machine::span::Span;

/// Shapes that a length of shaft bends in: those of a bending moment that is even, linear and quadratic along it.
pub const STRAINS: usize = 3;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// The machine as a whole.
    Machine,
    /// A bearing, by its number in the file.
    Bearing(usize),
    /// A disk, by its number in the file.
    Disk(usize),
    /// A probe, by its number in the file.
    Probe(usize),
    /// The left end of the shaft.
    LeftEnd,
    /// A run, by its number in the file.
    Run(usize),
    /// A length of the shaft.
    Span(Span),
    /// The strain of a length of the shaft in one of its bending shapes, by number; a change of stiffness acts on it.
    Strain(Span, usize),
}

impl Place {
    /// The name in the rotor's file; `None` for the whole machine.
    pub fn name(self, rotor: &Rotor) -> Option<Cow<'_, str>> {
        let name = match self {
            Self::Machine => return None,
            Self::Span(span) | Self::Strain(span, _) => return Some(span.name().into()),
            Self::Bearing(i) => &rotor.bearing[i].name,
            Self::Disk(i) => &rotor.disk[i].name,
            Self::Probe(i) => &rotor.probe[i].name,
            Self::LeftEnd => "left end",
            Self::Run(i) => &rotor.run[i].name,
        };
        Some(name.into())
    }
}

/// How a forcing depends on speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpeedLaw {
    /// The same at every speed.
    Constant,
    /// Grows with the square of the speed, as any force of inertia.
    Squared,
}

impl SpeedLaw {
    /// The factor on the forcing.
    pub fn factor(self, speed_rad_s: f64) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Squared => speed_rad_s * speed_rad_s,
        }
    }
}

/// An end of the shaft.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At position 0.
    Left,
    /// At the length of the shaft.
    Right,
}

/// A rotating pattern whose complex amplitude enters linearly and is solved for exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Unbalance of a disk, kg·m.
    DiskUnbalance(usize),
    /// Moment `Ω²` times this amplitude on a disk's tilt, kg·m².
    DiskTilt(usize),
    /// The force that holds the shaft straight against a half sine of this height between the
    /// bearings, m.
    Bow,
    /// The same, growing evenly from nothing to this height while a run lasts, m.
    GrowingBow,
    /// The force that holds the shaft straight against a full sine of this height between the bearings, m.
    FullBow,
    /// A force at an end, N.
    End(End),
    /// A moment on the tilt of an end, N·m.
    EndTilt(End),
    /// An offset of one probe at every speed, m.
    Runout(usize),
    /// Unbalance of a plane in the readings of one run alone, kg·m.
    RunUnbalance {
        /// Number of the run in the file.
        run: usize,
        /// Number of the plane in the file.
        plane: usize,
    },
}

impl Pattern {
    /// The pattern that has the same shape and does not grow while a run lasts.
    pub fn shape(self) -> Self {
        match self {
            Self::GrowingBow => Self::Bow,
            other => other,
        }
    }

    /// Half sines between the outermost bearings that the shaft is bent to; zero where a pattern is no bow.
    pub fn half_sines(self) -> u32 {
        match self {
            Self::Bow | Self::GrowingBow => 1,
            Self::FullBow => 2,
            _ => 0,
        }
    }

    /// Its number in a parameter that is a list of phasors; `None` where the parameter is one phasor.
    pub fn in_list(self) -> Option<usize> {
        match self {
            Self::Runout(probe) => Some(probe),
            Self::RunUnbalance { plane, .. } => Some(plane),
            _ => None,
        }
    }

    /// How the pattern grows with speed.
    pub fn law(self) -> SpeedLaw {
        match self {
            Self::DiskUnbalance(_) | Self::DiskTilt(_) | Self::RunUnbalance { .. } => SpeedLaw::Squared,
            Self::Bow
            | Self::GrowingBow
            | Self::FullBow
            | Self::End(_)
            | Self::EndTilt(_)
            | Self::Runout(_) => SpeedLaw::Constant,
        }
    }
}
