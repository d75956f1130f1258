//! How a support answers the motion of the shaft: the dynamic stiffness of a bearing, a seal or an added mass,
//! and what stands in series with it.

use nalgebra::{Complex, Matrix2};

const I: Complex<f64> = Complex::new(0.0, 1.0);

/// How a support answers the motion of its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportLaw {
    /// Stiffness, rows x y, N/m.
    pub stiffness_n_m: Matrix2<f64>,
    /// Damping, rows x y, N·s/m.
    pub damping_n_s_m: Matrix2<f64>,
    /// Mass that moves with the shaft, kg.
    pub mass_kg: f64,
    /// Relative rise of the stiffness from `reference_rad_s` to twice that speed.
    pub stiffness_slope: f64,
    /// Speed at which the stiffness is as stated, rad/s.
    pub reference_rad_s: f64,
    /// κ of the describing function `k (1 + ¾ κ a²)` of a cubic spring, 1/m².
    pub hardening_per_m2: f64,
    /// Elastic foundation in series, if any.
    pub pedestal: Option<Pedestal>,
}

/// A mass on a spring and damper between a bearing and the ground, the same in both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pedestal {
    /// Stiffness to ground, N/m.
    pub stiffness_n_m: f64,
    /// Damping to ground, N·s/m.
    pub damping_n_s_m: f64,
    /// Mass, kg.
    pub mass_kg: f64,
}

impl Pedestal {
    /// `k + iΩc − Ω²m`, N/m.
    pub fn dynamic_stiffness(&self, speed_rad_s: f64) -> Complex<f64> {
        Complex::new(
            self.stiffness_n_m - speed_rad_s.powi(2) * self.mass_kg,
            speed_rad_s * self.damping_n_s_m,
        )
    }
}

impl SupportLaw {
    /// A linear support with the given coefficients and nothing else.
    pub fn linear(stiffness_n_m: Matrix2<f64>, damping_n_s_m: Matrix2<f64>) -> Self {
        Self {
            stiffness_n_m,
            damping_n_s_m,
            mass_kg: 0.0,
            stiffness_slope: 0.0,
            reference_rad_s: 0.0,
            hardening_per_m2: 0.0,
            pedestal: None,
        }
    }

    /// Force per displacement at running speed, 2 × 2, N/m.
    ///
    /// `amplitude_m` is the zero-to-peak motion of the shaft here in x and y; it matters only to a
    /// support that hardens or softens.
    pub fn dynamic_stiffness(&self, speed_rad_s: f64, amplitude_m: [f64; 2]) -> Matrix2<Complex<f64>> {
        let mut stiffness = self.stiffness_n_m;
        if self.reference_rad_s > 0.0 {
            stiffness *= 1.0 + self.stiffness_slope * (speed_rad_s / self.reference_rad_s - 1.0);
        }
        for (axis, amplitude) in amplitude_m.into_iter().enumerate() {
            stiffness[(axis, axis)] *= 1.0 + 0.75 * self.hardening_per_m2 * amplitude * amplitude;
        }
        let inertia = speed_rad_s.powi(2) * self.mass_kg;
        let bearing = stiffness.map(Complex::from) + self.damping_n_s_m.map(|c| I * (speed_rad_s * c))
            - Matrix2::identity() * Complex::from(inertia);
        match &self.pedestal {
            Some(pedestal) => in_series(bearing, pedestal.dynamic_stiffness(speed_rad_s)),
            None => bearing,
        }
    }
}

/// A 2 × 2 dynamic stiffness on top of an isotropic one: `Zb (Zb + Zp)⁻¹ Zp`.
fn in_series(bearing: Matrix2<Complex<f64>>, pedestal: Complex<f64>) -> Matrix2<Complex<f64>> {
    let sum = bearing + Matrix2::identity() * pedestal;
    let det = sum[(0, 0)] * sum[(1, 1)] - sum[(0, 1)] * sum[(1, 0)];
    let adjugate = Matrix2::new(sum[(1, 1)], -sum[(0, 1)], -sum[(1, 0)], sum[(0, 0)]);
    bearing * adjugate * (pedestal / det)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bearing() -> SupportLaw {
        SupportLaw::linear(Matrix2::new(2e8, 1e7, -2e7, 3e8), Matrix2::new(1e5, 2e3, 1e3, 2e5))
    }

    #[test]
    fn a_rigid_pedestal_leaves_the_bearing_and_a_soft_one_leaves_the_pedestal() {
        let alone = bearing().dynamic_stiffness(1000.0, [0.0; 2]);
        let on = |k| {
            let pedestal = Some(Pedestal { stiffness_n_m: k, damping_n_s_m: 0.0, mass_kg: 0.0 });
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
        s.pedestal = Some(Pedestal { stiffness_n_m: 4e7, damping_n_s_m: 0.0, mass_kg: 0.0 });
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
}
