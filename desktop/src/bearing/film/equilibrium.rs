//! Where the journal runs under a load, from nearly unloaded to nearly touching.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Vector2};

use super::geometry::{Shape, Surface, within_half_turn};
use super::journal::{Films, JournalFilm};
use crate::error::{Error, FilmError};

/// Eccentricity relative to the set clearance, `1 − thinnest film / set clearance`, at which the path of
/// equilibria begins.
pub(super) const LEAST_ECCENTRICITY: f64 = 0.005;
/// And at which it ends: thinner films are outside the isothermal theory of a smooth, parallel journal.
pub(super) const MOST_ECCENTRICITY: f64 = 0.95;
/// Steps of the path: change of the relative eccentricity, and of the logarithm of the load.
const ECCENTRICITY_STEP: f64 = 0.025;
const LOAD_STEPS: [f64; 2] = [0.02, 0.1];
/// Remaining force, relative to the load.
const BALANCED: f64 = 1e-7;

/// The journal's place and the film's coefficients under a load along −y, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// Sommerfeld number S = μ N L D / W (R/c)², N in revolutions per second, c the pad clearance.
    pub sommerfeld: f64,
    /// Distance of the journal from the bearing's centre by the pad clearance.
    pub eccentricity_ratio: f64,
    /// From the load to the line of centres in the direction of rotation, degrees.
    pub attitude_deg: f64,
    /// Thinnest film by the pad clearance.
    pub film_ratio: f64,
    /// K c/W: rows the force lost in x and y, columns the displacement.
    pub stiffness: Matrix2<f64>,
    /// C c Ω/W.
    pub damping: Matrix2<f64>,
}

impl Equilibrium {
    fn new(at: Vector2<f64>, film: &JournalFilm, load: f64) -> Self {
        Self {
            sommerfeld: 1.0 / (6.0 * PI * load),
            eccentricity_ratio: at.norm(),
            attitude_deg: within_half_turn(at.y.atan2(at.x) + FRAC_PI_2).to_degrees(),
            film_ratio: film.thinnest,
            stiffness: film.stiffness / load,
            damping: film.damping / load,
        }
    }
}

/// The equilibria of a shape from the lightest load to the heaviest.
///
/// # Errors
/// If a step finds no equilibrium.
pub(super) fn path(shape: &Shape) -> Result<Vec<Equilibrium>, Error> {
    let mut films = Films::new(shape);
    let set = 1.0 - shape.preload;
    let relative = |film: &JournalFilm| 1.0 - film.thinnest / set;
    // a fixed film pushes the journal aside, a tilting one does not
    let aside: f64 = if matches!(shape.surface, Surface::Tilting(_)) { 0.0 } else { 1.2 };
    let mut at = LEAST_ECCENTRICITY * set * Vector2::new(aside.sin(), -aside.cos());
    let mut load = films.at(at).force.norm();
    let mut step = LOAD_STEPS[1];
    let mut found: Vec<Equilibrium> = Vec::new();
    let mut last = 0.0;
    loop {
        let film = settle(&mut films, &mut at, load)?;
        let eccentricity = relative(&film);
        found.push(Equilibrium::new(at, &film, load));
        if eccentricity >= MOST_ECCENTRICITY {
            return Ok(found);
        }
        if found.len() > 1 {
            let change: f64 = (eccentricity - last).max(1e-6);
            step = (step * (ECCENTRICITY_STEP / change).min(1.5)).clamp(LOAD_STEPS[0], LOAD_STEPS[1]);
        }
        last = eccentricity;
        load *= step.exp();
    }
}

/// Newton's method for the place where the film carries `load`; starts from `at` and leaves the place there.
fn settle(films: &mut Films, at: &mut Vector2<f64>, load: f64) -> Result<JournalFilm, Error> {
    const MOST: usize = 60;
    let wanted = Vector2::new(0.0, load);
    let mut best = f64::INFINITY;
    for step in 0..MOST {
        let film = films.at(*at);
        let left = film.force - wanted;
        best = best.min(left.norm() / load);
        // the active set makes the force piecewise smooth: near an edge Newton may hop around it
        if left.norm() <= BALANCED * load || step > MOST / 2 && left.norm() <= 1e-5 * load {
            return Ok(film);
        }
        // a bearing of few pads may not resist motion across the load at all
        let weak = 1e-9 * film.static_stiffness.norm();
        let solid = film.static_stiffness + Matrix2::identity() * weak;
        let mut change = solid.try_inverse().unwrap_or_else(Matrix2::zeros) * left;
        while films.thinnest(*at + change) < 0.4 * film.thinnest {
            change *= 0.5;
        }
        if step > MOST / 2 {
            change *= 0.5;
        }
        *at += change;
    }
    Err(FilmError::NoEquilibrium { sommerfeld: 1.0 / (6.0 * PI * load), force_left: best }.into())
}
