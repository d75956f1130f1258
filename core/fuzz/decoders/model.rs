//! Deployed models.

use nalgebra::{Matrix2, Vector2};
use rotor_edge_core::model::{
    Counts, Description, Knot, KnotRange, Matrices, Model, Modes, Noise, Probe, Spring, Support,
};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::track::{TrackConfig, Tracker};

use super::with_crc32;

/// Few shapes, so that a mutation meets what is read rather than one of many numbers.
pub type SmallModel = Model<2, 4, 2>;

/// Schema and counts.
pub const HEAD_BYTES: usize = 7;

/// A stiff shaft on two damped supports, one with a speed table: translation and tilt.
pub fn machine() -> SmallModel {
    let at = |place: f64| Vector2::new(1.0, place);
    let shaft = Matrices {
        stiffness: Matrix2::zeros(),
        mass: Matrix2::new(60.0, 3.0, 3.0, 20.0),
        polar_inertia: Matrix2::new(0.0, 0.0, 0.0, 4.0),
    };
    let springs = [-1.0, 1.0].map(|place| Spring { shape: at(place), stiffness_n_m: 1e8 });
    let modes = Modes::new(&shaft, &springs).expect("both ends are held");
    let mut supports = [-1.0, 1.0].map(|place| Support::isotropic(modes.shape(&at(place)), 5e7, 3e4));
    supports[0].table = Some(KnotRange { first: 0, count: 2 });
    let knot = |speed_rad_s: f32| Knot {
        speed_rad_s,
        stiffness_n_m: [[1e4 * speed_rad_s, 0.0], [0.0, 1e4 * speed_rad_s]],
        damping_n_s_m: [[100.0, 0.0], [0.0, 100.0]],
    };
    let probes = [(-0.9, [1.0, 0.0], 0), (-0.9, [0.0, 1.0], 0), (0.9, [1.0, 0.0], 1), (0.9, [0.0, 1.0], 1)];
    Model::new(&Description {
        machine: *b"fuzz",
        shaft: &modes.shaft(),
        internal_damping_s: 0.0,
        planes: &[-0.5, 0.6].map(|place| modes.forward(&at(place))),
        supports: &supports,
        knots: &[100.0, 1200.0].map(knot),
        forcings: &[],
        probes: &probes.map(|(place, way, bearing)| Probe::plain(modes.shape(&at(place)), way, bearing)),
        masked: 0,
        initial_unbalance_g_mm: &[[3000.0, 4000.0], [-1000.0, 2000.0]],
        unbalance_floor_g_mm: 100.0,
        noise: Noise { relative: 0.0, floor_um: 0.1 },
        speed_range_rpm: [600.0, 12_000.0],
    })
    .expect("it describes a machine")
}

/// The bytes that [`Model::encode`] writes.
pub fn encoded<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
) -> Vec<u8> {
    let mut buffer = vec![0; Model::<SHAPES, PROBES, PLANES>::max_size_bytes()];
    let length = model.encode(&mut buffer).expect("there is room");
    buffer.truncate(length);
    buffer
}

/// A model's bytes but for the checksum, which is put right. A model that is taken comes back from its own bytes, and it is
/// tracked to something finite or refused.
pub fn model(bytes: &[u8]) {
    assert!(Counts::read(bytes).is_none() || bytes.len() >= HEAD_BYTES);
    let (head, body) = bytes.split_at(bytes.len().min(HEAD_BYTES));
    let whole = [head, &with_crc32(body.to_vec())].concat();
    let Ok(model) = Model::<2, 8, 4>::decode(&whole) else { return };
    assert_eq!(Model::new(&model.description()).as_ref(), Ok(&model));
    assert_eq!(Model::decode(&encoded(&model)).as_ref(), Ok(&model));
    let mut tracker = Tracker::new(&model);
    let [lowest, highest] = model.description().speed_range_rpm;
    for speed_rpm in [lowest, 0.5 * (lowest + highest), highest] {
        let seen = vec![ProbeVector { cos_um: 20.0, sin_um: -10.0 }; model.description().probes.len()];
        let reading = Reading::new(speed_rpm, &seen).expect("up to eight");
        if let Ok(estimate) = tracker.update(&TrackConfig::default(), &model, &reading, &[1e5; 4]) {
            assert!(estimate.residual.e_um.is_finite());
            assert!(tracker.last_g_mm().iter().flatten().all(|part| part.is_finite()));
        }
    }
}
