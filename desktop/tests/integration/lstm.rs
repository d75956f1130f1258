//! The network of the forecast, with the feature `lstm`.

use rotor_edge_desktop::forecast::lstm::Network;

fn wave(n: usize) -> Vec<f64> {
    (0..n).map(|i| 400.0 + 30.0 * (i as f64 / 6.0).sin()).collect()
}

#[test]
fn lstm_forecast_beats_persistence() {
    let all = wave(240);
    let (past, future) = all.split_at(220);
    let network = Network::train(past, 1).unwrap();
    let ahead = network.forecast(past, 20).unwrap();
    let error = |f: &dyn Fn(usize) -> f64| (0..20).map(|k| (f(k) - future[k]).powi(2)).sum::<f64>();
    let (own, still) = (error(&|k| ahead[k]), error(&|_| past[219]));
    assert!(own < 0.5 * still, "{own} {still}");
}

#[test]
fn lstm_repeats_with_its_seed() {
    let past = wave(60);
    let ahead = |seed: u64| Network::train(&past, seed).unwrap().forecast(&past, 5).unwrap();
    assert_eq!(ahead(1), ahead(1));
    assert_ne!(ahead(1), ahead(2));
}

#[test]
fn a_past_that_is_too_short_is_refused() {
    let refusal = Network::train(&wave(40), 1).unwrap_err().to_string();
    assert!(refusal.contains("at least 51 days"), "{refusal}");
}
