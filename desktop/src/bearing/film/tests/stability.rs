//! The speed at which a rigid rotor on its films begins to whirl.

use super::*;

/// `Ω √(c/g)` at the threshold of a rigid rotor carried evenly by equal bearings, by Routh's criterion for
/// `M u″ + C u′ + K u = 0` (Lund 1965); the whirl's frequency by the speed beside it.
fn threshold(film: &Equilibrium) -> (f64, f64) {
    let (k, c) = (film.stiffness, film.damping);
    let shared =
        (k[(0, 0)] * c[(1, 1)] + k[(1, 1)] * c[(0, 0)] - k[(0, 1)] * c[(1, 0)] - k[(1, 0)] * c[(0, 1)])
            / c.trace();
    let squared = ((shared - k[(0, 0)]) * (shared - k[(1, 1)]) - k[(0, 1)] * k[(1, 0)]) / c.determinant();
    ((shared / squared).sqrt(), squared.sqrt())
}

/// Short-bearing theory at vanishing eccentricity: K c/W → 8/π and 4/π along and across the line of centres,
/// ±1/ε coupled, C c Ω/W → 2/ε; so the whirl is at half the speed and the threshold at `√(6/π) / ½` = 2.764.
/// Finite lengths differ in the first power of L/D, by the damping of the film's ends.
#[test]
fn light_short_bearings_extrapolate_to_whirl_at_half_speed_from_the_closed_forms_threshold() {
    let [long, short] = [0.1, 0.05].map(|ratio| {
        let film = equilibrium::path(&geometry::Shape::of(&bearing(FilmKind::Plain, ratio)));
        threshold(&film.expect("a path")[0])
    });
    let (speed, whirl) = (2.0 * short.0 - long.0, 2.0 * short.1 - long.1);
    assert!((whirl - 0.5).abs() < 0.005, "{whirl}");
    assert!((speed / (2.0 * (6.0 / std::f64::consts::PI).sqrt()) - 1.0).abs() < 0.02, "{speed}");
}

/// Nicholas, Barrett & Leader, J. Mech. Design 102 (1980) 344, table 6, set A: two axial grooves of 20°, L/D = 1,
/// S = 5.3 and 4.3, eccentricity 0.03 and 0.04: 2.1.
#[test]
fn two_axial_grooves_whirl_from_the_published_threshold() {
    let table = FilmTable::solve(&bearing(FilmKind::AxialGroove, 1.0)).expect("a table");
    for (s, eccentricity) in [(5.3, 0.03), (4.3, 0.04)] {
        let film = table.at(s).expect("within range");
        assert!((film.eccentricity_ratio - eccentricity).abs() < 0.006, "{film:?}");
        let (speed, _) = threshold(&film);
        assert!((speed / 2.1 - 1.0).abs() < 0.03, "{speed}");
    }
}

/// A heavily loaded plain bearing never whirls: short-bearing theory has the limit at an eccentricity of 0.76.
#[test]
fn beyond_an_eccentricity_of_three_quarters_a_short_plain_bearing_has_no_threshold() {
    let table = FilmTable::solve(&bearing(FilmKind::Plain, 0.2)).expect("a table");
    let [least, most] = table.range();
    let limit = (0..400)
        .map(|i| table.at(most * (least / most).powf(i as f64 / 400.0)).expect("within range"))
        .find(|film| !threshold(film).0.is_finite())
        .expect("a limit");
    assert!((limit.eccentricity_ratio - 0.76).abs() < 0.02, "{limit:?}");
}
