//! A run that sweeps too fast for its response to be that of a steady speed.
//!
//! A mass off its axis by u, turned through θ(t) with `θ' = Ω` and `θ'' = α`, drives the shaft by what it would at a steady
//! speed, with the transfer H(Ω) from `u e^{iθ}` to a probe. In the convolution with its impulse response h the past angle is
//! `θ − Ωτ + ατ²/2 − …`, so the amplitude beside `e^{iθ}` is
//! `∫ h e^{−iΩτ} (1 + iατ²/2 + …) dτ u = (H − (iα/2) d²H/dΩ² + …) u`: the second term is the lag. Passing one mode of damping
//! ratio ζ at ω, `H ∝ 1/(ω − Ω + iζω)`, it is `−iα/(ω − Ω + iζω)²` of the response: a phase of at most `α/(ζω)²` rad, at
//! resonance, and at most `(3√3/8) α/(ζω)²` of the amplitude, beside it. A run is quasi-steady where `α ≪ (ζω)²` (Lewis,
//! *Vibration during acceleration through a critical speed*, Trans. ASME 54, 1932).

pub mod beats;

use nalgebra::{Complex, DVector};

use super::base::{BaseModel, CandidateFit, FittedModel};
use crate::error::Error;
use crate::fit::data::Data;
use crate::fit::data::sweep::{SPEEDS, SweepPlan};
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Fit, Fitter};
use crate::machine::drawing::{Noise, Plane, Rotor};
use crate::measurement::Reading;
use crate::model::Model;
use crate::reduction::basis;
use crate::reduction::sizes::SIMULATED;
use crate::unbalance::phasor_kg_m;
use crate::units::{SECONDS_A_DAY, rpm};

type C = Complex<f64>;

/// Step of the speed for the second derivative, relative.
const STEP: f64 = 1e-4;
/// One-sided 5 % point of the normal law: χ² of N numbers scatters by √(2N), and what shifts it by more is seen.
const SEEN: f64 = 1.645;
/// Largest lag, relative to a probe's largest response, for which the series may end with its first term: the next one is
/// then below a tenth.
const FIRST_ORDER: f64 = 0.3;

/// The lag of readings that were taken in passing, where it is more than their noise hides.
pub struct Sweep {
    /// Of every probe in every reading, m.
    lag_m: Vec<Vec<C>>,
    /// Whether it is small enough to be taken off.
    pub small: bool,
    /// Runs whose lag is the largest: that of all others together is below the noise.
    runs: Vec<Option<String>>,
    pub remark: String,
    /// Rate below which the noise hides the lag, rpm a second.
    hidden_below_rpm_s: f64,
}

impl Sweep {
    /// By a fitted model; `None` where no times are known, or the lag is below the noise.
    pub fn of(fitted: &Rotor, readings: &[Reading], noise: &Noise) -> Option<Self> {
        let rates = rates_rad_s2(readings);
        if rates.iter().all(|rate| *rate == 0.0) {
            return None;
        }
        let lag_m = lags_m(fitted, readings, &rates);
        let (mut chi2, mut values) = (0.0, 0);
        let mut of_runs: Vec<(&Option<String>, f64)> = Vec::new();
        let mut worst = (0.0, 0, C::from(0.0));
        let mut largest = vec![(0.0_f64, 0.0_f64); fitted.probe.len()];
        for (row, reading) in readings.iter().enumerate() {
            for (p, y) in reading.probes.iter().enumerate().filter_map(|(p, y)| y.map(|y| (p, y))) {
                let lag = lag_m[row][p];
                let in_noise = (lag.norm() / noise.sigma_m(y)).powi(2);
                chi2 += in_noise;
                values += 2;
                match of_runs.iter_mut().find(|(run, _)| **run == reading.run) {
                    Some((_, own)) => *own += in_noise,
                    None => of_runs.push((&reading.run, in_noise)),
                }
                largest[p] = (largest[p].0.max(lag.norm()), largest[p].1.max(y.norm()));
                if in_noise > worst.0 {
                    worst = (in_noise, row, lag / y);
                }
            }
        }
        let hidden = SEEN * (2.0 * f64::from(values)).sqrt();
        if chi2 <= hidden {
            return None;
        }
        let (_, row, relative) = worst;
        let rate = fastest_rpm_s(&rates);
        let hidden_below_rpm_s = rate * (hidden / chi2).sqrt();
        let remark = format!(
            "The speed changes by up to {rate:.0} rpm a second, too fast for a steady response: at {:.0} rpm it is off by about \
             {:.0} % and {:.0}°. Below {hidden_below_rpm_s:.1} rpm a second the noise hides that.",
            readings[row].speed_rpm,
            100.0 * relative.re.abs(),
            relative.im.abs().to_degrees(),
        );
        let small = largest.iter().all(|(lag, shown)| *lag <= FIRST_ORDER * shown);
        of_runs.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut left = chi2;
        let mut is_seen = |own: &f64| {
            let seen = left > hidden;
            left -= own;
            seen
        };
        let largest = of_runs.iter().take_while(|(_, own)| is_seen(own));
        let runs = largest.map(|(run, _)| (*run).clone()).collect();
        Some(Self { lag_m, small, runs, remark, hidden_below_rpm_s })
    }

    /// The readings as they would be at steady speeds.
    pub fn taken_off(&self, readings: &[Reading]) -> Vec<Reading> {
        let steady = |(reading, lag): (&Reading, &Vec<C>)| Reading {
            probes: reading.probes.iter().zip(lag).map(|(y, lag)| y.map(|y| y - lag)).collect(),
            ..reading.clone()
        };
        readings.iter().zip(&self.lag_m).map(steady).collect()
    }
}

/// What is asked of a model by its fit to readings. Runs that change speed too fast are fitted as transients.
///
/// # Errors
/// If the machine is singular, or what is asked fails.
pub fn fitted<T>(
    steady: &Fitter,
    readings: &[Reading],
    noise: &Noise,
    asked: impl FnOnce(BaseModel) -> Result<T, Error>,
) -> Result<T, Error> {
    let base = BaseModel::fit(steady)?;
    match base.transient(readings, noise, 0)? {
        Some((fitter, found)) => asked(found.of(&fitter)),
        None => asked(base),
    }
}

/// A model with an effect more, by the fit of the model to readings, as [`fitted`] has it. An effect can reduce the damping, so that free
/// vibration lasts longer than in the model without it. The transient is then evaluated at more speeds, up to the last of [`SPEEDS`].
///
/// # Errors
/// If the machine is singular, or the effect cannot be fitted.
pub fn fitted_with<T>(
    steady: &Fitter,
    readings: &[Reading],
    noise: &Noise,
    add: impl Fn(&BaseModel) -> Result<(T, CandidateFit), Error>,
) -> Result<T, Error> {
    let base = BaseModel::fit(steady)?;
    let mut found = base.transient(readings, noise, 0)?;
    let mut last = None;
    while let Some((fitter, model)) = found {
        let (base_of_run, speeds) =
            (model.of(&fitter), fitter.data.sweeps.as_ref().map_or(0, |plan| plan.speeds));
        let (answer, t) = add(&base_of_run)?;
        let with = base_of_run.hypothesis.with(t.placed);
        if fitter.remembers_enough((readings, noise), &with, &t.fit, t.drawing(&base_of_run))? {
            return Ok(answer);
        }
        last = Some(answer);
        found = base.transient(readings, noise, speeds + 1)?;
    }
    last.map_or_else(|| Ok(add(&base)?.0), Ok)
}

/// The data with those runs as transients that change speed too fast, as [`fitted`] takes them; `None` where all are steady.
///
/// # Errors
/// If the machine is singular.
pub fn transients(steady: &Fitter, readings: &[Reading], noise: &Noise) -> Result<Option<Data>, Error> {
    Ok(BaseModel::fit(steady)?.transient(readings, noise, 0)?.map(|(fitter, _)| fitter.data))
}

impl<'a> BaseModel<'a> {
    /// The fit with those runs as transients that change speed too fast for a steady response, over `at_least` so many speeds; `None` where
    /// the noise hides that, where it cannot be told from the times, and where it would not explain the data better.
    ///
    /// # Errors
    /// If the machine is singular.
    fn transient(
        &self,
        readings: &[Reading],
        noise: &Noise,
        at_least: usize,
    ) -> Result<Option<(Fitter<'a>, FittedModel)>, Error> {
        let rotor = self.fitter.rotor;
        let found = self.written();
        // a steady fit can damp away the lag that an earlier fit saw
        let seen_before = || Sweep::of(&self.fitter.found_before.as_ref()?.file, readings, noise);
        let Some(sweep) = Sweep::of(&found, readings, noise).or_else(seen_before) else { return Ok(None) };
        for speeds in SPEEDS.into_iter().filter(|speeds| *speeds >= at_least) {
            let plan = SweepPlan { runs: sweep.runs.clone(), speeds };
            let Some(data) = Data::swept(rotor, noise, readings, &plan) else { continue };
            let fitter = self.fitter.on(data);
            let Ok(base) = BaseModel::fit(&fitter) else { continue };
            let (fit, drawing) = base.shown();
            if !fitter.remembers_enough((readings, noise), &base.hypothesis, fit, drawing)? {
                continue;
            }
            let better = base.in_stated_noise.chi2 < self.in_stated_noise.chi2;
            let found = FittedModel::from(base);
            return Ok(better.then_some((fitter, found)));
        }
        Ok(None)
    }
}

impl Fitter<'_> {
    /// Whether the runs that are no steady responses are followed as far back as they go, or twice as far would change nothing of a fit
    /// that is more than noise.
    fn remembers_enough(
        &self,
        (readings, noise): (&[Reading], &Noise),
        model: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<bool, Error> {
        let Some(plan) = self.data.sweeps.as_ref().filter(|plan| !plan.is_whole(readings)) else {
            return Ok(true);
        };
        let longer = SweepPlan { speeds: 2 * plan.speeds, ..plan.clone() };
        let Some(data) = Data::swept(self.rotor, noise, readings, &longer) else { return Ok(false) };
        let values = 2.0 * data.count() as f64;
        let change = self.change_to(&self.on(data), model, fit, drawing)?;
        Ok(change <= SEEN * (2.0 * values).sqrt())
    }
}

/// What is said of runs that change speed too fast, as these data of them were fitted or could not be.
pub fn remark(data: &Data, readings: &[Reading], sweep: Option<&Sweep>) -> Option<String> {
    if !data.is_swept() {
        return sweep.map(|sweep| sweep.remark.clone());
    }
    let below = sweep.map_or_else(String::new, |sweep| {
        format!(" Below {:.1} rpm a second the noise hides the difference.", sweep.hidden_below_rpm_s)
    });
    Some(format!(
        "The speed changes by up to {:.0} rpm a second, too fast for a steady response. The vibration is fitted as that of a \
         run-up or run-down, by the times of the readings.{below}",
        fastest_rpm_s(&rates_rad_s2(readings))
    ))
}

/// The largest of these rates, rad/s², in rpm a second.
fn fastest_rpm_s(rates: &[f64]) -> f64 {
    rpm(rates.iter().fold(0.0, |most, rate| rate.abs().max(most)))
}

/// Change of the speed at each reading, rad/s², from its neighbours in the same run; zero where times are not known.
fn rates_rad_s2(readings: &[Reading]) -> Vec<f64> {
    let rate = |row: usize| {
        let beside = |other: Option<&Reading>| other.filter(|o| o.run == readings[row].run).cloned();
        let before = row.checked_sub(1).and_then(|i| beside(readings.get(i)));
        let (from, to) = (before.unwrap_or_else(|| readings[row].clone()), beside(readings.get(row + 1)));
        let to = to.unwrap_or_else(|| readings[row].clone());
        let seconds = SECONDS_A_DAY * (to.time_d? - from.time_d?);
        (seconds > 0.0).then(|| (to.speed_rad_s() - from.speed_rad_s()) / seconds)
    };
    (0..readings.len()).map(|row| rate(row).unwrap_or(0.0)).collect()
}

/// `−(iα/2) d²(H u)/dΩ²` of every probe in every reading, m; nothing where the model has no steady response.
fn lags_m(fitted: &Rotor, readings: &[Reading], rates: &[f64]) -> Vec<Vec<C>> {
    let mut models: Vec<(Option<&String>, Model, DVector<C>)> = Vec::new();
    let mut lags = Vec::with_capacity(readings.len());
    for (reading, rate) in readings.iter().zip(rates) {
        let name = reading.run.as_ref();
        let known = models.iter().position(|(run, ..)| *run == name).unwrap_or_else(|| {
            let rotor = weighted(fitted, name);
            let size = |p: &Plane| (p.unbalance_g_mm.unwrap_or_default(), p.angle_deg.unwrap_or_default());
            let unbalance = rotor.plane.iter().map(size).map(|(size, angle)| phasor_kg_m(size, angle));
            let unbalance = DVector::from_vec(unbalance.collect());
            models.push((name, basis::reduced(&rotor, SIMULATED), unbalance));
            models.len() - 1
        });
        let (_, model, unbalance) = &models[known];
        lags.push(
            lag_m(model, unbalance, reading.speed_rad_s(), *rate)
                .unwrap_or_else(|| vec![C::from(0.0); fitted.probe.len()]),
        );
    }
    lags
}

fn lag_m(model: &Model, unbalance: &DVector<C>, speed: f64, rate: f64) -> Option<Vec<C>> {
    let at = |speed: f64| Some(model.response_under(speed, unbalance).ok()?.per_unbalance * unbalance);
    let step = STEP * speed;
    let bend = (at(speed + step)? - at(speed)? * C::from(2.0) + at(speed - step)?) / C::from(step * step);
    Some(bend.iter().map(|b| b * C::new(0.0, -0.5 * rate)).collect())
}

/// The rotor with the weights of a run as planes of their own.
fn weighted(fitted: &Rotor, run: Option<&String>) -> Rotor {
    let mut rotor = fitted.clone();
    let weights = fitted.run.iter().filter(|r| Some(&r.name) == run).flat_map(|r| &r.added_unbalance);
    rotor.plane.extend(weights.map(|a| Plane {
        name: String::new(),
        position_m: a.position_m,
        unbalance_g_mm: Some(a.magnitude_g_mm),
        angle_deg: Some(a.angle_deg),
    }));
    rotor
}

#[cfg(test)]
mod tests;
