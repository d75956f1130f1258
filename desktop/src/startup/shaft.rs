//! What the drawing says of the two-degree model: the shaft as a spring under the disk, and the mass.

use nalgebra::{DMatrix, DVector};

use crate::error::{Error, StartupError};
use crate::machine::drawing::{Disk, Rotor};
use crate::shaft::structure::Structure;
use crate::units::same_place;

/// Pieces of a segment: a beam element is exact in bending, the mass needs a few.
const PIECES: usize = 4;

/// A shaft on rigid bearings, felt at its disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftSpring {
    /// Force per displacement of the disk, N/m: `48 EI / L³` for a uniform shaft with the disk in the
    /// middle, `3 EI L / a²b²` elsewhere between the bearings.
    pub stiffness_n_m: f64,
    /// The disk's mass with the shaft's own share (Rayleigh, in the shape that the disk's weight bends
    /// it to), kg.
    pub effective_mass_kg: f64,
    /// Disk and shaft, kg.
    pub rotor_mass_kg: f64,
}

impl ShaftSpring {
    /// Beam theory by the elements that everything else here is made of, bearings as pins.
    ///
    /// # Errors
    /// If the disk sits on a bearing, where the shaft does not bend.
    pub fn of(rotor: &Rotor, disk: &Disk) -> Result<Self, Error> {
        let structure = Structure::finite_elements(rotor, &rotor.physics, PIECES);
        let at = |position_m: f64| structure.station(position_m).displacement.clone();
        let n = structure.size();
        // pins as Lagrange multipliers
        let mut pinned = DMatrix::zeros(n + 2, n + 2);
        pinned.view_mut((0, 0), (n, n)).copy_from(&structure.stiffness);
        for (k, bearing) in rotor.bearing.iter().enumerate() {
            let row = at(bearing.position_m);
            pinned.view_mut((n + k, 0), (1, n)).copy_from(&row.transpose());
            pinned.view_mut((0, n + k), (n, 1)).copy_from(&row);
        }
        if rotor.bearing.iter().any(|b| same_place(b.position_m, disk.position_m)) {
            return Err(StartupError::DiskOnBearing { disk: disk.name.clone() }.into());
        }
        let load = at(disk.position_m).resize_vertically(n + 2, 0.0);
        let bent: Option<DVector<f64>> = pinned.lu().solve(&load).map(|x| x.rows(0, n).into_owned());
        let bent = bent.ok_or_else(|| Error::Unsuitable("the shaft on its bearings is singular".into()))?;
        let flexibility = at(disk.position_m).dot(&bent);
        let shape = bent / flexibility;
        let rigid = structure.stations.iter().fold(DVector::zeros(n), |sum, s| sum + &s.displacement);
        Ok(Self {
            stiffness_n_m: flexibility.recip(),
            effective_mass_kg: shape.dot(&(&structure.mass * &shape)),
            rotor_mass_kg: rigid.dot(&(&structure.mass * &rigid)),
        })
    }

    /// What is in series with the shaft when both together have this stiffness, N/m; `None` if the shaft
    /// alone is softer than that.
    pub fn in_series_with_n_m(&self, together_n_m: f64) -> Option<f64> {
        (together_n_m < self.stiffness_n_m)
            .then(|| together_n_m * self.stiffness_n_m / (self.stiffness_n_m - together_n_m))
    }
}
