//! Physical effects that a model can lack: one file each, with its terms, its parameters and bounds,
//! and what an engineer should know of it. A new effect is a file of its own and a line in [`ALL`].
//!
//! # Example
//! Brushes that rub on a disk, as a damper on the ground:
//!
//! ```
//! use nalgebra::Matrix2;
//! use rotor_edge_desktop::bearing::support::SupportLaw;
//! use rotor_edge_desktop::effects::{Effect, Knowledge, Parameter, Place, Scale, Scales};
//! use rotor_edge_desktop::machine::drawing::Rotor;
//! use rotor_edge_desktop::rotor_file;
//! use rotor_edge_desktop::effects::terms::Terms;
//!
//! struct Brushes;
//!
//! impl Effect for Brushes {
//!     fn name(&self) -> &'static str {
//!         "brushes"
//!     }
//!
//!     fn places(&self, rotor: &Rotor) -> Vec<Place> {
//!         (0..rotor.disk.len()).map(Place::Disk).collect()
//!     }
//!
//!     fn parameters(&self, _: &Scales) -> Vec<Parameter> {
//!         vec![Parameter { name: "c", unit: "N·s/m", scale: Scale::Logarithmic, bounds: [0.0, f64::INFINITY] }]
//!     }
//!
//!     fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
//!         vec![vec![0.02 * scales.stiffness_n_m / scales.fastest_rad_s]]
//!     }
//!
//!     fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
//!         let &[c] = parameters else { return };
//!         terms.supports.push((place, SupportLaw::linear(Matrix2::zeros(), Matrix2::identity() * c)));
//!     }
//!
//!     fn knowledge(&self) -> Knowledge {
//!         Knowledge {
//!             what: "Brushes on a disk damp its motion.",
//!             means: "An earthing brush that is pressed too hard.",
//!             inspect: "The brushes' springs and wear.",
//!         }
//!     }
//! }
//!
//! let rotor = rotor_file::parse("fan.toml", r#"
//!     schema = 2
//!     name = "fan"
//!     shaft = [{ length_m = 1.0, outer_diameter_m = 0.06 }]
//!     disk = [{ name = "wheel", position_m = 0.5, mass_kg = 12.0, diametral_inertia_kg_m2 = 0.06, polar_inertia_kg_m2 = 0.11 }]
//!     plane = [{ name = "wheel", position_m = 0.5 }]
//!     probe = [{ name = "X", bearing = "A", position_m = 0.15, angle_deg = 0 }]
//!     bearing = [
//!         { name = "A", position_m = 0.1, stiffness_n_m = { xx = 4e7, yy = 4e7 }, damping_n_s_m = { xx = 2e4, yy = 2e4 } },
//!         { name = "B", position_m = 0.9, stiffness_n_m = { xx = 4e7, yy = 4e7 }, damping_n_s_m = { xx = 2e4, yy = 2e4 } },
//!     ]
//! "#)?;
//! let scales = Scales {
//!     stiffness_n_m: 4e7, sagging_n_m: 1e5, rotor_kg: 50.0, fastest_rad_s: 600.0, reference_rad_s: 600.0,
//!     amplitude_m: 1e-5,
//! };
//! let mut terms = Terms::drawn(&rotor);
//! let place = Brushes.places(&rotor)[0];
//! Brushes.apply(&rotor, place, &Brushes.starts(&scales)[0], &scales, &mut terms);
//! // beside the two bearings, i Ω c on the diagonal of the dynamic stiffness, and nothing beside it
//! let (_, law) = &terms.supports[2];
//! let z = law.dynamic_stiffness(100.0, [0.0; 2]);
//! assert!(z[(0, 0)].re.abs() < 1e-6 && (z[(0, 0)].im - 100.0 * 0.02 * 4e7 / 600.0).abs() < 1e-3);
//! assert_eq!(z[(0, 1)].norm(), 0.0);
//! # Ok::<(), rotor_edge_desktop::Error>(())
//! ```

mod bow_kink;
mod coupling_force;
mod coupling_misaligned;
mod cross_coupled_stiffness;
mod disk_mass;
mod disk_skew;
pub mod entry;
mod gyroscopic;
mod hot_oil;
mod internal_damping;
mod keyphasor_offset;
mod limits;
mod magnetic_pull;
mod moved_load;
mod nonlinear_stiffness;
mod pedestal;
mod pedestal_by_direction;
pub mod physical;
mod probe_calibration;
mod probe_reversed;
mod probes_swapped;
mod rotary_inertia;
mod rub;
mod runout;
mod seal;
mod shaft_bow;
mod shaft_stiffness;
mod shear_deformation;
mod speed_dependent_stiffness;
mod speed_factor;
pub mod terms;
mod thermal_bow;
mod unbalance_of_run;
mod unbalance_plane;
mod without_probes;
mod worn_clearance;

use nalgebra::Complex;

use crate::bearing::Law;
use crate::bearing::curve::Curve;
use crate::bearing::film_curve::FilmCurve;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;
pub use crate::machine::place::{End, Pattern, Place};
pub use crate::statistics::scale::Scale;

/// Every effect, in the order in which reports list them when nothing else decides.
pub const ALL: [&dyn Effect; 31] = [
    &gyroscopic::Gyroscopic,
    &shear_deformation::ShearDeformation,
    &rotary_inertia::RotaryInertia,
    &speed_dependent_stiffness::SpeedDependentStiffness,
    &pedestal::OnPedestal,
    &pedestal_by_direction::PedestalByDirection,
    &cross_coupled_stiffness::CrossCoupledStiffness,
    &seal::Seal,
    &unbalance_plane::UnbalancePlane,
    &unbalance_of_run::UnbalanceOfRun,
    &shaft_bow::ShaftBow,
    &thermal_bow::ThermalBow,
    &bow_kink::BowKink,
    &disk_skew::DiskSkew,
    &runout::Runout,
    &probe_calibration::ProbeCalibration,
    &probe_reversed::ProbeReversed,
    &probes_swapped::ProbesSwapped,
    &keyphasor_offset::KeyphasorOffset,
    &speed_factor::SpeedFactor,
    &coupling_force::CouplingForce,
    &coupling_misaligned::CouplingMisaligned,
    &disk_mass::DiskMass,
    &magnetic_pull::MagneticPull,
    &nonlinear_stiffness::NonlinearStiffness,
    &rub::Rub,
    &internal_damping::InternalDamping,
    &shaft_stiffness::ShaftStiffness,
    &worn_clearance::WornClearance,
    &hot_oil::HotOil,
    &moved_load::MovedLoad,
];

/// The effect of that name.
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    ALL.into_iter().find(|e| e.name() == name)
}

/// Sizes of one machine, to measure parameters against and to start searches from.
#[derive(Debug, Clone, Copy)]
pub struct Scales {
    /// Mean direct stiffness of the bearings, N/m.
    pub stiffness_n_m: f64,
    /// Stiffness of a support that would sag out of line under its share of the rotor's weight, N/m.
    pub sagging_n_m: f64,
    /// Mass of the rotor, kg.
    pub rotor_kg: f64,
    /// Fastest speed in the data, rad/s.
    pub fastest_rad_s: f64,
    /// Speed at which a stiffness that changes with speed is as stated, rad/s.
    pub reference_rad_s: f64,
    /// Root mean square amplitude at the bearings, m.
    pub amplitude_m: f64,
}

/// A real parameter that the response does not depend on linearly; SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// As in `[[effect]] parameters`.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    pub scale: Scale,
    /// Smallest and largest value that physics allows.
    pub bounds: [f64; 2],
}

/// A linear unknown as people know it: a pattern, and the factor from the pattern's amplitude to the
/// parameter in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    /// As in `[[effect]] parameters`.
    pub name: &'static str,
    /// SI unit of the parameter.
    pub unit: &'static str,
    pub pattern: Pattern,
    /// Pattern amplitude per unit of the parameter.
    pub per_unit: f64,
    /// Largest magnitude that physics allows.
    pub largest: f64,
}

/// What an engineer should know of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knowledge {
    pub what: &'static str,
    /// What it usually means on a machine.
    pub means: &'static str,
    pub inspect: &'static str,
}

/// A physical effect: one or more terms with a few parameters.
pub trait Effect: Sync {
    /// As in `[[effect]] kind` and on the command line.
    fn name(&self) -> &'static str;

    /// The effect of which this one is a special case at the same place; itself if of none.
    fn general(&self) -> &'static str {
        self.name()
    }

    /// Parameters of the general effect that describe this special case with these `parameters`, all in SI units; `None` if this
    /// effect is general itself, or the general effect has linear unknowns only.
    fn as_general(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let _ = parameters;
        None
    }

    /// Every place where the effect can sit on this rotor and does not yet by its `[physics]`.
    fn places(&self, rotor: &Rotor) -> Vec<Place>;

    /// Why the effect of a whole machine is not sought on this rotor, though its file may state it: after its name, it
    /// completes a sentence.
    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        let _ = rotor;
        None
    }

    /// Parameters that enter nonlinearly, so that they are searched.
    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let _ = scales;
        Vec::new()
    }

    /// Starting points of the search, in SI units.
    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let _ = scales;
        vec![Vec::new()]
    }

    /// Parameters of a usual strength, in SI units, for where nothing is measured yet.
    fn typical(&self, scales: &Scales) -> Vec<f64> {
        self.starts(scales).into_iter().next().unwrap_or_default()
    }

    /// Parameters, in SI units, of an effect so many times as strong as one with these; at zero there is none. Coefficients grow with
    /// it, factors are raised to its power.
    fn strengthened(&self, scales: &Scales, parameters: &[f64], strength: f64) -> Vec<f64> {
        let one = |(p, v): (Parameter, &f64)| match p.scale {
            Scale::Linear(_) => v * strength,
            Scale::Logarithmic if p.unit.is_empty() => v.powf(strength),
            Scale::Logarithmic => *v,
        };
        self.parameters(scales).into_iter().zip(parameters).map(one).collect()
    }

    /// Settings that belong to the parameters but are not fitted, as the file keeps them.
    fn settings(&self, scales: &Scales) -> Vec<(&'static str, f64)> {
        let _ = scales;
        Vec::new()
    }

    /// Parameters that are solved for.
    fn unknowns(&self, rotor: &Rotor, place: Place) -> Vec<Unknown> {
        let _ = (rotor, place);
        Vec::new()
    }

    /// Changes supports, physics and probes; linear unknowns are added by [`Effect::unknowns`].
    fn apply(&self, rotor: &Rotor, place: Place, parameters: &[f64], scales: &Scales, terms: &mut Terms) {
        let _ = (rotor, place, parameters, scales, terms);
    }

    /// What it says of the instruments, in words without a stop; `None` of an effect of the machine itself. `parameters` are in
    /// SI, in the order of [`Effect::parameters`].
    fn misreading(&self, _rotor: &Rotor, _place: Place, _parameters: &[f64]) -> Option<String> {
        None
    }

    fn knowledge(&self) -> Knowledge;
}

/// Adds the forcing or runout that a linear unknown of this size is; terms are those of every run, so what one run alone
/// carries is none of them.
pub(crate) fn add_unknown(unknown: &Unknown, value: Complex<f64>, terms: &mut Terms) {
    let amplitude = value * unknown.per_unit;
    match unknown.pattern {
        Pattern::Runout(probe) => terms.runout_m[probe] += amplitude,
        Pattern::RunUnbalance { .. } => {}
        pattern => terms.forcings.push((pattern, amplitude)),
    }
}

/// Every bearing of a rotor.
fn bearings(rotor: &Rotor) -> Vec<Place> {
    (0..rotor.bearing.len()).map(Place::Bearing).collect()
}

/// Every bearing with an oil film.
fn films(rotor: &Rotor) -> Vec<Place> {
    let mut places = bearings(rotor);
    places.retain(|p| matches!(p, Place::Bearing(i) if matches!(rotor.bearing[*i].law, Law::Film(_))));
    places
}

/// The film of a bearing, if it has one.
fn film_mut(place: Place, terms: &mut Terms) -> Option<&mut FilmCurve> {
    match &mut terms.bearing_mut(place).curve {
        Some(Curve::Film(film)) => Some(film),
        _ => None,
    }
}

/// Largest mass that moves with one bearing, relative to the rotor's. A block under a machine weighs three to five times the
/// machine (ACI 351.3R), and a machine up to ten times its rotor.
const HEAVIEST_PEDESTAL: f64 = 50.0;

/// Mass of a pedestal.
fn pedestal_mass(scales: &Scales) -> Parameter {
    Parameter {
        name: "m",
        unit: "kg",
        scale: Scale::Logarithmic,
        bounds: [0.0, HEAVIEST_PEDESTAL * scales.rotor_kg],
    }
}

/// A damping that is there, whatever its size.
fn positive_damping() -> Parameter {
    Parameter { name: "c", unit: "N·s/m", scale: Scale::Logarithmic, bounds: [0.0, f64::INFINITY] }
}

/// A stiffness that carries its share of the rotor.
fn carrying(name: &'static str, scales: &Scales) -> Parameter {
    Parameter { name, unit: "N/m", scale: Scale::Logarithmic, bounds: [scales.sagging_n_m, f64::INFINITY] }
}

/// A factor on a number of a film, beyond what is usual.
fn film_factor() -> Vec<Parameter> {
    vec![Parameter { name: "factor", unit: "", scale: Scale::Logarithmic, bounds: [0.2, 5.0] }]
}

/// Every disk of a rotor.
fn disks(rotor: &Rotor) -> Vec<Place> {
    (0..rotor.disk.len()).map(Place::Disk).collect()
}

/// The ends of the shaft that can be coupled: the right one is the machine's, as most are drawn with it there.
fn coupled_ends() -> Vec<Place> {
    vec![Place::Machine, Place::LeftEnd]
}

/// The end of the shaft at a place of [`coupled_ends`].
fn end(place: Place) -> End {
    if place == Place::LeftEnd { End::Left } else { End::Right }
}

/// The whole machine, unless something speaks against seeking the effect.
fn unless(not_sought: Option<&str>) -> Vec<Place> {
    if not_sought.is_some() { Vec::new() } else { vec![Place::Machine] }
}

/// What speaks against seeking a switch that is on.
fn switched_on(in_force: bool) -> Option<&'static str> {
    in_force.then_some("is already in the model")
}
