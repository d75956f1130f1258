//! Contact of the shaft with something around it.

use nalgebra::Matrix2;

/// A ring around the shaft that holds it back beyond a clearance, with dry friction against the rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubContact {
    /// Stiffness of ring and shaft against each other, N/m.
    pub stiffness_n_m: f64,
    /// How far the shaft moves before it touches, m.
    pub clearance_m: f64,
    /// Tangential over normal force.
    pub friction: f64,
}

impl RubContact {
    /// Force per displacement, rows x y, N/m, on an orbit of these amplitudes in x and y: nothing within the clearance,
    /// beyond it the describing function `k (1 − δ/a)` of a circle that touches all round, `a` its radius. An ellipse is
    /// taken as the circle of the same mean square radius.
    pub fn stiffness_n_m(&self, amplitude_m: [f64; 2]) -> Matrix2<f64> {
        let radius_m = (0.5 * (amplitude_m[0].powi(2) + amplitude_m[1].powi(2))).sqrt();
        if radius_m <= self.clearance_m {
            return Matrix2::zeros();
        }
        let normal = self.stiffness_n_m * (1.0 - self.clearance_m / radius_m);
        let tangential = self.friction * normal;
        // the surface at the contact moves from x into y, friction pushes the shaft back
        Matrix2::new(normal, -tangential, tangential, normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUB: RubContact = RubContact { stiffness_n_m: 4e6, clearance_m: 1e-4, friction: 0.2 };

    #[test]
    fn rub_force_on_circle_is_k_times_overlap_plus_friction() {
        let radius_m = 1.6e-4;
        for angle in [0.0_f64, 0.7, 2.5, -1.1] {
            let (sin, cos) = angle.sin_cos();
            let force = -RUB.stiffness_n_m([radius_m; 2]) * nalgebra::Vector2::new(cos, sin) * radius_m;
            let inward = -(force.x * cos + force.y * sin);
            let against_rotation = -(force.y * cos - force.x * sin);
            assert!((inward / (4e6 * 0.6e-4) - 1.0).abs() < 1e-12);
            assert!((against_rotation / (0.2 * inward) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn rub_stiffness_is_zero_in_clearance_and_full_far_beyond() {
        assert_eq!(RUB.stiffness_n_m([0.9e-4; 2]), Matrix2::zeros());
        let far = RUB.stiffness_n_m([1.0; 2]);
        assert!((far.m11 / 4e6 - 1.0).abs() < 1e-3 && (far.m21 / 8e5 - 1.0).abs() < 1e-3);
    }
}
