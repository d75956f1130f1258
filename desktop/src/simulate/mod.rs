//! What the probes of a machine would show: readings at 1x, simulated on full finite elements.
//!
//! The mesh is finer than the one that fits are made on, so that a fit of the readings is held against more than its own
//! arithmetic. What is wrong with the simulated machine is known: effects that are stated or drawn at random, and errors
//! of its drawing.
//!
//! | module | holds |
//! |---|---|
//! | `shown` | noise-free readings of every run |
//! | `stated` | an effect as somebody states it, checked |
//! | `hidden` | an effect, place and size drawn at random |
//! | `drawn` | errors of the drawing, drawn at random within its tolerances |
//! | `defaults` | speeds and unbalance where none are stated |
//! | `predicted` | the model of a file at given readings, nothing fitted |
//! | `steady` | whether the machine has a steady response |
//! | `usual` | how large effects are on machines |
//! | `visible` | how much of an effect a fit without it would leave |

mod defaults;
mod drawn;
mod hidden;
mod predicted;
mod shown;
mod stated;
mod steady;
mod usual;
mod visible;

use nalgebra::Complex;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use crate::check::critical::critical_speeds;
use crate::check::system::System;
use crate::effects::physical::scales;
use crate::effects::terms::Terms;
use crate::effects::{Scales, entry};
use crate::error::Error;
use crate::machine::drawing::{EffectEntry, Noise, Rotor};
use crate::measurement::Reading;
use crate::rotor_file::SCHEMA;
use crate::units::{rad_s, rpm};

pub use drawn::DrawingChange;
pub use hidden::{JUST_VISIBLE_SD, STRONG_SD};
pub use predicted::{FilePrediction, predicted};
pub use stated::StatedEffect;

type C = Complex<f64>;

/// Seeds of one simulation differ by what they are for.
const UNBALANCE_STREAM: u64 = 0x756e_6261;
const NOISE_STREAM: u64 = 0x6e6f_6973;

/// What is to be simulated of a machine; whatever is empty or `None` has a default.
#[derive(Debug, Clone, Default)]
pub struct SimulationRequest {
    /// Effects that the machine has beside those of its file.
    pub effects: Vec<StatedEffect>,
    /// Speeds of every run, rpm, in the order of the readings.
    pub speeds_rpm: Vec<f64>,
    /// Unbalance of planes by name, kg·m.
    pub unbalance_kg_m: Vec<(String, C)>,
    /// Noise of each component; a size of zero is none.
    pub noise: Option<Noise>,
    /// Seed of the noise, and of the angles of unbalance that is not stated.
    pub seed: u64,
    /// Draws errors of the drawing within its tolerances.
    pub drawing_seed: Option<u64>,
    /// Draws an effect, its place and its size.
    pub hidden_seed: Option<u64>,
}

/// An effect that was drawn at random.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenEffect {
    pub entry: EffectEntry,
    /// Root of the sum of squares of what a fit of bearings, unbalance and the drawing's tolerances leaves of it in the noise-free
    /// readings, over the noise.
    pub visible_sd: f64,
}

/// Readings, and the machine that they are of.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The machine with its effects and the errors of its drawing.
    pub machine: Rotor,
    /// Speeds of every run but slow rolls, rpm.
    pub speeds_rpm: Vec<f64>,
    pub readings: Vec<Reading>,
    /// The same without noise.
    pub noise_free: Vec<Reading>,
    pub noise: Noise,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
    /// Effects that were stated.
    pub effects: Vec<EffectEntry>,
    pub hidden: Option<HiddenEffect>,
    pub drawing: Vec<DrawingChange>,
    /// Undamped critical speeds of the machine as drawn up to its fastest reading, at least one, rpm.
    pub critical_speeds_rpm: Vec<f64>,
    /// First speed of the runs at which a mode of the machine grows, rpm.
    pub unstable_from_rpm: Option<f64>,
}

/// Simulates readings of the machine of a file in each of its runs.
///
/// # Errors
/// One sentence on what cannot be simulated: an unknown effect, place, parameter or plane, numbers beyond physics, a film
/// beyond its range, a drawing without tolerances, amplitudes that do not settle.
pub fn simulate(file: &Rotor, request: &SimulationRequest) -> Result<Simulation, Error> {
    if file.plane.is_empty() || file.probe.is_empty() {
        let missing = if file.plane.is_empty() { "[[plane]]" } else { "[[probe]]" };
        return Err(Error::Unsuitable(format!("the rotor's file has no {missing}, expected at least one")));
    }
    let speeds_rpm = match request.speeds_rpm.is_empty() {
        true => defaults::speeds_rpm(file)?,
        false => request.speeds_rpm.clone(),
    };
    let (_, fastest_rpm) = shown::ends(&speeds_rpm);
    let file = &Rotor {
        schema: file.schema.max(SCHEMA),
        fastest_rpm: Some(fastest_rpm.max(file.fastest_rpm.unwrap_or(0.0))),
        ..file.clone()
    };
    let mut random = stream(request.seed, UNBALANCE_STREAM);
    let unbalance = defaults::unbalance_kg_m(file, &request.unbalance_kg_m, fastest_rpm, &mut random)?;
    let (mut machine, drawing) = match request.drawing_seed {
        Some(seed) => drawn::within_tolerance(file, seed)?,
        None => (file.clone(), Vec::new()),
    };
    let scales = scales_of(file, &unbalance, &speeds_rpm)?;
    let mut effects = Vec::new();
    for stated in &request.effects {
        let entry = stated.entry(&machine, &scales)?;
        machine.effect.push(entry.clone());
        effects.push(entry);
    }
    machine.validate()?;
    let before = shown::noise_free(&machine, &unbalance, &speeds_rpm)?;
    let noise = request.noise.unwrap_or_else(|| Noise::of(file, &before));
    let hidden = match request.hidden_seed {
        Some(seed) => {
            let search = hidden::Search {
                file,
                scales: &scales,
                unbalance_kg_m: &unbalance,
                speeds_rpm: &speeds_rpm,
                noise: audible(noise, file, &before),
            };
            Some(search.draw(&machine, seed)?)
        }
        None => None,
    };
    machine.effect.extend(hidden.iter().map(|hidden| hidden.entry.clone()));
    let noise_free = match hidden {
        Some(_) => shown::noise_free(&machine, &unbalance, &speeds_rpm)?,
        None => before,
    };
    let critical = critical_speeds(&System::new(file)?, rad_s(fastest_rpm), 1);
    Ok(Simulation {
        unstable_from_rpm: steady::unstable_from_rpm(&machine, &speeds_rpm)?,
        critical_speeds_rpm: critical.iter().map(|c| rpm(c.speed_rad_s)).collect(),
        readings: noisy(&noise_free, &noise, request.seed),
        machine,
        speeds_rpm,
        noise_free,
        noise,
        unbalance_kg_m: unbalance,
        effects,
        hidden,
        drawing,
    })
}

/// Random numbers of a seed for one of its uses.
fn stream(seed: u64, of: u64) -> StdRng {
    StdRng::seed_from_u64(seed.wrapping_add(of.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

/// The noise that hidden effects are sized by: the usual one where none is simulated.
fn audible(noise: Noise, file: &Rotor, readings: &[Reading]) -> Noise {
    if noise.relative + noise.floor_um > 0.0 { noise } else { Noise::of(file, readings) }
}

/// Sizes of the machine as its file has it.
fn scales_of(file: &Rotor, unbalance_kg_m: &[C], speeds_rpm: &[f64]) -> Result<Scales, Error> {
    let readings = shown::noise_free(file, unbalance_kg_m, speeds_rpm)?;
    let squares = || readings.iter().flat_map(|r| r.probes.iter().flatten()).map(|y| y.norm_sqr());
    let amplitude_m = (squares().sum::<f64>() / squares().count().max(1) as f64).sqrt();
    let (_, fastest_rpm) = shown::ends(speeds_rpm);
    Ok(scales(file, &Terms::drawn(file), rad_s(fastest_rpm), amplitude_m.max(LEAST_AMPLITUDE_M)))
}

/// No machine vibrates less, m.
const LEAST_AMPLITUDE_M: f64 = 1e-9;

/// Readings with noise on both components of every phasor.
fn noisy(readings: &[Reading], noise: &Noise, seed: u64) -> Vec<Reading> {
    let mut random = stream(seed, NOISE_STREAM);
    let mut noisy = |y: C| {
        let sigma_m = noise.sigma_m(y);
        let mut part = || sigma_m * random.sample::<f64, _>(StandardNormal);
        y + C::new(part(), part())
    };
    let reading =
        |r: &Reading| Reading { probes: r.probes.iter().map(|y| y.map(&mut noisy)).collect(), ..r.clone() };
    readings.iter().map(reading).collect()
}

/// The machine with the switches of its effects in force.
fn switched(machine: &Rotor) -> Rotor {
    Rotor { physics: entry::terms_of(machine).physics, ..machine.clone() }
}
