//! Beats of a run that changed speed fast, seen in readings without times.
//!
//! A machine that passes a resonance at `Ω_n` fast goes on to vibrate freely there. With the speed changing by α, its angle turns from that
//! of the free vibration by `φ = (Ω − Ω_n)²/(2α)`, so that beside the forced response the 1x phasor holds `C e^{∓iφ}`, − above the resonance
//! in a run-up and + below it in a run-down, and decays by `e^{−δ|Ω − Ω_n|}` with `δ = ζΩ_n/α` (Lewis, *Vibration during acceleration
//! through a critical speed*, Trans. ASME 54, 1932). Amplitudes beat where `(Ω − Ω_n)²` has grown by 4πα: with a rate that no steady response
//! has, and that tells α.

use std::f64::consts::PI;

use nalgebra::{Complex, DMatrix, DVector};

use crate::machine::drawing::Noise;
use crate::measurement::Reading;
use crate::statistics::significance::NEGLIGIBLE;
use crate::units::rpm;

type C = Complex<f64>;

/// Readings beside the peak that are looked at, at least and at most: of more, so many that are evenly spread.
const FEWEST: usize = 16;
const MOST: usize = 100;
/// The readings begin where the largest amplitude has fallen to this share of the peak's.
const BESIDE_PEAK: f64 = 0.5;
/// Beats until the free vibration has decayed to e⁻², at least: with fewer it is like a second resonance.
const FEWEST_BEATS: f64 = 3.0;
/// Powers of the speed that the forced response is taken to follow, beside the resonance that was passed.
const POWERS: usize = 3;
/// The free vibration over all readings decays by so many powers of e.
const DECAYS: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 6.0];
/// Readings of a beat, at least, where the free vibration has decayed to 1/e: with two its sense of rotation is lost.
const READINGS_OF_BEAT: f64 = 2.0;
/// How much faster than by one turn for each reading the rate may be found: it is good to a tenth.
const RATE_MARGIN: f64 = 1.1;
/// Step of the number of beats over all readings. Two vibrations that differ by it are half a turn apart at the last of them.
const STEP_OF_BEATS: f64 = 0.5;
/// The resonance lies before the peak by at most so many steps, each a share of √α: an undamped one by 2.2 √α (Lewis).
const BEFORE_PEAK: usize = 20;
const STEP_BEFORE_PEAK: f64 = 0.15;
/// Speeds and widths of another resonance that could look like beats.
const RESONANCES: usize = 60;
const WIDTHS: [f64; 6] = [0.003, 0.006, 0.012, 0.025, 0.05, 0.1];

/// Free vibration beside the forced one.
pub struct Beats {
    /// Speed of the largest amplitude.
    pub peak_rpm: f64,
    /// Rate at which the speed changed.
    pub rate_rpm_s: f64,
    /// Twice the logarithm of the odds against another resonance in place of beats.
    evidence: f64,
}

impl Beats {
    /// Why nothing is claimed of such a run.
    pub fn words(&self) -> String {
        format!(
            "The vibration beats beside its peak at {:.0} rpm, as in a run whose speed changes by about {:.0} rpm a second. That is too \
             fast for a steady response, and the readings come without times (time_d).",
            self.peak_rpm, self.rate_rpm_s,
        )
    }

    /// The clearest beats of all runs that come without times; `None` where no run beats.
    pub fn of(readings: &[Reading], noise: &Noise) -> Option<Self> {
        let mut runs: Vec<&Option<String>> = Vec::new();
        for reading in readings {
            if !runs.contains(&&reading.run) {
                runs.push(&reading.run);
            }
        }
        let of_run = |run: &Option<String>| {
            let own: Vec<&Reading> = readings.iter().filter(|r| r.run == *run).collect();
            if own.iter().any(|r| r.time_d.is_some()) {
                return None;
            }
            [1.0, -1.0]
                .into_iter()
                .filter_map(|sense| Side::of(&own, noise, sense)?.beats())
                .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
        };
        runs.into_iter().filter_map(of_run).max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }
}

/// What a run shows on one side of its peak.
struct Side {
    peak_rad_s: f64,
    /// Distance of each reading from the peak, rad/s.
    beyond_rad_s: Vec<f64>,
    /// 1 above the peak, −1 below it.
    sense: f64,
    /// Number of readings that were measured there.
    measured: usize,
    probes: Vec<ProbeSide>,
}

/// The free vibration of a resonance that was passed.
struct Vibration {
    rate_rad_s2: f64,
    /// Powers of e from the resonance to the last reading.
    decay: f64,
    /// How far the resonance lies before the peak, rad/s.
    before_rad_s: f64,
}

/// What a probe shows there, without what a smooth forced response can follow, and with the weight of each reading.
struct ProbeSide {
    weights: Vec<f64>,
    smooth: DMatrix<C>,
    left: DVector<C>,
}

impl Side {
    fn of(run: &[&Reading], noise: &Noise, sense: f64) -> Option<Self> {
        let largest = |r: &Reading| r.probes.iter().flatten().map(|y| y.norm()).fold(0.0, f64::max);
        let peak = run.iter().max_by(|a, b| largest(a).total_cmp(&largest(b)))?;
        let (peak_rad_s, peak_m) = (peak.speed_rad_s(), largest(peak));
        let mut side: Vec<(f64, &Reading)> = run
            .iter()
            .map(|r| (sense * (r.speed_rad_s() - peak_rad_s), *r))
            .filter(|(d, _)| *d > 0.0)
            .collect();
        side.sort_by(|a, b| a.0.total_cmp(&b.0));
        let first = side.iter().position(|(_, r)| largest(r) < BESIDE_PEAK * peak_m)?;
        let side = &side[first..];
        if side.len() < FEWEST {
            return None;
        }
        let (measured, count) = (side.len(), side.len().min(MOST));
        let side: Vec<(f64, &Reading)> =
            (0..count).map(|k| side[k * (side.len() - 1) / (count - 1)]).collect();
        let beyond_rad_s: Vec<f64> = side.iter().map(|(d, _)| *d).collect();
        let count = side[0].1.probes.len();
        let probe = |p: usize| {
            let shown: Vec<Option<C>> = side.iter().map(|(_, r)| r.probes[p]).collect();
            (shown.iter().flatten().count() >= FEWEST).then(|| ProbeSide::new(&shown, &beyond_rad_s, noise))
        };
        let probes: Vec<ProbeSide> = (0..count).filter_map(probe).collect();
        (!probes.is_empty()).then_some(Self { peak_rad_s, beyond_rad_s, sense, measured, probes })
    }

    /// Squares that are left beside the smooth response and this pattern.
    fn left_beside(&self, pattern: impl Fn(f64) -> C) -> f64 {
        let pattern: Vec<C> = self.beyond_rad_s.iter().map(|d| pattern(*d)).collect();
        self.probes.iter().map(|probe| probe.left_beside(&pattern)).sum()
    }

    /// Beats, if they explain these readings beyond doubt better than another resonance does.
    fn beats(&self) -> Option<Beats> {
        let last = *self.beyond_rad_s.last()?;
        let values: usize =
            self.probes.iter().map(|p| 2 * p.left.iter().filter(|y| **y != C::from(0.0)).count()).sum();
        let resonance = (0..=RESONANCES)
            .flat_map(|k| WIDTHS.map(|width| (last * k as f64 / RESONANCES as f64, width * self.peak_rad_s)))
            .map(|(at, width)| self.left_beside(|d| C::new(at - d, width).inv()))
            .fold(f64::INFINITY, f64::min);
        let best = self.vibrations().map(|v| (self.left_beside_vibration(&v), v.rate_rad_s2));
        let (left, rate_rad_s2) = best.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // one number more than the resonance
        let evidence = values as f64 * (resonance / left).ln() - (values as f64).ln();
        (evidence > -2.0 * NEGLIGIBLE.ln()).then(|| Beats {
            peak_rpm: rpm(self.peak_rad_s),
            rate_rpm_s: rpm(rate_rad_s2),
            evidence,
        })
    }

    /// The rate at which the machine turns once between one of the readings and the next: a reading takes no less.
    fn fastest_rad_s2(&self) -> f64 {
        let [first, last] = [self.beyond_rad_s[0], self.beyond_rad_s[self.beyond_rad_s.len() - 1]];
        let square = |beyond: f64| (self.peak_rad_s + self.sense * beyond).powi(2);
        let angle_by_rate = (square(last) - square(first)).abs() / 2.0;
        RATE_MARGIN * angle_by_rate / (2.0 * PI * (self.measured - 1) as f64)
    }

    /// Free vibrations that these readings could show.
    fn vibrations(&self) -> impl Iterator<Item = Vibration> {
        let (count, last) = (self.beyond_rad_s.len(), self.beyond_rad_s[self.beyond_rad_s.len() - 1]);
        let fastest = self.fastest_rad_s2();
        let of_beats = move |(decay, beats): (f64, f64)| {
            (0..=BEFORE_PEAK).map(move |step| {
                let roots = STEP_BEFORE_PEAK * step as f64;
                // (last + roots √α)² = 4πα beats
                let root = last / ((4.0 * PI * beats).sqrt() - roots);
                Vibration { rate_rad_s2: root * root, decay, before_rad_s: roots * root }
            })
        };
        let of_decay = move |decay: f64| {
            let least = FEWEST_BEATS * (decay / 2.0).max(1.0).powi(2);
            let most = count as f64 * decay / (2.0 * READINGS_OF_BEAT);
            let steps = ((most - least) / STEP_OF_BEATS).floor();
            (0..=steps as usize)
                .filter(move |_| steps >= 0.0)
                .map(move |k| (decay, least + STEP_OF_BEATS * k as f64))
        };
        DECAYS.into_iter().flat_map(of_decay).flat_map(of_beats).filter(move |v| v.rate_rad_s2 <= fastest)
    }

    /// Squares that are left beside the smooth response and this vibration.
    fn left_beside_vibration(&self, vibration: &Vibration) -> f64 {
        let Vibration { rate_rad_s2, decay, before_rad_s } = *vibration;
        let length = self.beyond_rad_s[self.beyond_rad_s.len() - 1] + before_rad_s;
        self.left_beside(|beyond| {
            let from_resonance = beyond + before_rad_s;
            let phase = from_resonance * from_resonance / (2.0 * rate_rad_s2);
            C::from_polar((-decay * from_resonance / length).exp(), -self.sense * phase)
        })
    }
}

impl ProbeSide {
    fn new(shown: &[Option<C>], beyond_rad_s: &[f64], noise: &Noise) -> Self {
        let weights: Vec<f64> = shown.iter().map(|y| y.map_or(0.0, |y| noise.sigma_m(y).recip())).collect();
        let last = beyond_rad_s[beyond_rad_s.len() - 1];
        let smooth = DMatrix::from_fn(beyond_rad_s.len(), POWERS + 2, |i, j| {
            let power =
                if j <= POWERS { (beyond_rad_s[i] / last).powi(j as i32) } else { last / beyond_rad_s[i] };
            C::from(weights[i] * power)
        });
        let smooth = smooth.qr().q();
        let all = shown.iter().zip(&weights).map(|(y, weight)| y.unwrap_or_default() * *weight);
        let all = DVector::from_iterator(beyond_rad_s.len(), all);
        let left = &all - &smooth * smooth.ad_mul(&all);
        Self { weights, smooth, left }
    }

    /// Squares that are left beside the smooth response and as much of this pattern as fits best.
    fn left_beside(&self, pattern: &[C]) -> f64 {
        let weighted = pattern.iter().zip(&self.weights).map(|(y, weight)| y * *weight);
        let mut pattern = DVector::from_iterator(self.weights.len(), weighted);
        pattern -= &self.smooth * self.smooth.ad_mul(&pattern);
        let size = pattern.norm_squared();
        if size == 0.0 {
            self.left.norm_squared()
        } else {
            self.left.norm_squared() - pattern.dotc(&self.left).norm_sqr() / size
        }
    }
}
