use super::*;
use crate::units::rpm;

/// Readings from one speed to another, rad/s, at a steady rate.
fn ramp(from: f64, to: f64, rate: f64, count: usize) -> Vec<Reading> {
    let at = |k: usize| {
        let w = from + (to - from) * k as f64 / (count - 1) as f64;
        Reading {
            time_d: Some(3.0 + (w - from) / rate / SECONDS_A_DAY),
            speed_rpm: rpm(w),
            ..Reading::default()
        }
    };
    (0..count).map(at).collect()
}

fn rows(readings: &[Reading], speeds: usize) -> Vec<SweptRow> {
    let plan = SweepPlan { runs: vec![None], speeds };
    plan.rows(readings).unwrap().into_iter().map(Option::unwrap).collect()
}

fn shown(row: &SweptRow, transfer: impl Fn(f64) -> C) -> C {
    row.speeds_rad_s.iter().zip(&row.weights).map(|(nu, w)| w * transfer(*nu)).sum()
}

#[test]
fn constant_stays_constant_in_sweep() {
    for rate in [30.0, 150.0, -80.0] {
        let (from, to) = if rate > 0.0 { (150.0, 500.0) } else { (500.0, 150.0) };
        for row in rows(&ramp(from, to, rate, 40), 256) {
            assert!((shown(&row, |_| C::new(2.0, -1.0)) - C::new(2.0, -1.0)).norm() < 1e-12);
        }
    }
}

/// For `H = e^{−iντ₀}`, an echo after τ₀, the sweep shows what it was turned through since: `e^{−iΩτ₀ + iατ₀²/2}`.
#[test]
fn echo_in_sweep_is_of_past_angle() {
    // at 150 rad/s² the kernel of the first readings reaches down to standstill
    for (rate, from, to, within) in
        [(30.0, 150.0, 500.0, 3e-3), (150.0, 150.0, 500.0, 1e-2), (-80.0, 500.0, 150.0, 3e-3)]
    {
        let readings = ramp(from, to, rate, 40);
        let echo_s = 0.3;
        for (row, reading) in rows(&readings, 256).iter().zip(&readings) {
            // a run down is steady before its first reading
            if rate < 0.0 && (reading.speed_rad_s() - from) / rate < echo_s {
                continue;
            }
            let seen = shown(row, |nu| C::from_polar(1.0, -nu * echo_s));
            let past = C::from_polar(1.0, -reading.speed_rad_s() * echo_s + 0.5 * rate * echo_s * echo_s);
            assert!((seen - past).norm() < within, "{rate}: {:.1e}", (seen - past).norm());
        }
    }
}

#[test]
fn slow_sweep_is_steady_response() {
    let readings = ramp(150.0, 200.0, 0.5, 20);
    let transfer = |nu: f64| C::from(1.0) / C::new(180.0 * 180.0 - nu * nu, 30.0 * nu);
    for (row, reading) in rows(&readings, 256).iter().zip(&readings) {
        let (seen, steady) = (shown(row, transfer), transfer(reading.speed_rad_s()));
        // the lag is α/(ζω)² = 0.002 of the peak
        assert!((seen - steady).norm() < 3e-3 * transfer(180.0).norm());
    }
}

#[test]
fn times_that_are_unknown_or_stand_still_make_no_sweep() {
    let plan = SweepPlan { runs: vec![None], speeds: 256 };
    let mut readings = ramp(150.0, 500.0, 30.0, 40);
    assert!(plan.rows(&readings).is_some());
    readings[7].time_d = readings[6].time_d;
    assert!(plan.rows(&readings).is_none());
    readings[7].time_d = None;
    assert!(plan.rows(&readings).is_none());
    // as many speeds as flanks alone need are not enough
    let few = SweepPlan { speeds: 16, ..plan };
    assert!(few.rows(&ramp(150.0, 500.0, 30.0, 40)).is_none());
}
