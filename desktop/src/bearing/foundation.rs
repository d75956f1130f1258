//! A foundation that several bearings stand on, and that carries the motion of each to the others.
//!
//! It is given by its modes, as a finite-element model of it gives them, its flexibility between the feet of its bearings
//! being `R(Ω) = Σ φφᵀ / m (ω² − Ω² + 2iζωΩ)`; or by that flexibility over frequency, as an impact test gives it. With the bearings' own dynamic stiffness `Z` under the
//! shaft, force and motion are `f = Z (x − R f)`, so that shaft and ground are joined by `(1 + Z R)⁻¹ Z`, and the feet
//! move by `R (1 + Z R)⁻¹ Z x`. A foundation with no modes is rigid.

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use nalgebra::{Complex, DMatrix, Matrix2};
use serde::{Deserialize, Serialize};

use super::flexibility::{FlexibilityRow, FlexibilityTable};

type C = Complex<f64>;

/// A foundation as a file states it: by modes or by a table.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Foundation {
    /// Names of the bearings that stand on it, in the order of the modes' shapes.
    pub bearings: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mode: Vec<FoundationMode>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub table: Vec<FlexibilityRow>,
    /// The table made ready, once for all evaluations.
    #[serde(skip)]
    pub ready: CachedTable,
}

/// What follows from the rest and is made once.
#[derive(Debug, Clone, Default)]
pub struct CachedTable(OnceLock<Arc<FlexibilityTable>>);

impl PartialEq for CachedTable {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Foundation {
    /// What gives under its bearings.
    ///
    /// # Errors
    /// As [`FlexibilityTable::new`].
    pub fn compliance(&self) -> Result<Compliance, (usize, String)> {
        if self.table.is_empty() {
            return Ok(Compliance::Modes(self.mode.clone()));
        }
        if let Some(table) = self.ready.0.get() {
            return Ok(Compliance::Table(table.clone()));
        }
        let table = Arc::new(FlexibilityTable::new(&self.table, &self.bearings)?);
        Ok(Compliance::Table(self.ready.0.get_or_init(|| table).clone()))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Compliance {
    Modes(Vec<FoundationMode>),
    /// Measured flexibility over frequency.
    Table(Arc<FlexibilityTable>),
}

/// A mode of a foundation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundationMode {
    pub frequency_hz: f64,
    #[serde(default)]
    pub damping_ratio: f64,
    /// Modal mass for the shape as it is stated, kg.
    pub modal_mass_kg: f64,
    /// Motion of the foot of each bearing along x.
    pub x: Vec<f64>,
    /// Motion of the foot of each bearing along y.
    pub y: Vec<f64>,
}

impl FoundationMode {
    pub fn natural_rad_s(&self) -> f64 {
        TAU * self.frequency_hz
    }

    /// Motion of a foot in x and y.
    pub fn shape(&self, foot: usize) -> [f64; 2] {
        [self.x[foot], self.y[foot]]
    }

    fn flexibility(&self, speed_rad_s: f64) -> C {
        let natural = self.natural_rad_s();
        let real = natural * natural - speed_rad_s * speed_rad_s;
        let imaginary = 2.0 * self.damping_ratio * natural * speed_rad_s;
        (C::new(real, imaginary) * self.modal_mass_kg).inv()
    }
}

/// A foundation under bearings by number.
#[derive(Debug, Clone, PartialEq)]
pub struct Footing {
    /// Numbers of the bearings that stand on it.
    pub bearings: Vec<usize>,
    pub compliance: Compliance,
}

/// How bearings on a foundation hold the shaft: x and y of each in turn.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundationStiffness {
    /// Force per motion of the shaft, N/m.
    pub stiffness: DMatrix<C>,
    /// Motion of the feet per motion of the shaft.
    pub housing: DMatrix<C>,
}

impl Footing {
    /// Its modes, if it is given by them.
    pub fn modes(&self) -> &[FoundationMode] {
        match &self.compliance {
            Compliance::Modes(modes) => modes,
            Compliance::Table(_) => &[],
        }
    }

    /// Motion of the feet per force on them at running speed, m/N.
    pub fn flexibility(&self, speed_rad_s: f64) -> DMatrix<C> {
        let modes = match &self.compliance {
            Compliance::Modes(modes) => modes,
            Compliance::Table(table) => return table.at(speed_rad_s),
        };
        let size = 2 * self.bearings.len();
        let mut all = DMatrix::zeros(size, size);
        for mode in modes {
            let along = |i: usize| mode.shape(i / 2)[i % 2];
            let per_force = mode.flexibility(speed_rad_s);
            all += DMatrix::from_fn(size, size, |i, j| per_force * (along(i) * along(j)));
        }
        all
    }

    /// Shaft and ground joined by bearings with these dynamic stiffnesses and the foundation; not finite where the feet
    /// resonate with the bearings on them without any damping.
    pub fn held(&self, speed_rad_s: f64, bearings: &[Matrix2<C>]) -> FoundationStiffness {
        let size = 2 * self.bearings.len();
        let mut own = DMatrix::zeros(size, size);
        for (i, block) in bearings.iter().enumerate() {
            own.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(block);
        }
        let flexibility = self.flexibility(speed_rad_s);
        let joined = (DMatrix::identity(size, size) + &own * &flexibility).lu().solve(&own);
        let stiffness = joined.unwrap_or_else(|| DMatrix::from_element(size, size, C::from(f64::NAN)));
        FoundationStiffness { housing: flexibility * &stiffness, stiffness }
    }
}

#[cfg(test)]
mod tests {
    use super::super::support::{Pedestal, SupportLaw};
    use super::*;

    fn mode(frequency_hz: f64, modal_mass_kg: f64, x: [f64; 2], y: [f64; 2]) -> FoundationMode {
        FoundationMode { frequency_hz, damping_ratio: 0.02, modal_mass_kg, x: x.to_vec(), y: y.to_vec() }
    }

    fn bearings(speed_rad_s: f64) -> [Matrix2<C>; 2] {
        [1.0, 1.7].map(|by| {
            SupportLaw::linear(Matrix2::new(2e8, 1e7, -2e7, 3e8) * by, Matrix2::new(1e5, 2e3, 1e3, 2e5))
                .dynamic_stiffness(speed_rad_s, [0.0; 2])
        })
    }

    #[test]
    fn foot_with_own_modes_equals_pedestal() {
        let (mass, speed) = (200.0, 900.0);
        let at = |i: usize, axis: usize| f64::from(u8::from(i == axis));
        let modes: Vec<FoundationMode> = (0..4)
            .map(|k| {
                let (foot, axis) = (k / 2, k % 2);
                let only = |axis_of: usize| [0, 1].map(|f| if f == foot { at(axis_of, axis) } else { 0.0 });
                mode(100.0, mass, only(0), only(1))
            })
            .collect();
        let natural = modes[0].natural_rad_s();
        let footing = Footing { bearings: vec![0, 1], compliance: Compliance::Modes(modes) };
        let held = footing.held(speed, &bearings(speed));
        for (i, by) in [1.0, 1.7].into_iter().enumerate() {
            let pedestal = Pedestal::isotropic(mass * natural * natural, 2.0 * 0.02 * natural * mass, mass);
            let law = SupportLaw {
                pedestal: Some(pedestal),
                ..SupportLaw::linear(Matrix2::new(2e8, 1e7, -2e7, 3e8) * by, Matrix2::new(1e5, 2e3, 1e3, 2e5))
            };
            let (series, housing) = (law.dynamic_stiffness(speed, [0.0; 2]), law.housing(speed, [0.0; 2]));
            let block = |m: &DMatrix<C>| m.fixed_view::<2, 2>(2 * i, 2 * i).into_owned();
            assert!((block(&held.stiffness) - series).norm() < 1e-9 * series.norm());
            assert!((block(&held.housing) - housing).norm() < 1e-9 * housing.norm());
        }
        assert!(held.stiffness.fixed_view::<2, 2>(0, 2).norm() < 1e-9 * held.stiffness.norm());
    }

    #[test]
    fn foundation_mode_force_balance_equals_newtons_law() {
        // one mode: m (ω² − Ω² + 2iζωΩ) q = φᵀ f, f = Z (x − φ q)
        let (speed, shape) = (700.0, mode(95.0, 800.0, [0.3, -0.2], [1.0, 0.7]));
        let footing = Footing { bearings: vec![0, 1], compliance: Compliance::Modes(vec![shape.clone()]) };
        let held = footing.held(speed, &bearings(speed));
        let motion = nalgebra::DVector::from_fn(4, |i, _| C::new(1e-5 * i as f64, -2e-5));
        let (force, feet) = (&held.stiffness * &motion, &held.housing * &motion);
        let phi = [0.3, 1.0, -0.2, 0.7];
        let q = feet[1] / phi[1];
        assert!((0..4).all(|i| (feet[i] - q * phi[i]).norm() < 1e-12 * feet.norm()), "one shape");
        let natural = shape.natural_rad_s();
        let taken = C::new(natural * natural - speed * speed, 0.04 * natural * speed) * 800.0 * q;
        let pushed: C = (0..4).map(|i| force[i] * phi[i]).sum();
        assert!((pushed - taken).norm() < 1e-9 * taken.norm());
        for (i, block) in bearings(speed).iter().enumerate() {
            let squeezed = motion.fixed_rows::<2>(2 * i) - feet.fixed_rows::<2>(2 * i);
            assert!((block * squeezed - force.fixed_rows::<2>(2 * i)).norm() < 1e-9 * force.norm());
        }
    }

    #[test]
    fn a_table_of_what_modes_give_holds_the_shaft_as_they_do() {
        let names = ["A".to_string(), "B".to_string()];
        let by_modes = Footing {
            bearings: vec![0, 1],
            compliance: Compliance::Modes(vec![
                mode(95.0, 800.0, [0.3, -0.2], [1.0, 0.7]),
                mode(140.0, 500.0, [1.0, 0.4], [0.1, 0.2]),
            ]),
        };
        let place = |i: usize| format!("{}.{}", names[i / 2], ["x", "y"][i % 2]);
        let rows = |hz: f64| {
            let all = by_modes.flexibility(TAU * hz);
            let row = move |(i, j): (usize, usize)| FlexibilityRow {
                frequency_hz: hz,
                response: place(i),
                force: place(j),
                real_m_n: all[(i, j)].re,
                imaginary_m_n: all[(i, j)].im,
            };
            // one way is enough
            (0..4).flat_map(|i| (0..=i).map(move |j| (i, j))).map(row).collect::<Vec<_>>()
        };
        let table = [rows(80.0), rows(100.0)].concat();
        let measured = Foundation { bearings: names.to_vec(), table, ..Foundation::default() };
        let by_table = Footing { bearings: vec![0, 1], compliance: measured.compliance().unwrap() };
        for hz in [80.0, 100.0] {
            let speed = TAU * hz;
            let [a, b] = [&by_modes, &by_table].map(|f| f.held(speed, &bearings(speed)));
            assert!((&a.stiffness - &b.stiffness).norm() < 1e-9 * a.stiffness.norm());
            assert!((&a.housing - &b.housing).norm() < 1e-9 * a.housing.norm());
        }
    }
}
