//! Method 2: bearings are identified anew when the residual jumps and stays.

use nalgebra::Complex;

use super::answer::{FlagCause, ReadingEstimate, Reidentified};
use super::cases::{BeforeEvent, fit_all};
use super::coefficients::Logs;
use super::daily::{EventDetector, TrackedRecord, Tracking};
use super::record::Day;

type C = Complex<f64>;

/// Good readings whose mean unbalance is held in the cases that hold it.
const HELD_READINGS: usize = 10;

/// State of the method between readings.
struct PhaseTwoState {
    logs: Logs,
    last: Vec<C>,
    last_d: f64,
    detector: EventDetector,
}

/// Whether a jump of the unbalance explains a flag.
pub enum Jump {
    Explains(Vec<ReadingEstimate>),
    /// It lowers the residual, but leaves it suspicious.
    Helps(Vec<ReadingEstimate>),
    None,
}

impl Tracking<'_> {
    /// Phase II, and one of four re-identifications after every flag. The readings that raised a flag are
    /// the first to be described by the new bearings.
    pub fn adaptive(&self, progress: &mut dyn FnMut(usize, usize)) -> TrackedRecord {
        let mut run = TrackedRecord::default();
        let mut state = PhaseTwoState {
            logs: self.logs.clone(),
            last: self.unbalance_kg_m.clone(),
            last_d: f64::NAN,
            detector: EventDetector::new(self.config),
        };
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            let Some(mut estimate) = self.follow(day, &mut state) else { continue };
            let raised = state.detector.evaluate(&days[..=k], &mut estimate);
            run.estimates.push(estimate);
            if let Some(suspect) = raised {
                self.answer(&days[..=k], suspect, &mut state, &mut run);
            }
            progress(k + 1, days.len());
        }
        run
    }

    /// Phase II of one reading within the bounds.
    fn follow(&self, day: &Day, state: &mut PhaseTwoState) -> Option<ReadingEstimate> {
        let last_d = if state.last_d.is_nan() { day.time_d } else { state.last_d };
        let estimate = self.phase_two(day, &state.logs, Some((&state.last, last_d)))?;
        (state.last, state.last_d) = (estimate.unbalance_kg_m.clone(), day.time_d);
        Some(estimate)
    }

    /// Determines the cause of a flag and continues from it.
    fn answer(&self, days: &[&Day], suspect: usize, state: &mut PhaseTwoState, run: &mut TrackedRecord) {
        let persistence = self.config.thresholds.persistence.max(1);
        let streak = &days[days.len().saturating_sub(persistence)..];
        let now = run.estimates[run.estimates.len() - streak.len()..].to_vec();
        let jump = self.jump(streak, &state.logs, &state.detector, &now);
        if let Jump::Explains(free) = jump {
            run.flags.push(self.flag(&now, suspect, FlagCause::Unbalance));
            return self.replace(free, state, run);
        }
        let (held, _) = self.held(&run.estimates, streak[0]);
        let before = BeforeEvent {
            numbers: &self.numbers,
            logs: &state.logs,
            unbalance_kg_m: &held,
            suspect,
            plane: self.plane_of(suspect),
        };
        let cases = fit_all(streak, &before);
        let best = cases.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion)).cloned();
        let found = best
            .and_then(|best| Some((self.restart(streak, &best.logs, best.unbalance_kg_m.clone())?, best)));
        // new bearings must undo the rise of the residual, also compared with a jump of the unbalance alone
        let known = if let Jump::Helps(free) = &jump { free } else { &now };
        let Some((after, best)) = found.filter(|(after, _)| self.better(after, known)) else {
            let cause = if let Jump::Helps(_) = jump { FlagCause::Unbalance } else { FlagCause::Model };
            run.flags.push(self.flag(&now, suspect, cause));
            // a residual that no bearings explain is the new baseline, or it would raise a flag every three days
            return now.iter().for_each(|e| state.detector.residuals.accept(&e.residual));
        };
        run.flags.push(self.flag(&now, suspect, FlagCause::Model));
        run.reidentified.push(Reidentified {
            since_d: streak[0].time_d,
            time_d: streak[streak.len() - 1].time_d,
            case: best.case,
            bearing: suspect,
            logs: best.logs.clone(),
            cases,
        });
        state.logs = best.logs;
        self.replace(after, state, run);
    }

    /// Replaces the last estimates by new ones; the baseline before the flag is kept.
    fn replace(&self, estimates: Vec<ReadingEstimate>, state: &mut PhaseTwoState, run: &mut TrackedRecord) {
        run.estimates.truncate(run.estimates.len() - estimates.len());
        state.detector.reset();
        for estimate in estimates {
            (state.last, state.last_d) = (estimate.unbalance_kg_m.clone(), estimate.time_d);
            run.estimates.push(estimate);
        }
    }

    /// Phase II of a streak on the present bearings without a bound on the unbalance.
    pub fn jump(
        &self,
        streak: &[&Day],
        logs: &[f64],
        detector: &EventDetector,
        now: &[ReadingEstimate],
    ) -> Jump {
        let free: Option<Vec<ReadingEstimate>> =
            streak.iter().map(|day| self.phase_two(day, logs, None)).collect();
        match free {
            Some(free) if !free.iter().any(|e| detector.residuals.suspects(&e.residual)) => {
                Jump::Explains(free)
            }
            Some(free) if self.better(&free, now) => Jump::Helps(free),
            _ => Jump::None,
        }
    }

    /// Whether the residual of `these` is smaller than that of `others` by at least the suspicious rise.
    pub fn better(&self, these: &[ReadingEstimate], others: &[ReadingEstimate]) -> bool {
        let sum = |all: &[ReadingEstimate]| all.iter().map(|e| e.residual.e_um).sum::<f64>();
        sum(these) * (1.0 + self.config.thresholds.rise) <= sum(others)
    }

    /// Mean unbalance of the last good readings before a day, and the day of the last of them.
    pub fn held(&self, estimates: &[ReadingEstimate], before: &Day) -> (Vec<C>, f64) {
        let good = estimates.iter().rev().filter(|e| e.row < before.row && !e.suspicious);
        let good: Vec<&ReadingEstimate> = good.take(HELD_READINGS).collect();
        let Some(last) = good.first() else { return (self.unbalance_kg_m.clone(), before.time_d) };
        let mean = |j: usize| good.iter().map(|e| e.unbalance_kg_m[j]).sum::<C>() / good.len() as f64;
        ((0..self.unbalance_kg_m.len()).map(mean).collect(), last.time_d)
    }

    /// The plane nearest to a bearing.
    fn plane_of(&self, bearing: usize) -> usize {
        let at = self.rotor.bearing[bearing].position_m;
        let distance = |j: &usize| (self.rotor.plane[*j].position_m - at).abs();
        (0..self.rotor.plane.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}
