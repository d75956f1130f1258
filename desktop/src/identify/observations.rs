//! Readings made ready for fitting: receptances, weights, and the linear solution for the unbalance.

use nalgebra::{Complex, DMatrix, DVector};

use super::bearings::{LogCoefficients, dynamic_stiffness};
use crate::error::Error;
use crate::measurement::Reading;
use crate::model::Model;
use crate::receptance::{Receptance, Updated, nominal_spring};
use crate::rotor::{Noise, Rotor};
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

/// Noise to go by where a rotor's file states none: two percent, and two percent of the median
/// amplitude as floor.
pub fn assumed_noise(readings: &[Reading]) -> Noise {
    let mut sizes: Vec<f64> =
        readings.iter().flat_map(|r| r.probes.iter().flatten()).map(|y| y.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let median_um = sizes.get(sizes.len() / 2).map_or(1.0, |m| m * 1e6);
    Noise { relative: 0.02, floor_um: (0.02 * median_um).max(1e-3) }
}

/// One probe's value in one reading.
struct Value {
    probe: usize,
    measured_m: C,
    /// Standard deviation of each component, m.
    sigma_m: f64,
}

struct Row {
    receptance: Receptance<4>,
    values: Vec<Value>,
}

/// Measurements of one rotor with everything that does not depend on its bearings worked out.
pub struct Observations<'a> {
    rotor: &'a Rotor,
    planes: usize,
    runout_m: Vec<C>,
    rows: Vec<Row>,
}

/// The best unbalance for given bearings, and what is left.
pub struct Solution {
    /// One phasor a plane, kg·m.
    pub unbalance_kg_m: DVector<C>,
    /// Noise-weighted residuals, measured minus model, one complex number a value.
    pub weighted: DVector<C>,
    /// Σ|Re| + Σ|Im| of the residuals, µm.
    pub residual_um: f64,
    weighted_columns: DMatrix<C>,
    updated: Vec<Updated<4>>,
}

impl<'a> Observations<'a> {
    /// Prepares all readings; lost values are left out.
    ///
    /// # Errors
    /// If fewer values remain than there are unknown planes.
    pub fn new(rotor: &'a Rotor, noise: &Noise, readings: &[Reading]) -> Result<Self, Error> {
        let model = Model::finite_elements(rotor);
        let nominal = nominal_spring(&model);
        let planes = model.planes.len();
        let mut rows = Vec::with_capacity(readings.len());
        for reading in readings {
            let speed = reading.speed_rad_s();
            let forces = force_patterns(rotor, &model, reading);
            let receptance = Receptance::new(&model, nominal, speed, &forces).ok_or_else(|| {
                Error::Unsuitable(format!("the model is singular at {} rpm", reading.speed_rpm))
            })?;
            let values = reading
                .probes
                .iter()
                .enumerate()
                .filter_map(|(probe, y)| {
                    y.map(|measured_m| Value {
                        probe,
                        measured_m,
                        sigma_m: noise.relative * measured_m.norm() + noise.floor_um * 1e-6,
                    })
                })
                .collect();
            rows.push(Row { receptance, values });
        }
        let runout_m = model.probes.iter().map(|p| p.runout_m).collect();
        let observations = Self { rotor, planes, runout_m, rows };
        if observations.values() < planes {
            return Err(Error::Unsuitable(format!(
                "{} measured values cannot fix the unbalance of {planes} planes",
                observations.values()
            )));
        }
        Ok(observations)
    }

    /// Number of complex values that were measured.
    pub fn values(&self) -> usize {
        self.rows.iter().map(|r| r.values.len()).sum()
    }

    /// Number of unknown planes.
    pub fn planes(&self) -> usize {
        self.planes
    }

    /// Σ|u_c| + Σ|u_s| of all readings, µm.
    pub fn feature_sum_um(&self) -> f64 {
        let values = self.rows.iter().flat_map(|r| &r.values);
        values.map(|v| (v.measured_m.re.abs() + v.measured_m.im.abs()) * 1e6).sum()
    }

    /// Noise-weighted least squares for the unbalance with the bearings given.
    ///
    /// `None` if the machine is singular on these bearings.
    pub fn solve(&self, bearings: &LogCoefficients) -> Option<Solution> {
        let count = self.values();
        let mut columns = DMatrix::zeros(count, self.planes);
        let mut target = DVector::zeros(count);
        let mut updated = Vec::with_capacity(self.rows.len());
        let mut at = 0;
        for row in &self.rows {
            let z = dynamic_stiffness(self.rotor, bearings, row.receptance.speed_rad_s);
            let now = row.receptance.updated(&z)?;
            for v in &row.values {
                let known = now.response[(v.probe, self.planes)] + self.runout_m[v.probe];
                target[at] = (v.measured_m - known) / v.sigma_m;
                for j in 0..self.planes {
                    columns[(at, j)] = now.response[(v.probe, j)] / v.sigma_m;
                }
                at += 1;
            }
            updated.push(now);
        }
        let unbalance_kg_m = least_squares(&columns, &target)?;
        let weighted = target - &columns * &unbalance_kg_m;
        let sigmas = self.rows.iter().flat_map(|r| &r.values).map(|v| v.sigma_m);
        let residual_um = weighted.iter().zip(sigmas).map(|(r, s)| (r.re.abs() + r.im.abs()) * s * 1e6).sum();
        Some(Solution { unbalance_kg_m, weighted, residual_um, weighted_columns: columns, updated })
    }

    /// Derivative of the weighted residuals with the unbalance following along (variable projection,
    /// Kaufman's form): one column for each coefficient whose dynamic stiffness changes by
    /// `slope(i, speed)` at coordinate `place(i)`.
    pub fn derivative(
        &self,
        solution: &Solution,
        parameters: usize,
        place: impl Fn(usize) -> usize,
        slope: impl Fn(usize, f64) -> C,
    ) -> DMatrix<C> {
        let mut d = DMatrix::zeros(self.values(), parameters);
        let mut at = 0;
        for (row, now) in self.rows.iter().zip(&solution.updated) {
            for v in &row.values {
                for i in 0..parameters {
                    let held = place(i);
                    let known = now.sensitivity(v.probe, self.planes, held, held);
                    let forced: C = (0..self.planes)
                        .map(|j| now.sensitivity(v.probe, j, held, held) * solution.unbalance_kg_m[j])
                        .sum();
                    d[(at, i)] = -(known + forced) * slope(i, row.receptance.speed_rad_s) / v.sigma_m;
                }
                at += 1;
            }
        }
        for mut column in d.column_iter_mut() {
            let inside = least_squares(&solution.weighted_columns, &column.clone_owned());
            if let Some(u) = inside {
                column -= &solution.weighted_columns * u;
            }
        }
        d
    }
}

/// Columns: each plane's unbalance, then everything known (forcings and the run's trial weights).
fn force_patterns(rotor: &Rotor, model: &Model, reading: &Reading) -> DMatrix<C> {
    let speed = reading.speed_rad_s();
    let n = model.structure.size();
    let mut forces = DMatrix::zeros(n, model.planes.len() + 1);
    for (j, shape) in model.planes.iter().enumerate() {
        forces.set_column(j, &shape.map(|s| C::from(s * speed * speed)));
    }
    let mut known = forces.column_mut(model.planes.len());
    for f in &model.forcings {
        known += f.shape.map(|s| f.amplitude * (s * f.law.factor(speed)));
    }
    let run = rotor.run.iter().find(|r| Some(&r.name) == reading.run.as_ref());
    for weight in run.iter().flat_map(|r| &r.added_unbalance) {
        let u = phasor_kg_m(weight.magnitude_g_mm, weight.angle_deg);
        let shape = &model.structure.station(weight.position_m).displacement;
        known += shape.map(|s| u * (s * speed * speed));
    }
    forces
}

/// Complex least squares by normal equations on scaled columns: few columns, well apart.
fn least_squares(columns: &DMatrix<C>, target: &DVector<C>) -> Option<DVector<C>> {
    let norms: Vec<f64> = columns.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let mut scaled = columns.clone();
    for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
        column /= C::from(*norm);
    }
    let normal = scaled.adjoint() * &scaled;
    let mut u = normal.cholesky()?.solve(&(scaled.adjoint() * target));
    for (value, norm) in u.iter_mut().zip(&norms) {
        *value /= C::from(*norm);
    }
    Some(u)
}
