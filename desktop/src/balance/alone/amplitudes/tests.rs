//! Amplitudes without phase against closed forms.

use super::*;
use crate::balance::alone::correct;
use crate::measurement::Reading;

fn series(amplitudes: &[(&str, f64)]) -> ProbeRecord {
    let reading = |(run, size): &(&str, f64)| Reading {
        run: Some((*run).into()),
        speed_rpm: 1480.0,
        probes: vec![Some(C::from(size * 1e-6))],
        ..Reading::default()
    };
    ProbeRecord {
        unit: "um".into(),
        conditions: Vec::new(),
        probes: vec!["P".into()],
        readings: amplitudes.iter().map(reading).collect(),
    }
}

fn solved(angles_deg: &[f64], own: C) -> Result<C, Error> {
    let mut table = "run,plane,magnitude_g_mm,angle_deg\n".to_string();
    let names: Vec<String> = (0..angles_deg.len()).map(|k| format!("T{k}")).collect();
    let influence = C::new(0.01, -0.02);
    let mut runs = vec![("base", (influence * own).norm())];
    for (name, angle_deg) in names.iter().zip(angles_deg) {
        table += &format!("{name},A,900,{angle_deg}\n");
        runs.push((name, (influence * (own + C::from_polar(900.0, angle_deg.to_radians()))).norm()));
    }
    let weights = Weights::parse("w.csv", &table, false).unwrap();
    let request = CorrectionRequest { same_speed: 0.01, ..CorrectionRequest::default() };
    let machine = machine(&series(&runs), &weights, &request)?;
    Ok(correct(&machine, &request)?.weights[0].wanted_g_mm)
}

#[test]
fn four_amplitudes_give_the_hidden_unbalance_at_any_angles() {
    for angles_deg in [[0.0, 120.0, 240.0], [0.0, 90.0, 180.0], [10.0, 75.0, 300.0]] {
        for k in 0..12 {
            let own = C::from_polar(300.0 + 250.0 * f64::from(k), 0.5 * f64::from(k));
            let found = solved(&angles_deg, own).unwrap();
            assert!((found + own).norm() < 1e-4 * own.norm(), "{angles_deg:?} {own}: {found}");
        }
    }
}

#[test]
fn two_weights_that_fit_alike_are_refused_with_the_remedy() {
    let why = solved(&[0.0, 180.0, 180.0], C::from_polar(2000.0, 1.0)).unwrap_err().to_string();
    assert!(why.contains("two different weights fit the amplitudes of P alike"), "{why}");
    let why = solved(&[0.0], C::from(2000.0)).unwrap_err().to_string();
    assert!(why.contains("three runs with a trial weight in each plane"), "{why}");
}

/// Weight over the trial weight where three equal ones sit at thirds of a turn: `V₀ / √(mean Vₖ² − V₀²)`, and against the
/// direction of `Σ Vₖ² e^{iθₖ}`.
fn closed_form(base: f64, with: [f64; 3]) -> C {
    let squares = with.map(|v| v * v);
    let effect = (squares.iter().sum::<f64>() / 3.0 - base * base).sqrt();
    let third = |k: usize| C::from_polar(squares[k], std::f64::consts::TAU * k as f64 / 3.0);
    let direction: C = (0..3).map(third).sum();
    -C::from_polar(base / effect, direction.arg())
}

#[test]
fn least_squares_equals_closed_form_and_scatters_less() {
    let table = "run,plane,magnitude_g_mm,angle_deg\na,A,900,0\nb,A,900,120\nc,A,900,240\n";
    let weights = Weights::parse("w.csv", table, false).unwrap();
    let request = CorrectionRequest { same_speed: 0.01, ..CorrectionRequest::default() };
    let fitted = |base: f64, [a, b, c]: [f64; 3]| {
        let machine = machine(&series(&[("base", base), ("a", a), ("b", b), ("c", c)]), &weights, &request);
        let row = &machine.unwrap().coefficients[0];
        -row.before / row.per_weight[0] / 900.0
    };
    let exact = |effect: C| {
        let with = |k: usize| {
            (C::from(150.0) + effect * C::from_polar(1.0, std::f64::consts::TAU * k as f64 / 3.0)).norm()
        };
        [0, 1, 2].map(with)
    };
    let mut squares = [0.0; 2];
    for k in 0..16_u32 {
        let effect = C::from_polar(57.0, 0.4 * f64::from(k));
        let (with, truth) = (exact(effect), -C::from(150.0) / effect);
        for found in [fitted(150.0, with), closed_form(150.0, with)] {
            assert!((found / truth - 1.0).norm() < 1e-6, "{found} {truth}");
        }
        // amplitudes that are 1 % off, each pattern of signs once
        let off = |bit: u32| 1.0 + if k >> bit & 1 == 1 { 0.01 } else { -0.01 };
        let (base, with) = (150.0 * off(3), [with[0] * off(0), with[1] * off(1), with[2] * off(2)]);
        for (sum, found) in squares.iter_mut().zip([fitted(base, with), closed_form(base, with)]) {
            *sum += (found / truth - 1.0).norm_sqr();
        }
    }
    assert!(squares[0] < 0.25 * squares[1], "{squares:?}");
}

#[test]
fn misfit_and_closed_form_of_rounded_amplitudes_are_told() {
    let table = "run,plane,magnitude_g_mm,angle_deg\na,A,9000,0\nb,A,9000,120\nc,A,9000,240\n";
    let weights = Weights::parse("w.csv", table, false).unwrap();
    let request = CorrectionRequest { same_speed: 0.01, ..CorrectionRequest::default() };
    let measured = series(&[("base", 152.0), ("a", 198.0), ("b", 172.0), ("c", 105.0)]);
    let machine = machine(&measured, &weights, &request).unwrap();
    let found = correct(&machine, &request).unwrap();
    let [from, to] = found.weights[0].interval_95.unwrap().0;
    // 152 / √((198² + 172² + 105²) / 3 − 152²) by hand
    assert!(
        found.doubts.iter().any(|d| d.contains("gives 2.57 times the trial weight")),
        "{:?}",
        found.doubts
    );
    assert!((from..to).contains(&(2.569 * 9000.0)), "{from} {to}");
}
