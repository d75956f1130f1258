//! A run that sweeps too fast for its response to be that of a steady speed.
//!
//! A mass off its axis by u, turned through θ(t) with `θ' = Ω` and `θ'' = α`, drives the shaft by what it would at a steady
//! speed, with the transfer H(Ω) from `u e^{iθ}` to a probe. In the convolution with its impulse response h the past angle is
//! `θ − Ωτ + ατ²/2 − …`, so the amplitude beside `e^{iθ}` is
//! `∫ h e^{−iΩτ} (1 + iατ²/2 + …) dτ u = (H − (iα/2) d²H/dΩ² + …) u`: the second term is the lag. Passing one mode of damping
//! ratio ζ at ω, `H ∝ 1/(ω − Ω + iζω)`, it is `−iα/(ω − Ω + iζω)²` of the response: a phase of at most `α/(ζω)²` rad, at
//! resonance, and at most `(3√3/8) α/(ζω)²` of the amplitude, beside it. A run is quasi-steady where `α ≪ (ζω)²` (Lewis,
//! *Vibration during acceleration through a critical speed*, Trans. ASME 54, 1932).

use crate::units::SECONDS_A_DAY;
use nalgebra::{Complex, DVector};

use crate::machine::drawing::{Noise, Plane, Rotor};
use crate::measurement::Reading;
use crate::model::Model;
use crate::reduction::basis;
use crate::reduction::sizes::SIMULATED;
use crate::unbalance::phasor_kg_m;
use crate::units::rpm;

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
    pub remark: String,
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
        let mut worst = (0.0, 0, C::from(0.0));
        let mut largest = vec![(0.0_f64, 0.0_f64); fitted.probe.len()];
        for (row, reading) in readings.iter().enumerate() {
            for (p, y) in reading.probes.iter().enumerate().filter_map(|(p, y)| y.map(|y| (p, y))) {
                let lag = lag_m[row][p];
                let in_noise = (lag.norm() / noise.sigma_m(y)).powi(2);
                chi2 += in_noise;
                values += 2;
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
        let rate = rpm(rates.iter().fold(0.0, |most, rate| rate.abs().max(most)));
        let remark = format!(
            "The speed changes by up to {rate:.0} rpm a second, too fast for a steady response: at {:.0} rpm it is off by about \
             {:.0} % and {:.0}°. Below {:.1} rpm a second the noise hides that.",
            readings[row].speed_rpm,
            100.0 * relative.re.abs(),
            relative.im.abs().to_degrees(),
            rate * (hidden / chi2).sqrt()
        );
        let small = largest.iter().all(|(lag, shown)| *lag <= FIRST_ORDER * shown);
        Some(Self { lag_m, small, remark })
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
mod tests {
    use super::*;
    use crate::diagnose::{DiagnosisVerdict, best_fit, diagnose, improve};
    use crate::rotor_file;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    /// One mass on a light stiff shaft between two equal bearings: ω = 300 rad/s, ζ = 0.05.
    const MACHINE: &str = r#"
schema = 2
name = "one mass"
noise = { relative = 0.01, floor_um = 0.05 }
shaft = [{ length_m = 0.4, outer_diameter_m = 0.3, density_kg_m3 = 100, youngs_modulus_pa = 1e13 }]
disk = [{ name = "mass", position_m = 0.2, mass_kg = 47.486725877, diametral_inertia_kg_m2 = 0.1, polar_inertia_kg_m2 = 0.1 }]
bearing = [
  { name = "A", position_m = 0.0, stiffness_n_m = { xx = 2.264e6, yy = 2.264e6 }, damping_n_s_m = { xx = 754.7, yy = 754.7 } },
  { name = "B", position_m = 0.4, stiffness_n_m = { xx = 2.264e6, yy = 2.264e6 }, damping_n_s_m = { xx = 754.7, yy = 754.7 } },
]
probe = [
  { name = "AX", bearing = "A", position_m = 0.0, angle_deg = 0 },
  { name = "AY", bearing = "A", position_m = 0.0, angle_deg = 90 },
  { name = "BX", bearing = "B", position_m = 0.4, angle_deg = 0 },
  { name = "BY", bearing = "B", position_m = 0.4, angle_deg = 90 },
]
plane = [{ name = "mass", position_m = 0.2, unbalance_g_mm = 500, angle_deg = 40 }]
"#;

    /// Mass with the shaft's 2.827 kg, stiffness and damping of both bearings.
    const MASS_KG: f64 = 50.314_159_265;
    const STIFFNESS: f64 = 2.0 * 2.264e6;
    const DAMPING: f64 = 2.0 * 754.7;

    /// The mass swept from 150 to 500 rad/s, its motion beside the turning angle: Runge and Kutta's fourth order.
    fn swept(rate: f64, speeds: &[f64]) -> Vec<C> {
        let u = phasor_kg_m(500.0, 40.0) / MASS_KG;
        let begin = 120.0;
        let acceleration = |t: f64, a: C, v: C| {
            let w = begin + rate * t;
            let (i, k, c) = (C::i(), STIFFNESS / MASS_KG, DAMPING / MASS_KG);
            u * C::new(w * w, -rate) - v * (2.0 * w * i + c) - a * (k - w * w + i * (w * c + rate))
        };
        // from the steady state
        let (k, c) = (STIFFNESS / MASS_KG, DAMPING / MASS_KG);
        let mut a = u * begin * begin / C::new(k - begin * begin, c * begin);
        let (mut v, mut t) = (C::from(0.0), 0.0);
        let mut seen = Vec::new();
        for speed in speeds {
            let until = (speed - begin) / rate;
            let steps = ((until - t) / 5e-4).ceil();
            let h = (until - t) / steps;
            for _ in 0..steps as usize {
                let k1 = (v, acceleration(t, a, v));
                let k2 = (
                    v + k1.1 * (h / 2.0),
                    acceleration(t + h / 2.0, a + k1.0 * (h / 2.0), v + k1.1 * (h / 2.0)),
                );
                let k3 = (
                    v + k2.1 * (h / 2.0),
                    acceleration(t + h / 2.0, a + k2.0 * (h / 2.0), v + k2.1 * (h / 2.0)),
                );
                let k4 = (v + k3.1 * h, acceleration(t + h, a + k3.0 * h, v + k3.1 * h));
                a += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
                v += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
                t += h;
            }
            seen.push(a);
        }
        seen
    }

    fn readings(rate: f64, noisy: bool) -> Vec<Reading> {
        let speeds: Vec<f64> = (0..60).map(|k| 150.0 + 350.0 * f64::from(k) / 59.0).collect();
        let mut random = StdRng::seed_from_u64(11);
        let mut shown = |y: C| {
            let sigma_m = if noisy { 0.01 * y.norm() + 0.05e-6 } else { 0.0 };
            let mut part = || sigma_m * random.sample::<f64, _>(StandardNormal);
            Some(y + C::new(part(), part()))
        };
        let seen = swept(rate, &speeds);
        let row = |(w, a): (&f64, &C)| Reading {
            time_d: Some(w / rate / SECONDS_A_DAY),
            speed_rpm: rpm(*w),
            // forward: y is x a quarter turn later
            probes: [*a, -C::i() * a, *a, -C::i() * a].map(&mut shown).to_vec(),
            ..Reading::default()
        };
        speeds.iter().zip(&seen).map(row).collect()
    }

    fn machine() -> Rotor {
        rotor_file::parse("rotor.toml", MACHINE).unwrap()
    }

    #[test]
    fn sweep_lag_equals_time_integration_to_second_order() {
        let rotor = machine();
        let steady = |w: f64| {
            let u = phasor_kg_m(500.0, 40.0) / MASS_KG;
            u * w * w / C::new(STIFFNESS / MASS_KG - w * w, w * DAMPING / MASS_KG)
        };
        // (ζω)² = 225 rad/s²
        for rate in [2.0, 8.0] {
            let swept = readings(rate, false);
            let lags = lags_m(&rotor, &swept, &rates_rad_s2(&swept));
            let largest = lags.iter().map(|l| l[0].norm()).fold(0.0, f64::max);
            for (swept, lag) in swept.iter().zip(&lags) {
                let off = swept.probes[0].unwrap() - steady(swept.speed_rad_s()) - lag[0];
                // the next term of the series, −(α²/8) d⁴H/dΩ⁴, is 3α/(ζω)² of it at resonance; a tenth of that for the rest
                let next = 3.3 * rate / 225.0;
                assert!(off.norm() < next * largest, "{rate}: {:.4} of {next:.4}", off.norm() / largest);
            }
        }
    }

    #[test]
    fn slow_sweep_is_adequate_and_fast_sweep_claims_no_cause() {
        let rotor = machine();
        let slow = diagnose(&rotor, &readings(0.5, true)).unwrap();
        assert_eq!(slow.verdict, DiagnosisVerdict::Adequate, "{}", slow.summary);
        let about = |remarks: &[String]| remarks.iter().filter(|r| r.contains("too fast")).count();
        assert_eq!(about(&slow.remarks), 0, "{:?}", slow.remarks);
        for rate in [30.0, 150.0] {
            let readings = readings(rate, true);
            let fast = diagnose(&rotor, &readings).unwrap();
            assert!(
                !matches!(fast.verdict, DiagnosisVerdict::Missing | DiagnosisVerdict::Unknown),
                "{rate}: {}",
                fast.summary
            );
            assert!(fast.too_fast, "{rate}: {}", fast.summary);
            assert_eq!(about(&fast.remarks), 1, "{rate}: {:?}", fast.remarks);
            assert!(improve(&rotor, &readings, |_| {}).unwrap().steps.is_empty());
            assert_eq!(about(&best_fit(&rotor, &readings).unwrap().remarks), 1);
        }
    }
}
