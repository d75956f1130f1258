//! An oil film over speed, at whatever clearance, viscosity and load.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

use super::dynamic_coefficients::DynamicCoefficients;
use super::film::{Film, FilmState, FilmTable};
use crate::error::Error;

/// A film at whatever clearance, viscosity and load.
#[derive(Debug, Clone)]
pub struct FilmCurve {
    pub(super) film: Arc<Film>,
    pub(super) table: Arc<FilmTable>,
    /// Where the journal lies still, by the clearance.
    pub(super) at_rest: Option<Vector2<f64>>,
    /// Of the machined pad or lobe, m.
    pub clearance_m: f64,
    pub viscosity_pa_s: f64,
    pub load_n: f64,
}

impl FilmCurve {
    /// Equilibrium and coefficients at running speed.
    ///
    /// # Errors
    /// If the eccentricity is out of the solver's range.
    pub fn state(&self, speed_rad_s: f64) -> Result<FilmState, Error> {
        self.film.at(&self.table, self.load_n, self.clearance_m, self.viscosity_pa_s, speed_rad_s)
    }

    /// Coefficients at running speed; beyond what the film is solved for, as at the nearest speed that it is.
    pub fn at(&self, speed_rad_s: f64) -> DynamicCoefficients {
        match self.nearest(speed_rad_s) {
            Ok(state) => DynamicCoefficients { stiffness: state.stiffness_n_m, damping: state.damping_n_s_m },
            Err(_) => DynamicCoefficients {
                stiffness: Matrix2::repeat(f64::NAN),
                damping: Matrix2::repeat(f64::NAN),
            },
        }
    }

    /// Motion of the journal from where it lies still to where it runs, m, beyond what the film is solved for as [`Self::at`]; `None`
    /// where either is not known.
    pub fn risen_m(&self, speed_rad_s: f64) -> Option<Vector2<f64>> {
        let state = self.nearest(speed_rad_s).ok()?;
        Some(Vector2::new(state.x_m, state.y_m) - self.at_rest? * self.clearance_m)
    }

    /// Equilibrium at the nearest speed that the film is solved for.
    fn nearest(&self, speed_rad_s: f64) -> Result<FilmState, Error> {
        let [slowest, fastest] = self.range_rad_s();
        self.state(speed_rad_s.clamp(slowest, fastest.max(slowest)))
    }

    /// Slowest and fastest speed that the film is solved for, rad/s.
    pub fn range_rad_s(&self) -> [f64; 2] {
        let per_rad_s = self.film.sommerfeld(self.load_n, self.clearance_m, self.viscosity_pa_s, 1.0);
        self.table.range().map(|s| s / per_rad_s)
    }
}

impl PartialEq for FilmCurve {
    fn eq(&self, other: &Self) -> bool {
        let numbers = |c: &Self| [c.clearance_m, c.viscosity_pa_s, c.load_n];
        numbers(self) == numbers(other) && Arc::ptr_eq(&self.table, &other.table) && self.film == other.film
    }
}
