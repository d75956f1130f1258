//! What the films of all pads do to the journal at one place.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, Matrix2, Rotation2, Vector2};
use rayon::prelude::*;

use super::geometry::{Shape, Surface};
use super::reynolds::{Cavity, Pad, PadFilm};

/// Approach to a pad with a pivot in its middle, in pad clearances, at which its motion is that of a pad the
/// journal only just touches: one at right angles to the load, whose film has no curvature to carry it.
const TOUCHING: f64 = 1e-3;
/// Approaches this near to each other are the same but for rounding.
const ROUNDING: f64 = 1e-9;
/// Positions tried for a pad whose tilt is not near its last.
const TILTS: usize = 24;

/// Force on the journal and its derivatives in units of 6 μ Ω R L (R/c)² for forces, c for lengths and
/// 1/Ω for time.
#[derive(Debug, Clone, Copy)]
pub(super) struct JournalFilm {
    pub(super) force: Vector2<f64>,
    /// Loss of force per displacement at rest.
    pub(super) static_stiffness: Matrix2<f64>,
    /// Loss of force per displacement, and per velocity, at running speed.
    pub(super) stiffness: Matrix2<f64>,
    pub(super) damping: Matrix2<f64>,
    /// Thinnest film in units of the pad clearance.
    pub(super) thinnest: f64,
}

/// How a tilting pad stood last.
#[derive(Debug, Clone, Copy)]
struct Tilt {
    /// Its tilt, as the displacement across its pivot that it undoes.
    across: f64,
    /// Up to this approach the pad was found loose; the nearer the journal, the better a pad carries.
    loose: f64,
}

/// The films of a bearing, each with the cavity its last solution left.
pub(super) struct Films {
    preload: f64,
    surface: Surface,
    pads: Vec<(Pad, Cavity)>,
    tilts: Vec<Tilt>,
}

impl Films {
    pub(super) fn new(shape: &Shape) -> Self {
        let arcs = match &shape.surface {
            Surface::Plain => vec![(PI, TAU)],
            Surface::Fixed(arcs) => arcs.iter().map(|a| (a.start, a.arc)).collect(),
            // in each pad's own frame, pivot at 0
            Surface::Tilting(arcs) => arcs.iter().map(|a| (a.start - a.pivot, a.arc)).collect(),
        };
        let pads: Vec<_> = arcs
            .iter()
            .map(|&(start, arc)| (Pad::new(start, arc, shape.length_ratio), Cavity::new()))
            .collect();
        let tilts = vec![Tilt { across: 0.0, loose: f64::NEG_INFINITY }; pads.len()];
        Self { preload: shape.preload, surface: shape.surface.clone(), pads, tilts }
    }

    /// The thinnest film at the lands around a journal at `at`, pads untilted.
    pub(super) fn thinnest(&self, at: Vector2<f64>) -> f64 {
        match &self.surface {
            Surface::Plain => 1.0 - at.norm(),
            Surface::Fixed(arcs) => arcs
                .iter()
                .zip(&self.pads)
                .map(|(arc, (pad, _))| pad.thinnest((at + inwards(arc.pivot, self.preload)).into()))
                .fold(f64::INFINITY, f64::min),
            Surface::Tilting(arcs) => arcs
                .iter()
                .map(|arc| 1.0 - self.preload - at.dot(&inwards(arc.pivot, 1.0)))
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// The films around a journal at rest at `at`.
    pub(super) fn at(&mut self, at: Vector2<f64>) -> JournalFilm {
        let mut sum = JournalFilm {
            force: Vector2::zeros(),
            static_stiffness: Matrix2::zeros(),
            stiffness: Matrix2::zeros(),
            damping: Matrix2::zeros(),
            thinnest: self.thinnest(at),
        };
        match &self.surface {
            Surface::Plain => sum.add_fixed(plain(&mut self.pads[0], at)),
            Surface::Fixed(arcs) => {
                let pads = arcs.par_iter().zip(&mut self.pads).map(|(arc, (pad, cavity))| {
                    pad.film((at + inwards(arc.pivot, self.preload)).into(), cavity)
                });
                pads.collect::<Vec<_>>().into_iter().for_each(|film| sum.add_fixed(film));
            }
            Surface::Tilting(arcs) => {
                let pads =
                    arcs.par_iter().zip(&mut self.pads).zip(&mut self.tilts).map(|((arc, pad), tilt)| {
                        let towards = inwards(arc.pivot, 1.0);
                        (tilted(pad, at.dot(&towards) + self.preload, tilt), towards)
                    });
                for (film, towards) in pads.collect::<Vec<_>>() {
                    if let Some(film) = film {
                        sum.add_tilting(&film, towards);
                    }
                }
            }
        }
        sum
    }
}

impl JournalFilm {
    fn add_fixed(&mut self, film: PadFilm) {
        self.force += Vector2::from(film.force);
        self.static_stiffness += film.stiffness;
        self.stiffness += film.stiffness;
        self.damping += film.damping;
    }

    fn add_tilting(&mut self, film: &TiltedFilm, towards: Vector2<f64>) {
        let along = towards * towards.transpose();
        self.force -= film.push * towards;
        self.static_stiffness += film.static_stiffness * along;
        self.stiffness += film.dynamic_stiffness.re * along;
        self.damping += film.dynamic_stiffness.im * along;
    }
}

/// A displacement by `size` along `angle`.
fn inwards(angle: f64, size: f64) -> Vector2<f64> {
    Vector2::new(size * angle.cos(), size * angle.sin())
}

/// A full circle whose film begins where it is widest, wherever the journal is (Raimondi & Boyd 1958).
///
/// Moving the journal around the centre turns everything with it, which gives the second column of the
/// stiffness without a perturbation.
fn plain((pad, cavity): &mut (Pad, Cavity), at: Vector2<f64>) -> PadFilm {
    let eccentricity = at.norm();
    let film = pad.film([eccentricity, 0.0], cavity);
    let mut stiffness = film.stiffness;
    stiffness[(0, 1)] = film.force[1] / eccentricity;
    stiffness[(1, 1)] = -film.force[0] / eccentricity;
    let turn = Rotation2::new(at.y.atan2(at.x));
    let turned = |m: Matrix2<f64>| turn.matrix() * m * turn.matrix().transpose();
    PadFilm {
        force: (turn * Vector2::from(film.force)).into(),
        stiffness: turned(stiffness),
        damping: turned(film.damping),
    }
}

/// The film of a tilting pad, along the direction of its pivot.
struct TiltedFilm {
    /// Force away from the pad.
    push: f64,
    static_stiffness: f64,
    /// Stiffness + i damping for motion at running speed.
    dynamic_stiffness: Complex<f64>,
}

/// A pad free to tilt about its pivot, without inertia, around a journal `approach` nearer to it than the
/// centre of its arc.
///
/// In a thin film a tilt acts as a displacement across the pivot, and the moment about it is R times the
/// force across: so the pad stands where that force is zero, whatever the journal does across, and its
/// motion at running speed is eliminated by the same condition (Lund 1964).
///
/// `None` for a pad that stands loose: no tilt carries anything.
fn tilted(pad: &mut (Pad, Cavity), approach: f64, tilt: &mut Tilt) -> Option<TiltedFilm> {
    let (film, push) = match balanced(pad, approach, tilt) {
        Some(film) => (film, -film.force[0]),
        None if approach.abs() < TOUCHING => (balanced(pad, TOUCHING, tilt)?, 0.0),
        None => return None,
    };
    let (k, c) = (film.stiffness, film.damping);
    let z = k.map(Complex::from) + c.map(|c| Complex::new(0.0, c));
    Some(TiltedFilm {
        push,
        static_stiffness: k[(0, 0)] - k[(0, 1)] * k[(1, 0)] / k[(1, 1)],
        dynamic_stiffness: z[(0, 0)] - z[(0, 1)] * z[(1, 0)] / z[(1, 1)],
    })
}

/// The film at the stable tilt that leaves no force across the pivot; starts from the last tilt.
fn balanced((pad, cavity): &mut (Pad, Cavity), approach: f64, tilt: &mut Tilt) -> Option<PadFilm> {
    let touching = |at: f64| pad.thinnest([approach, at]) <= 0.02 * (1.0 - approach);
    let done = |film: &PadFilm| film.force[1].abs() <= 1e-8 * film.force[0].abs();
    let carries = |film: &PadFilm| film.force[0] < 0.0;
    if approach <= tilt.loose {
        return None;
    }
    let mut at = tilt.across;
    for _ in 0..12 {
        if touching(at) {
            break;
        }
        let film = pad.film([approach, at], cavity);
        if !carries(&film) || film.stiffness[(1, 1)] <= 0.0 {
            break;
        }
        if done(&film) {
            tilt.across = at;
            return Some(film);
        }
        at += film.force[1] / film.stiffness[(1, 1)];
    }
    // from the trailing edge nearly touching, where the film pushes back, to the first tilt where it does not
    let reach = 1.2 * (1.0 - approach) / pad.reach();
    let place = |i: usize| reach * (1.0 - 2.0 * i as f64 / TILTS as f64);
    let pushes_on = |at: f64, cavity: &mut Cavity| pad.force([approach, at], [0.0; 2], cavity)[1] > 0.0;
    let mut tilts = (0..=TILTS).filter(|&i| !touching(place(i)));
    let Some(found) = tilts.find(|&i| pushes_on(place(i), cavity)) else {
        tilt.loose = approach + ROUNDING;
        return None;
    };
    let (mut low, mut high) = (place(found), place(found.max(1) - 1));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let film = (!touching(middle)).then(|| pad.film([approach, middle], cavity));
        match film {
            Some(film) if done(&film) || high - low < 1e-13 => {
                tilt.across = middle;
                return Some(film);
            }
            Some(film) if film.force[1] > 0.0 => low = middle,
            _ => high = middle,
        }
    }
    None
}
