//! What a window holds beside 1x: its spectrum by order, and the vector at twice the running speed.
//!
//! Samples are taken as they are, each at the angle where the marks put it, and weighted by a Hann window over whole turns:
//! a harmonic is found exactly, and what lies between the harmonics stays within two lines of its place.

use std::f64::consts::TAU;

use nalgebra::Complex;
use rayon::prelude::*;
use rotor_edge_core::extraction::Outcome;

use super::channels::Assignment;
use super::mark::Mark;
use super::settings::Settings;
use super::windows::Window;

/// Spectra end here, or where the samples do.
const HIGHEST_ORDER: f64 = 4.0;
/// An order needs so many samples a period, as is usual with a filter before the converter.
const FEWEST_SAMPLES: f64 = 2.56;
/// So many spectra are kept of a file, evenly over its windows.
const MOST_SPECTRA: usize = 40;
/// Fewer turns do not keep harmonics apart under a Hann window, whose line is four lines wide.
pub const FEWEST_TURNS: u16 = 3;

/// The orders of one window.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// From the beginning of the file to the middle of the window, s.
    pub time_s: f64,
    pub speed_rpm: f64,
    /// Spectral lines per order.
    pub turns: u16,
    /// By probe, from order 0 on: the mean of `u e^{−iθ·order}`, µm; nothing where the probe is lost.
    pub probes: Vec<Option<Vec<Complex<f64>>>>,
}

/// Channels and the angle of the shaft.
pub struct AngularSamples<'a> {
    pub probes: &'a [Assignment<'a>],
    pub marks: &'a [Mark],
    pub rate_hz: f64,
    /// What a number of a channel stands for, in the unit of the settings.
    pub unit_per_number: f64,
    pub settings: &'a Settings,
}

/// A sample of a window.
struct WeightedSample {
    number: usize,
    /// Turns since the window began.
    turns: f64,
    /// Its part of the mean.
    weight: f64,
}

impl AngularSamples<'_> {
    /// The 2x vector of every probe in every window, `cos − i sin` in µm with the angle from the mark; none where the probe is
    /// lost.
    pub fn two_x(&self, windows: &[Window]) -> Vec<Vec<Option<Complex<f64>>>> {
        windows
            .par_iter()
            .map(|window| {
                let of_probe = |samples: &[WeightedSample], probe: usize| {
                    let line = 2 * usize::from(self.settings.revolutions);
                    2.0 * self.lines(window, samples, probe, line..line + 1)[0]
                };
                self.each(window, of_probe)
            })
            .collect()
    }

    /// Spectra of windows evenly over the file.
    pub fn spectra(&self, windows: &[Window]) -> Vec<Spectrum> {
        let usable: Vec<&Window> = windows.iter().filter(|w| w.outcome == Outcome::Measured).collect();
        let number = usable.len().min(MOST_SPECTRA);
        let chosen = (0..number).map(|i| usable[i * usable.len() / number]);
        chosen
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|window| {
                let turns = self.settings.revolutions;
                let speed_rpm = f64::from(window.speed_rpm);
                let highest = HIGHEST_ORDER.min(60.0 * self.rate_hz / speed_rpm / FEWEST_SAMPLES);
                let lines = (highest * f64::from(turns)) as usize + 1;
                let half_s = 30.0 * f64::from(turns) / speed_rpm;
                Spectrum {
                    time_s: window.sample as f64 / self.rate_hz - half_s,
                    speed_rpm,
                    turns,
                    probes: self.each(window, |samples, probe| self.lines(window, samples, probe, 0..lines)),
                }
            })
            .collect()
    }

    fn each<T>(&self, window: &Window, of: impl Fn(&[WeightedSample], usize) -> T) -> Vec<Option<T>> {
        let samples = match window.outcome {
            Outcome::Measured => self.samples(window),
            _ => None,
        };
        let is_seen = |probe: usize| !window.probes[probe].is_clipped && !window.probes[probe].is_open;
        (0..self.probes.len())
            .map(|probe| samples.as_ref().filter(|_| is_seen(probe)).map(|samples| of(samples, probe)))
            .collect()
    }

    /// The samples between the marks of a window.
    fn samples(&self, window: &Window) -> Option<Vec<WeightedSample>> {
        let turns = usize::from(self.settings.revolutions);
        let last = self.marks.binary_search_by_key(&window.sample, |mark| mark.sample).ok()?;
        let marks: Vec<f64> = self.marks[last.checked_sub(turns)?..=last].iter().map(|m| m.at()).collect();
        let mut samples = Vec::new();
        for (turn, ends) in marks.windows(2).enumerate() {
            let length = ends[1] - ends[0];
            // the speed changes over the turn as it does from the turn before to the turn after
            let before = if turn > 0 { ends[0] - marks[turn - 1] } else { length };
            let after = marks.get(turn + 2).map_or(length, |next| next - ends[1]);
            let rise = 0.5 * (before - after) / length;
            for number in ends[0].ceil() as usize..ends[1].ceil() as usize {
                let part = (number as f64 - ends[0]) / length;
                let turned = turn as f64 + part + 0.5 * rise * part * (part - 1.0);
                let hann = 1.0 - (TAU * turned / turns as f64).cos();
                let weight = hann * (1.0 + rise * (part - 0.5)) / length;
                samples.push(WeightedSample { number, turns: turned, weight });
            }
        }
        let sum: f64 = samples.iter().map(|sample| sample.weight).sum();
        samples.iter_mut().for_each(|sample| sample.weight /= sum);
        Some(samples)
    }

    /// `mean(u e^{−iθ·line/turns})`, µm.
    fn lines(
        &self,
        window: &Window,
        samples: &[WeightedSample],
        probe: usize,
        lines: std::ops::Range<usize>,
    ) -> Vec<Complex<f64>> {
        let turns = f64::from(self.settings.revolutions);
        let Assignment { channel, mv_um, .. } = &self.probes[probe];
        let um_per_number = self.unit_per_number * self.settings.unit().mv() / f64::from(*mv_um);
        let mut means = vec![Complex::default(); lines.len()];
        let mean: f64 = samples.iter().map(|s| s.weight * channel.samples.at(s.number)).sum();
        for sample in samples {
            let angle = |line: f64| Complex::from_polar(1.0, -TAU * sample.turns * line / turns);
            let (step, mut at) = (angle(1.0), angle(lines.start as f64));
            // without the gap, whose line would cover its neighbours
            let value = sample.weight * (channel.samples.at(sample.number) - mean);
            for mean in &mut means {
                *mean += value * at;
                at *= step;
            }
        }
        for (line, mean) in lines.zip(&mut means) {
            let speed_rpm = f64::from(window.speed_rpm) * line as f64 / turns;
            let integral = match line {
                0 => None,
                _ => self.settings.unit().integral(speed_rpm),
            };
            *mean *= integral.unwrap_or(Complex::new(1.0, 0.0)) * um_per_number;
        }
        means
    }
}
