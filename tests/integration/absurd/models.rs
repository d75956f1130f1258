//! Deployed models whose checksum is right and whose numbers are not.

use nalgebra::SVector;
use rotor_edge::edge::{Deployment, EdgeModel, SHAPES, encoded};
use rotor_edge::sample;
use rotor_edge_core::model::{Description, ModelError, Noise, Pair, Probe, Shaft, Support};
use rotor_edge_core::response::{SupportAmplitudes, response};

use super::values::Dice;

fn model() -> EdgeModel {
    let (mut rotor, ..) = sample::load().unwrap();
    for plane in &mut rotor.plane {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(500.0), Some(40.0));
    }
    Deployment::new(&rotor, 11_500.0).unwrap().edge
}

/// The parts of a model that hold numbers.
struct Parts {
    shaft: Shaft<SHAPES>,
    planes: Vec<SVector<f32, SHAPES>>,
    supports: Vec<Support<SHAPES>>,
    probes: Vec<Probe<SHAPES>>,
    initial_unbalance_g_mm: Vec<Pair>,
    internal_damping_s: f32,
    unbalance_floor_g_mm: f32,
    noise: Noise,
    speed_range_rpm: [f32; 2],
}

impl Parts {
    fn of(model: &EdgeModel) -> Self {
        let description = model.description();
        Self {
            shaft: description.shaft.clone(),
            planes: description.planes.to_vec(),
            supports: description.supports.to_vec(),
            probes: description.probes.to_vec(),
            initial_unbalance_g_mm: description.initial_unbalance_g_mm.to_vec(),
            internal_damping_s: description.internal_damping_s,
            unbalance_floor_g_mm: description.unbalance_floor_g_mm,
            noise: description.noise,
            speed_range_rpm: description.speed_range_rpm,
        }
    }

    fn assembled(&self, like: &EdgeModel) -> Result<EdgeModel, ModelError> {
        EdgeModel::new(&Description {
            shaft: &self.shaft,
            planes: &self.planes,
            supports: &self.supports,
            probes: &self.probes,
            initial_unbalance_g_mm: &self.initial_unbalance_g_mm,
            internal_damping_s: self.internal_damping_s,
            unbalance_floor_g_mm: self.unbalance_floor_g_mm,
            noise: self.noise,
            speed_range_rpm: self.speed_range_rpm,
            ..like.description()
        })
    }

    /// Every number of the model.
    fn numbers(&mut self) -> Vec<&mut f32> {
        let mut all: Vec<&mut f32> = Vec::new();
        for values in [&mut self.shaft.forward_s2, &mut self.shaft.backward_s2] {
            all.extend(values.iter_mut());
        }
        all.extend(&mut self.shaft.springs_n_m);
        all.extend([&mut self.internal_damping_s, &mut self.unbalance_floor_g_mm]);
        all.extend([&mut self.noise.relative, &mut self.noise.floor_um]);
        all.extend(&mut self.speed_range_rpm);
        all.extend(self.initial_unbalance_g_mm.iter_mut().flatten());
        all.extend(self.planes.iter_mut().flat_map(|shape| shape.iter_mut()));
        for support in &mut self.supports {
            all.extend(support.shape.forward.iter_mut().chain(&mut support.shape.backward));
            all.extend(support.stiffness_n_m.iter_mut().flatten());
            all.extend(support.damping_n_s_m.iter_mut().flatten());
            all.extend([&mut support.mass_kg, &mut support.stiffness_slope]);
            all.extend([&mut support.reference_speed_rad_s, &mut support.hardening_per_um2]);
        }
        for probe in &mut self.probes {
            all.extend(probe.shape.forward.iter_mut().chain(&mut probe.shape.backward));
            all.extend(probe.direction.iter_mut().chain(&mut probe.gain).chain(&mut probe.runout_um));
        }
        all
    }
}

/// The limits that `Model::new` documents, and a finite response over the whole range.
fn assert_sound(model: &EdgeModel, what: &str) {
    let at_speed = |speed| {
        response(model, speed, &SupportAmplitudes::default()).unwrap_or_else(|e| panic!("{what}: {e:?}"))
    };
    let model = model.description();
    let [lowest, highest] = model.speed_range_rpm;
    assert!(0.0 < lowest && lowest <= highest && highest.is_finite(), "{what}: {lowest} to {highest} rpm");
    assert!((0.0..1.0).contains(&model.noise.relative) && model.noise.floor_um >= 0.0, "{what}");
    assert!(model.unbalance_floor_g_mm >= 0.0, "{what}");
    assert!(model.shaft.backward_s2.iter().all(|square| *square > 0.0), "{what}");
    for share in [0.0, 0.5, 1.0] {
        let speed = (lowest + share * (highest - lowest)) * std::f32::consts::PI / 30.0;
        for vector in at_speed(speed).vectors(model.initial_unbalance_g_mm) {
            assert!(vector.cos_um.is_finite() && vector.sin_um.is_finite(), "{what}: {vector:?}");
        }
    }
}

#[test]
fn model_with_absurd_number_is_refused_or_answers_in_range() {
    const MODELS: usize = 2000;
    let mut dice = Dice::new();
    let whole = model();
    assert_eq!(EdgeModel::decode(&encoded(&whole).unwrap()), Ok(whole.clone()));
    let mut refused = 0;
    for _ in 0..MODELS {
        let mut parts = Parts::of(&whole);
        let mut all = parts.numbers();
        let (count, place) = (all.len(), dice.below(all.len()));
        let absurd = match dice.below(6) {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -*all[place],
            _ => dice.huge(10.0, 38.0) as f32,
        };
        *all[place] = absurd;
        match parts.assembled(&whole) {
            Ok(taken) => {
                assert_sound(&taken, &format!("number {place} of {count} is {absurd:e}"));
                assert_eq!(EdgeModel::decode(&encoded(&taken).unwrap()), Ok(taken));
            }
            Err(_) => refused += 1,
        }
    }
    println!("{refused} of {MODELS} absurd models refused, the others answer with finite numbers");
    assert!(refused > MODELS / 2, "{refused}");
}
