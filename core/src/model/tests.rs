use std::vec;

use nalgebra::{Matrix2, SMatrix, SVector};

use super::*;
use crate::testing::Random;

/// A stiff shaft on two unlike, damped supports: translation and tilt, shape = [1, place / half length].
pub(crate) fn rigid_rotor() -> Model<2> {
    let at = |place: f32| SVector::from([1.0, place]);
    let support = |place, kxx, kyy| Support {
        stiffness_n_m: [[kxx, 2e6], [-3e6, kyy]],
        ..Support::isotropic(at(place), 0.0, 3e4)
    };
    Model {
        stiffness: Matrix2::zeros(),
        mass: Matrix2::new(60.0, 3.0, 3.0, 20.0),
        polar_inertia: Matrix2::new(0.0, 0.0, 0.0, 4.0),
        internal_damping_s: 0.0,
        planes: Vec::from_array([at(-0.5), at(0.6)]),
        supports: [support(-1.0, 6e7, 5e7), support(1.0, 4e7, 7e7)].into_iter().collect(),
        forcings: Vec::new(),
        probes: [(-0.9, [1.0, 0.0]), (-0.9, [0.0, 1.0]), (0.95, [1.0, 0.0]), (0.95, [0.0, 1.0])]
            .map(|(place, direction)| Probe::plain(at(place), direction)),
        initial_unbalance_g_mm: [[3000.0, 4000.0], [-1000.0, 2000.0]],
        unbalance_floor_g_mm: 100.0,
        speed_range_rpm: [600.0, 12_000.0],
    }
}

/// Every list as long as it may be, every number different.
fn full() -> Model<6> {
    let mut random = Random::new(21);
    let mut shape = || SVector::<f32, 6>::from_fn(|_, _| random.signed());
    let pedestal = Some(Pedestal { stiffness_n_m: 1e8, damping_n_s_m: 1e4, mass_kg: 3.0 });
    let mut diagonal = SMatrix::<f32, 6, 6>::identity();
    diagonal[(0, 1)] = 0.25;
    diagonal[(1, 0)] = 0.25;
    Model {
        stiffness: diagonal * 1e8,
        mass: diagonal * 30.0,
        polar_inertia: diagonal,
        internal_damping_s: 1e-6,
        planes: (0..MAX_PLANES).map(|_| shape()).collect(),
        supports: (0..MAX_SUPPORTS)
            .map(|_| Support { pedestal, hardening_per_um2: 1e-4, ..Support::isotropic(shape(), 1e7, 1e4) })
            .collect(),
        forcings: (0..MAX_FORCINGS)
            .map(|_| Forcing { shape: shape(), amplitude: [1.0, -2.0], law: ForcingLaw::SpeedSquared })
            .collect(),
        probes: core::array::from_fn(|_| Probe::plain(shape(), [1.0, 0.0])),
        initial_unbalance_g_mm: [[1.0, 2.0], [3.0, 4.0]],
        unbalance_floor_g_mm: 5.0,
        speed_range_rpm: [500.0, 15_000.0],
    }
}

#[test]
fn the_longest_model_takes_exactly_the_stated_size_and_comes_back_equal() {
    let mut buffer = [0; Model::<6>::max_size_bytes()];
    assert_eq!(full().encode(&mut buffer), Ok(buffer.len()));
    assert_eq!(Model::decode(&buffer), Ok(full()));
    let (short, _) = buffer.split_at_mut(Model::<6>::max_size_bytes() - 1);
    assert_eq!(full().encode(short), Err(ModelError::Space));
    assert_eq!(full().encode(&mut []), Err(ModelError::Space));
}

#[test]
fn bytes_after_the_checksum_are_ignored() {
    let mut page = [0xff; 2048];
    rigid_rotor().encode(&mut page).unwrap();
    assert_eq!(Model::decode(&page), Ok(rigid_rotor()));
}

#[test]
fn every_flipped_byte_and_every_cut_is_refused() {
    let mut buffer = [0; 1024];
    let length = rigid_rotor().encode(&mut buffer).unwrap();
    for place in 0..length {
        let mut damaged = buffer;
        damaged[place] ^= 0x10;
        let error = Model::<2>::decode(&damaged[..length]).unwrap_err();
        let expected: &[ModelError] = match place {
            0..4 => &[ModelError::Schema],
            4 => &[ModelError::BasisSize],
            _ => &[ModelError::Encoding],
        };
        assert!(expected.contains(&error), "byte {place}: {error:?}");
        assert!(Model::<2>::decode(&buffer[..place]).is_err());
    }
    assert_eq!(Model::<3>::decode(&buffer[..length]), Err(ModelError::BasisSize));
}

#[test]
fn each_fault_of_a_model_is_named() {
    assert_eq!(rigid_rotor().check(), Ok(()));
    assert_eq!(full().check(), Ok(()));
    type Fault = (fn(&mut Model<2>), ModelError);
    let faults: vec::Vec<Fault> = vec![
        (|m| m.stiffness[(0, 1)] = f32::NAN, ModelError::NotFinite),
        (|m| m.probes[3].gain[1] = f32::INFINITY, ModelError::NotFinite),
        (|m| m.supports[1].damping_n_s_m[0][1] = f32::NAN, ModelError::NotFinite),
        (|m| m.planes.clear(), ModelError::Planes),
        (|m| m.supports.truncate(1), ModelError::Supports),
        (|m| m.mass[(0, 1)] = 3.1, ModelError::Asymmetric),
        (|m| m.mass = -m.mass, ModelError::Mass),
        (|m| m.unbalance_floor_g_mm = -1.0, ModelError::UnbalanceFloor),
        (|m| m.speed_range_rpm = [2000.0, 1000.0], ModelError::SpeedRange),
        (|m| m.speed_range_rpm = [0.0, 1000.0], ModelError::SpeedRange),
        (|m| m.mass *= 1e36, ModelError::Response),
    ];
    for (number, (spoil, error)) in faults.into_iter().enumerate() {
        let mut model = rigid_rotor();
        spoil(&mut model);
        assert_eq!(model.check(), Err(error), "fault {number}");
    }
}

#[test]
fn speed_range_includes_its_ends_and_excludes_not_a_number() {
    let model = rigid_rotor();
    assert!(model.covers(600.0) && model.covers(12_000.0));
    assert!(!model.covers(599.0) && !model.covers(f32::NAN));
}
