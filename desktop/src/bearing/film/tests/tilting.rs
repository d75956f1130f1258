//! A tilting pad against its motion in time, and the table against itself.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;

use super::super::equilibrium::path;
use super::super::geometry::Shape;
use super::super::interpolation::Monotone;
use super::super::journal::Films;
use super::super::reynolds::{Cavity, Pad};
use super::*;

/// Three pads without preload, the load on one: the other two stand loose, so the bearing is that pad.
fn single() -> Film {
    Film { pad_arc_deg: Some(75.0), ..pads(3, PadLoad::OnPad, 0.0) }
}

/// A pad without moment about its pivot at every moment, while the journal moves to and fro at running speed:
/// its tilting velocity is what leaves no force across; integrated until it repeats.
#[test]
fn tilting_pad_coefficients_equal_nonlinear_time_integration() {
    let approach = 0.6;
    let mut films = Films::new(&Shape::of(&single()));
    let film = films.at(Vector2::new(0.0, -approach));

    let arc = 75f64.to_radians();
    let pad = Pad::new(-arc / 2.0, arc, 0.5);
    let mut cavity = Cavity::new();
    let (mut low, mut high) = (0.0, 0.5);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let pushes_on = pad.force([approach, middle], [0.0; 2], &mut cavity)[1] > 0.0;
        if pushes_on { low = middle } else { high = middle }
    }
    let amplitude = 2e-3;
    let mut force = |time: f64, across: f64, across_velocity: f64| {
        let (sin, cos) = f64::sin_cos(time);
        pad.force([approach + amplitude * cos, across], [-amplitude * sin, across_velocity], &mut cavity)
    };
    let mut velocity = 0.0;
    let mut free = |time: f64, across: f64| {
        for _ in 0..8 {
            let at = force(time, across, velocity)[1];
            let slope = (force(time, across, velocity + 1e-4)[1] - at) / 1e-4;
            velocity -= at / slope;
        }
        velocity
    };
    let (steps, turns) = (100, 5);
    let step = TAU / steps as f64;
    let mut across = low;
    let mut record = Vec::new();
    for i in 0..steps * turns {
        let time = i as f64 * step;
        let a = free(time, across);
        if i >= steps * (turns - 1) {
            record.push((time, across, a));
        }
        let b = free(time + 0.5 * step, across + 0.5 * step * a);
        across += step * b;
    }
    // F = F₀ − k a cos τ + c a sin τ
    let (mut k, mut c) = (0.0, 0.0);
    for (time, across, velocity) in record {
        let push = force(time, across, velocity)[0];
        k -= 2.0 * push * time.cos() / (steps as f64 * amplitude);
        c += 2.0 * push * time.sin() / (steps as f64 * amplitude);
    }
    assert!((film.stiffness[(1, 1)] / k - 1.0).abs() < 0.01, "{} {k}", film.stiffness);
    assert!((film.damping[(1, 1)] / c - 1.0).abs() < 0.01, "{} {c}", film.damping);
}

#[test]
fn tilting_pad_static_stiffness_equals_force_difference() {
    for film in [single(), pads(5, PadLoad::BetweenPads, 0.3)] {
        let mut films = Films::new(&Shape::of(&film));
        for down in [0.2, 0.5] {
            let at = |films: &mut Films, d: f64| films.at(Vector2::new(0.0, -down + d));
            let slope = (at(&mut films, 2e-3).force.y - at(&mut films, -2e-3).force.y) / 4e-3;
            let stiffness = at(&mut films, 0.0).static_stiffness[(1, 1)];
            assert!((stiffness / -slope - 1.0).abs() < 0.01, "{film:?} {down} {stiffness} {slope}");
        }
    }
}

#[test]
fn every_other_knot_gives_the_knots_between_to_one_per_cent() {
    for film in [bearing(FilmKind::AxialGroove, 0.5), lemon(1.0, 0.5), pads(4, PadLoad::BetweenPads, 0.0)] {
        let mut knots = path(&Shape::of(&film)).expect("a path");
        knots.reverse();
        let row = |e: &Equilibrium| {
            let (k, c) = (e.stiffness, e.damping);
            [e.eccentricity_ratio, k[0], k[1], k[2], k[3], c[0], c[1], c[2], c[3]]
        };
        let even: Vec<&Equilibrium> = knots.iter().step_by(2).collect();
        let coarse = Monotone::new(
            even.iter().map(|e| e.sommerfeld.ln()).collect(),
            even.iter().map(|e| row(e)).collect(),
        );
        // not at the ends, where the slopes are one-sided
        let inner = even[2].sommerfeld..even[even.len() - 3].sommerfeld;
        for e in knots.iter().filter(|e| inner.contains(&e.sommerfeld)) {
            let between = coarse.at(e.sommerfeld.ln()).0;
            let exact = row(e);
            assert!((between[0] / exact[0] - 1.0).abs() < 0.005, "{e:?}");
            for (part, norm) in [(1..5, e.stiffness.norm()), (5..9, e.damping.norm())] {
                for i in part {
                    assert!((between[i] - exact[i]).abs() < 0.01 * norm, "{i} {} {e:?}", between[i]);
                }
            }
        }
    }
}

/// The two loaded pads of ROSS's TiltingPad: five of 57.6°, L/D 0.5, D 100 mm, pad clearance 100 µm, preload 0.3, 20 mPa·s
/// at 3000 rpm, load between pads, eccentricity 0.3 and 0.6 of the set clearance; `tests/reference/make_film_reference.py`.
#[test]
fn a_loaded_pad_pushes_as_ross_says() {
    let film = Film { pad_arc_deg: Some(57.6), ..pads(3, PadLoad::OnPad, 0.0) };
    let mut films = Films::new(&Shape::of(&film));
    let unit_n = 6.0 * 0.02 * (100.0 * PI) * 0.05 * 0.05 * 500f64.powi(2);
    let text = include_str!("../../../../tests/data/film/ross_pad.csv");
    for record in csv::Reader::from_reader(text.as_bytes()).records() {
        let record = record.expect("a row");
        let [eccentricity, push_n] = std::array::from_fn(|i| record[i].parse::<f64>().expect("a number"));
        let approach = 0.3 + 0.7 * eccentricity * 36f64.to_radians().cos();
        let ours = films.at(Vector2::new(0.0, -approach)).force.y * unit_n;
        assert!((ours / push_n - 1.0).abs() < 0.002, "{eccentricity}: {ours} {push_n}");
    }
}
