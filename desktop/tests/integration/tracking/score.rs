//! What an estimate is worth against the truth.

use nalgebra::Complex;
use rotor_edge_desktop::Error;
use rotor_edge_desktop::forecast::backtest::{ForecastBasis, backtest};
use rotor_edge_desktop::forecast::scores::Score as ForecastScore;
use rotor_edge_desktop::forecast::{known, series};
use rotor_edge_desktop::track::{
    ConditionEffect, Config, Event, Flag, Interval, LaterRunup, Method, ReadingEstimate, SecondSpeed, Track,
    filtered, track,
};

use rotor_edge_desktop::unbalance::{g_mm_deg, static_and_dynamic};

use super::generator::{Plan, Record};

/// Half of a 95 % interval, in standard deviations.
const HALF: f64 = 1.96;
/// Unbalance at which errors are told, g·mm: the built-in sample's.
const SAMPLE_G_MM: f64 = 627.0;

/// What the estimates of some days are worth.
#[derive(Debug, Clone, Default)]
pub struct Score {
    pub days: usize,
    /// Share of 95 % intervals of a plane's size that hold the truth.
    pub coverage: f64,
    /// The same of its angle.
    pub angle_coverage: f64,
    /// Error of the logarithm of each plane's size in its own standard deviations, averaged over the days.
    pub z: Vec<f64>,
    /// Vector error of the planes (rms), g·mm where they are 627 g·mm.
    pub rms_g_mm: f64,
}

/// The scores of many records.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    pub records: usize,
    pub coverage: f64,
    pub least_coverage: f64,
    pub angle_coverage: f64,
    pub least_angle_coverage: f64,
    /// Mean over records and planes, and root mean square.
    pub mean_z: f64,
    pub rms_z: f64,
    pub rms_g_mm: f64,
}

impl Summary {
    pub fn of(scores: impl Iterator<Item = Score>) -> Self {
        let all: Vec<Score> = scores.collect();
        let mean = |of: &dyn Fn(&Score) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        Self {
            records: all.len(),
            coverage: mean(&|s| s.coverage),
            least_coverage: all.iter().map(|s| s.coverage).fold(1.0, f64::min),
            angle_coverage: mean(&|s| s.angle_coverage),
            least_angle_coverage: all.iter().map(|s| s.angle_coverage).fold(1.0, f64::min),
            mean_z: mean(&|s| s.z.iter().sum::<f64>() / s.z.len() as f64),
            rms_z: mean(&|s| s.z.iter().map(|z| z * z).sum::<f64>() / s.z.len() as f64).sqrt(),
            rms_g_mm: mean(&|s| s.rms_g_mm.powi(2)).sqrt(),
        }
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} records: size {:.1} % of days, least {:.1} %, angle {:.1} %, least {:.1} %, z {:.2} (rms {:.2}), {:.1} g·mm",
            self.records,
            100.0 * self.coverage,
            100.0 * self.least_coverage,
            100.0 * self.angle_coverage,
            100.0 * self.least_angle_coverage,
            self.mean_z,
            self.rms_z,
            self.rms_g_mm
        )
    }
}

/// A record followed, and its truth.
pub struct Judged {
    plan: Plan,
    positions_m: Vec<f64>,
    track: Track,
    pub before: Score,
    pub after: Option<Score>,
}

impl Judged {
    /// By method joint, with the later run-up or without; or why it cannot be followed.
    pub fn new(plan: &Plan, record: &Record, with_later: bool) -> Result<Self, Error> {
        let later: Vec<LaterRunup> = match &record.later {
            Some((time_d, readings)) if with_later => vec![LaterRunup { time_d: *time_d, readings }],
            _ => Vec::new(),
        };
        let config = Config::new(Method::Joint);
        let track = track(&record.rotor, &record.readings, &record.runup, &later, &config, &mut |_, _| ())?;
        Ok(Self::of(plan, record, track))
    }

    /// By this configuration, without a later run-up.
    pub fn by(plan: &Plan, record: &Record, config: &Config) -> Result<Self, Error> {
        let track = track(&record.rotor, &record.readings, &record.runup, &[], config, &mut |_, _| ())?;
        Ok(Self::of(plan, record, track))
    }

    /// Every Nth reading, estimated with data up to its day only.
    pub fn filtered(plan: &Plan, record: &Record, every: usize) -> Result<Self, Error> {
        let config = Config::new(Method::Joint);
        let Record { rotor, readings, runup, .. } = record;
        let track = filtered(rotor, readings, runup, &[], &config, every, &mut |_, _| ())?;
        Ok(Self::of(plan, record, track))
    }

    fn of(plan: &Plan, record: &Record, track: Track) -> Self {
        let event_d = plan.event.map_or(f64::INFINITY, |(day, _)| day as f64);
        let before = score(record, &track.estimates, |day| day < event_d);
        let after = plan.event.map(|_| score(record, &track.estimates, |day| day >= event_d));
        Self { plan: *plan, positions_m: record.rotor.plane_positions_m(), track, before, after }
    }

    pub fn last(&self) -> Option<&ReadingEstimate> {
        self.track.estimates.last()
    }

    pub fn flags(&self) -> &[Flag] {
        &self.track.flags
    }

    pub fn seed(&self) -> u64 {
        self.plan.seed
    }

    pub fn remarks(&self) -> &[String] {
        &self.track.remarks
    }

    /// What conditions of operation change.
    pub fn conditions(&self) -> &[ConditionEffect] {
        self.track.joint.as_ref().map_or(&[], |joint| &joint.conditions)
    }

    pub fn events(&self) -> &[Event] {
        self.track.joint.as_ref().map_or(&[], |joint| &joint.events)
    }

    pub fn second_speed(&self) -> Option<SecondSpeed> {
        self.track.joint.as_ref()?.second_speed
    }

    pub fn possible(&self) -> &[Event] {
        self.track.joint.as_ref().map_or(&[], |joint| &joint.possible)
    }

    /// One event, and the true day inside its interval; days without a reading are passed over.
    pub fn finds_its_event(&self) -> bool {
        let Some((day, _)) = self.plan.event else { return self.events().is_empty() };
        let first = self.track.estimates.iter().map(|e| e.time_d).find(|d| *d >= day as f64);
        let holds = |e: &Event| first.is_some_and(|d| e.interval_d.low <= d && d <= e.interval_d.high);
        matches!(self.events(), [one] if holds(one))
    }

    /// Scores of forecasts from each day on, of each of the four series and of each at every horizon.
    pub fn forecasts(&self, by: ForecastBasis, horizons: &[usize]) -> Vec<ForecastScore> {
        let history = series::parse("track.csv", &self.csv()).unwrap();
        history.series.iter().flat_map(|s| backtest(s, by, 90, horizons, 1).unwrap().0).collect()
    }

    /// The columns of its track that a forecast reads.
    fn csv(&self) -> String {
        let head = ["time_d", "static_g_mm", "static_deg", "dynamic_g_mm", "dynamic_deg"].map(String::from);
        let mut lines = vec![[&head[..], &known::header()].concat().join(",")];
        let joint = self.track.joint.as_ref().unwrap();
        for (e, filter_states) in self.track.estimates.iter().zip(&joint.filter_states) {
            let estimated =
                static_and_dynamic(&self.positions_m, &e.unbalance_kg_m).into_iter().flat_map(g_mm_deg);
            let cells = [e.time_d].into_iter().chain(estimated).map(|value| value.to_string());
            lines.push(cells.chain(known::cells(filter_states)).collect::<Vec<_>>().join(","));
        }
        lines.join("\n")
    }

    /// Everything about it in one line.
    pub fn line(&self) -> String {
        let part = |s: &Score| {
            let z: Vec<String> = s.z.iter().map(|z| format!("{z:>5.2}")).collect();
            let [size, angle] = [s.coverage, s.angle_coverage].map(|share| 100.0 * share);
            format!("{size:>5.1} {angle:>5.1} %, z {}, {:>5.1} g·mm", z.join(" "), s.rms_g_mm)
        };
        let event = |e: &Event| {
            let Interval { low, high } = e.interval_d;
            format!(" day {} ({low} to {high}), evidence {:.0}: {:?}", e.time_d, e.evidence, e.scope)
        };
        format!(
            "{:<10} {} before {} after {}{}",
            self.plan.machine.name,
            self.plan.seed,
            part(&self.before),
            self.after.as_ref().map_or("–".into(), part),
            self.events().iter().map(event).collect::<String>()
        )
    }
}

fn score(record: &Record, estimates: &[ReadingEstimate], days: impl Fn(f64) -> bool) -> Score {
    let planes = record.rotor.plane.len();
    let mut score = Score { z: vec![0.0; planes], ..Score::default() };
    let (mut held, mut angles_held, mut squares, mut sizes) = (0.0, 0.0, 0.0, 0.0);
    for e in estimates.iter().filter(|e| days(e.time_d)) {
        let spread = e.spread.as_ref().unwrap();
        score.days += 1;
        for (j, truth) in record.unbalance_kg_m[e.row].iter().enumerate() {
            let interval = spread.magnitude_kg_m[j];
            held += f64::from(u8::from(interval.low <= truth.norm() && truth.norm() <= interval.high));
            let Interval { low, high } = spread.angle_rad[j];
            let off = (truth * Complex::from_polar(1.0, -0.5 * (low + high))).arg().abs();
            angles_held += f64::from(u8::from(off <= 0.5 * (high - low)));
            let size = e.unbalance_kg_m[j].norm();
            let sd = (interval.high.ln() - interval.low.max(1e-3 * size).ln()) / (2.0 * HALF);
            score.z[j] += (size / truth.norm()).ln() / sd;
            squares += (e.unbalance_kg_m[j] - truth).norm_sqr();
            sizes += truth.norm();
        }
    }
    let (days, all) = (score.days as f64, (planes * score.days) as f64);
    (score.coverage, score.angle_coverage) = (held / all, angles_held / all);
    score.z.iter_mut().for_each(|z| *z /= days);
    score.rms_g_mm = (squares / all).sqrt() / (sizes / all) * SAMPLE_G_MM;
    score
}
