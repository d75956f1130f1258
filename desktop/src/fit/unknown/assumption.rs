//! What can be assumed of an unknown cause, and what the probes show of it.

use nalgebra::{Complex, DMatrix};

use super::functions::Functions;
use crate::error::Error;
use crate::fit::drawing_errors::DrawingErrors;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::problem::Problem;
use crate::fit::{Drawing, Fit, Fitter, ShaftKind, singular};
use crate::machine::place::SpeedLaw;
use crate::reduction::nodal::NodalSum;

type C = Complex<f64>;

/// What is assumed of an unknown cause.
#[derive(Debug, Clone, PartialEq)]
pub enum Assumption {
    /// A force on the shaft at one place.
    Force {
        /// Where it acts, m from the left end.
        position_m: f64,
        /// How its size would grow with speed if it were simple.
        law: SpeedLaw,
    },
    /// A dynamic stiffness at each of these places, m from the left end.
    Stiffness(Vec<f64>),
    /// Errors of the drawing beyond its tolerance, or beyond the usual one where none is stated.
    Drawing,
}

/// What the probes would show of an assumption, per unit of its unknowns.
pub struct AssumptionResponse {
    /// Response at every value, in noise units: rows real and imaginary parts of the values, columns real unknowns.
    pub response: DMatrix<f64>,
    /// Force on the shaft for each reading: its speed, and terms by complex unknown.
    pub forces: Vec<(f64, Vec<Term>)>,
}

/// One value of the data and one place of the shaft.
#[derive(Debug, Clone, Copy)]
struct UnderForce {
    /// What the value shows, in noise units, of a force of one newton there that turns forward, and of one backward.
    shown: [C; 2],
    /// Motion of the shaft there, m: forward, backward.
    motion: [C; 2],
}

/// The force that a complex unknown is.
#[derive(Debug, Clone, Copy)]
pub struct Term {
    pub place: usize,
    /// 0 forward, 1 backward.
    pub sense: usize,
    /// N per unit.
    pub factor: C,
}

impl Assumption {
    /// Where it acts on the shaft, m from the left end.
    pub fn positions_m(&self) -> &[f64] {
        match self {
            Self::Force { position_m, .. } => std::slice::from_ref(position_m),
            Self::Stiffness(positions_m) => positions_m,
            Self::Drawing => &[],
        }
    }

    /// The force of each complex unknown in one reading, functions of speed within places: forward and backward, of a stiffness per
    /// forward and backward motion of the shaft there.
    fn terms(&self, shares: &[f64], growth: f64, at: &[UnderForce]) -> Vec<Term> {
        let of = |place: usize, share: f64| {
            let senses = (0..2).flat_map(move |sense| match self {
                Self::Force { .. } => vec![Term { place, sense, factor: C::from(share * growth) }],
                _ => at[place].motion.map(|q| Term { place, sense, factor: q * share }).to_vec(),
            });
            senses.collect::<Vec<_>>()
        };
        (0..at.len()).flat_map(|place| shares.iter().flat_map(move |share| of(place, *share))).collect()
    }
}

impl Problem<'_> {
    /// Of every evaluated value, at each of some places.
    fn under_unit_forces(&self, places: &[&NodalSum]) -> Option<Vec<Vec<UnderForce>>> {
        let now = self.evaluated()?;
        let mut seen = Vec::with_capacity(self.count());
        for (row, snapshot) in self.rows.iter().zip(self.snapshots(now)) {
            seen.extend(row.values.iter().map(|v| {
                let gain = now.terms.gains[v.probe] / v.sigma_m;
                let at = |place: &&NodalSum| UnderForce {
                    shown: snapshot.under_force(place, now.terms.shows[v.probe]).map(|y| y * gain),
                    motion: snapshot.motion(place),
                };
                places.iter().map(at).collect()
            }));
        }
        Some(seen)
    }
}

impl Fitter<'_> {
    /// Every assumption that is made: at each bearing, disk and end of the shaft a force, constant or growing with the
    /// square of speed; a dynamic stiffness at all bearings, as they change with speed together, or at one disk; a drawing that
    /// is off.
    pub fn unknown_causes(&self) -> Vec<Assumption> {
        let rotor = self.rotor;
        let bearings: Vec<f64> = rotor.bearing.iter().map(|b| b.position_m).collect();
        let disks = rotor.disk.iter().map(|d| d.position_m);
        let mut places: Vec<f64> = bearings.iter().copied().chain(disks.clone()).collect();
        places.extend([0.0, rotor.length_m()]);
        places.sort_by(f64::total_cmp);
        places.dedup_by(|a, b| (*a - *b).abs() < 1e-3 * rotor.length_m());
        let with = |law| places.iter().map(move |z| Assumption::Force { position_m: *z, law });
        let mut all: Vec<Assumption> = with(SpeedLaw::Constant).chain(with(SpeedLaw::Squared)).collect();
        all.push(Assumption::Stiffness(bearings));
        all.extend(disks.map(|z| Assumption::Stiffness(vec![z])));
        all.push(Assumption::Drawing);
        all
    }

    /// What the probes would show of each assumption beside a fit.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn shown(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumptions: &[Assumption],
    ) -> Result<Vec<AssumptionResponse>, Error> {
        let shaft = self.shaft(&ShaftKind::of(&hypothesis.terms(&fit.x)));
        let problem = self.at(hypothesis, fit, drawing)?;
        let mut places: Vec<f64> = assumptions.iter().flat_map(|a| a.positions_m()).copied().collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let rows: Vec<&NodalSum> = places.iter().map(|z| &shaft.section(*z).displacement).collect();
        let seen = problem.under_unit_forces(&rows).ok_or_else(singular)?;
        let number = |z: &f64| places.iter().position(|other| other == z);
        let shown = |a: &Assumption| {
            if *a == Assumption::Drawing {
                let deviations = self.suspected_deviations();
                let centre = drawing.deviation.clone().resize_vertically(deviations.len(), 0.0);
                let errors = DrawingErrors::new(self.rotor, shaft, &deviations, &centre);
                let response = problem.error_derivative(&errors).ok_or_else(singular)?;
                return Ok(AssumptionResponse { response, forces: Vec::new() });
            }
            let numbers: Vec<usize> = a.positions_m().iter().filter_map(number).collect();
            let AssumptionResponse { response, forces } = self.shown_of_forces(a, &numbers, &seen);
            Ok(AssumptionResponse { response: problem.observed(response), forces })
        };
        assumptions.iter().map(shown).collect()
    }

    fn shown_of_forces(
        &self,
        a: &Assumption,
        places: &[usize],
        seen: &[Vec<UnderForce>],
    ) -> AssumptionResponse {
        let speeds = self.data.rows.iter().map(|r| r.speed_rad_s);
        // the motion that a stiffness is multiplied by has the resonances in it
        let functions = match a {
            Assumption::Force { .. } => Functions::knots(speeds),
            _ => Functions::smooth(speeds),
        };
        let mut forces = Vec::with_capacity(self.rows().len());
        let mut response = DMatrix::zeros(2 * seen.len(), 0);
        let mut i = 0;
        for row in self.rows().iter().filter(|row| !row.values.is_empty()) {
            let at = |value: usize| places.iter().map(|p| seen[value][*p]).collect::<Vec<UnderForce>>();
            let growth = match a {
                Assumption::Force { law, .. } => {
                    law.factor(row.speed_rad_s) / law.factor(self.data.fastest_rad_s())
                }
                _ => 1.0,
            };
            let terms = a.terms(&functions.at(row.speed_rad_s), growth, &at(i));
            if response.ncols() == 0 {
                response = response.resize_horizontally(2 * terms.len(), 0.0);
            }
            for value in i..i + row.values.len() {
                for (j, t) in terms.iter().enumerate().filter(|(_, t)| t.factor != C::from(0.0)) {
                    let y = seen[value][places[t.place]].shown[t.sense] * t.factor;
                    (response[(2 * value, 2 * j)], response[(2 * value + 1, 2 * j)]) = (y.re, y.im);
                    (response[(2 * value, 2 * j + 1)], response[(2 * value + 1, 2 * j + 1)]) = (-y.im, y.re);
                }
            }
            i += row.values.len();
            forces.push((row.speed_rad_s, terms));
        }
        AssumptionResponse { response, forces }
    }
}
