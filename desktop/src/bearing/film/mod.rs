//! Oil-film bearings: equilibrium and the eight coefficients from the Reynolds equation.
//!
//! | file | holds |
//! |---|---|
//! | `geometry` | the bearing's shape, without its size |
//! | `reynolds`, `banded` | the film of one pad: pressure, cavitation, force and its derivatives |
//! | `journal` | all pads around the journal; tilting pads |
//! | `equilibrium` | where the journal runs, from light to heavy load |
//! | `rest` | where a journal lies that does not turn |
//! | `table`, `interpolation` | that over the Sommerfeld number |
//! | `viscosity` | oil from its ISO grade |
//! | `check` | what a file may say |
//!
//! The theory: a thin, laminar, isothermal film of constant viscosity around a journal parallel to the bearing,
//! all its surroundings at ambient pressure, cavitated by the Reynolds condition. No thermal or turbulent
//! effects, no elasticity of pads or pivots, no friction at pivots, no inertia of pads or oil.
//!
//! Directions: rotation takes x into y. A load along −y moves the journal of a plain bearing towards −y and +x.
//! Stiffness and damping have the force lost in their rows: `F_x = −k_xx x − k_xy y − …`; for that bearing at
//! light load `k_xy > 0 > k_yx`, which drives forward whirl.

mod banded;
mod check;
mod equilibrium;
mod geometry;
mod interpolation;
mod journal;
mod rest;
mod reynolds;
mod state;
mod table;
#[cfg(test)]
mod tests;
mod viscosity;

use serde::{Deserialize, Serialize};

pub use equilibrium::Equilibrium;
pub use state::{FilmSlope, FilmState};
pub use table::FilmTable;
pub use viscosity::viscosity_pa_s;

/// An oil-film bearing as a file states it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Film {
    pub kind: FilmKind,
    /// Diameter of the journal, m.
    pub diameter_m: f64,
    /// Of the film along the shaft, m.
    pub length_m: f64,
    /// Of the machined pad or lobe: its radius minus the journal's, m. The set (assembled) clearance of a
    /// preloaded bearing is `1 − preload` times this.
    pub radial_clearance_m: f64,
    /// Dynamic viscosity of the oil in the film, Pa·s; or `iso_vg` and `temperature_c`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscosity_pa_s: Option<f64>,
    /// ISO 3448 grade, mm²/s at 40 °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso_vg: Option<f64>,
    /// Of the oil in the film, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Static load, N; where it is missing, from the shaft's weight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_n: Option<f64>,
    /// Direction in which the load pulls, degrees from +x in the direction of rotation. The pads are
    /// arranged about it.
    #[serde(default = "downwards")]
    pub load_angle_deg: f64,
    /// Tilting pads, lobes, or lands between axial grooves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pads: Option<usize>,
    /// Arc of a tilting pad, degrees; four fifths of the pitch unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pad_arc_deg: Option<f64>,
    /// `1 − set clearance / pad clearance`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preload: Option<f64>,
    /// Place of the pivot, or of a lobe's narrowest point, from the leading edge by the arc; 0.5 unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// Where the load points. Between pads unless stated for tilting pads; else on the middle of a lobe.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<PadLoad>,
    /// Between fixed lobes, degrees; 20 unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groove_arc_deg: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FilmKind {
    /// A full circle, fed where the film is widest.
    Plain,
    /// A circle interrupted by axial grooves (two, unless `pads` says otherwise).
    AxialGroove,
    /// Lobes moved inwards by a preload: two make the lemon bore, three or four a multi-lobe bearing.
    Elliptical,
    /// Two halves moved against each other along the split, so that each converges in the direction of
    /// rotation.
    Offset,
    /// Pads that tilt about pivots.
    TiltingPad,
}

/// Direction of the load relative to the pads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PadLoad {
    /// At the pivot of a pad, or the middle of a lobe.
    OnPad,
    /// At the middle between two.
    BetweenPads,
}

fn downwards() -> f64 {
    -90.0
}

impl Film {
    /// Viscosity of the oil, Pa·s: as stated, or of its grade at its temperature.
    ///
    /// `None` if the file states neither, which [`check`](Self::check) refuses.
    pub fn viscosity(&self) -> Option<f64> {
        self.viscosity_pa_s.or_else(|| Some(viscosity_pa_s(self.iso_vg?, self.temperature_c?)))
    }

    /// Sommerfeld number S = μ N L D / W (R/c)², N in revolutions per second.
    pub fn sommerfeld(&self, load_n: f64, clearance_m: f64, viscosity_pa_s: f64, speed_rad_s: f64) -> f64 {
        let revolutions_per_s = speed_rad_s / std::f64::consts::TAU;
        let slimness = 0.5 * self.diameter_m / clearance_m;
        viscosity_pa_s * revolutions_per_s * self.length_m * self.diameter_m / load_n * slimness.powi(2)
    }
}
