//! The machine and its probes: a reading of each scene.

use rand_core::Rng;
use rotor_edge_boards::monitor::BoardModel;
use rotor_edge_core::can::{Keyphasor, NumberedReading};
use rotor_edge_core::model::MAX_PLANES;
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::track::{TrackConfig, Tracker};
use rotor_edge_mps2_an386::sample;

use super::truth::Scene;

/// Standard deviation of a component, µm: within what the model states.
const NOISE_UM: f32 = 0.1;

/// What the record's first reading would be if the model were true and the unbalance no greater than it says.
#[inline(never)]
pub fn healthy(model: &[u8]) -> Reading {
    let Some(reading) = sample::readings().find(Reading::is_complete) else { panic!("no record") };
    let Ok(model) = BoardModel::decode(model) else { panic!("the sample's model is refused") };
    let mut bounds_g_mm = [0.0; MAX_PLANES];
    for (bound_g_mm, [x, y]) in bounds_g_mm.iter_mut().zip(model.description().initial_unbalance_g_mm) {
        *bound_g_mm = x.abs().max(y.abs());
    }
    let Ok(estimate) = Tracker::new(&model).update(&TrackConfig::default(), &model, &reading, &bounds_g_mm)
    else {
        panic!("the record's first reading has no estimate")
    };
    let calculated = &estimate.calculated[..reading.probes().len()];
    let Some(healthy) = Reading::new(reading.speed_rpm, calculated) else { unreachable!() };
    healthy
}

/// What a scene makes of the healthy machine's reading.
pub fn reading(random: &mut impl Rng, good: &Reading, now: Scene, sequence: u16) -> NumberedReading {
    let mut probes = [ProbeVector::LOST; 4];
    for (probe, good) in probes.iter_mut().zip(good.probes()) {
        let (cos_um, sin_um) = (good.cos_um + noise_um(random), good.sin_um + noise_um(random));
        *probe = ProbeVector { cos_um, sin_um };
    }
    let mut speed_rpm = good.speed_rpm;
    let mut gaps_v = [-10.0; 4];
    match now {
        Scene::ProbeLost => probes[1] = ProbeVector::LOST,
        Scene::TwoProbesLost => (probes[0], probes[3]) = (ProbeVector::LOST, ProbeVector::LOST),
        Scene::ProbesOff => gaps_v = [-24.0, -10.0, -24.0, 0.0],
        Scene::TooFast => speed_rpm = 30_000.0,
        Scene::Absurd => probes[2].cos_um = 1e6,
        Scene::Fault => {
            let ProbeVector { cos_um, sin_um } = probes[0];
            probes[0] = ProbeVector { cos_um: -5.0 * cos_um, sin_um: -5.0 * sin_um };
        }
        _ => {}
    }
    let Some(reading) = Reading::new(speed_rpm, &probes) else { unreachable!() };
    let keyphasor = match now {
        Scene::NoKeyphasor => Keyphasor::Missing,
        _ => Keyphasor::Locked,
    };
    NumberedReading { sequence, keyphasor, reading: reading.with_gaps_v(&gaps_v) }
}

/// The sum of twelve uniform draws less six.
fn noise_um(random: &mut impl Rng) -> f32 {
    let sum: f32 = (0..12).map(|_| random.next_u32() as f32 / u32::MAX as f32).sum();
    NOISE_UM * (sum - 6.0)
}
