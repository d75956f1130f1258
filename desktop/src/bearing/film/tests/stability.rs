//! The speed at which a rigid rotor on its films begins to whirl.

use super::limits::{at_eccentricity, ocvirk};
use super::*;

/// `Ω √(c/g)` at the threshold of a rigid rotor carried evenly by equal bearings, by Routh's criterion for
/// `M u″ + C u′ + K u = 0` (Lund 1965); the whirl's frequency by the speed beside it.
fn threshold(k: &Matrix2<f64>, c: &Matrix2<f64>) -> (f64, f64) {
    let shared =
        (k[(0, 0)] * c[(1, 1)] + k[(1, 1)] * c[(0, 0)] - k[(0, 1)] * c[(1, 0)] - k[(1, 0)] * c[(0, 1)])
            / c.trace();
    let squared = ((shared - k[(0, 0)]) * (shared - k[(1, 1)]) - k[(0, 1)] * k[(1, 0)]) / c.determinant();
    ((shared / squared).sqrt(), squared.sqrt())
}

/// Short-bearing theory at vanishing eccentricity: K c/W → 8/π and 4/π along and across the line of centres,
/// ±1/ε coupled, C c Ω/W → 2/ε; so the whirl is at half the speed and the threshold at `√(6/π) / ½` = 2.764.
#[test]
fn the_closed_forms_light_bearing_whirls_at_half_speed() {
    let (_, _, k, c) = ocvirk(1e-3);
    let (speed, whirl) = threshold(&k, &c);
    assert!((whirl - 0.5).abs() < 1e-4, "{whirl}");
    assert!((speed / (2.0 * (6.0 / std::f64::consts::PI).sqrt()) - 1.0).abs() < 1e-4, "{speed}");
}

/// Finite lengths differ in the first power of L/D, by the damping of the film's ends.
#[test]
fn short_bearing_threshold_extrapolates_to_ocvirk_closed_form() {
    for e in [0.1, 0.3, 0.5] {
        let (_, attitude, k, c) = ocvirk(e);
        let expected = threshold(&k, &c);
        let [long, short] = [0.1, 0.05].map(|ratio| {
            let (_, _, k, c) = at_eccentricity(ratio, e, attitude);
            threshold(&k, &c)
        });
        let (speed, whirl) = (2.0 * short.0 - long.0, 2.0 * short.1 - long.1);
        assert!((whirl / expected.1 - 1.0).abs() < 0.01, "ε {e}: {whirl} {expected:?}");
        assert!((speed / expected.0 - 1.0).abs() < 0.02, "ε {e}: {speed} {expected:?}");
    }
}

/// Nicholas, Barrett & Leader, J. Mech. Design 102 (1980) 344, table 6, set A: two axial grooves of 20°, L/D = 1,
/// S = 5.3 and 4.3, eccentricity 0.03 and 0.04: 2.1.
#[test]
fn two_axial_grooves_whirl_from_the_published_threshold() {
    let table = FilmTable::solve(&bearing(FilmKind::AxialGroove, 1.0)).expect("a table");
    for (s, eccentricity) in [(5.3, 0.03), (4.3, 0.04)] {
        let film = table.at(s).expect("within range");
        assert!((film.eccentricity_ratio - eccentricity).abs() < 0.006, "{film:?}");
        let (speed, _) = threshold(&film.stiffness, &film.damping);
        assert!((speed / 2.1 - 1.0).abs() < 0.03, "{speed}");
    }
}

/// A heavily loaded plain bearing never whirls: short-bearing theory has the limit at an eccentricity of 0.76.
#[test]
fn short_bearing_beyond_eccentricity_0_76_has_no_threshold() {
    let table = FilmTable::solve(&bearing(FilmKind::Plain, 0.2)).expect("a table");
    let [least, most] = table.range();
    let limit = (0..400)
        .map(|i| table.at(most * (least / most).powf(i as f64 / 400.0)).expect("within range"))
        .find(|film| !threshold(&film.stiffness, &film.damping).0.is_finite())
        .expect("a limit");
    assert!((limit.eccentricity_ratio - 0.76).abs() < 0.02, "{limit:?}");
}
