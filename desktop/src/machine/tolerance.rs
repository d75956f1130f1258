//! Drawings are never exact: moduli, diameters, masses, inertias and positions differ from what is
//! stated, by standard deviations that `[tolerance]` gives, or by what is usual where it is absent.
//!
//! One material makes the whole shaft, so its modulus is one number; every turned diameter, disk and
//! position is off by itself, and so are the two inertias of a disk, which are computed from different
//! dimensions.

use nalgebra::DVector;

use crate::machine::drawing::{Rotor, Tolerance};
use crate::units::same_place;

/// One thing that may differ from the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Deviation {
    Modulus,
    Diameter(usize),
    DiskMass(usize),
    DiskDiametralInertia(usize),
    DiskPolarInertia(usize),
    BearingPosition(usize),
    DiskPosition(usize),
    ProbePosition(usize),
    PlanePosition(usize),
}

impl Deviation {
    /// Everything that may differ on a rotor, whatever its tolerances.
    pub fn all(rotor: &Rotor) -> Vec<Self> {
        let mut all = vec![Self::Modulus];
        all.extend((0..rotor.shaft.len()).map(Self::Diameter));
        for i in 0..rotor.disk.len() {
            all.extend([
                Self::DiskMass(i),
                Self::DiskDiametralInertia(i),
                Self::DiskPolarInertia(i),
                Self::DiskPosition(i),
            ]);
        }
        all.extend((0..rotor.bearing.len()).map(Self::BearingPosition));
        all.extend((0..rotor.probe.len()).map(Self::ProbePosition));
        all.extend((0..rotor.plane.len()).map(Self::PlanePosition));
        all
    }

    /// As much of a deviation as leaves what stands on the shaft between its ends.
    fn on_the_shaft(self, rotor: &Rotor, by: f64) -> f64 {
        let position_m = match self {
            Self::DiskPosition(i) => rotor.disk[i].position_m,
            Self::BearingPosition(i) => rotor.bearing[i].position_m,
            Self::ProbePosition(i) => rotor.probe[i].position_m,
            Self::PlanePosition(i) => rotor.plane[i].position_m,
            _ => return by,
        };
        (position_m + by).clamp(0.0, rotor.length_m()) - position_m
    }

    /// As `[tolerance.found]` calls it.
    pub fn name(self, rotor: &Rotor) -> String {
        match self {
            Self::Modulus => "shaft youngs_modulus".into(),
            Self::Diameter(i) => format!("shaft {} outer_diameter", i + 1),
            Self::DiskMass(i) => format!("disk {} mass", rotor.disk[i].name),
            Self::DiskDiametralInertia(i) => format!("disk {} diametral_inertia", rotor.disk[i].name),
            Self::DiskPolarInertia(i) => format!("disk {} polar_inertia", rotor.disk[i].name),
            Self::DiskPosition(i) => format!("disk {} position_m", rotor.disk[i].name),
            Self::BearingPosition(i) => format!("bearing {} position_m", rotor.bearing[i].name),
            Self::ProbePosition(i) => format!("probe {} position_m", rotor.probe[i].name),
            Self::PlanePosition(i) => format!("plane {} position_m", rotor.plane[i].name),
        }
    }

    /// Unit of how far it is off; empty of a share of the drawn value.
    pub fn unit(self) -> &'static str {
        match self {
            Self::DiskPosition(_)
            | Self::BearingPosition(_)
            | Self::ProbePosition(_)
            | Self::PlanePosition(_) => "m",
            Self::Modulus
            | Self::Diameter(_)
            | Self::DiskMass(_)
            | Self::DiskDiametralInertia(_)
            | Self::DiskPolarInertia(_) => "",
        }
    }

    /// Its standard deviation, relative or in m.
    fn sd(self, tolerance: &Tolerance) -> f64 {
        match self {
            Self::Modulus => tolerance.modulus_relative,
            Self::Diameter(_) => tolerance.diameter_relative,
            Self::DiskMass(_) => tolerance.mass_relative,
            Self::DiskDiametralInertia(_) | Self::DiskPolarInertia(_) => tolerance.inertia_relative,
            Self::DiskPosition(_)
            | Self::BearingPosition(_)
            | Self::ProbePosition(_)
            | Self::PlanePosition(_) => tolerance.position_m,
        }
    }

    /// Changes the numbers of a rotor: sizes by a factor, positions by an offset, m. Trial weights that sit in a plane
    /// move with it.
    pub fn change(self, rotor: &mut Rotor, factor: f64, offset_m: f64) {
        match self {
            Self::Modulus => rotor.shaft.iter_mut().for_each(|s| s.youngs_modulus_pa *= factor),
            Self::Diameter(i) => rotor.shaft[i].outer_diameter_m *= factor,
            Self::DiskMass(i) => rotor.disk[i].mass_kg *= factor,
            Self::DiskDiametralInertia(i) => rotor.disk[i].diametral_inertia_kg_m2 *= factor,
            Self::DiskPolarInertia(i) => rotor.disk[i].polar_inertia_kg_m2 *= factor,
            Self::DiskPosition(i) => rotor.disk[i].position_m += offset_m,
            Self::BearingPosition(i) => rotor.bearing[i].position_m += offset_m,
            Self::ProbePosition(i) => rotor.probe[i].position_m += offset_m,
            Self::PlanePosition(i) => {
                let z = rotor.plane[i].position_m;
                let weights = rotor.run.iter_mut().flat_map(|run| &mut run.added_unbalance);
                weights.filter(|a| same_place(a.position_m, z)).for_each(|a| a.position_m += offset_m);
                rotor.plane[i].position_m += offset_m;
            }
        }
    }
}

/// Everything that may differ, with its standard deviation.
#[derive(Debug, Clone)]
pub struct Deviations {
    pub(crate) kinds: Vec<(Deviation, f64)>,
}

/// Positions that differ from the drawing, m; empty for as drawn.
#[derive(Debug, Clone, Default)]
pub struct Offsets {
    pub bearing_m: Vec<f64>,
    pub disk_m: Vec<f64>,
    pub probe_m: Vec<f64>,
    pub plane_m: Vec<f64>,
}

impl Tolerance {
    /// Of a machine that is exactly as drawn.
    pub fn exact() -> Self {
        Self { exact: true, ..Self::default() }
    }

    /// What is usual of a drawing that states no tolerance: handbook values of moduli and computed masses scatter by a percent
    /// or so, turned diameters by much less, inertias computed from several of them by more, and positions by a millimetre, or by
    /// [`USUAL_POSITION`] of the length of a small machine.
    fn usual(rotor: &Rotor) -> Self {
        Self {
            modulus_relative: 0.01,
            diameter_relative: 0.002,
            mass_relative: 0.015,
            inertia_relative: 0.03,
            position_m: (USUAL_POSITION * rotor.length_m()).min(1e-3),
            ..Self::default()
        }
    }

    /// The tolerance that a rotor's drawing has: as its file states it, or the usual one.
    pub fn holding(rotor: &Rotor) -> Self {
        rotor.tolerance.clone().unwrap_or_else(|| Self::usual(rotor))
    }

    /// A sentence on the tolerance that is taken, where the rotor's file states none.
    pub fn assumption(rotor: &Rotor) -> Option<String> {
        let usual = Self::usual(rotor);
        let percent = |relative: f64| 100.0 * relative;
        rotor.tolerance.is_none().then(|| {
            format!(
                "The rotor's file has no [tolerance]; usual errors of a drawing were assumed (modulus {} %, diameters {} %, masses \
                 {} %, inertias {} %, positions {:.1} mm). Of a machine exactly as drawn, state `exact = true` there.",
                percent(usual.modulus_relative),
                percent(usual.diameter_relative),
                percent(usual.mass_relative),
                percent(usual.inertia_relative),
                1e3 * usual.position_m,
            )
        })
    }
}

/// Largest usual error of a position over the length of the shaft.
const USUAL_POSITION: f64 = 0.003;

impl Deviations {
    /// Those that are usual, whatever the file states.
    pub fn usual(rotor: &Rotor) -> Self {
        Self::of(&Rotor { tolerance: None, ..rotor.clone() })
    }

    /// The deviations of a rotor; none where the tolerance is zero.
    pub fn of(rotor: &Rotor) -> Self {
        let tolerance = Tolerance::holding(rotor);
        let kinds = Deviation::all(rotor).into_iter().map(|kind| (kind, kind.sd(&tolerance)));
        Self { kinds: kinds.filter(|(_, sd)| *sd > 0.0).collect() }
    }

    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether the drawing is taken as exact.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The one farthest out in units of its standard deviation: in words, and where it is, m from the left end.
    pub fn worst(&self, rotor: &Rotor, t: &DVector<f64>) -> (String, f64) {
        let ((kind, sd), t) = (self.kinds.iter().zip(t.iter()))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .expect("a drawing that is off is off in something");
        let by = sd * t;
        let percent = |what: String| format!("{what} differs from the drawing by {:+.1} %", 100.0 * by);
        let moved =
            |what: &str, name: &str| format!("{what} {name} sits {:+.1} mm from where it is drawn", 1e3 * by);
        let disk = |i: usize| (&rotor.disk[i].name, rotor.disk[i].position_m);
        match *kind {
            Deviation::Modulus => (percent("Young's modulus".into()), 0.5 * rotor.length_m()),
            Deviation::Diameter(i) => {
                let start: f64 = rotor.shaft[..i].iter().map(|s| s.length_m).sum();
                let end = start + rotor.shaft[i].length_m;
                (percent(format!("the diameter from {start:.3} to {end:.3} m")), 0.5 * (start + end))
            }
            Deviation::DiskMass(i) => (percent(format!("the mass of {}", disk(i).0)), disk(i).1),
            Deviation::DiskDiametralInertia(i) => {
                (percent(format!("the diametral inertia of {}", disk(i).0)), disk(i).1)
            }
            Deviation::DiskPolarInertia(i) => {
                (percent(format!("the polar inertia of {}", disk(i).0)), disk(i).1)
            }
            Deviation::DiskPosition(i) => (moved("disk", disk(i).0), disk(i).1),
            Deviation::BearingPosition(i) => {
                (moved("bearing", &rotor.bearing[i].name), rotor.bearing[i].position_m)
            }
            Deviation::ProbePosition(i) => (moved("probe", &rotor.probe[i].name), rotor.probe[i].position_m),
            Deviation::PlanePosition(i) => (moved("plane", &rotor.plane[i].name), rotor.plane[i].position_m),
        }
    }

    /// The rotor with its deviations at `t` standard deviations, and the positions that moved.
    pub fn apply(&self, rotor: &Rotor, t: &DVector<f64>) -> (Rotor, Offsets) {
        let mut changed = rotor.clone();
        let mut offsets = Offsets {
            bearing_m: vec![0.0; rotor.bearing.len()],
            disk_m: vec![0.0; rotor.disk.len()],
            probe_m: vec![0.0; rotor.probe.len()],
            plane_m: vec![0.0; rotor.plane.len()],
        };
        for ((kind, sd), t) in self.kinds.iter().zip(t.iter()) {
            let by = sd * t;
            match *kind {
                Deviation::BearingPosition(i) => offsets.bearing_m[i] = by,
                Deviation::DiskPosition(i) => offsets.disk_m[i] = by,
                Deviation::ProbePosition(i) => offsets.probe_m[i] = by,
                Deviation::PlanePosition(i) => offsets.plane_m[i] = by,
                relative => relative.change(&mut changed, 1.0 + by, by),
            }
        }
        (changed, offsets)
    }

    /// The rotor's file with its deviations at `t` standard deviations in its numbers, and written down as found.
    pub fn build_into(&self, rotor: &mut Rotor, t: &DVector<f64>) {
        let mut tolerance = Tolerance::holding(rotor);
        for ((kind, sd), t) in self.kinds.iter().zip(t.iter()) {
            let by = kind.on_the_shaft(rotor, sd * t);
            kind.change(rotor, 1.0 + by, by);
            tolerance.found.insert(kind.name(rotor), by);
        }
        rotor.tolerance = Some(tolerance);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::uniform_shaft;

    #[test]
    fn drawing_without_tolerance_has_usual_errors() {
        let rotor = Rotor { tolerance: None, ..uniform_shaft() };
        let stated = Rotor { tolerance: Some(Tolerance::holding(&rotor)), ..rotor.clone() };
        let (usual, stated) = (Deviations::of(&rotor), Deviations::of(&stated));
        assert_eq!(usual.kinds, stated.kinds);
        assert!(usual.kinds.contains(&(Deviation::Diameter(0), 0.002)));
        assert!(usual.kinds.contains(&(Deviation::ProbePosition(0), 1e-3)));
    }

    #[test]
    fn positions_of_small_machine_are_off_by_less() {
        let mut rotor = Rotor { tolerance: None, ..uniform_shaft() };
        rotor.shaft[0].length_m = 0.1;
        assert!((Tolerance::holding(&rotor).position_m - 3e-4).abs() < 1e-12);
    }

    #[test]
    fn what_stands_at_the_end_of_the_shaft_stays_on_it() {
        let mut drawn = Rotor { tolerance: None, ..uniform_shaft() };
        drawn.bearing[0].position_m = 0.0;
        let deviations = Deviations::of(&drawn);
        let mut built = drawn.clone();
        deviations.build_into(&mut built, &DVector::from_element(deviations.len(), -1.0));
        assert_eq!(built.bearing[0].position_m, 0.0);
        assert!(built.probe[0].position_m < drawn.probe[0].position_m);
        assert!((built.as_stated().bearing[0].position_m - drawn.bearing[0].position_m).abs() < 1e-15);
    }

    #[test]
    fn exact_drawing_has_no_errors() {
        let rotor = Rotor { tolerance: Some(Tolerance::exact()), ..uniform_shaft() };
        assert!(Deviations::of(&rotor).is_empty());
        assert_eq!(Tolerance::assumption(&rotor), None);
        assert!(!Deviations::usual(&rotor).is_empty());
    }
}
