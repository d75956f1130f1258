//! Phase II in full precision: the unbalance of least residual for one reading, exactly.
//!
//! The response is linear in the unbalance, so `min Σ|f_model − f_measured|` with each plane's
//! magnitude bounded is a convex second-order cone programme. It has one optimum, which the
//! controller's swarm can be checked against.
//!
//! The bound is the paper's: each U at most 1.2 times the last (Machines 2023, 11, 976). Unbalance
//! that grows slowly never feels it. After a real jump (a lost blade, a replaced ring) it lets the
//! estimate rise by a factor 1.2 a reading, so for `ln(jump)/ln 1.2` readings the residual
//! stays high although the model may still be right; a flag raised then is about the jump. A plane
//! with next to no unbalance could never grow, so the bound has a floor.

use clarabel::solver::SupportedConeT::NonnegativeConeT;
use nalgebra::{Complex, DVector};

use crate::cone::Programme;
use crate::error::Error;
use crate::model::Response;
use crate::unbalance::G_MM;

/// Bounds on each plane's unbalance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnbalanceBounds {
    /// Largest ratio to the last reading's unbalance.
    pub growth: f64,
    /// The bound never falls below this, kg·m.
    pub floor_kg_m: f64,
}

impl UnbalanceBounds {
    /// The largest unbalance allowed after `last`, kg·m.
    pub fn largest(&self, last_kg_m: Complex<f64>) -> f64 {
        (self.growth * last_kg_m.norm()).max(self.floor_kg_m)
    }
}

/// The unbalance of least residual.
#[derive(Debug, Clone)]
pub struct LeastResidual {
    /// One phasor a plane, kg·m.
    pub unbalance_kg_m: DVector<Complex<f64>>,
    /// Σ|f_model − f_measured|, µm.
    pub residual_um: f64,
}

/// Σ|f_model − f_measured| over the components of all probes, µm.
pub fn residual_um(model_m: &DVector<Complex<f64>>, measured_m: &DVector<Complex<f64>>) -> f64 {
    (model_m - measured_m).iter().map(|d| (d.re.abs() + d.im.abs()) * 1e6).sum()
}

/// The exact L1 optimum for one reading: the phasors `measured_m` of all probes.
///
/// `largest_kg_m` bounds each plane's magnitude; infinite for no bound.
///
/// # Errors
/// If the programme cannot be solved, which a finite response and finite measurements rule out.
pub fn least_residual(
    response: &Response,
    measured_m: &DVector<Complex<f64>>,
    largest_kg_m: &[f64],
) -> Result<LeastResidual, Error> {
    let planes = response.per_unbalance.ncols();
    let features = 2 * measured_m.len();
    // unknowns: unbalance in g·mm (x, y a plane), then one slack in µm per feature
    let unknowns = 2 * planes + features;
    let mut programme = Programme::default();
    for (p, (y, fixed)) in measured_m.iter().zip(response.fixed.iter()).enumerate() {
        let target = (y - fixed) * 1e6;
        for (component, value) in [target.re, -target.im].into_iter().enumerate() {
            let slack = 2 * planes + 2 * p + component;
            for sign in [1.0, -1.0] {
                for j in 0..planes {
                    let c = response.per_unbalance[(p, j)] * sign;
                    let row = if component == 0 { [c.re, -c.im] } else { [-c.im, -c.re] };
                    programme.push(2 * j, row[0]);
                    programme.push(2 * j + 1, row[1]);
                }
                programme.push(slack, -1.0);
                programme.end_row(sign * value);
            }
        }
    }
    programme.cones.push(NonnegativeConeT(2 * features));
    for (j, largest) in largest_kg_m.iter().enumerate().filter(|(_, largest)| largest.is_finite()) {
        programme.bound_pair(2 * j, largest * G_MM);
    }
    let cost: Vec<f64> = (0..unknowns).map(|k| if k < 2 * planes { 0.0 } else { 1.0 }).collect();
    let x = programme.solve("phase II", &cost)?;
    let unbalance_kg_m = DVector::from_fn(planes, |j, _| Complex::new(x[2 * j], x[2 * j + 1]) / G_MM);
    let residual_um = residual_um(&response.at(&unbalance_kg_m), measured_m);
    Ok(LeastResidual { unbalance_kg_m, residual_um })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::testing::sample_rotor;

    fn case() -> (Response, DVector<Complex<f64>>, DVector<Complex<f64>>) {
        let response = Model::finite_elements(&sample_rotor()).response(1000.0).unwrap();
        let truth = DVector::from_vec(vec![Complex::new(3e-4, -1e-4), Complex::new(-2e-4, 2.5e-4)]);
        let measured = response.at(&truth);
        (response, truth, measured)
    }

    #[test]
    fn a_noiseless_reading_gives_its_unbalance_back() {
        let (response, truth, measured) = case();
        let best = least_residual(&response, &measured, &[f64::INFINITY; 2]).unwrap();
        assert!((best.unbalance_kg_m - &truth).norm() < 1e-6 * truth.norm());
        assert!(best.residual_um < 1e-6);
    }

    #[test]
    fn two_grossly_wrong_features_do_not_move_an_l1_estimate() {
        let (response, truth, mut measured) = case();
        measured[2] += Complex::new(40e-6, -25e-6);
        let best = least_residual(&response, &measured, &[f64::INFINITY; 2]).unwrap();
        assert!((best.unbalance_kg_m - &truth).norm() < 1e-6 * truth.norm());
    }

    #[test]
    fn optimum_equals_the_best_vertex_of_the_linear_programme() {
        let (response, truth, mut measured) = case();
        for (k, y) in measured.iter_mut().enumerate() {
            *y += Complex::new(0.3e-6 * (k as f64 * 1.7).sin(), 0.3e-6 * (k as f64 * 2.9).cos());
        }
        let best = least_residual(&response, &measured, &[f64::INFINITY; 2]).unwrap();
        // without bounds an optimum makes four of the eight feature errors vanish
        let h = nalgebra::DMatrix::from_fn(8, 4, |i, k| {
            let c = response.per_unbalance[(i / 2, k / 2)];
            [[c.re, -c.im], [-c.im, -c.re]][i % 2][k % 2]
        });
        let m = DVector::from_fn(8, |i, _| if i % 2 == 0 { measured[i / 2].re } else { -measured[i / 2].im });
        let mut least = f64::INFINITY;
        for mask in (0..256_u32).filter(|m| m.count_ones() == 4) {
            let rows: Vec<usize> = (0..8).filter(|i| mask >> i & 1 == 1).collect();
            if let Some(u) = h.select_rows(&rows).lu().solve(&m.select_rows(&rows)) {
                least = least.min((&h * u - &m).iter().map(|r| r.abs() * 1e6).sum());
            }
        }
        assert!((best.residual_um - least).abs() < 1e-6 * least, "{} {least}", best.residual_um);
        assert!(truth.norm() > 0.0);
    }

    #[test]
    fn after_a_jump_the_estimate_sits_on_the_bound_and_grows_by_it() {
        let (response, truth, measured) = case();
        let bounds = UnbalanceBounds { growth: 1.2, floor_kg_m: 1e-6 };
        let mut last = &truth * Complex::from(0.5);
        let mut readings = 0;
        while (&last - &truth).norm() > 1e-4 * truth.norm() {
            let largest: Vec<f64> = last.iter().map(|u| bounds.largest(*u)).collect();
            let now = least_residual(&response, &measured, &largest).unwrap().unbalance_kg_m;
            for (u, limit) in now.iter().zip(&largest) {
                assert!(u.norm() <= limit * (1.0 + 1e-7));
            }
            last = now;
            readings += 1;
        }
        // ln 2 / ln 1.2 = 3.8
        assert_eq!(readings, 4);
    }
}
