//! What a file may say, and what a real bearing's state is made of.

use super::*;

#[test]
fn every_number_out_of_range_is_refused_with_its_key_and_itself() {
    let plain = || bearing(FilmKind::Plain, 0.5);
    let cases = [
        (Film { diameter_m: 9.0, ..plain() }, "diameter_m", "9"),
        (Film { length_m: 0.3, ..plain() }, "length_m", "0.3"),
        (Film { radial_clearance_m: 1e-3, ..plain() }, "radial_clearance_m", "0.001"),
        (Film { radial_clearance_m: f64::NAN, ..plain() }, "radial_clearance_m", "NaN"),
        (Film { viscosity_pa_s: Some(-0.02), ..plain() }, "viscosity_pa_s", "-0.02"),
        (Film { viscosity_pa_s: None, ..plain() }, "viscosity_pa_s", "missing"),
        (Film { iso_vg: Some(32.0), ..plain() }, "viscosity_pa_s", "0.02"),
        (Film { viscosity_pa_s: None, iso_vg: Some(32.0), ..plain() }, "temperature_c", "32"),
        (Film { load_n: Some(-5.0), ..plain() }, "load_n", "-5"),
        (Film { preload: Some(0.5), ..plain() }, "preload", "plain"),
        (lemon(1.0, 0.95), "preload", "0.95"),
        (bearing(FilmKind::Elliptical, 1.0), "preload", "missing"),
        (bearing(FilmKind::TiltingPad, 1.0), "pads", "missing"),
        (pads(2, PadLoad::OnPad, 0.0), "pads", "2"),
        (Film { pad_arc_deg: Some(80.0), ..pads(5, PadLoad::OnPad, 0.0) }, "pad_arc_deg", "80"),
        (Film { offset: Some(0.1), ..pads(5, PadLoad::OnPad, 0.0) }, "offset", "0.1"),
        (Film { groove_arc_deg: Some(100.0), ..lemon(1.0, 0.5) }, "groove_arc_deg", "100"),
    ];
    for (film, key, number) in cases {
        let (said, sentence) = film.check().expect_err(key);
        assert_eq!(said, key, "{sentence}");
        assert!(sentence.contains(number) && !sentence.contains('\n'), "{sentence}");
    }
    assert_eq!(plain().check(), Ok(()));
}

#[test]
fn a_film_is_read_from_a_file_and_an_unknown_key_refused() {
    let text = "kind = \"tilting_pad\"\ndiameter_m = 0.12\nlength_m = 0.06\nradial_clearance_m = 1.2e-4\n\
                iso_vg = 32\ntemperature_c = 55.0\npads = 5\npreload = 0.3\nload = \"on_pad\"\n";
    let film: Film = toml::from_str(text).expect("a film");
    assert_eq!(film.check(), Ok(()));
    assert_eq!((film.load_angle_deg, film.load), (-90.0, Some(PadLoad::OnPad)));
    assert!((film.viscosity().expect("an oil") - viscosity_pa_s(32.0, 55.0)).abs() < 1e-15);
    let again: Film = toml::from_str(&toml::to_string(&film).expect("written")).expect("read");
    assert_eq!(again, film);
    assert!(toml::from_str::<Film>(&format!("{text}clearance = 1.0\n")).is_err());
}

#[test]
fn plain_bearing_under_down_load_drives_forward_whirl() {
    let film = bearing(FilmKind::Plain, 0.5);
    let table = FilmTable::solve(&film).expect("a table");
    let at = film.at(&table, 500.0, 1e-4, 0.02, 400.0).expect("a state");
    assert!(at.x_m > 0.0 && at.y_m < 0.0);
    assert!(at.stiffness_n_m[(0, 1)] > 0.0 && at.stiffness_n_m[(1, 0)] < 0.0);
    let distance = at.x_m.hypot(at.y_m);
    assert!((distance - at.eccentricity_ratio * 1e-4).abs() < 1e-15);
    assert!((at.film_m - (1.0 - at.eccentricity_ratio) * 1e-4).abs() < 1e-8);
}

#[test]
fn turning_the_load_turns_the_journal_and_the_coefficients() {
    let down = lemon(0.8, 0.4);
    let aside = Film { load_angle_deg: -30.0, ..down.clone() };
    let table = FilmTable::solve(&down).expect("a table");
    let state = |film: &Film| film.at(&table, 3000.0, 1e-4, 0.02, 300.0).expect("a state");
    let (a, b) = (state(&down), state(&aside));
    let turn = nalgebra::Rotation2::new(60f64.to_radians());
    let place = turn * nalgebra::Vector2::new(a.x_m, a.y_m);
    assert!((place - nalgebra::Vector2::new(b.x_m, b.y_m)).norm() < 1e-12);
    let turned = turn.matrix() * a.stiffness_n_m * turn.matrix().transpose();
    assert!(apart(&turned, &b.stiffness_n_m) < 1e-12);
}

#[test]
fn the_derivatives_of_a_state_are_differences_of_states() {
    let film = Film { load_angle_deg: -75.0, ..bearing(FilmKind::AxialGroove, 0.5) };
    let table = FilmTable::solve(&film).expect("a table");
    let state = |scales: [f64; 3]| {
        film.at(&table, 2000.0 * scales[0], 1e-4 * scales[1], 0.02 * scales[2], 300.0).expect("a state")
    };
    let step = 1e-5f64;
    let at = state([1.0; 3]);
    for (parameter, slope) in [at.by_ln_load, at.by_ln_clearance, at.by_ln_viscosity].into_iter().enumerate()
    {
        let mut scales = [1.0; 3];
        scales[parameter] = step.exp();
        let up = state(scales);
        scales[parameter] = (-step).exp();
        let down = state(scales);
        let over = 2.0 * step;
        let close = |a: &Matrix2<f64>, b: &Matrix2<f64>| (a - b).norm() < 1e-5 * (b.norm() + 1.0);
        assert!(close(&((up.stiffness_n_m - down.stiffness_n_m) / over), &slope.stiffness_n_m));
        assert!(close(&((up.damping_n_s_m - down.damping_n_s_m) / over), &slope.damping_n_s_m));
        assert!(((up.x_m - down.x_m) / over - slope.x_m).abs() < 1e-9);
        assert!(((up.y_m - down.y_m) / over - slope.y_m).abs() < 1e-9);
    }
}

#[test]
fn load_outside_table_or_table_of_other_shape_is_refused() {
    let film = bearing(FilmKind::Plain, 0.5);
    let table = FilmTable::solve(&film).expect("a table");
    let sentence = |load: f64| film.at(&table, load, 1e-4, 0.02, 300.0).expect_err("refused").to_string();
    assert!(sentence(1e7).contains("eccentricity beyond 0.95"), "{}", sentence(1e7));
    assert!(sentence(1e-3).contains("eccentricity below 0.005"), "{}", sentence(1e-3));
    assert!(sentence(-1.0).contains("-1"), "{}", sentence(-1.0));
    let other = bearing(FilmKind::Plain, 0.6);
    let refused = other.at(&table, 500.0, 1e-4, 0.02, 300.0).expect_err("refused").to_string();
    assert!(refused.contains("another bearing geometry"), "{refused}");
}
