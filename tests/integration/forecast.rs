//! The prognosis against statsmodels: `tests/reference/make_statsmodels_reference.py` made the golden values.

use rotor_edge_desktop::forecast::arima::{Arima, Order};
use rotor_edge_desktop::forecast::smooth::rlowess;
use serde_json::Value;

fn golden() -> Value {
    serde_json::from_str(include_str!("../reference/statsmodels/prognosis.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Each of statsmodels' models with its parameters, beside what it says of it.
fn models<'a>(golden: &'a Value) -> Vec<(Arima, &'a Value)> {
    let one = |m: &'a Value| {
        let order = numbers(&m["order"]);
        let order = Order { p: order[0] as usize, d: order[1] as usize, q: order[2] as usize };
        let (ar, ma) = (numbers(&m["ar"]), numbers(&m["ma"]));
        let [variance, centre] = ["variance", "centre"].map(|key| m[key].as_f64().unwrap());
        (Arima { order, ar, ma, variance, centre }, m)
    };
    golden["arima"].as_array().unwrap().iter().map(one).collect()
}

#[test]
fn likelihood_and_criterion_equal_statsmodels_at_its_parameters() {
    let golden = golden();
    let series = numbers(&golden["series"]);
    for (model, reference) in models(&golden) {
        for (ours, key) in [(model.log_likelihood(&series), "log_likelihood"), (model.aic(&series), "aic")] {
            let theirs = reference[key].as_f64().unwrap();
            assert!((ours - theirs).abs() < 1e-6 * theirs.abs(), "{:?} {key}: {ours} {theirs}", model.order);
        }
    }
}

#[test]
fn arima_fit_reaches_likelihood_of_statsmodels() {
    let golden = golden();
    let series = numbers(&golden["series"]);
    for (model, reference) in models(&golden) {
        let found = Arima::fit(&series, model.order, None).unwrap().log_likelihood(&series);
        let theirs = reference["log_likelihood"].as_f64().unwrap();
        assert!(found > theirs - 0.05, "{:?}: {found} {theirs}", model.order);
    }
}

#[test]
fn forecasts_and_their_spread_equal_statsmodels() {
    let golden = golden();
    let series = numbers(&golden["series"]);
    for (model, reference) in models(&golden) {
        // statsmodels was given the differences
        let flat = (0..model.order.d)
            .fold(series.clone(), |s, _| s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
        let plain = Arima { order: Order { d: 0, ..model.order }, ..model.clone() };
        let theirs = numbers(&reference["differenced_forecast"]);
        for (ours, theirs) in plain.forecast(&flat, 5).iter().zip(theirs) {
            assert!((ours - model.centre - theirs).abs() < 1e-6, "{:?}: {ours} {theirs}", model.order);
        }
        for (ours, theirs) in plain.spread(&flat, 5).iter().zip(numbers(&reference["differenced_sd"])) {
            assert!((ours / theirs - 1.0).abs() < 1e-6, "{:?}: {ours} {theirs}", model.order);
        }
        // and the series itself goes on by the sums of its differences
        let ahead = model.forecast(&series, 5);
        let mut all = series.clone();
        all.extend(&ahead);
        let again =
            (0..model.order.d).fold(all, |s, _| s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
        for (a, b) in again[again.len() - 5..].iter().zip(plain.forecast(&flat, 5)) {
            assert!((a - b).abs() < 1e-6, "{:?}", model.order);
        }
    }
}

#[test]
fn robust_smoothing_equals_statsmodels() {
    let golden = golden();
    let y = numbers(&golden["lowess"]["y"]);
    for case in golden["lowess"]["cases"].as_array().unwrap() {
        let (fraction, iterations) =
            (case["fraction"].as_f64().unwrap(), case["iterations"].as_u64().unwrap());
        let ours = rlowess(&y, fraction, iterations as usize).unwrap();
        for (i, (ours, theirs)) in ours.iter().zip(numbers(&case["smooth"])).enumerate() {
            assert!((ours - theirs).abs() < 1e-6, "{fraction} {iterations}, value {i}: {ours} {theirs}");
        }
    }
}
