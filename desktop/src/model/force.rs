//! Generalised forces of the rotating patterns, on a shaft in any coordinates.

use nalgebra::{DMatrix, DVector};

use crate::decomposition::svd;
use crate::machine::drawing::Rotor;
use crate::machine::place::{End, Pattern};
use crate::shaft::structure::{Station, Structure};

/// A cross-section of the shaft that a pattern acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadedSection {
    Disk(usize),
    Plane(usize),
    End(End),
}

/// A shaft that forces act on.
pub trait LoadedShaft {
    /// Generalised force in the coordinates of the shaft.
    type Coordinates;

    /// Of a unit force, N, on the displacement of a section.
    fn displacing(&self, section: LoadedSection) -> Self::Coordinates;

    /// Of a unit moment, N·m, on the tilt of a section.
    fn tilting(&self, section: LoadedSection) -> Self::Coordinates;

    /// Of the force that holds the shaft straight against a pattern of half sines of unit height, m.
    fn straightening(&self, pattern: Pattern) -> Self::Coordinates;
}

/// Generalised force of a rotating pattern of unit amplitude (at unit Ω² where it grows with it); `None` for runout, which
/// is no force.
pub fn generalised_force<S: LoadedShaft>(pattern: Pattern, shaft: &S) -> Option<S::Coordinates> {
    match pattern {
        Pattern::DiskUnbalance(i) => Some(shaft.displacing(LoadedSection::Disk(i))),
        Pattern::DiskTilt(i) => Some(shaft.tilting(LoadedSection::Disk(i))),
        Pattern::End(end) => Some(shaft.displacing(LoadedSection::End(end))),
        Pattern::EndTilt(end) => Some(shaft.tilting(LoadedSection::End(end))),
        Pattern::RunUnbalance { plane, .. } => Some(shaft.displacing(LoadedSection::Plane(plane))),
        Pattern::Bow | Pattern::GrowingBow | Pattern::FullBow => Some(shaft.straightening(pattern)),
        Pattern::Runout(_) => None,
    }
}

/// The shaft of a rotor as drawn.
pub(super) struct DrawnShaft<'a> {
    pub structure: &'a Structure,
    pub rotor: &'a Rotor,
}

impl DrawnShaft<'_> {
    fn station(&self, section: LoadedSection) -> &Station {
        let stations = &self.structure.stations;
        match section {
            LoadedSection::Disk(i) => self.structure.station(self.rotor.disk[i].position_m),
            LoadedSection::Plane(i) => self.structure.station(self.rotor.plane[i].position_m),
            LoadedSection::End(End::Left) => &stations[0],
            LoadedSection::End(End::Right) => &stations[stations.len() - 1],
        }
    }
}

impl LoadedShaft for DrawnShaft<'_> {
    type Coordinates = DVector<f64>;

    fn displacing(&self, section: LoadedSection) -> DVector<f64> {
        self.station(section).displacement.clone()
    }

    fn tilting(&self, section: LoadedSection) -> DVector<f64> {
        self.station(section).slope.clone()
    }

    fn straightening(&self, pattern: Pattern) -> DVector<f64> {
        &self.structure.stiffness * half_sines(pattern, self.structure, self.rotor)
    }
}

/// Coordinates of a bow's half sines of unit height, m, between the outermost bearings, continued beyond them.
pub(crate) fn half_sines(pattern: Pattern, structure: &Structure, rotor: &Rotor) -> DVector<f64> {
    let [left, right] = rotor.span_m();
    let wave = f64::from(pattern.half_sines()) * std::f64::consts::PI / (right - left);
    coordinates(structure, |z| [(wave * (z - left)).sin(), wave * (wave * (z - left)).cos()])
}

/// Coordinates of a shape given by its height and slope at every station.
fn coordinates(structure: &Structure, shape: impl Fn(f64) -> [f64; 2]) -> DVector<f64> {
    let stations = &structure.stations;
    if structure.size() == 2 * stations.len() {
        let pairs = stations.iter().flat_map(|s| shape(s.position_m));
        return DVector::from_iterator(structure.size(), pairs);
    }
    // other shape functions come as near as they can, by least squares
    let shapes = DMatrix::from_fn(stations.len(), structure.size(), |i, k| stations[i].displacement[k]);
    let target = DVector::from_iterator(stations.len(), stations.iter().map(|s| shape(s.position_m)[0]));
    let nearest = svd(shapes).and_then(|svd| svd.solve(&target, 1e-9).ok());
    nearest.unwrap_or_else(|| DVector::zeros(structure.size()))
}
