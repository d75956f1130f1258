//! The equilibria of a bearing's shape over the Sommerfeld number.

use nalgebra::Matrix2;

use super::Film;
use super::equilibrium::{Equilibrium, LEAST_ECCENTRICITY, MOST_ECCENTRICITY, path};
use super::geometry::Shape;
use super::interpolation::Monotone;
use crate::error::{Error, FilmError};

/// Eccentricity ratio, attitude, film ratio, four stiffnesses, four dampings.
const COLUMNS: usize = 11;

/// The equilibria of one shape of bearing, whatever its size, oil, load and speed.
///
/// Interpolated monotonely in ln S; from a relative eccentricity of about 0.005 to 0.95.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmTable {
    pub(super) shape: Shape,
    columns: Monotone<COLUMNS>,
}

impl FilmTable {
    /// Solves the Reynolds equation for the shape of a bearing.
    ///
    /// # Errors
    /// If the film's numbers are out of range, or an equilibrium is not found.
    pub fn solve(film: &Film) -> Result<Self, Error> {
        film.check().map_err(|(key, expected)| FilmError::OutOfRange {
            key: key.to_string(),
            expected: expected.to_string(),
        })?;
        let shape = Shape::of(film);
        let mut equilibria = path(&shape)?;
        equilibria.reverse();
        let x = equilibria.iter().map(|e| e.sommerfeld.ln()).collect();
        let y = equilibria.iter().map(columns).collect();
        Ok(Self { shape, columns: Monotone::new(x, y) })
    }

    /// Whether these are the equilibria of this film's shape.
    pub fn is_of(&self, film: &Film) -> bool {
        self.shape == Shape::of(film)
    }

    /// The smallest and the largest Sommerfeld number covered.
    pub fn range(&self) -> [f64; 2] {
        self.columns.range().map(f64::exp)
    }

    /// The equilibrium at a Sommerfeld number S = μ N L D / W (R/c)², N in revolutions per second.
    ///
    /// # Errors
    /// If the eccentricity would be beyond 0.95, or below 0.005, of the set clearance.
    pub fn at(&self, sommerfeld: f64) -> Result<Equilibrium, Error> {
        Ok(self.with_slope(sommerfeld)?.0)
    }

    /// The equilibrium, and the derivatives of its numbers with respect to ln S.
    pub(super) fn with_slope(&self, sommerfeld: f64) -> Result<(Equilibrium, Equilibrium), Error> {
        let [least, most] = self.range();
        // a knot's own number survives its logarithm only to rounding
        if sommerfeld.is_nan() || sommerfeld < least * (1.0 - 1e-12) {
            let limit = MOST_ECCENTRICITY;
            return Err(FilmError::TooEccentric { limit, sommerfeld, sommerfeld_at_limit: least }.into());
        }
        if sommerfeld > most * (1.0 + 1e-12) {
            let limit = LEAST_ECCENTRICITY;
            return Err(FilmError::TooCentred { limit, sommerfeld, sommerfeld_at_limit: most }.into());
        }
        let (value, slope) = self.columns.at(sommerfeld.ln());
        Ok((equilibrium(sommerfeld, &value), equilibrium(sommerfeld, &slope)))
    }
}

fn columns(e: &Equilibrium) -> [f64; COLUMNS] {
    let (k, c) = (&e.stiffness, &e.damping);
    [
        e.eccentricity_ratio,
        e.attitude_deg,
        e.film_ratio,
        k[(0, 0)],
        k[(0, 1)],
        k[(1, 0)],
        k[(1, 1)],
        c[(0, 0)],
        c[(0, 1)],
        c[(1, 0)],
        c[(1, 1)],
    ]
}

fn equilibrium(sommerfeld: f64, row: &[f64; COLUMNS]) -> Equilibrium {
    let &[eccentricity_ratio, attitude_deg, film_ratio, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy] = row;
    Equilibrium {
        sommerfeld,
        eccentricity_ratio,
        attitude_deg,
        film_ratio,
        stiffness: Matrix2::new(kxx, kxy, kyx, kyy),
        damping: Matrix2::new(cxx, cxy, cyx, cyy),
    }
}
