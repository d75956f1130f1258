//! How probable an event is before a forecast is over.
//!
//! A forecast goes on from the machine as it is: a bearing that changes, a seal that rubs or a weight that comes loose ends
//! it. Events come at random, at a rate of which the track's own events are all that is known. With Jeffreys' prior a rate
//! of which `n` were seen in `T` days is distributed as Gamma(n + ½, T), and none comes in the next `h` days with
//! probability `(T/(T + h))^(n + ½)` (Lomax 1954, the mixture of exponential waiting times).

/// Chance of at least one event within the days ahead, after so many in the days seen.
///
/// ```
/// use rotor_edge_desktop::forecast::events::chance;
///
/// // nothing in a year and a quarter does not rule out the next two months
/// assert!((0.05..0.07).contains(&chance(0, 460.0, 60.0)));
/// ```
pub fn chance(seen: usize, seen_d: f64, ahead_d: f64) -> f64 {
    1.0 - (seen_d / (seen_d + ahead_d)).powf(seen as f64 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Continuous, Gamma};

    #[test]
    fn event_chance_equals_poisson_averaged_over_gamma_rates() {
        for (seen, seen_d, ahead_d) in [(1, 460.0, 60.0), (4, 200.0, 30.0), (12, 900.0, 365.0)] {
            let rates = Gamma::new(f64::from(seen) + 0.5, seen_d).unwrap();
            let step = 1e-5;
            let at = |k: u32| (f64::from(k) + 0.5) * step;
            let averaged: f64 =
                (0..200_000).map(|k| rates.pdf(at(k)) * (1.0 - (-at(k) * ahead_d).exp()) * step).sum();
            let told = chance(seen as usize, seen_d, ahead_d);
            assert!((told - averaged).abs() < 1e-4, "{seen}: {told} {averaged}");
        }
    }
}
