//! The motion of the whole shaft: what probes see of it at their places, between them.

use nalgebra::{Complex, DVector};

use super::Model;
use crate::error::Error;

/// The motion of one cross-section of the shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflection {
    /// From the left end, m.
    pub position_m: f64,
    /// Phasors along x and y, m.
    pub xy_m: [Complex<f64>; 2],
}

impl Deflection {
    /// Semi-major axis of the orbit, m: the radii of its forward and its backward part together.
    pub fn largest_m(&self) -> f64 {
        let [x, y] = self.xy_m;
        0.5 * ((x + Complex::<f64>::i() * y).norm() + (x - Complex::<f64>::i() * y).norm())
    }
}

impl Model {
    /// Motion at every station along the shaft for these unbalances (kg·m), at a speed as data state it.
    ///
    /// # Errors
    /// As [`Model::response_under`].
    pub fn deflection(
        &self,
        speed_rad_s: f64,
        unbalance_kg_m: &DVector<Complex<f64>>,
    ) -> Result<Vec<Deflection>, Error> {
        let (_, amplitudes_m) = self.settled_under(speed_rad_s, unbalance_kg_m)?;
        let columns = self.motion(self.true_rad_s(speed_rad_s), &amplitudes_m)?;
        let (planes, known) = columns.columns_range_pair(..unbalance_kg_m.len(), unbalance_kg_m.len()..);
        let motion = planes * unbalance_kg_m + known.column(0);
        let n = self.structure.size();
        let along = |shape: &DVector<f64>, from: usize| {
            (0..n).map(|k| motion[from + k] * shape[k]).sum::<Complex<f64>>()
        };
        let stations = self.structure.stations.iter();
        Ok(stations
            .map(|s| Deflection {
                position_m: s.position_m,
                xy_m: [along(&s.displacement, 0), along(&s.displacement, n)],
            })
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    #[test]
    fn at_a_probe_the_shaft_moves_as_the_probe_reads() {
        let rotor = sample_rotor();
        let model = Model::finite_elements(&rotor);
        let unbalance_kg_m =
            DVector::from_fn(rotor.plane.len(), |j, _| Complex::from_polar(1e-4, 1.0 + 2.0 * j as f64));
        let read = model.response_under(900.0, &unbalance_kg_m).unwrap().at(&unbalance_kg_m);
        let shaft = model.deflection(900.0, &unbalance_kg_m).unwrap();
        for (probe, read) in rotor.probe.iter().zip(read.iter()) {
            let here = shaft.iter().find(|d| (d.position_m - probe.position_m).abs() < 1e-9).unwrap();
            let (sin, cos) = probe.angle_deg.to_radians().sin_cos();
            let seen = here.xy_m[0] * cos + here.xy_m[1] * sin;
            assert!((seen - read).norm() < 1e-9 * read.norm(), "{}", probe.name);
        }
    }

    #[test]
    fn largest_radius_of_ellipse_or_line_is_semi_major_axis() {
        let at = |x: Complex<f64>, y: Complex<f64>| Deflection { position_m: 0.0, xy_m: [x, y] }.largest_m();
        let i = Complex::<f64>::i();
        assert!((at(3e-6.into(), -i * 1e-6) - 3e-6).abs() < 1e-18);
        assert!((at(3e-6.into(), Complex::from(4e-6)) - 5e-6).abs() < 1e-18);
    }
}
