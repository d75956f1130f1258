//! The film of a real bearing at one speed.

use nalgebra::{Matrix2, Rotation2, Vector2};

use super::equilibrium::Equilibrium;
use super::{Film, FilmTable};
use crate::error::{Error, FilmError};

/// Equilibrium and coefficients of a film in machine axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmState {
    /// S = μ N L D / W (R/c)², N in revolutions per second.
    pub sommerfeld: f64,
    /// Distance of the journal from the bearing's centre by the pad clearance.
    pub eccentricity_ratio: f64,
    /// From the load to the line of centres in the direction of rotation, degrees.
    pub attitude_deg: f64,
    /// Thinnest film, m; of a tilting pad, at its pivot.
    pub film_m: f64,
    /// Journal from the bearing's centre, m.
    pub x_m: f64,
    /// Journal from the bearing's centre, m.
    pub y_m: f64,
    /// Rows the force lost in x and y, columns the displacement, N/m.
    pub stiffness_n_m: Matrix2<f64>,
    /// Rows the force lost in x and y, columns the velocity, N·s/m.
    pub damping_n_s_m: Matrix2<f64>,
    /// Derivatives with respect to the logarithm of the load.
    pub by_ln_load: FilmSlope,
    /// Derivatives with respect to the logarithm of the clearance.
    pub by_ln_clearance: FilmSlope,
    /// Derivatives with respect to the logarithm of the viscosity.
    pub by_ln_viscosity: FilmSlope,
}

/// Derivatives of a film's coefficients and place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmSlope {
    /// In N/m per unit of the logarithm.
    pub stiffness_n_m: Matrix2<f64>,
    /// In N·s/m per unit of the logarithm.
    pub damping_n_s_m: Matrix2<f64>,
    /// Of the journal's place, m.
    pub x_m: f64,
    /// Of the journal's place, m.
    pub y_m: f64,
}

impl Film {
    /// The film under a load, N, with a pad clearance, m, and a viscosity, Pa·s, which may differ from the
    /// file's, at a speed, rad/s.
    ///
    /// # Errors
    /// If one of the four is not positive, the table is of another shape, or the eccentricity out of range.
    pub fn at(
        &self,
        table: &FilmTable,
        load_n: f64,
        clearance_m: f64,
        viscosity_pa_s: f64,
        speed_rad_s: f64,
    ) -> Result<FilmState, Error> {
        for (quantity, value, unit) in [
            ("load", load_n, "N"),
            ("clearance", clearance_m, "m"),
            ("viscosity", viscosity_pa_s, "Pa·s"),
            ("speed", speed_rad_s, "rad/s"),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(FilmError::NotPositive { quantity, value, unit }.into());
            }
        }
        if !table.is_of(self) {
            return Err(FilmError::OtherShape.into());
        }
        let sommerfeld = self.sommerfeld(load_n, clearance_m, viscosity_pa_s, speed_rad_s);
        let (film, slope) = table.with_slope(sommerfeld)?;
        // the table's load pulls along −y
        let turn = Rotation2::new((self.load_angle_deg + 90.0).to_radians());
        let turned = |m: Matrix2<f64>| turn.matrix() * m * turn.matrix().transpose();
        let (place, place_slope) = place(&film, &slope);
        let (place, place_slope) = (clearance_m * (turn * place), clearance_m * (turn * place_slope));
        let per_length = load_n / clearance_m;
        let per_velocity = per_length / speed_rad_s;
        let stiffness_n_m = turned(film.stiffness) * per_length;
        let damping_n_s_m = turned(film.damping) * per_velocity;
        // K = (W/c) κ(ln S), ln S = ln μ − ln W − 2 ln c + …
        let by = |scale: f64, length: f64, sommerfeld: f64| FilmSlope {
            stiffness_n_m: scale * stiffness_n_m + sommerfeld * per_length * turned(slope.stiffness),
            damping_n_s_m: scale * damping_n_s_m + sommerfeld * per_velocity * turned(slope.damping),
            x_m: length * place.x + sommerfeld * place_slope.x,
            y_m: length * place.y + sommerfeld * place_slope.y,
        };
        Ok(FilmState {
            sommerfeld,
            eccentricity_ratio: film.eccentricity_ratio,
            attitude_deg: film.attitude_deg,
            film_m: clearance_m * film.film_ratio,
            x_m: place.x,
            y_m: place.y,
            stiffness_n_m,
            damping_n_s_m,
            by_ln_load: by(1.0, 0.0, -1.0),
            by_ln_clearance: by(-1.0, 1.0, -2.0),
            by_ln_viscosity: by(0.0, 0.0, 1.0),
        })
    }
}

/// The journal's place under a load along −y, in clearances, and its derivative with respect to ln S.
fn place(film: &Equilibrium, slope: &Equilibrium) -> (Vector2<f64>, Vector2<f64>) {
    let (sin, cos) = film.attitude_deg.to_radians().sin_cos();
    let (along, across) = (Vector2::new(sin, -cos), Vector2::new(cos, sin));
    let turning = slope.attitude_deg.to_radians();
    (
        film.eccentricity_ratio * along,
        slope.eccentricity_ratio * along + film.eccentricity_ratio * turning * across,
    )
}
