//! What each error of the drawing changes: elements, inertias, the places of what sits on the shaft.

use nalgebra::{DVector, Matrix4, Vector4};

use crate::machine::drawing::Rotor;
use crate::machine::place::Pattern;
use crate::machine::tolerance::{Deviation, Deviations};
use crate::receptance::modal_shaft::Force;
use crate::reduction::nodal::{NodalSum, Section, Shaft};
use crate::shaft::mesh::Piece;

/// Step in standard deviations for the change of an element: its matrices are smooth in its diameter.
const ELEMENT_STEP: f64 = 0.05;

/// Change of one finite element.
pub(super) struct ElementChange {
    pub(super) number: usize,
    pub(super) stiffness: Matrix4<f64>,
    pub(super) mass: Matrix4<f64>,
    pub(super) polar_inertia: Matrix4<f64>,
    /// Change of the force of each pattern that is a bent shaft, of unit height.
    pub(super) bends: Vec<(Pattern, Vector4<f64>)>,
}

/// What one error of the drawing changes, per standard deviation.
pub(super) enum DrawingChange {
    Elements(Vec<ElementChange>),
    /// Mass, diametral and polar inertia at a place.
    Inertia {
        displacement: NodalSum,
        tilt: NodalSum,
        inertia: [f64; 3],
    },
    /// A disk moves with all that acts at it.
    Disk {
        number: usize,
        displacement: [NodalSum; 2],
        tilt: [NodalSum; 2],
        inertia: [f64; 3],
    },
    Bearing {
        number: usize,
        rate: NodalSum,
    },
    Probe {
        number: usize,
        rate: NodalSum,
    },
    /// Unbalance and trial weights of a plane move.
    Plane {
        force: Force,
        rate: NodalSum,
    },
}

/// The errors of a drawing around a state of it.
pub struct DrawingErrors {
    pub(super) changes: Vec<DrawingChange>,
}

impl DrawingErrors {
    /// Around the deviations `centre`.
    pub fn new(rotor: &Rotor, shaft: &Shaft, deviations: &Deviations, centre: &DVector<f64>) -> Self {
        // the runs of a long measurement take longer to copy than all that an error changes
        let mut bare = rotor.clone();
        bare.run.clear();
        let rotor = &bare;
        let (changed, offsets) = deviations.apply(rotor, centre);
        let scaled = |row: &NodalSum, by: f64| row.iter().map(|(k, v)| (*k, v * by)).collect::<NodalSum>();
        let rate = |section: &Section, sd: f64| scaled(&section.displacement_rate, sd);
        let at_disk = |i: usize| {
            let section = shaft.section(rotor.disk[i].position_m);
            (section, section.displacement_beside(offsets.disk_m[i]), section.tilt_beside(offsets.disk_m[i]))
        };
        let inertia_of = |i: usize| {
            let polar = if shaft.physics().gyroscopic { changed.disk[i].polar_inertia_kg_m2 } else { 0.0 };
            [changed.disk[i].mass_kg, changed.disk[i].diametral_inertia_kg_m2 * shaft.tilt_share(), polar]
        };
        let at_rest = |i: usize| {
            let d = &rotor.disk[i];
            let polar = if shaft.physics().gyroscopic { d.polar_inertia_kg_m2 } else { 0.0 };
            [d.mass_kg, d.diametral_inertia_kg_m2 * shaft.tilt_share(), polar]
        };
        let only = |i: usize, which: usize, sd: f64| {
            let (_, displacement, tilt) = at_disk(i);
            let mut inertia = [0.0; 3];
            inertia[which] = at_rest(i)[which] * sd;
            DrawingChange::Inertia { displacement, tilt, inertia }
        };
        let change = |(number, (kind, sd)): (usize, &(Deviation, f64))| match *kind {
            Deviation::Modulus | Deviation::Diameter(_) => {
                DrawingChange::Elements(element_changes(rotor, shaft, deviations, centre, number))
            }
            Deviation::DiskMass(i) => only(i, 0, *sd),
            Deviation::DiskDiametralInertia(i) => only(i, 1, *sd),
            Deviation::DiskPolarInertia(i) => only(i, 2, *sd),
            Deviation::DiskPosition(number) => {
                let (section, displacement, tilt) = at_disk(number);
                DrawingChange::Disk {
                    number,
                    displacement: [displacement, rate(section, *sd)],
                    tilt: [tilt, scaled(&section.tilt_rate, *sd)],
                    inertia: inertia_of(number),
                }
            }
            Deviation::BearingPosition(i) => DrawingChange::Bearing {
                number: i,
                rate: rate(shaft.section(rotor.bearing[i].position_m), *sd),
            },
            Deviation::ProbePosition(i) => {
                DrawingChange::Probe { number: i, rate: rate(shaft.section(rotor.probe[i].position_m), *sd) }
            }
            Deviation::PlanePosition(i) => {
                let z = rotor.plane[i].position_m;
                DrawingChange::Plane { force: Force::UnbalanceAt(z), rate: rate(shaft.section(z), *sd) }
            }
        };
        Self { changes: deviations.kinds.iter().enumerate().map(change).collect() }
    }
}

fn element_changes(
    rotor: &Rotor,
    shaft: &Shaft,
    deviations: &Deviations,
    centre: &DVector<f64>,
    number: usize,
) -> Vec<ElementChange> {
    let side = |by: f64| {
        let mut t = centre.clone();
        t[number] += by;
        deviations.apply(rotor, &t).0
    };
    let (up, down) = (side(ELEMENT_STEP), side(-ELEMENT_STEP));
    let changed = |(_, piece): &(usize, &Piece)| match piece {
        Piece::Segment(segment) => up.shaft[*segment] != down.shaft[*segment],
        Piece::Coupling(_) => false,
    };
    shaft
        .pieces()
        .iter()
        .enumerate()
        .filter(changed)
        .map(|(number, _)| {
            let (a, b) = (shaft.element(number, &up), shaft.element(number, &down));
            let slope = |a: Matrix4<f64>, b: Matrix4<f64>| (a - b) / (2.0 * ELEMENT_STEP);
            let stiffness = slope(a.stiffness, b.stiffness);
            let force = |shape: &DVector<f64>| stiffness * shape.fixed_rows::<4>(2 * number);
            ElementChange {
                number,
                stiffness,
                mass: slope(a.mass, b.mass),
                polar_inertia: slope(a.polar_inertia, b.polar_inertia),
                bends: shaft.bends().iter().map(|(pattern, shape)| (*pattern, force(shape))).collect(),
            }
        })
        .collect()
}
