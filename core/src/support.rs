//! The 2×2 dynamic stiffness of a support.

use nalgebra::Complex;

use crate::model::{Knot, Pair, Pedestal, Support};
use crate::scalar;

type C = Complex<f32>;

/// Rows and columns x, y; N/m.
pub(crate) type Block = [[C; 2]; 2];

/// Stiffness and damping, `[[xx, xy], [yx, yy]]` each.
type Coefficients = [[Pair; 2]; 2];

impl<const SHAPES: usize> Support<SHAPES> {
    /// Dynamic stiffness at a speed, N/m, with the shaft moving `amplitude_um` (x, y) at the support; `knots` are those
    /// of its own table.
    #[inline]
    pub(crate) fn dynamic_stiffness(&self, knots: &[Knot], speed_rad_s: f32, amplitude_um: Pair) -> Block {
        let bearing = self.bearing(knots, speed_rad_s, amplitude_um);
        let Some(pedestal) = &self.pedestal else {
            return bearing;
        };
        let pedestal = pedestal.dynamic_stiffness(speed_rad_s);
        let [[xx, xy], [yx, yy]] = housing(bearing, pedestal);
        let [x, y] = pedestal;
        [[x * xx, x * xy], [y * yx, y * yy]]
    }

    /// `[[kxx, kxy], [kyx, kyy]]` at rest, without the pedestal, with the coefficients of this speed, N/m.
    pub(crate) fn static_stiffness_n_m(&self, knots: &[Knot], speed_rad_s: f32) -> [Pair; 2] {
        let [stiffness, _] = self.coefficients(knots, speed_rad_s);
        stiffness
    }

    #[inline(never)] // once in flash
    fn coefficients(&self, knots: &[Knot], speed_rad_s: f32) -> Coefficients {
        let slope = if self.reference_speed_rad_s == 0.0 {
            1.0
        } else {
            1.0 + self.stiffness_slope * (speed_rad_s / self.reference_speed_rad_s - 1.0)
        };
        let mut stiffness = self.stiffness_n_m.map(|row| row.map(|k| k * slope));
        let mut damping = self.damping_n_s_m;
        if let Some([k, c]) = interpolate(knots, speed_rad_s) {
            add(&mut stiffness, &k);
            add(&mut damping, &c);
        }
        [stiffness, damping]
    }

    /// Dynamic stiffness without the pedestal, N/m.
    #[inline(never)] // once in flash
    fn bearing(&self, knots: &[Knot], speed_rad_s: f32, amplitude_um: Pair) -> Block {
        let [stiffness, damping] = self.coefficients(knots, speed_rad_s);
        // Describing function of a cubic spring: ¾ of the stiffness at the peak.
        let [hard_x, hard_y] = amplitude_um.map(|a| 1.0 + 0.75 * self.hardening_per_um2 * a * a);
        let [[kxx, kxy], [kyx, kyy]] = stiffness;
        let [[cxx, cxy], [cyx, cyy]] = damping.map(|row| row.map(|c| c * speed_rad_s));
        let inertia = speed_rad_s * speed_rad_s * self.mass_kg;
        [
            [C::new(kxx * hard_x - inertia, cxx), C::new(kxy, cxy)],
            [C::new(kyx, cyx), C::new(kyy * hard_y - inertia, cyy)],
        ]
    }

    /// Motion of the housing for a motion of the shaft, `(Zb + Zp)⁻¹ Zb`; zero on rigid ground.
    pub(crate) fn housing(&self, knots: &[Knot], speed_rad_s: f32, amplitude_um: Pair) -> Block {
        let Some(pedestal) = &self.pedestal else {
            return Block::default();
        };
        housing(self.bearing(knots, speed_rad_s, amplitude_um), pedestal.dynamic_stiffness(speed_rad_s))
    }
}

/// On the straight line between the knots beside the speed, the outermost beyond them.
fn interpolate(knots: &[Knot], speed_rad_s: f32) -> Option<Coefficients> {
    let of = |knot: &Knot| [knot.stiffness_n_m, knot.damping_n_s_m];
    let mut below: Option<&Knot> = None;
    for knot in knots {
        if knot.speed_rad_s >= speed_rad_s {
            let Some(below) = below else {
                return Some(of(knot));
            };
            let part = (speed_rad_s - below.speed_rad_s) / (knot.speed_rad_s - below.speed_rad_s);
            let mut between = of(below);
            let cells = between.as_flattened_mut().as_flattened_mut();
            for (cell, &above) in cells.iter_mut().zip(of(knot).as_flattened().as_flattened()) {
                *cell += part * (above - *cell);
            }
            return Some(between);
        }
        below = Some(knot);
    }
    below.map(of)
}

fn add(sum: &mut [Pair; 2], other: &[Pair; 2]) {
    for (cell, other) in sum.as_flattened_mut().iter_mut().zip(other.as_flattened()) {
        *cell += other;
    }
}

impl Pedestal {
    /// Along x and y, N/m.
    #[inline]
    fn dynamic_stiffness(&self, speed_rad_s: f32) -> [C; 2] {
        let [kx, ky] = self.stiffness_n_m;
        let [cx, cy] = self.damping_n_s_m;
        let [mx, my] = self.mass_kg;
        [(kx, cx, mx), (ky, cy, my)]
            .map(|(k, c, m)| C::new(k - speed_rad_s * speed_rad_s * m, speed_rad_s * c))
    }
}

/// `(Zb + Zp)⁻¹ Zb`, both divided by their largest entry first: the determinant of stiffnesses squared leaves f32.
#[inline(never)]
fn housing(bearing: Block, pedestal: [C; 2]) -> Block {
    let [of_bearing, of_pedestal] = [bearing.as_flattened(), &pedestal].map(scalar::largest_size);
    let scale = 1.0 / scalar::greater(of_bearing, of_pedestal);
    let [[a, b], [c, d]] = bearing.map(|row| row.map(|z| z * scale));
    let [px, py] = pedestal.map(|z| z * scale);
    let factor = scalar::reciprocal((a + px) * (d + py) - b * c);
    let determinant = a * d - b * c;
    [
        [factor * (determinant + a * py), factor * (b * py)],
        [factor * (c * px), factor * (determinant + d * px)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Shape;
    use nalgebra::{ComplexField, SVector};

    fn bearing() -> Support<1> {
        let one = SVector::from([1.0]);
        Support {
            stiffness_n_m: [[8e7, 1e7], [-2e7, 5e7]],
            damping_n_s_m: [[4e4, -1e3], [2e3, 3e4]],
            ..Support::isotropic(Shape { forward: one, backward: one }, 0.0, 0.0)
        }
    }

    fn difference(left: Block, right: Block) -> f32 {
        let pairs = left.as_flattened().iter().zip(right.as_flattened());
        pairs.fold(0.0, |worst, (a, b)| worst.max((a - b).modulus()))
    }

    #[test]
    fn pedestal_in_series_matches_the_matrix_formula_in_f64() {
        use nalgebra::Matrix2;
        let mut support = bearing();
        let speed = 900.0_f32;
        let widen = |z: Complex<f32>| Complex::new(f64::from(z.re), f64::from(z.im));
        let alone = support.dynamic_stiffness(&[], speed, [0.0; 2]).map(|row| row.map(widen));
        support.pedestal =
            Some(Pedestal { stiffness_n_m: [3e7, 5e7], damping_n_s_m: [2e3, 1e3], mass_kg: [20.0, 30.0] });
        let got = support.dynamic_stiffness(&[], speed, [0.0; 2]);
        let zb = Matrix2::new(alone[0][0], alone[0][1], alone[1][0], alone[1][1]);
        let px = Complex::new(3e7 - 900.0 * 900.0 * 20.0, 900.0 * 2e3);
        let py = Complex::new(5e7 - 900.0 * 900.0 * 30.0, 900.0 * 1e3);
        let zp = Matrix2::from_diagonal(&[px, py].into());
        let want = zp * (zb + zp).try_inverse().unwrap() * zb;
        for (i, row) in got.iter().enumerate() {
            for (j, &cell) in row.iter().enumerate() {
                assert!((widen(cell) - want[(i, j)]).modulus() < 1e-6 * want.norm());
            }
        }
    }

    #[test]
    fn rigid_pedestal_leaves_bearing_and_soft_leaves_pedestal() {
        let alone = bearing().dynamic_stiffness(&[], 500.0, [0.0; 2]);
        let with = |stiffness_n_m| {
            let pedestal = Some(Pedestal {
                stiffness_n_m: [stiffness_n_m; 2],
                damping_n_s_m: [0.0; 2],
                mass_kg: [0.0; 2],
            });
            Support { pedestal, ..bearing() }.dynamic_stiffness(&[], 500.0, [0.0; 2])
        };
        assert!(difference(with(1e15), alone) < 1e-6 * 8e7);
        let soft = Complex::new(10.0, 0.0);
        let nothing = Complex::new(0.0, 0.0);
        assert!(difference(with(10.0), [[soft, nothing], [nothing, soft]]) < 1e-5 * 10.0);
    }

    #[test]
    fn pedestal_mass_leaves_bearing_stiffness_at_infinite_speed() {
        let pedestal = Some(Pedestal { stiffness_n_m: [1e7; 2], damping_n_s_m: [0.0; 2], mass_kg: [1e6; 2] });
        let speed = 1e4;
        let heavy = Support { pedestal, ..bearing() }.dynamic_stiffness(&[], speed, [0.0; 2]);
        assert!(difference(heavy, bearing().dynamic_stiffness(&[], speed, [0.0; 2])) < 1e-4 * 4e8);
    }

    #[test]
    fn slope_scales_stiffness_and_not_damping() {
        let support = Support { stiffness_slope: 0.5, reference_speed_rad_s: 1000.0, ..bearing() };
        let [[zxx, _], [zyx, _]] = support.dynamic_stiffness(&[], 1500.0, [0.0; 2]);
        assert!((zxx.re / (8e7 * 1.25) - 1.0).abs() < 1e-6);
        assert!((zyx.re / (-2e7 * 1.25) - 1.0).abs() < 1e-6);
        assert!((zxx.im / (4e4 * 1500.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn hardening_acts_on_each_direction_by_its_own_amplitude() {
        let support = Support { hardening_per_um2: 1e-3, ..bearing() };
        let [[zxx, zxy], [_, zyy]] = support.dynamic_stiffness(&[], 100.0, [20.0, 10.0]);
        assert!((zxx.re / (8e7 * 1.3) - 1.0).abs() < 1e-6);
        assert!((zyy.re / (5e7 * 1.075) - 1.0).abs() < 1e-6);
        assert_eq!(zxy.re, 1e7);
    }

    #[test]
    fn mass_lowers_the_diagonal_by_speed_squared() {
        let [[zxx, zxy], _] = Support { mass_kg: 2.0, ..bearing() }.dynamic_stiffness(&[], 1000.0, [0.0; 2]);
        assert!((zxx.re - (8e7 - 2e6)).abs() < 10.0);
        assert_eq!(zxy.re, 1e7);
    }
}
