//! What an instrument does to readings while it fails.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use std::fmt;

use rotor_edge_desktop::machine::drawing::Noise;

use super::dice::Dice;
use super::machine::C;

/// Readings that an instrument can repeat, at most.
pub const LONGEST_LOOP: usize = 40;

/// A reading on its way from the machine to the monitor.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    pub speed_rpm: f64,
    /// m; `None` where the sender knows that the probe is lost.
    pub probes: Vec<Option<C>>,
}

/// What fails. Angles are phase lags in degrees, factors are of amplitudes unless they say otherwise; probes and bearings
/// count from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    // at all probes alike
    Angle(f64),
    /// Each reading turned by an angle of its own, up to this to either side.
    RandomAngle(f64),
    /// The reference takes steps of this standard deviation from reading to reading.
    AngleDiffuses(f64),
    /// Each reading has one of two marks that are so far apart.
    TwoMarks(f64),
    /// Phases are counted against the rotation.
    AnglesReversed,
    Scale(f64),
    /// Each reading has a factor of its own between 0 and 1: vectors averaged over a slipping reference.
    RandomScale,
    Zeros,
    /// Noise without any signal.
    OnlyNoise,
    /// Bit-identical vectors and speed, with fresh sequence numbers.
    Frozen,
    /// The same vectors at a speed that is still read.
    FrozenVectors,
    /// The last so many readings, over and over.
    Loop(usize),
    /// Noise as many times the stated one.
    Noise(f64),
    /// Noise of this part of each amplitude.
    NoisePart(f64),
    SpeedFactor(f64),
    /// All probes of two bearings are exchanged.
    BearingsExchanged([usize; 2]),

    // at one probe
    ProbeReversed(usize),
    ProbeGain(usize, f64),
    ProbeAngle(usize, f64),
    ProbeRandomAngle(usize),
    ProbeZero(usize),
    ProbeOnlyNoise(usize),
    ProbeLost(usize),
    /// Amplitude cut off at this part of the healthy one.
    ProbeClipped(usize, f64),
    /// A vector of this part of the healthy amplitude, at this angle, on top.
    ProbeOffset(usize, f64, f64),
    ProbeNoisePart(usize, f64),
    ProbeFrozen(usize),
    /// One probe shows what another sees.
    ProbeCopied {
        from: usize,
        to: usize,
    },

    // at two probes
    ProbesExchanged(usize, usize),
    PairScale([usize; 2], f64),
    PairAngle([usize; 2], f64),
}

impl Fault {
    /// Every probe alike is concerned, so that the readings may still fit the model.
    pub fn is_common(self) -> bool {
        use Fault::*;
        matches!(
            self,
            Angle(_)
                | RandomAngle(_)
                | AngleDiffuses(_)
                | TwoMarks(_)
                | AnglesReversed
                | Scale(_)
                | RandomScale
                | Zeros
                | OnlyNoise
                | Frozen
                | FrozenVectors
                | Loop(_)
                | SpeedFactor(_)
        )
    }

    /// The readings are old: wrong only once the machine has changed.
    pub fn is_stale(self) -> bool {
        matches!(self, Self::Frozen | Self::FrozenVectors | Self::Loop(_) | Self::ProbeFrozen(_))
    }

    /// By how much the unbalance changes under the model, relative to its size; none if the readings no longer fit.
    pub fn change(self) -> Option<f64> {
        match self {
            Self::Angle(deg) => Some(deg.to_radians().abs()),
            Self::Scale(factor) => Some((factor - 1.0).abs()),
            // near the bearing's plane it acts as its unbalance does
            Self::PairScale(_, factor) => Some((factor - 1.0).abs()),
            Self::PairAngle(_, deg) => Some(deg.to_radians().abs()),
            _ => None,
        }
    }
}

/// An instrument with what it remembers.
pub struct Instrument {
    noise: Noise,
    /// Without noise and fault, m.
    healthy_m: Vec<f64>,
    history: VecDeque<Measured>,
    frozen: Option<Measured>,
    replayed: usize,
    wandered: f64,
}

impl Instrument {
    /// `healthy_m`: amplitude at each probe before the fault.
    pub fn new(noise: Noise, healthy_m: Vec<f64>) -> Self {
        let history = VecDeque::with_capacity(LONGEST_LOOP);
        Self { noise, healthy_m, history, frozen: None, replayed: 0, wandered: 0.0 }
    }

    /// The reading as a sound instrument has it: with the stated noise.
    pub fn measure(&self, speed_rpm: f64, shown_m: &[C], dice: &mut Dice) -> Measured {
        let with_noise = |y: &C| Some(y + dice.normals() * self.noise.sigma_m(*y));
        Measured { speed_rpm, probes: shown_m.iter().map(with_noise).collect() }
    }

    /// Remembers a reading that the fault did not touch.
    pub fn remember(&mut self, measured: &Measured) {
        if self.history.len() == LONGEST_LOOP {
            self.history.pop_front();
        }
        self.history.push_back(measured.clone());
    }

    /// Spoils a reading; `strength` is above 0 and at most 1, less only while a slow fault grows.
    pub fn spoil(&mut self, fault: Fault, strength: f64, measured: &mut Measured, dice: &mut Dice) {
        let turn = |deg: f64| C::from_polar(1.0, -deg.to_radians());
        match fault {
            Fault::Angle(deg) => all(measured, turn(deg * strength)),
            Fault::RandomAngle(deg) => all(measured, turn(dice.between(-deg, deg))),
            Fault::AngleDiffuses(deg) => {
                self.wandered += deg * dice.normal();
                all(measured, turn(self.wandered));
            }
            Fault::TwoMarks(deg) => all(measured, turn(if dice.happens(0.5) { deg } else { 0.0 })),
            Fault::AnglesReversed => each(measured, |y| y.conj()),
            Fault::Scale(factor) => all(measured, C::from(factor.powf(strength))),
            Fault::RandomScale => all(measured, C::from(dice.between(0.0, 1.0))),
            Fault::Zeros => all(measured, C::from(0.0)),
            Fault::OnlyNoise => each(measured, |_| self.floor(dice)),
            Fault::Frozen => *measured = self.frozen(measured).clone(),
            Fault::FrozenVectors => measured.probes = self.frozen(measured).probes.clone(),
            Fault::Loop(length) => {
                let oldest = self.history.len() - length;
                *measured = self.history[oldest + self.replayed % length].clone();
                self.replayed += 1;
            }
            Fault::Noise(factor) => each(measured, |y| y + dice.normals() * self.noise.sigma_m(y) * factor),
            Fault::NoisePart(part) => each(measured, |y| y + dice.normals() * y.norm() * part),
            Fault::SpeedFactor(factor) => measured.speed_rpm *= factor.powf(strength),
            Fault::BearingsExchanged([a, b]) => {
                for axis in 0..2 {
                    measured.probes.swap(2 * a + axis, 2 * b + axis);
                }
            }
            _ => self.spoil_probes(fault, strength, measured, dice),
        }
    }

    fn spoil_probes(&mut self, fault: Fault, strength: f64, measured: &mut Measured, dice: &mut Dice) {
        let turn = |deg: f64| C::from_polar(1.0, -deg.to_radians());
        match fault {
            Fault::ProbeReversed(k) => one(measured, k, |y| -y),
            Fault::ProbeGain(k, factor) => one(measured, k, |y| y * factor.powf(strength)),
            Fault::ProbeAngle(k, deg) => one(measured, k, |y| y * turn(deg * strength)),
            Fault::ProbeRandomAngle(k) => one(measured, k, |y| C::from_polar(y.norm(), dice.angle())),
            Fault::ProbeZero(k) => one(measured, k, |_| C::from(0.0)),
            Fault::ProbeOnlyNoise(k) => one(measured, k, |_| self.floor(dice)),
            Fault::ProbeLost(k) => measured.probes[k] = None,
            Fault::ProbeClipped(k, part) => {
                let most_m = part * self.healthy_m[k];
                one(measured, k, |y| y * (most_m / y.norm()).min(1.0));
            }
            Fault::ProbeOffset(k, part, deg) => {
                one(measured, k, |y| y + part * strength * self.healthy_m[k] * turn(deg));
            }
            Fault::ProbeNoisePart(k, part) => one(measured, k, |y| y + dice.normals() * y.norm() * part),
            Fault::ProbeFrozen(k) => measured.probes[k] = self.frozen(measured).probes[k],
            Fault::ProbeCopied { from, to } => measured.probes[to] = measured.probes[from],
            Fault::ProbesExchanged(a, b) => measured.probes.swap(a, b),
            Fault::PairScale(pair, factor) => {
                pair.into_iter().for_each(|k| one(measured, k, |y| y * factor.powf(strength)));
            }
            Fault::PairAngle(pair, deg) => {
                pair.into_iter().for_each(|k| one(measured, k, |y| y * turn(deg * strength)));
            }
            _ => unreachable!("a fault of all probes"),
        }
    }

    fn frozen(&mut self, present: &Measured) -> &Measured {
        let last = || self.history.back().unwrap_or(present).clone();
        self.frozen.get_or_insert_with(last)
    }

    fn floor(&self, dice: &mut Dice) -> C {
        dice.normals() * self.noise.floor_um * 1e-6
    }
}

fn each(measured: &mut Measured, mut change: impl FnMut(C) -> C) {
    measured.probes.iter_mut().flatten().for_each(|y| *y = change(*y));
}

fn all(measured: &mut Measured, factor: C) {
    each(measured, |y| y * factor);
}

fn one(measured: &mut Measured, probe: usize, change: impl FnOnce(C) -> C) {
    if let Some(y) = &mut measured.probes[probe] {
        *y = change(*y);
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Angle(deg) => write!(f, "all turned by {deg:.0}°"),
            Self::RandomAngle(deg) => write!(f, "each reading turned by up to ±{deg:.0}°"),
            Self::AngleDiffuses(deg) => write!(f, "phase diffuses, {deg:.0}° a reading"),
            Self::TwoMarks(deg) => write!(f, "two marks {deg:.0}° apart"),
            Self::AnglesReversed => write!(f, "phases counted backwards"),
            Self::Scale(factor) => write!(f, "all × {factor:.3}"),
            Self::RandomScale => write!(f, "each reading × 0 to 1"),
            Self::Zeros => write!(f, "all zero"),
            Self::OnlyNoise => write!(f, "noise without signal"),
            Self::Frozen => write!(f, "frozen"),
            Self::FrozenVectors => write!(f, "frozen vectors, live speed"),
            Self::Loop(length) => write!(f, "loop of {length} readings"),
            Self::Noise(factor) => write!(f, "noise × {factor:.0}"),
            Self::NoisePart(part) => write!(f, "noise of {:.0} %", 100.0 * part),
            Self::SpeedFactor(factor) => write!(f, "speed × {factor:.3}"),
            Self::BearingsExchanged([a, b]) => write!(f, "bearings {a} and {b} exchanged"),
            Self::ProbeReversed(k) => write!(f, "probe {k} reversed"),
            Self::ProbeGain(k, factor) => write!(f, "probe {k} × {factor:.2}"),
            Self::ProbeAngle(k, deg) => write!(f, "probe {k} turned by {deg:.0}°"),
            Self::ProbeRandomAngle(k) => write!(f, "probe {k} at random angles"),
            Self::ProbeZero(k) => write!(f, "probe {k} zero"),
            Self::ProbeOnlyNoise(k) => write!(f, "probe {k} noise alone"),
            Self::ProbeLost(k) => write!(f, "probe {k} lost"),
            Self::ProbeClipped(k, part) => write!(f, "probe {k} clipped at {:.0} %", 100.0 * part),
            Self::ProbeOffset(k, part, deg) => {
                write!(f, "probe {k} offset {:.0} % at {deg:.0}°", 100.0 * part)
            }
            Self::ProbeNoisePart(k, part) => write!(f, "probe {k} noise of {:.0} %", 100.0 * part),
            Self::ProbeFrozen(k) => write!(f, "probe {k} frozen"),
            Self::ProbeCopied { from, to } => write!(f, "probe {to} shows probe {from}"),
            Self::ProbesExchanged(a, b) => write!(f, "probes {a} and {b} exchanged"),
            Self::PairScale([a, b], factor) => write!(f, "probes {a} and {b} × {factor:.2}"),
            Self::PairAngle([a, b], deg) => write!(f, "probes {a} and {b} turned by {deg:.0}°"),
        }
    }
}

/// When a fault acts, in readings since it began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    Permanent,
    /// Grows over so many readings and stays.
    Slow(usize),
    /// One reading of so many.
    OneOf(usize),
    /// All readings but one of so many.
    AllButOneOf(usize),
    /// So many readings, then as many without.
    Bursts(usize),
    /// Each reading with this probability.
    Sometimes(f64),
}

impl Course {
    /// Strength at a reading since the beginning, 0 to 1.
    pub fn strength(self, reading: usize, dice: &mut Dice) -> f64 {
        let acts = match self {
            Self::Permanent => true,
            Self::Slow(readings) => return ((reading + 1) as f64 / readings as f64).min(1.0),
            Self::OneOf(number) => reading.is_multiple_of(number),
            Self::AllButOneOf(number) => reading % number != number - 1,
            Self::Bursts(length) => (reading / length).is_multiple_of(2),
            Self::Sometimes(probability) => reading == 0 || dice.happens(probability),
        };
        f64::from(u8::from(acts))
    }
}

impl fmt::Display for Course {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Permanent => Ok(()),
            Self::Slow(readings) => write!(f, ", over {readings} readings"),
            Self::OneOf(number) => write!(f, ", one reading of {number}"),
            Self::AllButOneOf(number) => write!(f, ", {} readings of {number}", number - 1),
            Self::Bursts(length) => write!(f, ", bursts of {length}"),
            Self::Sometimes(probability) => write!(f, ", {:.0} % of readings", 100.0 * probability),
        }
    }
}

#[test]
fn stale_reading_is_last_one_and_loop_repeats() {
    let mut dice = Dice::new(1);
    let mut instrument = Instrument::new(Noise { relative: 0.1, ..Noise::default() }, vec![1.0]);
    let readings: Vec<Measured> =
        (0..5).map(|k| instrument.measure(k as f64, &[C::from(1.0)], &mut dice)).collect();
    readings.iter().for_each(|reading| instrument.remember(reading));
    let mut shown = |fault| {
        let mut measured = Measured { speed_rpm: 9.0, probes: vec![Some(C::from(PI))] };
        instrument.spoil(fault, 1.0, &mut measured, &mut dice);
        measured
    };
    assert_eq!((shown(Fault::Frozen), shown(Fault::Frozen)), (readings[4].clone(), readings[4].clone()));
    for k in [2, 3, 4, 2, 3] {
        assert_eq!(shown(Fault::Loop(3)), readings[k]);
    }
    assert_eq!(shown(Fault::Angle(TAU.to_degrees() / 2.0)).probes[0].unwrap().re, -PI);
}
