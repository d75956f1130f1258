//! The machine as its drawing states it: the contents of `rotor.toml`.
//!
//! SI units throughout; unbalance is written in g·mm and degrees, as on the shop floor.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use super::bearing::Bearing;
pub use super::coupling::{Coupling, Flexibility};
pub use super::disk::Disk;
pub use super::probes::UnusedProbe;
pub use super::segment::Segment;
pub use crate::bearing::constant::{Coefficients, Constant};
use crate::bearing::foundation::{Footing, Foundation};
use crate::units::SAME_NODE_M;

/// A rotor on its bearings, watched by proximity probes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rotor {
    /// Version of the file's layout; this crate reads 1 and 2.
    pub schema: u32,
    /// What the machine is called in reports.
    pub name: String,
    /// The machine's own number, which no other has; see [`Rotor::identity`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
    /// Fastest speed in the data that bearings, planes and effects were fitted to, rpm; written by the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fastest_rpm: Option<f64>,
    /// Which parts of the beam theory are in force.
    #[serde(default)]
    pub physics: Physics,
    /// Standard deviation of a measured component, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// How far the machine may differ from its drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Tolerance>,
    /// What the machine is made to do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rated: Option<Rated>,
    /// Search ranges of phase I.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identify: Option<SearchBounds>,
    /// Shaft segments from the left end.
    #[serde(deserialize_with = "super::segment::read")]
    pub shaft: Vec<Segment>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coupling: Vec<Coupling>,
    /// Rigid disks on the shaft.
    #[serde(default)]
    pub disk: Vec<Disk>,
    /// One to sixteen bearings.
    #[serde(default)]
    pub bearing: Vec<Bearing>,
    /// What several bearings stand on together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foundation: Option<Foundation>,
    #[serde(default)]
    pub probe: Vec<Probe>,
    /// Probes that the file has and nothing uses; see [`Rotor::whole`].
    #[serde(skip)]
    pub unused: Vec<UnusedProbe>,
    /// Planes in which the unbalance is sought.
    #[serde(default)]
    pub plane: Vec<Plane>,
    /// Runs with known added unbalance.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub run: Vec<Run>,
    /// Physical effects beside bearings and unbalance, with their parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<EffectEntry>,
}

/// Switches of the beam theory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Physics {
    /// Polar inertia couples the two planes.
    pub gyroscopic: bool,
    /// Tilting cross-sections of the shaft carry inertia.
    pub rotary_inertia: bool,
    /// Timoshenko's shear flexibility.
    pub shear_deformation: bool,
    /// Shape functions of the reduced model.
    #[serde(skip_serializing_if = "is_default")]
    pub basis: BasisKind,
    /// Form of the equations of motion.
    #[serde(skip_serializing_if = "is_default")]
    pub formulation: Formulation,
}

impl Default for Physics {
    fn default() -> Self {
        Self {
            gyroscopic: true,
            rotary_inertia: true,
            shear_deformation: true,
            basis: BasisKind::default(),
            formulation: Formulation::default(),
        }
    }
}

pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Shape functions that the reduced model is built on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BasisKind {
    /// Modes of the real shaft on mean supports and the static deflection under each bearing.
    #[default]
    Supported,
    /// Bending modes of a uniform free-free beam, translation and rotation (Bera et al. 2023).
    FreeFree,
}

/// Form of the equations of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Formulation {
    /// Fixed frame: the polar gyroscopic term alone.
    #[default]
    Standard,
    /// As equation (1) of Bera et al. 2023 is printed, with `−Ω² N` in the stiffness, `N` the
    /// rotary-inertia matrix; kept to reproduce the paper.
    Printed2023,
}

/// Noise of each measured component as it is stated: `relative · |Y| + floor_um`; and what a fit found of it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Part that grows with the amplitude.
    pub relative: f64,
    /// Part that is always there, µm.
    pub floor_um: f64,
    /// Its size over the stated one as it was found. Written by the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Correlation of neighbouring readings of one probe as it was found. Written by the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Scatter between runs as it was found, relative to the response. Written by the tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between_runs: Option<f64>,
}

/// Standard deviations of what the drawing states. A file without them has those that are usual, see
/// [`Tolerance::holding`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerance {
    /// Whether the machine is exactly as drawn, as a simulated one is: all that follows is zero.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub exact: bool,
    /// Young's modulus, relative.
    #[serde(skip_serializing_if = "is_zero")]
    pub modulus_relative: f64,
    /// Outer diameters, relative.
    #[serde(skip_serializing_if = "is_zero")]
    pub diameter_relative: f64,
    /// Disk masses, relative.
    #[serde(skip_serializing_if = "is_zero")]
    pub mass_relative: f64,
    /// Disk inertias, relative.
    #[serde(skip_serializing_if = "is_zero")]
    pub inertia_relative: f64,
    /// Axial positions, m.
    #[serde(skip_serializing_if = "is_zero")]
    pub position_m: f64,
    /// How far a fit found the machine from its drawing, by what it is about, relative or in m; the file's numbers have it in
    /// them already. Written by the tool; see [`Rotor::as_stated`].
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub found: BTreeMap<String, f64>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Ranges that phase I searches for every bearing coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchBounds {
    /// Lowest and highest direct stiffness, N/m.
    pub stiffness_n_m: [f64; 2],
    /// Lowest and highest direct damping, N·s/m.
    pub damping_n_s_m: [f64; 2],
}

/// What the machine is made to do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rated {
    /// Slowest and fastest speed that it may be run at, rpm: no advice goes beyond.
    pub speed_rpm: [f64; 2],
    /// Balance quality grade G of ISO 21940-11 that it is balanced to, mm/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balance_grade_mm_s: Option<f64>,
}

/// A proximity probe that reads `x cos(angle) + y sin(angle)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Its name, also the prefix of its columns in a measurement file.
    pub name: String,
    /// Name of the bearing beside the probe.
    pub bearing: String,
    /// Place on the shaft, m from the left end.
    pub position_m: f64,
    /// From +x, in the direction of rotation, degrees.
    pub angle_deg: f64,
    /// Whether its readings are used; a controller masks one that is not.
    #[serde(default = "used", skip_serializing_if = "is_used")]
    pub used: bool,
    /// What it is mounted on.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mount: Mount,
    /// Its gap voltage, if that of the shaft at rest is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gap: Option<Gap>,
}

fn used() -> bool {
    true
}

fn is_used(used: &bool) -> bool {
    *used
}

/// Gap voltage of an eddy-current probe: negative, and more so the further away the shaft is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gap {
    /// While the shaft lies still in its bearing, V.
    pub at_rest_v: f64,
    /// Change per mm that the shaft comes nearer, V/mm; 7.87 is 200 mV/mil.
    #[serde(default = "standard_sensitivity_v_mm")]
    pub sensitivity_v_mm: f64,
    /// Standard deviation of what the probe shows from a straight line, µm; unless stated, that of a probe that is off by
    /// up to 25.4 µm, as API 670 allows.
    #[serde(default = "standard_accuracy_um")]
    pub accuracy_um: f64,
}

/// Of API standard 670.
fn standard_sensitivity_v_mm() -> f64 {
    7.87
}

fn standard_accuracy_um() -> f64 {
    25.4 / 3.0_f64.sqrt()
}

impl Gap {
    /// How far the shaft has come nearer since it lay still, m.
    pub fn moved_m(&self, gap_v: f64) -> f64 {
        (gap_v - self.at_rest_v) / self.sensitivity_v_mm * 1e-3
    }
}

/// What a probe is mounted on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mount {
    /// Something that does not move: the probe sees the shaft's motion.
    #[default]
    Ground,
    /// The housing of its bearing: the probe sees the shaft's motion less the housing's.
    Housing,
}

/// A plane in which unbalance is sought.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    pub name: String,
    /// Place on the shaft, m from the left end.
    pub position_m: f64,
    /// Identified unbalance, g·mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unbalance_g_mm: Option<f64>,
    /// Its angle from the keyphasor mark, in the direction of rotation, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
}

/// A run of the machine with known weights added.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// As in the `run` column of the measurements.
    pub name: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added_unbalance: Vec<AddedUnbalance>,
    /// Turned so slowly that nothing but runout shows: its mean is taken off every other reading.
    #[serde(default, skip_serializing_if = "is_default")]
    pub slow_roll: bool,
}

/// A trial weight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AddedUnbalance {
    /// Place on the shaft, m from the left end.
    pub position_m: f64,
    pub magnitude_g_mm: f64,
    /// From the keyphasor mark, in the direction of rotation, degrees.
    #[serde(default = "unstated")]
    pub angle_deg: f64,
}

/// What a reader finds where a file states no number; no checked rotor has one.
fn unstated() -> f64 {
    f64::NAN
}

/// A physical effect that the model has; see [`crate::effects`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectEntry {
    pub kind: String,
    /// Name of the bearing, disk, probe or run; absent for the whole machine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<String>,
    /// Parameters by name, SI units.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, ParameterValue>,
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ParameterValue {
    Real(f64),
    /// Real and imaginary part of a phasor.
    Phasor([f64; 2]),
    /// A phasor for each probe or plane.
    Phasors(Vec<[f64; 2]>),
}

impl Rotor {
    /// Length of the whole shaft, m.
    pub fn length_m(&self) -> f64 {
        self.shaft.iter().map(|s| s.length_m).sum()
    }

    /// The segment that covers a position.
    ///
    /// # Panics
    /// If the shaft has no segment, which a checked one has.
    pub fn segment_at(&self, position_m: f64) -> &Segment {
        let mut end = 0.0;
        let covers = |s: &&Segment| {
            end += s.length_m;
            position_m < end
        };
        let last = || self.shaft.last().expect("a checked rotor has a segment");
        self.shaft.iter().find(covers).unwrap_or_else(last)
    }

    /// Every axial position that something is attached to, ascending, without repeats, m.
    pub fn marks_m(&self) -> Vec<f64> {
        let mut marks: Vec<f64> = self
            .disk
            .iter()
            .map(|d| d.position_m)
            .chain(self.bearing.iter().map(|b| b.position_m))
            .chain(self.probe.iter().map(|p| p.position_m))
            .chain(self.plane.iter().map(|p| p.position_m))
            .chain(self.run.iter().flat_map(|r| r.added_unbalance.iter().map(|a| a.position_m)))
            .collect();
        marks.sort_by(f64::total_cmp);
        marks.dedup_by(|a, b| (*a - *b).abs() < SAME_NODE_M);
        marks
    }

    /// Places of the planes, m.
    pub fn plane_positions_m(&self) -> Vec<f64> {
        self.plane.iter().map(|p| p.position_m).collect()
    }

    /// From the first bearing along the shaft to the last, m; the whole shaft where there are not two.
    pub fn span_m(&self) -> [f64; 2] {
        let places = || self.bearing.iter().map(|b| b.position_m);
        let (left, right) = (places().fold(f64::INFINITY, f64::min), places().fold(0.0, f64::max));
        if left < right { [left, right] } else { [0.0, self.length_m()] }
    }

    /// Whether the file states what gives under a bearing.
    pub fn stands(&self, bearing: usize) -> bool {
        let b = &self.bearing[bearing];
        b.pedestal.is_some() || self.foundation.as_ref().is_some_and(|f| f.bearings.contains(&b.name))
    }

    /// The foundation under its bearings, by number; none if it is one that no machine can have.
    pub fn footing(&self) -> Option<Footing> {
        let foundation = self.foundation.as_ref()?;
        let number = |name: &String| self.bearing.iter().position(|b| b.name == *name);
        let bearings = foundation.bearings.iter().filter_map(number).collect();
        Some(Footing { bearings, compliance: foundation.compliance().ok()? })
    }

    /// Height of each bearing above the straight line, in the order of the file, m.
    pub fn elevations_m(&self) -> Vec<f64> {
        self.bearing.iter().map(|b| b.elevation_m).collect()
    }

    /// Index of the bearing that a probe belongs to.
    pub fn bearing_of(&self, probe: &Probe) -> Option<usize> {
        self.bearing.iter().position(|b| b.name == probe.bearing)
    }
}

#[cfg(test)]
mod tests {
    use super::Gap;

    #[test]
    fn gap_voltage_converts_0_787_v_to_0_1_mm_at_200_mv_per_mil() {
        let gap: Gap = toml::from_str("at_rest_v = -10.0").unwrap();
        assert!((gap.moved_m(-10.0 + 0.787) - 1e-4).abs() < 1e-12);
        assert!((200e-3 / 25.4e-3 / gap.sensitivity_v_mm - 1.0).abs() < 1e-3);
    }
}
