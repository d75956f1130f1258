//! Fitting hypotheses to measurements.
//!
//! | module | holds |
//! |---|---|
//! | [`data`], [`hypothesis`] | what was measured, what is unknown |
//! | [`problem`], `derivative`, `optimum` | the least-squares problem of one hypothesis, and its solution |
//! | `starts` | where a search begins, and which of many starts are followed |
//! | [`projection`] | its linear unknowns, solved for exactly |
//! | `drawing`, [`drawing_errors`], `common_optimum` | the drawing, and allowing for its errors |
//! | `found_before` | where a file that was fitted before begins |
//! | `transient` | runs whose speed changes too fast for a steady response |
//! | `scattered`, [`unknown`] | the noise that a fit leaves; a cause that no effect is |
//! | [`bearings`], [`dimensions`] | bearings and drawing of a fit with their uncertainty |
//! | [`forward`] | what a hypothesis predicts of readings that nobody has made yet |
//! | `queries`, [`trial`] | uncertainty, sensitivity and misfit of a fit that is there, or anywhere else |
//!
//! [`Fitter`] holds what all hypotheses about one machine share.

pub mod bearings;
mod centreline;
mod common_optimum;
pub mod data;
mod derivative;
pub(crate) mod descent;
pub mod dimensions;
mod drawing;
pub mod drawing_errors;
mod error_slopes;
pub mod forward;
mod found_before;
pub mod hypothesis;
mod optimum;
pub mod problem;
pub mod progress;
pub mod projection;
mod queries;
mod row_groups;
mod scattered;
mod starts;
mod supports;
#[cfg(test)]
mod tests;
mod transient;
pub mod trial;
pub mod unknown;
pub mod within;

use std::sync::{Arc, OnceLock};

use nalgebra::{Complex, DMatrix, DVector};

use crate::effects::terms::Terms;
use crate::effects::{Place, Scales, physical};
use crate::error::Error;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{Noise, Rotor};
use crate::machine::span::{self, Span};
use crate::machine::tolerance::Deviations;
use crate::model::amplitude::Relaxation;
use crate::receptance::modal_shaft::ModalShaft;
use crate::reduction::nodal::Shaft;
use crate::statistics::between_runs::RunErrors;
use crate::statistics::evidence::Sizes;
use crate::statistics::scatter::{Predecessors, Scatter};
use crate::statistics::whitening::{DataScatter, Whitening};
use data::Amplitudes;
use data::Data;
use descent::Stop;
pub use drawing::Drawing;
use drawing::{SHAFT_KINDS, ShaftKind};
use found_before::FoundBefore;
use hypothesis::Hypothesis;
pub use optimum::Fit;
use problem::Problem;
use progress::{Progress, ProgressListener};
use projection::LinearSolution;
use starts::scout;
pub use starts::starts_for;
use transient::Transient;

type C = Complex<f64>;

/// Rounds over the amplitude at bearings that harden or soften.
const AMPLITUDE_ROUNDS: usize = 20;
const ROUGH_ROUNDS: usize = 4;
/// Share of the way to the squared amplitudes of a fit, in a round.
const AMPLITUDE_WEIGHT: f64 = 0.7;
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Bearings and effects as the start has them: only what is linear is solved for.
    Linear,
    /// One short run from every start, and the best of their ends: to see from where to go on.
    Glance,
    /// Like `Search`, with the search ended early and the amplitudes at supports that depend on them only roughly settled: to
    /// see which effects are worth a closer look.
    Rough,
    /// Short runs from every start, the best to the end.
    Search,
    /// Like `Search`, with the covariance.
    Final,
}

/// One machine's measurements, ready to fit hypotheses to.
pub struct Fitter<'a> {
    /// The machine as its file states it.
    pub rotor: &'a Rotor,
    pub data: Data,
    transient: Option<Transient>,
    deviations: Deviations,
    /// How large an effect can be.
    pub sizes: Sizes,
    /// The noise as stated, on the drawing as stated.
    plain: Whitening,
    shafts: [OnceLock<Shaft>; SHAFT_KINDS],
    /// A length of the shaft beside those that are sought and stated.
    further: Option<Span>,
    /// The file of the rotor, if an earlier fit wrote it.
    pub(crate) found_before: Option<Arc<FoundBefore>>,
    /// How far a search by this is.
    pub progress: Progress<'a>,
}

impl<'a> Fitter<'a> {
    /// Prepares measurements of a rotor.
    pub fn new(rotor: &'a Rotor, data: Data) -> Self {
        let values = 2 * data.count();
        let used_up = Bearings::of(rotor).count() + 2 * rotor.plane.len();
        let scattered = DataScatter {
            series: Arc::new(Predecessors::new(data.series())),
            runs: RunErrors::none(values),
            scatter: Scatter::STATED,
            free: values.saturating_sub(used_up).max(1) as f64,
            stated_log_sd: Noise::log_sd(rotor),
        };
        let plain = Whitening::new(DMatrix::zeros(values, 0), DVector::zeros(0), scattered);
        let squares = data.values().map(|v| v.measured_m.norm_sqr() / (v.sigma_m * v.sigma_m)).sum();
        let (deviations, sizes) = (Deviations::of(rotor), Sizes::up_to(squares));
        Self {
            rotor,
            transient: Transient::of(&data, rotor.probe.len()),
            data,
            deviations,
            sizes,
            plain,
            shafts: Default::default(),
            further: None,
            found_before: None,
            progress: Progress::default(),
        }
    }

    /// The same machine with these rows of the data alone.
    pub fn part(&self, rows: &[usize]) -> Self {
        self.anew(self.data.part(rows))
    }

    /// The same machine and search on other data.
    pub fn on(&self, data: Data) -> Self {
        Self { progress: self.progress.anew(), ..self.anew(data) }
    }

    /// The same machine on other data, for which nobody waits.
    fn anew(&self, data: Data) -> Self {
        let found_before = self.found_before.clone();
        Self { further: self.further, found_before, ..Self::new(self.rotor, data) }
    }

    /// The same where an effect may sit at this place, be it a length of the shaft that nothing else knows of.
    pub fn knowing(self, place: Place) -> Self {
        match place {
            Place::Span(span) => Self { further: Some(span), ..self },
            _ => self,
        }
    }

    /// The same for a search that somebody waits for.
    pub fn telling(self, told: ProgressListener<'a>) -> Self {
        Self { progress: Progress::telling(told), ..self }
    }

    /// Evidence for the effects that a fit has beyond another of the same data: twice the logarithm of the Bayes factor.
    pub fn evidence(&self, over: &Fit, fit: &Fit) -> f64 {
        self.sizes.evidence(over.cost - fit.cost, fit.effect_unknowns - over.effect_unknowns)
    }

    /// Scales of the machine; `amplitude_m` at the bearings from a fit, where there is one.
    pub fn scales(&self, base: Option<&Fit>) -> Scales {
        let bearings = self.rotor.bearing.len();
        let mean_square = base.map_or(1e-10, |fit| {
            let at_bearings = fit.amplitudes.iter().flat_map(|row| &row[..bearings]);
            let count = at_bearings.clone().count().max(1) * 2;
            let all = at_bearings.flatten();
            (all.sum::<f64>() / count as f64).max(1e-18)
        });
        let drawn = Terms::drawn(self.rotor);
        physical::scales(self.rotor, &drawn, self.data.fastest_rad_s(), mean_square.sqrt())
    }

    /// The drawing as stated, with no allowance for its errors.
    pub fn exact_drawing(&self) -> Drawing {
        Drawing::new(DVector::zeros(self.deviations.len()), self.plain.of_scatter())
    }

    /// How far the stated noise is trusted, standard deviation of the logarithm of its size.
    pub fn stated_log_sd(&self) -> f64 {
        self.plain.stated_log_sd()
    }

    /// Whether the drawing is taken as exact.
    pub fn drawing_is_exact(&self) -> bool {
        self.deviations.is_empty()
    }

    /// Mesh and shape functions of the drawing.
    fn shaft(&self, kind: &ShaftKind) -> &Shaft {
        let new = || {
            let lengths = if kind.has_lengths { self.lengths() } else { Vec::new() };
            Shaft::with_strains(self.rotor, &kind.physics, &lengths)
        };
        self.shafts[kind.number()].get_or_init(new)
    }

    /// Lengths of the shaft that may differ in stiffness: those that are sought, those that the file states, and one that somebody asks
    /// for.
    fn lengths(&self) -> Vec<Span> {
        let mut lengths = span::sought(self.rotor);
        for further in span::stated(self.rotor).map(|(span, _)| span).chain(self.further) {
            if !lengths.contains(&further) {
                lengths.push(further);
            }
        }
        lengths
    }

    /// The shaft of a drawing that is off, solved.
    fn plant(&self, deviation: &DVector<f64>, kind: &ShaftKind) -> Result<Arc<ModalShaft>, Error> {
        let (rotor, offsets) = self.deviations.apply(self.rotor, deviation);
        let nominal_n_m = self.scales(None).stiffness_n_m;
        let speeds_rad_s: Vec<f64> = self.rows().iter().map(|row| row.speed_rad_s).collect();
        Ok(Arc::new(ModalShaft::new(&rotor, self.shaft(kind), &offsets, nominal_n_m, &speeds_rad_s)?))
    }

    fn plant_of(&self, drawing: &Drawing, kind: &ShaftKind) -> Result<Arc<ModalShaft>, Error> {
        drawing.plants[kind.number()].get_or_init(|| self.plant(&drawing.deviation, kind)).clone()
    }

    /// A hypothesis against the data, on a plant.
    fn problem<'p>(
        &'p self,
        hypothesis: &'p Hypothesis<'p>,
        plant: Arc<ModalShaft>,
        amplitudes: Option<&Amplitudes>,
        whitening: &'p Whitening,
    ) -> Problem<'p> {
        let at_rest = hypothesis.terms(&hypothesis.origin());
        let mut held: Vec<Place> = (0..self.rotor.bearing.len()).map(Place::Bearing).collect();
        for (place, _) in &at_rest.supports {
            if !held.contains(place) {
                held.push(*place);
            }
        }
        let transient = self.transient.as_ref();
        Problem::new(hypothesis, (&self.data, transient), plant, held, amplitudes, whitening)
    }

    /// Fits a hypothesis from several starting points (search coordinates).
    ///
    /// # Errors
    /// If the machine is singular from every start.
    pub fn fit(
        &self,
        hypothesis: &Hypothesis,
        starts: &[Vec<f64>],
        drawing: &Drawing,
        effort: Effort,
        amplitudes: Option<&Amplitudes>,
    ) -> Result<Fit, Error> {
        self.fit_below(f64::INFINITY, hypothesis, starts, drawing, effort, amplitudes)
    }

    /// The same for somebody who wants no fit above this cost of the data: searches that will not come below it end early, at what
    /// they have.
    ///
    /// # Errors
    /// As [`Fitter::fit`].
    pub fn fit_below(
        &self,
        most: f64,
        hypothesis: &Hypothesis,
        starts: &[Vec<f64>],
        drawing: &Drawing,
        effort: Effort,
        amplitudes: Option<&Amplitudes>,
    ) -> Result<Fit, Error> {
        let terms = hypothesis.terms(&starts[0]);
        let plant = self.plant_of(drawing, &ShaftKind::of(&terms))?;
        let nonlinear = terms.supports.iter().any(|(_, law)| law.depends_on_amplitude());
        let mut amplitudes = amplitudes.filter(|_| nonlinear).cloned();
        if terms.supports.iter().any(|(_, law)| law.rub.is_some()) {
            amplitudes = self.reaching_disks(hypothesis, &starts[0], plant.clone(), amplitudes)?;
        }
        let (rounds_at_most, settled_within, end) = match effort {
            Effort::Linear | Effort::Glance => (0, 1.0, STAY),
            Effort::Rough => (ROUGH_ROUNDS, 1.0, ROUGH),
            Effort::Search | Effort::Final => (AMPLITUDE_ROUNDS, 1e-3, FINISH),
        };
        let until_settled = if rounds_at_most == 0 { STAY } else { SCOUT };
        let mut problem = self.problem(hypothesis, plant, amplitudes.as_ref(), &drawing.whitening);
        // with other amplitudes a fit can come lower than its equations foresee
        problem.most = if amplitudes.is_some() { f64::INFINITY } else { most };
        scout(&mut problem, starts, if effort == Effort::Glance { starts::GLANCE } else { starts::ALL });
        let mut relaxation = Relaxation::steady(AMPLITUDE_WEIGHT);
        let mut last_cost = f64::INFINITY;
        let mut rounds = 0;
        loop {
            // while amplitudes still change there is no point in going to the end
            problem.descend(if amplitudes.is_some() { until_settled } else { end });
            let settled = (last_cost - problem.cost()).abs() < settled_within || rounds >= rounds_at_most;
            let Some(held) = amplitudes.as_mut().filter(|_| !settled) else {
                problem.descend(end);
                return self.result(&problem, hypothesis, drawing, effort);
            };
            last_cost = problem.cost();
            let caused = problem.amplitudes().ok_or_else(singular)?;
            relaxation.step(held.iter_mut().flatten().flatten(), caused.iter().flatten().flatten().copied());
            problem.hold(held);
            rounds += 1;
        }
    }

    /// Amplitudes that were gathered before a disk was held, with those at that disk: nothing touches yet.
    fn reaching_disks(
        &self,
        hypothesis: &Hypothesis,
        start: &[f64],
        plant: Arc<ModalShaft>,
        amplitudes: Option<Amplitudes>,
    ) -> Result<Option<Amplitudes>, Error> {
        let Some(mut known) = amplitudes else { return Ok(None) };
        let mut problem = self.problem(hypothesis, plant, Some(&known), &self.plain);
        problem.go_to(start);
        let free = problem.amplitudes().ok_or_else(singular)?;
        drop(problem);
        for (known, free) in known.iter_mut().flatten().zip(free.into_iter().flatten()) {
            if *known == [0.0; 2] {
                *known = free;
            }
        }
        Ok(Some(known))
    }

    fn result(
        &self,
        problem: &Problem,
        hypothesis: &Hypothesis,
        drawing: &Drawing,
        effort: Effort,
    ) -> Result<Fit, Error> {
        let solved = problem.solved().ok_or_else(singular)?;
        Ok(Fit {
            x: problem.x().to_vec(),
            unknowns: solved.unknowns.clone(),
            chi2: problem.chi2(),
            stated_chi2: drawing.whitening.stated_chi2(&solved.left),
            cost: problem.cost() + drawing.whitening.cost(),
            values: 2 * self.data.count(),
            effect_unknowns: hypothesis.size() - hypothesis.bearings.count()
                + 2 * hypothesis.unknowns().len(),
            predicted_m: self.predicted_m(solved, drawing),
            amplitudes: problem.amplitudes().ok_or_else(singular)?,
            covariance: if effort == Effort::Final { problem.covariance() } else { None },
            weighted: solved.left.clone(),
        })
    }

    /// The model at every value, m, with the drawing's errors at their most probable.
    fn predicted_m(&self, solved: &LinearSolution, drawing: &Drawing) -> Vec<C> {
        let mut predicted_m = solved.predicted_m(&self.data);
        let shift = drawing.whitening.shift(&drawing.whitening.estimate(&solved.left));
        for (i, (m, v)) in predicted_m.iter_mut().zip(self.data.values()).enumerate() {
            *m += C::new(shift[2 * i], shift[2 * i + 1]) * v.sigma_m;
        }
        predicted_m
    }
}

/// A short run, none, one to where a candidate is seen for what it is worth, and one to the end.
const SCOUT: Stop = Stop::after(10, 1e-4);
const STAY: Stop = Stop::after(0, 0.0);
const ROUGH: Stop = Stop::after(100, 1e-4);
const FINISH: Stop = Stop::after(200, 1e-8).in_standard_deviations();

fn singular() -> Error {
    Error::SingularMachine { tried: "at every start" }
}
