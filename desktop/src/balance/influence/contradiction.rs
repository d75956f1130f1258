//! The one run that contradicts all others: its weight is not where it is stated, a phase is wrong, or the machine was another.
//!
//! Every run is left out in turn. The squares that go with it are compared with those that stay, by an F test corrected for the
//! number of runs. Readings of one run share its errors over probes and speeds, so a run counts as one complex value, however many
//! readings it has. Readings with reversed phases are examined in the same way.

use nalgebra::Complex;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::trials::{TrialFit, Trials};
use crate::balance::sense::{CHANCE, PhaseSense, ReversedWithRun};
use crate::error::Error;

type C = Complex<f64>;

/// Chance above which a second run may as well be the one that contradicts.
const SECOND: f64 = 0.05;
/// Squares below this, relative to the readings', are rounding.
const ROUNDING: f64 = 1e-12;

/// Coefficients of the runs that agree, and the run that does not.
#[derive(Debug, Clone)]
pub struct AgreeingRuns {
    pub fit: TrialFit,
    pub contradiction: Option<Contradiction>,
}

/// Runs that contradict the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Contradiction {
    /// Names of the runs that it may be.
    pub runs: Vec<String>,
    /// Number of the run that is left out; none if the runs do not tell which it is, or scatter may explain it.
    pub left_out: Option<usize>,
    /// Chance of so much by scatter alone.
    pub chance: f64,
    /// The weight that fits its readings over the stated one; none where it has no weight, or several.
    pub over_stated: Option<C>,
}

impl Contradiction {
    /// What is to be checked, in one sentence or two.
    pub fn doubt(&self) -> String {
        let runs: Vec<String> = self.runs.iter().map(|run| format!("\"{run}\"")).collect();
        let named = match &runs[..] {
            [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
            runs => runs.join(""),
        };
        let fits = self.over_stated.map_or(String::new(), |ratio| {
            let turned_deg = ratio.arg().to_degrees();
            let way = if turned_deg < 0.0 { "against" } else { "in" };
            format!(
                "the others fit its readings with {:.2} times its weight, {:.0}° from the stated angle {way} the direction of \
                 rotation; ",
                ratio.norm(),
                turned_deg.abs()
            )
        });
        match (self.left_out.is_some(), self.runs.len()) {
            (true, _) => format!(
                "The run {named} contradicts the other runs and is left out: {fits}check its weight and its readings."
            ),
            (false, 1) => format!(
                "The run {named} agrees least with the others and is still used: {fits}check its weight and its readings."
            ),
            _ => format!(
                "One of the runs {named} contradicts the others, and they do not tell which; all are used, so check their weights \
                 and readings."
            ),
        }
    }
}

/// Squares that the runs leave without one of them, and degrees of freedom.
#[derive(Debug, Clone, Copy)]
struct Residual {
    squares: f64,
    freedom: usize,
}

impl Residual {
    fn mean(self) -> f64 {
        self.squares / self.freedom as f64
    }
}

/// All runs but one.
struct Without {
    run: usize,
    fit: TrialFit,
}

/// Leaves each run out that the others do not need.
fn each_left_out(trials: &Trials, whole: &TrialFit) -> Vec<Without> {
    let fitted = |run: usize| {
        let fit = trials.without(run).least_squares().ok()?;
        (fit.coefficients.len() == whole.coefficients.len()).then_some(Without { run, fit })
    };
    (0..trials.runs.len()).filter(|run| trials.onto != Some(*run)).filter_map(fitted).collect()
}

/// The run without which least is left, with the chances that scatter alone explains it: with a run as one value, and with all of
/// its readings independent.
struct Suspect {
    place: usize,
    chance: f64,
    chance_of_readings: f64,
    /// Others that it may be as well.
    seconds: Vec<usize>,
}

/// `known` is whether squares are in variances of the noise.
fn suspect(whole: Residual, left: &[Option<Residual>], known: bool) -> Option<Suspect> {
    let usable = |(place, left): (usize, &Option<Residual>)| {
        left.filter(|l| l.freedom > 0 && l.freedom < whole.freedom).map(|l| (place, l))
    };
    let all: Vec<(usize, Residual)> = left.iter().enumerate().filter_map(usable).collect();
    let (place, best) = *all.iter().min_by(|a, b| a.1.mean().total_cmp(&b.1.mean()))?;
    let values = whole.freedom - best.freedom;
    let others = 2.0 * (best.freedom as f64 / values as f64).max(1.0);
    let floor = if known { 1.0 } else { f64::MIN_POSITIVE };
    let ratio = ((whole.squares - best.squares) / values as f64 / best.mean().max(floor)).min(1e12);
    let runs = left.len() as f64;
    let by = |values: f64, others: f64| {
        let exceeds = match known && best.mean() <= 1.0 {
            true => ChiSquared::new(values).map_or(1.0, |c| c.sf(values * ratio)),
            false => FisherSnedecor::new(values, others).map_or(1.0, |f| f.sf(ratio)),
        };
        (runs * exceeds).min(1.0)
    };
    let as_well = |(at, l): &(usize, Residual)| {
        let ratio = (l.mean() / best.mean().max(floor)).min(1e12);
        *at != place && FisherSnedecor::new(others, others).map_or(1.0, |f| f.sf(ratio)) > SECOND
    };
    Some(Suspect {
        place,
        chance: by(2.0, others),
        chance_of_readings: by(values as f64, best.freedom as f64),
        seconds: all.iter().filter(|l| as_well(l)).map(|l| l.0).collect(),
    })
}

impl Trials {
    /// Coefficients of the runs that agree.
    ///
    /// # Errors
    /// As [`least_squares`](Self::least_squares), or if the phases are reversed.
    pub fn fit(&self) -> Result<AgreeingRuns, Error> {
        let whole = self.least_squares()?;
        let all = each_left_out(self, &whole);
        let misfit = |fit: &TrialFit| {
            fit.misfit.map(|m| Residual { squares: m.chi2_per_value * m.freedom as f64, freedom: m.freedom })
        };
        let squares = self.squares();
        let stated = misfit(&whole).filter(|m| m.squares > ROUNDING * squares).and_then(|m| {
            suspect(m, &all.iter().map(|w| misfit(&w.fit)).collect::<Vec<_>>(), self.is_noise_known)
        });
        let is_sure = |s: &&Suspect| s.chance <= CHANCE;
        let of_stated = stated.as_ref().filter(is_sure).map(|s| &all[s.place]);
        self.check_sense(&whole, &all, of_stated)?;
        let Some(suspect) = stated.filter(|s| s.chance_of_readings <= CHANCE) else {
            return Ok(AgreeingRuns { fit: whole, contradiction: None });
        };
        let found = &all[suspect.place];
        let is_sole = suspect.chance <= CHANCE && suspect.seconds.is_empty();
        let name = |place: &usize| self.runs[all[*place].run].clone();
        let contradiction = Contradiction {
            runs: [suspect.place].iter().chain(&suspect.seconds).map(name).collect(),
            left_out: is_sole.then_some(found.run),
            chance: suspect.chance,
            over_stated: self.over_stated(found.run, &found.fit),
        };
        let fit = if is_sole { found.fit.clone() } else { whole };
        Ok(AgreeingRuns { fit, contradiction: Some(contradiction) })
    }

    /// Refuses reversed phases, also where one run contradicts the others; `of_stated` are the runs without it as stated.
    fn check_sense(
        &self,
        whole: &TrialFit,
        all: &[Without],
        of_stated: Option<&Without>,
    ) -> Result<(), Error> {
        let turned = |sense: &PhaseSense| {
            let (squares, freedom) = sense.turned();
            (freedom > 0).then_some(Residual { squares, freedom: 2 * freedom })
        };
        let left: Vec<Option<Residual>> = all.iter().map(|w| turned(&w.fit.sense)).collect();
        let found = turned(&whole.sense).and_then(|m| suspect(m, &left, self.is_noise_known));
        let of_turned = found.filter(|s| s.chance <= CHANCE).map(|s| &all[s.place]);
        let stated = &of_stated.map_or(whole, |w| &w.fit).sense;
        let contradicting =
            of_turned.map(|w| ReversedWithRun { run: self.runs[w.run].clone(), tried: all.len() });
        let turned = &of_turned.map_or(whole, |w| &w.fit).sense;
        PhaseSense::of_both(stated, turned).check(&self.probes, contradicting.as_ref())
    }

    /// Squares of all readings over their variances.
    fn squares(&self) -> f64 {
        let all = self.readings.iter().flat_map(|t| t.probes.iter().flatten());
        all.map(|y| y.phasor.norm_sqr() / y.sigma.powi(2)).sum()
    }

    /// The same runs but one.
    pub fn without(&self, run: usize) -> Self {
        let readings = self.readings.iter().filter(|t| t.run != run).cloned().collect();
        Self { readings, ..self.clone() }
    }

    /// The weight that fits the readings of a run by the others, over the stated one.
    fn over_stated(&self, run: usize, others: &TrialFit) -> Option<C> {
        let stated = &self.readings.iter().find(|t| t.run == run)?.weights;
        let mut placed = (0..stated.len()).filter(|j| stated[*j].norm() > 0.0);
        let (place, None) = (placed.next()?, placed.next()) else { return None };
        let (mut along, mut squares) = (C::from(0.0), 0.0);
        for c in &others.coefficients {
            let a = c.per_weight.get(place)?;
            let here = |t: &&super::trials::TrialReading| {
                t.run == run && self.speeds.mean_rpm[t.speed] == c.speed_rpm
            };
            for y in self.readings.iter().filter(here).filter_map(|t| t.probes[c.probe]) {
                along += a.conj() * (y.phasor - c.before) / y.sigma.powi(2);
                squares += a.norm_sqr() / y.sigma.powi(2);
            }
        }
        Some(along / squares / stated[place]).filter(|ratio| ratio.is_finite())
    }
}
