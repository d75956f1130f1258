//! How a support answers the motion of the shaft: the dynamic stiffness of a bearing, a seal or an added mass,
//! and what stands in series with it.

use nalgebra::{Complex, Matrix2};
use serde::{Deserialize, Serialize};

use super::curve::Curve;
use super::dynamic_coefficients::DynamicCoefficients;
use super::rub::RubContact;

type C = Complex<f64>;

/// Below this speed damping that changes with speed is taken at it, rad/s.
pub(crate) const SLOWEST_RAD_S: f64 = 1.0;

/// Whether dampers act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dampers {
    In,
    /// Without dampers and without what does work on a closed orbit.
    Out,
}

/// How a support answers the motion of its place.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportLaw {
    /// Stiffness that no curve states, rows x y, N/m.
    pub stiffness_n_m: Matrix2<f64>,
    /// Damping that no curve states, rows x y, N·s/m.
    pub damping_n_s_m: Matrix2<f64>,
    /// Stiffness and damping that follow the speed, beside the constant ones.
    pub curve: Option<Curve>,
    /// Mass that moves with the shaft, kg.
    pub mass_kg: f64,
    /// Relative rise of the constant stiffness from `reference_rad_s` to twice that speed.
    pub stiffness_slope: f64,
    /// Speed at which the stiffness is as stated, rad/s.
    pub reference_rad_s: f64,
    /// κ of the describing function `k (1 + ¾ κ a²)` of a cubic spring, 1/m².
    pub hardening_per_m2: f64,
    /// Contact beyond a clearance, if any.
    pub rub: Option<RubContact>,
    /// Elastic foundation in series, if any.
    pub pedestal: Option<Pedestal>,
}

/// A mass on a spring and damper between a bearing and the ground, along x and along y.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pedestal {
    /// Stiffness to ground, x and y, N/m.
    pub stiffness_n_m: [f64; 2],
    /// Damping to ground, x and y, N·s/m.
    #[serde(default)]
    pub damping_n_s_m: [f64; 2],
    /// Mass that moves along x and along y, kg.
    #[serde(default)]
    pub mass_kg: [f64; 2],
}

impl Pedestal {
    /// The same in both directions.
    pub fn isotropic(stiffness_n_m: f64, damping_n_s_m: f64, mass_kg: f64) -> Self {
        Self { stiffness_n_m: [stiffness_n_m; 2], damping_n_s_m: [damping_n_s_m; 2], mass_kg: [mass_kg; 2] }
    }

    /// `k + λc + λ²m` along x and y for motion `e^{λt}`, N/m.
    pub fn dynamic_stiffness(&self, lambda: C) -> Matrix2<C> {
        let along = |axis: usize| {
            C::from(self.stiffness_n_m[axis])
                + lambda * self.damping_n_s_m[axis]
                + lambda * lambda * self.mass_kg[axis]
        };
        Matrix2::new(along(0), C::from(0.0), C::from(0.0), along(1))
    }
}

impl SupportLaw {
    /// A linear support with the given coefficients and nothing else.
    pub fn linear(stiffness_n_m: Matrix2<f64>, damping_n_s_m: Matrix2<f64>) -> Self {
        Self {
            stiffness_n_m,
            damping_n_s_m,
            curve: None,
            mass_kg: 0.0,
            stiffness_slope: 0.0,
            reference_rad_s: 0.0,
            hardening_per_m2: 0.0,
            rub: None,
            pedestal: None,
        }
    }

    /// Whether its dynamic stiffness changes with the motion of the shaft.
    pub fn depends_on_amplitude(&self) -> bool {
        self.hardening_per_m2 != 0.0 || self.rub.is_some()
    }

    /// Stiffness and damping at running speed, of a shaft at rest in the bearing.
    pub fn coefficients(&self, speed_rad_s: f64) -> DynamicCoefficients {
        let mut pair = DynamicCoefficients { stiffness: self.stiffness_n_m, damping: self.damping_n_s_m };
        if self.reference_rad_s > 0.0 {
            pair.stiffness *= 1.0 + self.stiffness_slope * (speed_rad_s / self.reference_rad_s - 1.0);
        }
        if let Some(curve) = &self.curve {
            let more = curve.at(speed_rad_s);
            pair.stiffness += more.stiffness;
            pair.damping += more.damping;
        }
        pair
    }

    /// The same of bearing and pedestal in series, as they are for motion at running speed.
    pub fn coefficients_in_series(&self, speed_rad_s: f64) -> DynamicCoefficients {
        if self.pedestal.is_none() {
            return self.coefficients(speed_rad_s);
        }
        let at = speed_rad_s.max(SLOWEST_RAD_S);
        let z = Self { mass_kg: 0.0, ..self.clone() }.dynamic_stiffness(at, [0.0; 2]);
        DynamicCoefficients { stiffness: z.map(|z| z.re), damping: z.map(|z| z.im / at) }
    }

    /// The pedestal, where it moves by itself: it has a mass in both directions.
    pub fn moving_pedestal(&self) -> Option<&Pedestal> {
        self.pedestal.as_ref().filter(|p| p.mass_kg.iter().all(|m| *m > 0.0))
    }

    /// Stiffness where the law is stated: its own, with the curve in the middle of its speeds.
    pub fn typical_stiffness_n_m(&self) -> Matrix2<f64> {
        self.curve
            .as_ref()
            .map_or(self.stiffness_n_m, |c| self.stiffness_n_m + c.at(c.middle_rad_s()).stiffness)
    }

    /// The law without its curve, whose stiffness and damping at one speed are constants.
    pub fn frozen_at(&self, speed_rad_s: f64) -> Self {
        let Some(curve) = &self.curve else { return self.clone() };
        let more = curve.at(speed_rad_s);
        Self {
            stiffness_n_m: self.stiffness_n_m + more.stiffness,
            damping_n_s_m: self.damping_n_s_m + more.damping,
            curve: None,
            ..self.clone()
        }
    }

    /// Force per displacement at running speed, 2 × 2, N/m.
    ///
    /// `amplitude_m` is the zero-to-peak motion of the shaft here in x and y; it matters only to a
    /// support that hardens or softens, or rubs.
    pub fn dynamic_stiffness(&self, speed_rad_s: f64, amplitude_m: [f64; 2]) -> Matrix2<C> {
        self.held(C::new(0.0, speed_rad_s), speed_rad_s, amplitude_m, Dampers::In)
    }

    /// Force per displacement `e^{λt}` of a shaft that turns at this speed, 2 × 2, N/m.
    pub fn held(&self, lambda: C, speed_rad_s: f64, amplitude_m: [f64; 2], dampers: Dampers) -> Matrix2<C> {
        let mut pair = self.coefficients(speed_rad_s);
        let mut pedestal = self.pedestal;
        if dampers == Dampers::Out {
            pair.stiffness = (pair.stiffness + pair.stiffness.transpose()) * 0.5;
            pair.damping = Matrix2::zeros();
            pedestal.iter_mut().for_each(|p| p.damping_n_s_m = [0.0; 2]);
        }
        let bearing = self.without_pedestal(pair, lambda, amplitude_m);
        let held = match &pedestal {
            Some(pedestal) => in_series(bearing, pedestal.dynamic_stiffness(lambda)),
            None => bearing,
        };
        held + Matrix2::identity() * (lambda * lambda * self.mass_kg)
    }

    /// Motion of the housing per motion of the shaft, `(Zb + Zp)⁻¹ Zb`: zero on rigid ground.
    pub fn housing(&self, speed_rad_s: f64, amplitude_m: [f64; 2]) -> Matrix2<C> {
        let Some(pedestal) = &self.pedestal else { return Matrix2::zeros() };
        let lambda = C::new(0.0, speed_rad_s);
        let bearing = self.without_pedestal(self.coefficients(speed_rad_s), lambda, amplitude_m);
        inverse(bearing + pedestal.dynamic_stiffness(lambda)) * bearing
    }

    /// Spring and damper of the bearing alone at an amplitude.
    fn without_pedestal(&self, pair: DynamicCoefficients, lambda: C, amplitude_m: [f64; 2]) -> Matrix2<C> {
        let DynamicCoefficients { mut stiffness, damping } = pair;
        for (axis, amplitude) in amplitude_m.into_iter().enumerate() {
            stiffness[(axis, axis)] *= 1.0 + 0.75 * self.hardening_per_m2 * amplitude * amplitude;
        }
        if let Some(rub) = &self.rub {
            stiffness += rub.stiffness_n_m(amplitude_m);
        }
        stiffness.map(C::from) + damping.map(|c| lambda * c)
    }
}

/// A dynamic stiffness on top of another: `Zp (Zb + Zp)⁻¹ Zb`.
fn in_series(bearing: Matrix2<C>, pedestal: Matrix2<C>) -> Matrix2<C> {
    product(&product(&pedestal, &inverse(bearing + pedestal)), &bearing)
}

/// The library multiplies small complex matrices column by column, which takes three times as long.
fn product(a: &Matrix2<C>, b: &Matrix2<C>) -> Matrix2<C> {
    Matrix2::new(
        a.m11 * b.m11 + a.m12 * b.m21,
        a.m11 * b.m12 + a.m12 * b.m22,
        a.m21 * b.m11 + a.m22 * b.m21,
        a.m21 * b.m12 + a.m22 * b.m22,
    )
}

/// By the adjugate; not finite where the matrix is singular.
fn inverse(m: Matrix2<C>) -> Matrix2<C> {
    let determinant = m.m11 * m.m22 - m.m12 * m.m21;
    Matrix2::new(m.m22, -m.m12, -m.m21, m.m11) * determinant.inv()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::curve::{Interpolation, Knots};
    use super::*;

    fn bearing() -> SupportLaw {
        SupportLaw::linear(Matrix2::new(2e8, 1e7, -2e7, 3e8), Matrix2::new(1e5, 2e3, 1e3, 2e5))
    }

    #[test]
    fn series_stiffness_tends_to_softer_of_bearing_and_pedestal() {
        let alone = bearing().dynamic_stiffness(1000.0, [0.0; 2]);
        let on = |k| {
            let pedestal = Some(Pedestal::isotropic(k, 0.0, 0.0));
            SupportLaw { pedestal, ..bearing() }.dynamic_stiffness(1000.0, [0.0; 2])
        };
        assert!((on(1e16) - alone).norm() < 1e-6 * alone.norm());
        let soft = on(1.0);
        assert!((soft - Matrix2::identity() * Complex::from(1.0)).norm() < 1e-6);
    }

    #[test]
    fn series_of_equal_isotropic_springs_is_half_of_one() {
        let isotropic = Matrix2::identity() * 4e7;
        let mut s = SupportLaw::linear(isotropic, Matrix2::zeros());
        s.pedestal = Some(Pedestal::isotropic(4e7, 0.0, 0.0));
        let z = s.dynamic_stiffness(500.0, [0.0; 2]);
        assert!((z - (isotropic * 0.5).map(Complex::from)).norm() < 1e-6);
    }

    #[test]
    fn stiffness_follows_speed_and_amplitude_as_stated() {
        let mut s = bearing();
        (s.stiffness_slope, s.reference_rad_s, s.hardening_per_m2) = (0.4, 500.0, 1e8);
        let z = s.dynamic_stiffness(1000.0, [1e-4, 0.0]);
        assert!((z[(0, 0)].re / (2e8 * 1.4 * (1.0 + 0.75)) - 1.0).abs() < 1e-12);
        assert!((z[(1, 1)].re / (3e8 * 1.4) - 1.0).abs() < 1e-12);
        assert!((z[(0, 0)].im / 1e8 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn force_through_bearing_equals_force_through_pedestal() {
        let pedestal =
            Pedestal { stiffness_n_m: [5e7, 9e7], damping_n_s_m: [2e3, 1e3], mass_kg: [40.0, 60.0] };
        let alone = bearing().dynamic_stiffness(800.0, [0.0; 2]);
        let on = SupportLaw { pedestal: Some(pedestal), ..bearing() };
        let (series, housing) = (on.dynamic_stiffness(800.0, [0.0; 2]), on.housing(800.0, [0.0; 2]));
        let through_pedestal = pedestal.dynamic_stiffness(C::new(0.0, 800.0)) * housing;
        let through_film = alone * (Matrix2::identity() - housing);
        assert!((through_pedestal - series).norm() < 1e-12 * series.norm());
        assert!((through_film - series).norm() < 1e-9 * series.norm());
        assert_eq!(bearing().housing(800.0, [0.0; 2]), Matrix2::zeros());
    }

    #[test]
    fn a_curve_adds_to_what_is_constant_and_freezes_into_it() {
        let pair = DynamicCoefficients {
            stiffness: Matrix2::new(1e7, 2e6, 3e6, 4e7),
            damping: Matrix2::repeat(7e3),
        };
        let knots = Arc::new(Knots::new(vec![100.0, 200.0], vec![pair, pair], Interpolation::Monotone));
        let mut law = bearing();
        law.curve = Some(Curve::Knots { knots, factors: DynamicCoefficients::ones() });
        let at = law.coefficients(150.0);
        assert!((at.stiffness - bearing().stiffness_n_m - pair.stiffness).norm() < 1.0);
        assert!((at.damping - bearing().damping_n_s_m - pair.damping).norm() < 1e-6);
        assert_eq!(
            law.frozen_at(150.0).dynamic_stiffness(150.0, [0.0; 2]),
            law.dynamic_stiffness(150.0, [0.0; 2])
        );
    }
}
