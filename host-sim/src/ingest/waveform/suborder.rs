//! Whether the shaft turns more slowly than its marks come: vibration at a whole part of their frequency.

use std::f64::consts::TAU;
use std::fmt;

use nalgebra::Complex;

use super::channels::Assignment;
use super::mark::Mark;
use super::orders::AngularSamples;
use crate::ingest::samples::Samples;

/// Pulses a turn that are looked for besides those that a wheel's gap names.
const USUAL: [usize; 6] = [2, 3, 4, 5, 6, 8];
/// Periods of the part that are looked at, at most and at least.
const PERIODS: [usize; 2] = [64, 8];
/// Lines on either side of the part's that a sharp line stands out of, and by how much.
const BESIDE: [usize; 3] = [3, 4, 5];
const SHARP: f64 = 3.0;
/// The same for wheels, of which so many are tried that noise would stand out of six lines by three now and then: by ten it
/// does so once in 10⁹ lines.
const SHARP_WHEEL: f64 = 10.0;
/// From this part of 1x on, a doubt is told; from the whole on, nothing is written.
const DOUBT: f64 = 0.3;
/// Teeth of a wheel that are looked for, at most, and the marks that are looked at.
const MOST_TEETH: usize = 512;
const MOST_MARKS: usize = 8192;

/// Vibration at a whole part of the marks' frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suborder {
    /// How many marks make one period of it.
    pub marks: usize,
    /// Its amplitude as a part of that at the marks' frequency.
    pub ratio: f64,
}

impl Suborder {
    /// Whether it is so large that it is rather the shaft's own speed.
    pub fn is_rather_1x(self) -> bool {
        self.ratio >= 1.0
    }
}

impl fmt::Display for Suborder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { marks, ratio } = self;
        write!(
            f,
            "the vibration at 1/{marks} of the marks' frequency is {ratio:.2} times that at it, as if there were {marks} \
             marks a turn"
        )
    }
}

/// The largest of them, if one is worth a doubt; `gap_every` are the marks from one gap to the next.
pub fn strongest(samples: &AngularSamples, gap_every: Option<usize>) -> Option<Suborder> {
    let each = USUAL.into_iter().chain(gap_every.filter(|marks| *marks > 1));
    let found = each.filter_map(|marks| Some(Suborder { marks, ratio: ratio(samples, marks, SHARP)? }));
    let found = found.filter(|s| s.ratio >= DOUBT).chain(wheel(samples));
    found.reduce(|a, b| if b.ratio > a.ratio { b } else { a })
}

/// The wheel whose turn the vibration shows, if that is larger than at the frequency of the marks.
fn wheel(samples: &AngularSamples) -> Option<Suborder> {
    let each = || (USUAL[USUAL.len() - 1] + 1)..=MOST_TEETH;
    let amplitudes = samples.at_parts(each());
    let found = |marks: usize| {
        let ratio = ratio(samples, marks, SHARP_WHEEL).filter(|ratio| *ratio >= 1.0)?;
        Some(Suborder { marks, ratio })
    };
    // the noise of an integrated acceleration grows towards low frequencies
    let largest = |power: i32| {
        let weighted = each().zip(&amplitudes).map(|(marks, a)| (marks, a * (marks as f64).powi(power)));
        weighted.reduce(|a, b| if b.1 > a.1 { b } else { a }).and_then(|(marks, _)| found(marks))
    };
    let strongest = largest(0).or_else(|| largest(1)).or_else(|| largest(2))?;
    // 2x and 3x may be larger than the line at the turn
    let slower = [3, 2].into_iter().filter_map(|times| found(times * strongest.marks));
    Some({ slower }.find(|slower| slower.ratio >= DOUBT * strongest.ratio).unwrap_or(strongest))
}

/// Amplitude at the part as one of that at the marks' frequency, all probes together; nothing where there is no sharp line.
fn ratio(samples: &AngularSamples, marks: usize, sharp: f64) -> Option<f64> {
    let turns = samples.marks.len().checked_sub(1)?;
    let [most, least] = PERIODS;
    let periods = (turns / marks).min(most);
    if periods < least {
        return None;
    }
    let whole = periods * marks;
    let first = (turns - whole) / 2;
    let ends: Vec<f64> = samples.marks[first..=first + whole].iter().map(|mark| mark.at()).collect();
    let [a, b, c] = BESIDE;
    let lines =
        [periods, whole, periods - a, periods - b, periods - c, periods + a, periods + b, periods + c];
    let [at, first_order, beside @ ..] = samples.amplitudes_um(&ends, lines);
    let is_sharp = beside.iter().all(|other| at > sharp * other);
    (is_sharp && first_order > 0.0).then(|| at / first_order)
}

impl AngularSamples<'_> {
    /// Amplitudes of all probes together at parts of the marks' frequency as the channels show them, up to a common factor, by
    /// the mean between each two marks; zero where there are not the fewest periods.
    fn at_parts(&self, parts: impl Iterator<Item = usize>) -> Vec<f64> {
        let number = self.marks.len().saturating_sub(1).min(MOST_MARKS);
        let first = (self.marks.len() - number.min(self.marks.len())) / 2;
        let marks = &self.marks[first..(first + number + 1).min(self.marks.len())];
        let means: Vec<Vec<f64>> =
            self.probes.iter().map(|probe| means(&probe.channel.samples, marks)).collect();
        let amplitude = |marks: usize| {
            if number < PERIODS[1] * marks {
                return 0.0;
            }
            let of_probe = |(means, assigned): (&Vec<f64>, &Assignment)| {
                let step = Complex::from_polar(1.0, -TAU / marks as f64);
                let mut at = Complex::new(1.0, 0.0);
                let mut sum = Complex::<f64>::default();
                for mean in means {
                    sum += *mean * at;
                    at *= step;
                }
                sum.norm() / f64::from(assigned.mv_um).abs()
            };
            means.iter().zip(self.probes).map(of_probe).sum::<f64>()
        };
        parts.map(amplitude).collect()
    }

    /// Amplitudes of all probes together at some lines of a spectrum over the turns between marks, up to a common factor.
    fn amplitudes_um<const N: usize>(&self, ends: &[f64], lines: [usize; N]) -> [f64; N] {
        let turns = (ends.len() - 1) as f64;
        let speed_rpm = 60.0 * self.rate_hz * turns / (ends[ends.len() - 1] - ends[0]);
        let mut sums = [0.0; N];
        for assigned in self.probes {
            let channel = &assigned.channel.samples;
            let from = ends[0].ceil() as usize;
            let to = (ends[ends.len() - 1].ceil() as usize).min(channel.len());
            let mean = (from..to).map(|n| channel.at(n)).sum::<f64>() / (to - from) as f64;
            let mut phasors = [Complex::<f64>::default(); N];
            for (turn, pair) in ends.windows(2).enumerate() {
                let part = |n: f64| (turn as f64 + (n - pair[0]) / (pair[1] - pair[0])) / turns;
                let (begin, end) = (pair[0].ceil() as usize, (pair[1].ceil() as usize).min(to));
                let angle = |part: f64, line: usize| Complex::from_polar(1.0, -TAU * part * line as f64);
                let mut at = lines.map(|line| angle(part(begin as f64), line));
                let steps = lines.map(|line| angle(1.0 / (turns * (pair[1] - pair[0])), line));
                for n in begin..end {
                    let value = (1.0 - (TAU * part(n as f64)).cos()) * (channel.at(n) - mean);
                    for ((phasor, at), step) in phasors.iter_mut().zip(&mut at).zip(steps) {
                        *phasor += value * *at;
                        *at *= step;
                    }
                }
            }
            for ((sum, phasor), line) in sums.iter_mut().zip(phasors).zip(lines) {
                let integral = self.settings.unit().integral(speed_rpm * line as f64 / turns);
                *sum += phasor.norm() * integral.map_or(1.0, |factor| factor.norm())
                    / f64::from(assigned.mv_um).abs();
            }
        }
        sums
    }
}

/// The means of a channel between marks, without their own mean and under a Hann window.
fn means(samples: &Samples, marks: &[Mark]) -> Vec<f64> {
    let between = |pair: &[Mark]| {
        let from = pair[0].sample.min(samples.len().saturating_sub(1));
        let to = pair[1].sample.clamp(from + 1, samples.len().max(from + 1));
        (from..to).map(|n| samples.at(n)).sum::<f64>() / (to - from) as f64
    };
    let all: Vec<f64> = marks.windows(2).map(between).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let hann = |at: usize| 1.0 - (TAU * (at as f64 + 0.5) / all.len() as f64).cos();
    all.iter().enumerate().map(|(at, value)| hann(at) * (value - mean)).collect()
}
