//! Random numbers of the generator: drift, wander, and when the machine is looked at.

use std::f64::consts::TAU;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ContinuousCDF, Normal};

use super::generator::{Plan, Schedule, USUAL_DEGC};

/// Days over which a drift is smooth.
const SMOOTH_DAYS: usize = 9;

/// Random numbers, and the paths that are made of them.
pub struct Random {
    bits: Xoshiro256PlusPlus,
    normal: Normal,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { bits: Xoshiro256PlusPlus::seed_from_u64(seed), normal: Normal::standard() }
    }

    pub fn uniform(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn normal(&mut self) -> f64 {
        let inside = self.uniform().clamp(1e-15, 1.0 - 1e-15);
        self.normal.inverse_cdf(inside)
    }

    /// Sum over the days of a smooth random rate of this standard deviation.
    pub fn drift(&mut self, days: usize, sd: f64) -> Vec<f64> {
        let window: Vec<f64> =
            (1..=SMOOTH_DAYS).map(|i| 1.0 - (TAU * i as f64 / (SMOOTH_DAYS + 1) as f64).cos()).collect();
        let norm = window.iter().map(|w| w * w).sum::<f64>().sqrt();
        let pushes: Vec<f64> = (0..days + SMOOTH_DAYS).map(|_| self.normal()).collect();
        let rate = |d: usize| window.iter().zip(&pushes[d..]).map(|(w, p)| w * p).sum::<f64>() * sd / norm;
        let mut at = 0.0;
        (0..days)
            .map(|d| {
                at += rate(d);
                at
            })
            .collect()
    }

    /// A process that returns to zero over ten days, of this standard deviation.
    pub fn wander(&mut self, moments: &[Moment], sd: f64) -> Vec<f64> {
        let (mut at, mut last_d) = (0.0, -1.0);
        let mut step = |moment: &Moment| {
            let keep = ((last_d - moment.time_d) / 10.0).exp();
            at = keep * at + (1.0 - keep * keep).sqrt() * sd * self.normal();
            last_d = moment.time_d;
            at
        };
        moments.iter().map(&mut step).collect()
    }

    /// Temperature of the oil: a year's swing, weather of days, and a scatter from reading to reading, °C.
    pub fn temperature(&mut self, moments: &[Moment]) -> Vec<f64> {
        let begin_rad = TAU * self.uniform();
        let weather = self.wander(moments, 3.0);
        let mut at = |(moment, weather): (&Moment, f64)| {
            let year = 7.0 * (TAU * moment.time_d / 365.0 + begin_rad).sin();
            USUAL_DEGC + year + weather + self.normal()
        };
        moments.iter().zip(weather).map(&mut at).collect()
    }

    /// When the machine is looked at, and how fast it turns then.
    pub fn moments(&mut self, plan: &Plan) -> Vec<Moment> {
        let last_d = plan.days as f64;
        let daily = |day: usize| Moment { time_d: day as f64, speed: 1.0 };
        let mut all = Vec::new();
        match plan.schedule {
            Schedule::Daily => all.extend((0..plan.days).map(daily)),
            Schedule::Irregular => {
                let mut time_d = 0.0;
                while time_d < last_d {
                    all.push(Moment { time_d, speed: 1.0 });
                    time_d += (0.014_f64.ln() + 214_f64.ln() * self.uniform()).exp();
                }
            }
            Schedule::Speeds => {
                let (mut speed, mut until) = (1.0, 30.0);
                for day in 0..plan.days {
                    let time_d = day as f64;
                    all.push(Moment { time_d, speed });
                    if time_d >= until {
                        speed = [0.8, 0.9, 1.0][self.between(0.0, 2.999) as usize];
                        all.push(Moment { time_d: time_d + 0.3, speed });
                        until += self.between(5.0, 25.0).round();
                    }
                }
            }
            Schedule::Stops => {
                let mut day = 0;
                while day < plan.days {
                    let runs = self.between(20.0, 90.0) as usize;
                    all.extend((day..(day + runs).min(plan.days)).map(daily));
                    day += runs + self.between(4.0, 30.0) as usize;
                }
            }
        }
        all
    }
}

/// A time of the record, days since it began, and the speed then as a share of the machine's.
pub struct Moment {
    pub time_d: f64,
    pub speed: f64,
}
