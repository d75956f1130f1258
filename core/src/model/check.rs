//! Whether a model can be run at all.

use nalgebra::{Complex, SMatrix};

use super::{Model, ModelError};
use crate::reading::rad_s;
use crate::response::{SupportAmplitudes, response};

/// Relative step in speed that tries a model's conditioning, and the largest relative change of the response it may
/// cause: room for a resonance of quality 5,000; a shaft on fluid films stays below 100.
const SPEED_STEP: f32 = 1e-6;
const LARGEST_CHANGE: f32 = 1e-2;

/// Asymmetry that rounding of f64 matrices to f32 and their products may leave, relative to the largest entry.
const SYMMETRY: f32 = 1e-4;

impl<const N: usize> Model<N> {
    /// Every number finite, one or two planes, two supports or more, symmetric matrices, positive masses, a speed range
    /// in order, and a finite, well-conditioned response at its ends and middle.
    pub fn check(&self) -> Result<(), ModelError> {
        if self.planes.is_empty() {
            return Err(ModelError::Planes);
        }
        if self.supports.len() < 2 {
            return Err(ModelError::Supports);
        }
        if !self.is_finite() {
            return Err(ModelError::NotFinite);
        }
        for matrix in [&self.stiffness, &self.mass, &self.polar_inertia] {
            if !is_symmetric(matrix) {
                return Err(ModelError::Asymmetric);
            }
        }
        if (0..N).any(|i| self.mass.data.0[i][i] <= 0.0) {
            return Err(ModelError::Mass);
        }
        if self.unbalance_floor_g_mm < 0.0 {
            return Err(ModelError::UnbalanceFloor);
        }
        let [lowest, highest] = self.speed_range_rpm;
        if !(lowest > 0.0 && highest >= lowest) {
            return Err(ModelError::SpeedRange);
        }
        for speed_rpm in [lowest, 0.5 * (lowest + highest), highest] {
            self.try_out(rad_s(speed_rpm))?;
        }
        Ok(())
    }

    /// A response that a millionth of the speed turns over is one of rounding errors, not of the machine.
    fn try_out(&self, speed_rad_s: f32) -> Result<(), ModelError> {
        let at =
            |speed| response(self, speed, &SupportAmplitudes::default()).map_err(|_| ModelError::Response);
        let (here, beside) = (at(speed_rad_s)?, at(speed_rad_s * (1.0 + SPEED_STEP))?);
        let (here, beside) = (here.per_unbalance.as_flattened(), beside.per_unbalance.as_flattened());
        let response = largest(here.iter().copied());
        let change = largest(here.iter().zip(beside).map(|(here, beside)| here - beside));
        if change <= LARGEST_CHANGE * response { Ok(()) } else { Err(ModelError::IllConditioned) }
    }

    fn is_finite(&self) -> bool {
        let shaft = [&self.stiffness, &self.mass, &self.polar_inertia];
        shaft.into_iter().all(|matrix| all(matrix.data.0.as_flattened()))
            && all(&[self.internal_damping_s, self.unbalance_floor_g_mm])
            && all(&self.speed_range_rpm)
            && all(self.initial_unbalance_g_mm.as_flattened())
            && self.planes.iter().all(|shape| all(shape.data.0.as_flattened()))
            && self.supports.iter().all(|support| {
                all(support.shape.data.0.as_flattened())
                    && all(support.stiffness_n_m.as_flattened())
                    && all(support.damping_n_s_m.as_flattened())
                    && all(&[support.mass_kg, support.stiffness_slope])
                    && all(&[support.reference_speed_rad_s, support.hardening_per_um2])
                    && support.pedestal.is_none_or(|pedestal| {
                        all(&[pedestal.stiffness_n_m, pedestal.damping_n_s_m, pedestal.mass_kg])
                    })
            })
            && self
                .forcings
                .iter()
                .all(|forcing| all(forcing.shape.data.0.as_flattened()) && all(&forcing.amplitude))
            && self.probes.iter().all(|probe| {
                all(probe.shape.data.0.as_flattened())
                    && all(&probe.direction)
                    && all(&probe.gain)
                    && all(&probe.runout_um)
            })
    }
}

fn largest(cells: impl Iterator<Item = Complex<f32>>) -> f32 {
    cells.map(|cell| cell.l1_norm()).fold(0.0, f32::max)
}

fn all(numbers: &[f32]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

fn is_symmetric<const N: usize>(matrix: &SMatrix<f32, N, N>) -> bool {
    let cells = &matrix.data.0;
    let largest = cells.as_flattened().iter().fold(0.0_f32, |largest, cell| largest.max(cell.abs()));
    (0..N).all(|i| (0..N).all(|j| (cells[i][j] - cells[j][i]).abs() <= SYMMETRY * largest))
}
