//! The network of the forecast, with the feature `lstm`.

use rotor_edge_desktop::forecast::lstm::Network;

fn wave(n: usize) -> Vec<f64> {
    (0..n).map(|i| 400.0 + 30.0 * (i as f64 / 6.0).sin()).collect()
}

#[test]
fn lstm_forecast_beats_persistence_and_repeats_with_seed() {
    let all = wave(240);
    let (past, future) = all.split_at(220);
    let network = Network::train(past, 1).unwrap();
    let ahead = network.forecast(past, 20).unwrap();
    let error = |f: &dyn Fn(usize) -> f64| (0..20).map(|k| (f(k) - future[k]).powi(2)).sum::<f64>();
    let (own, still) = (error(&|k| ahead[k]), error(&|_| past[219]));
    assert!(own < 0.5 * still, "{own} {still}");
    assert_eq!(Network::train(past, 1).unwrap().forecast(past, 20).unwrap(), ahead);
}

#[test]
fn a_past_that_is_too_short_is_refused() {
    let refusal = Network::train(&wave(40), 1).unwrap_err().to_string();
    assert!(refusal.contains("at least 51 days"), "{refusal}");
}
