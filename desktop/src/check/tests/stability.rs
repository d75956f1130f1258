//! Damping, growth and sense of modes.

use super::*;
use crate::check::modes::Whirl;

#[test]
fn modes_of_one_root_are_backward_and_forward() {
    let mut rotor = rigid(1e4, 5.0);
    rotor.physics.gyroscopic = false;
    for pair in modes(&System::new(&rotor).unwrap(), 100.0, 0.0, 4).unwrap().chunks(2) {
        assert!((pair[0].eigenvalue - pair[1].eigenvalue).norm() < 1e-8 * pair[0].eigenvalue.norm());
        assert_eq!([pair[0].whirl, pair[1].whirl], [Whirl::Backward, Whirl::Forward]);
    }
}

#[test]
fn mode_of_a_shaft_at_rest_has_no_sense() {
    let found = modes(&System::new(&sample_rotor()).unwrap(), 0.0, 0.0, 4).unwrap();
    assert!(found.iter().all(|m| m.whirl == Whirl::Mixed), "{found:?}");
}

#[test]
fn undamped_mode_has_neither_decrement_nor_growth_nor_amplitude() {
    let undamped = modes(&System::new(&rigid(1e4, 0.0)).unwrap(), 100.0, 0.0, 4).unwrap();
    assert!(undamped.iter().all(|m| m.log_decrement() == 0.0 && !m.grows() && !m.has_amplitude()));
    let damped = modes(&System::new(&rigid(1e4, 0.1)).unwrap(), 100.0, 0.0, 4).unwrap();
    assert!(damped.iter().all(|m| m.log_decrement() > 0.0 && m.has_amplitude()));
}

#[test]
fn negative_stiffness_is_unstable_without_oscillation() {
    let mut rotor = rigid(-1e4, 5.0);
    rotor.physics.gyroscopic = false;
    // softer, and not the same in x and y, so that no roots are close to each other or to rounding
    rotor.shaft[0].youngs_modulus_pa = 1e12;
    let four = |xx, yy| Coefficients { xx, yy, xy: 0.0, yx: 0.0 };
    for b in &mut rotor.bearing {
        *b = Bearing::constant(b.name.clone(), b.position_m, four(-1e4, -2e4), four(5.0, 5.0));
    }
    let system = System::new(&rotor).unwrap();
    let campbell = Campbell::new(&system, &[10.0, 50.0], 500.0).unwrap();
    let threshold = campbell.threshold(&system, 0).unwrap();
    assert!(threshold.from_the_first && threshold.frequency_rad_s == 0.0, "{threshold:?}");
    // m λ² + 2 c λ + 2 k = 0 of the rigid shaft that moves along
    let (mass, k, c) = (mass_and_centre(&rotor).0, -1e4_f64, 5.0_f64);
    let growth = (-c + (c * c - 2.0 * k * mass).sqrt()) / mass;
    let nearest =
        campbell.real_rad_s[0].iter().map(|r| (r / growth - 1.0).abs()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-3, "{growth}: {:?}", campbell.real_rad_s);
}
