use super::beats::Beats;
use super::*;
use crate::diagnose::{DiagnosisVerdict, TooFast, best_fit, diagnose, improve};
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

/// The mass on bearings of this damping swept over these speeds, rad/s, its motion beside the turning angle: Runge and Kutta's fourth order.
fn swept(rate: f64, damping: f64, speeds: &[f64]) -> Vec<C> {
    let u = phasor_kg_m(500.0, 40.0) / MASS_KG;
    let begin = speeds[0] - 30.0 * rate.signum();
    let acceleration = |t: f64, a: C, v: C| {
        let w = begin + rate * t;
        let (i, k, c) = (C::i(), STIFFNESS / MASS_KG, damping / MASS_KG);
        u * C::new(w * w, -rate) - v * (2.0 * w * i + c) - a * (k - w * w + i * (w * c + rate))
    };
    // from the steady state
    let (k, c) = (STIFFNESS / MASS_KG, damping / MASS_KG);
    let mut a = u * begin * begin / C::new(k - begin * begin, c * begin);
    let (mut v, mut t) = (C::from(0.0), 0.0);
    let mut seen = Vec::new();
    for speed in speeds {
        let until = (speed - begin) / rate;
        let steps = ((until - t) / 5e-4).ceil();
        let h = (until - t) / steps;
        for _ in 0..steps as usize {
            let k1 = (v, acceleration(t, a, v));
            let k2 =
                (v + k1.1 * (h / 2.0), acceleration(t + h / 2.0, a + k1.0 * (h / 2.0), v + k1.1 * (h / 2.0)));
            let k3 =
                (v + k2.1 * (h / 2.0), acceleration(t + h / 2.0, a + k2.0 * (h / 2.0), v + k2.1 * (h / 2.0)));
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
    readings_at(rate, DAMPING, &speeds(60), noisy)
}

/// So many from 150 to 500 rad/s.
fn speeds(count: u32) -> Vec<f64> {
    (0..count).map(|k| 150.0 + 350.0 * f64::from(k) / f64::from(count - 1)).collect()
}

fn readings_at(rate: f64, damping: f64, speeds: &[f64], noisy: bool) -> Vec<Reading> {
    let mut random = StdRng::seed_from_u64(11);
    let mut shown = |y: C| {
        let sigma_m = if noisy { 0.01 * y.norm() + 0.05e-6 } else { 0.0 };
        let mut part = || sigma_m * random.sample::<f64, _>(StandardNormal);
        Some(y + C::new(part(), part()))
    };
    let seen = swept(rate, damping, speeds);
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
            // the next term of the series, −(α²/8) d⁴H/dΩ⁴, is 3α/(ζω)² of the lag at resonance; later terms have a tenth of that
            let next = 3.3 * rate / 225.0;
            assert!(off.norm() < next * largest, "{rate}: {:.4} of {next:.4}", off.norm() / largest);
        }
    }
}

fn about(remarks: &[String]) -> Vec<&String> {
    remarks.iter().filter(|r| r.contains("too fast")).collect()
}

#[test]
fn slow_sweep_is_steady() {
    let (rotor, readings) = (machine(), readings(0.5, true));
    let slow = diagnose(&rotor, &readings).unwrap();
    assert_eq!(slow.verdict, DiagnosisVerdict::Adequate, "{}", slow.summary);
    assert!(about(&slow.remarks).is_empty(), "{:?}", slow.remarks);
}

#[test]
fn fast_sweep_is_fitted_as_transient() {
    // what it is fitted from is a third off
    let rotor =
        rotor_file::parse("off.toml", &MACHINE.replace("2.264e6", "3.0e6").replace("754.7", "500")).unwrap();
    for rate in [8.0, 30.0, 150.0] {
        let readings = readings(rate, true);
        let fast = diagnose(&rotor, &readings).unwrap();
        assert_eq!(fast.verdict, DiagnosisVerdict::Adequate, "{rate}: {}", fast.summary);
        assert!(fast.too_fast.is_none() && fast.chi2_per_value < 1.2, "{rate}: {}", fast.chi2_per_value);
        let remarks = about(&fast.remarks);
        assert!(remarks.len() == 1 && remarks[0].contains("by the times"), "{rate}: {remarks:?}");
        let best = best_fit(&rotor, &readings).unwrap();
        assert_eq!(about(&best.remarks).len(), 1);
        let found = &best.determined.planes[0];
        let [least, most] = found.interval_95_g_mm;
        assert!(least < 500.0 && most > 500.0 && most - least < 100.0, "{rate}: {least} to {most}");
        assert!((found.angle_deg - 40.0).abs() < found.angle_95_deg.min(5.0), "{rate}: {}", found.angle_deg);
        for b in &fast.bearings {
            let truth = if b.unit.contains('s') { DAMPING / 2.0 } else { STIFFNESS / 2.0 };
            let [least, most] = b.interval_95.unwrap();
            assert!(least < truth && truth < most, "{rate} {} {}: {least} to {most}", b.bearing, b.symbol);
            assert!((b.value / truth - 1.0).abs() < 0.1, "{rate} {} {}: {}", b.bearing, b.symbol, b.value);
        }
    }
}

/// Runout is the same at every speed, and no transient.
#[test]
fn hidden_runout_is_found_in_fast_sweep() {
    let mut readings = readings(30.0, true);
    let runout_m = C::new(2e-6, -3e-6);
    readings.iter_mut().flat_map(|r| r.probes[1].as_mut()).for_each(|y| *y += runout_m);
    let found = diagnose(&machine(), &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    assert_eq!(found.candidates[0].effect, "runout", "{}", found.summary);
    for (probe, parameter) in found.candidates[0].parameters.iter().enumerate() {
        let truth = if probe == 1 { [runout_m.re, runout_m.im] } else { [0.0; 2] };
        for (truth, [least, most]) in truth.iter().zip(&parameter.interval_95) {
            assert!(least < truth && truth < most && most - least < 0.3e-6, "{probe}: {least} to {most}");
        }
    }
}

/// Where the times are not known nothing is claimed, as nothing is known of the sweep either.
#[test]
fn fast_sweep_whose_times_contradict_claims_no_cause() {
    let rotor = machine();
    let mut readings = readings(30.0, true);
    readings[20].time_d = readings[19].time_d;
    let fast = diagnose(&rotor, &readings).unwrap();
    assert_eq!(fast.too_fast, Some(TooFast::Times), "{}", fast.summary);
    assert_eq!(about(&fast.remarks).len(), 1, "{:?}", fast.remarks);
    assert!(improve(&rotor, &readings, |_| {}).unwrap().steps.is_empty());
}

/// What no known effect explains may be a speed that did not change evenly, so that it is no unknown cause of the machine either.
#[test]
fn unexplained_part_of_transient_claims_no_cause() {
    let rotor = machine();
    let mut readings = readings(30.0, true);
    for r in &mut readings {
        let wave = C::from_polar(5e-6, r.speed_rad_s() / 12.0);
        r.probes.iter_mut().take(2).flatten().for_each(|y| *y += wave);
    }
    let found = diagnose(&rotor, &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Undecided, "{}", found.summary);
    assert!(
        found.too_fast == Some(TooFast::Times) && found.unknown.is_none() && found.named().is_none(),
        "{}",
        found.summary
    );
    assert!(found.summary.ends_with("No effect is claimed."), "{}", found.summary);
    let outcome = improve(&rotor, &readings, |_| {}).unwrap();
    assert_eq!(outcome.verdict, DiagnosisVerdict::Undecided, "{}", outcome.summary);
    assert!(outcome.steps.is_empty() && outcome.unknown.is_none());
}

/// A run up or down without times, ζ = 0.01, at 150 rad/s²: five beats until the free vibration has decayed to e⁻². Every reading takes a
/// turn at least, so that there are fewer where it turns more slowly.
fn beating(up: bool) -> Vec<Reading> {
    let (rate, mut speeds) = if up { (150.0, speeds(140)) } else { (-150.0, speeds(70)) };
    if !up {
        speeds.reverse();
    }
    let mut readings = readings_at(rate, DAMPING / 5.0, &speeds, true);
    readings.iter_mut().for_each(|r| r.time_d = None);
    readings
}

#[test]
fn beats_of_run_without_times_tell_its_rate() {
    let rotor = machine();
    let noise = Noise::of(&rotor, &[]);
    for up in [true, false] {
        let found = Beats::of(&beating(up), &noise).unwrap();
        assert!((found.rate_rpm_s / rpm(150.0) - 1.0).abs() < 0.1, "{up}: {}", found.rate_rpm_s);
    }
    // slower runs have none: (ζω)² is 9 rad/s²
    for rate in [0.1, 2.0] {
        let mut slow = readings_at(rate, DAMPING / 5.0, &speeds(140), true);
        slow.iter_mut().for_each(|r| r.time_d = None);
        assert!(Beats::of(&slow, &noise).is_none(), "{rate}");
    }
}

#[test]
fn beating_run_without_times_claims_no_cause_and_asks_for_times() {
    let soft = rotor_file::parse("soft.toml", &MACHINE.replace("754.7", "150.9")).unwrap();
    let readings = beating(true);
    let found = diagnose(&soft, &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Undecided, "{}", found.summary);
    assert_eq!(found.too_fast, Some(TooFast::Beats), "{}", found.summary);
    assert!(found.summary.contains("without times (time_d)"), "{}", found.summary);
    assert!(found.unknown.is_none() && found.named().is_none());
    assert_eq!(about(&best_fit(&soft, &readings).unwrap().remarks).len(), 1);
    assert!(improve(&soft, &readings, |_| {}).unwrap().steps.is_empty());
}
