use std::vec;

use nalgebra::{Matrix2, SMatrix, SVector};

use super::*;
use crate::testing::Random;

/// Translation and tilt of a stiff shaft: the place is relative to half of its length.
pub(crate) fn rigid_place(place: f64) -> SVector<f64, 2> {
    SVector::from([1.0, place])
}

pub(crate) fn rigid_matrices() -> Matrices<2> {
    Matrices {
        stiffness: Matrix2::zeros(),
        mass: Matrix2::new(60.0, 3.0, 3.0, 20.0),
        polar_inertia: Matrix2::new(0.0, 0.0, 0.0, 4.0),
    }
}

pub(crate) fn rigid_modes() -> Modes<2> {
    let springs = [-1.0, 1.0].map(|place| Spring { shape: rigid_place(place), stiffness_n_m: 5.5e7 });
    Modes::new(&rigid_matrices(), &springs).unwrap()
}

/// A stiff shaft on two unlike, damped supports.
pub(crate) fn rigid_rotor() -> Model<2, 4, 2> {
    let modes = rigid_modes();
    let at = |place| modes.shape(&rigid_place(place));
    let support = |place, kxx, kyy| Support {
        stiffness_n_m: [[kxx, 2e6], [-3e6, kyy]],
        ..Support::isotropic(at(place), 0.0, 3e4)
    };
    let probes = [(-0.9, [1.0, 0.0], 0), (-0.9, [0.0, 1.0], 0), (0.95, [1.0, 0.0], 1), (0.95, [0.0, 1.0], 1)];
    Model {
        machine: *b"unit",
        shaft: modes.shaft(),
        internal_damping_s: 0.0,
        planes: [-0.5, 0.6].map(|place| modes.forward(&rigid_place(place))).into_iter().collect(),
        supports: [support(-1.0, 6e7, 5e7), support(1.0, 4e7, 7e7)].into_iter().collect(),
        knots: Vec::new(),
        forcings: Vec::new(),
        probes: probes
            .map(|(place, direction, bearing)| Probe::plain(at(place), direction, bearing))
            .into_iter()
            .collect(),
        masked: 0,
        initial_unbalance_g_mm: Vec::from_array([[3000.0, 4000.0], [-1000.0, 2000.0]]),
        unbalance_floor_g_mm: 100.0,
        noise: Noise { relative: 0.0, floor_um: 0.1 },
        speed_range_rpm: [600.0, 12_000.0],
    }
}

type Full = Model<6, 4, 2>;

/// Every list as long as it may be, every number different.
fn full() -> Full {
    let mut random = Random::new(21);
    let mut place = || SVector::<f64, 6>::from_fn(|_, _| f64::from(random.signed()));
    let pedestal =
        Some(Pedestal { stiffness_n_m: [1e8, 2e8], damping_n_s_m: [1e4, 2e4], mass_kg: [3.0, 4.0] });
    let mut diagonal = SMatrix::<f64, 6, 6>::identity();
    diagonal[(0, 1)] = 0.25;
    diagonal[(1, 0)] = 0.25;
    let matrices = Matrices { stiffness: diagonal * 1e8, mass: diagonal * 30.0, polar_inertia: diagonal };
    let springs = [0; MAX_SUPPORTS].map(|_| Spring { shape: place(), stiffness_n_m: 1e7 });
    let modes = Modes::new(&matrices, &springs).unwrap();
    let mut forward = || modes.forward(&place());
    let mut model = Model {
        machine: [4, 3, 2, 1],
        shaft: modes.shaft(),
        internal_damping_s: 1e-6,
        planes: (0..2).map(|_| forward()).collect(),
        supports: springs
            .map(|spring| Support {
                pedestal,
                table: Some(KnotRange { first: 4, count: (MAX_KNOTS - 4) as u8 }),
                hardening_per_um2: 1e-4,
                ..Support::isotropic(modes.shape(&spring.shape), 1e7, 1e4)
            })
            .into_iter()
            .collect(),
        knots: (0..MAX_KNOTS)
            .map(|number| Knot {
                speed_rad_s: 100.0 * number as f32,
                stiffness_n_m: [[1e6, 2e5], [-3e5, 2e6]],
                damping_n_s_m: [[1e3, 2e2], [3e2, 4e3]],
            })
            .collect(),
        forcings: (0..MAX_FORCINGS)
            .map(|_| Forcing { shape: forward(), amplitude: [1.0, -2.0], law: ForcingLaw::SpeedSquared })
            .collect(),
        probes: Vec::new(),
        masked: 0b0100,
        initial_unbalance_g_mm: Vec::from_array([[1.0, 2.0], [3.0, 4.0]]),
        unbalance_floor_g_mm: 5.0,
        noise: Noise { relative: 0.0, floor_um: 0.25 },
        speed_range_rpm: [500.0, 15_000.0],
    };
    let probe = |_| Probe { mount: Some(3), ..Probe::plain(modes.shape(&place()), [1.0, 0.0], 1) };
    model.probes = (0..4).map(probe).collect();
    model
}

#[test]
fn longest_model_takes_stated_size_and_round_trips() {
    let mut buffer = [0; Full::max_size_bytes()];
    assert_eq!(full().encode(&mut buffer), Ok(buffer.len()));
    assert_eq!(Model::decode(&buffer), Ok(full()));
    let (short, _) = buffer.split_at_mut(Full::max_size_bytes() - 1);
    assert_eq!(full().encode(short), Err(ModelError::Space));
    assert_eq!(full().encode(&mut []), Err(ModelError::Space));
}

#[test]
fn longest_board_model_leaves_room_for_command_in_3_kilobytes() {
    const { assert!(Full::max_size_bytes() <= 2_400) };
}

#[test]
fn bytes_do_not_depend_on_the_capacity_they_are_read_with() {
    let (mut small, mut large) = ([0; 4096], [0; 4096]);
    let length = full().encode(&mut small).unwrap();
    let roomy = Model::<6, 8, 4>::decode(&small).unwrap();
    assert_eq!(roomy.encode(&mut large), Ok(length));
    assert_eq!(small, large);
    assert_eq!(roomy.checksum(), full().checksum());
}

#[test]
fn oversized_model_is_refused_naming_part_and_both_numbers() {
    let mut buffer = [0; 4096];
    full().encode(&mut buffer).unwrap();
    assert_eq!(Model::<6, 2, 2>::decode(&buffer), Err(ModelError::Probes));
    assert_eq!(Model::<6, 4, 1>::decode(&buffer), Err(ModelError::Planes));
    assert_eq!(Model::<5, 4, 2>::decode(&buffer), Err(ModelError::BasisSize));
    assert_eq!(Counts::read(&buffer), Some(Counts { shapes: 6, probes: 4, planes: 2 }));
    buffer[0] = 1;
    assert_eq!(Full::decode(&buffer), Err(ModelError::Schema));
    assert_eq!(Counts::read(&buffer), None);
}

#[test]
fn bytes_after_the_checksum_are_ignored() {
    let mut page = [0xff; 2048];
    rigid_rotor().encode(&mut page).unwrap();
    assert_eq!(Model::decode(&page), Ok(rigid_rotor()));
}

#[test]
fn every_flipped_byte_and_every_cut_is_refused() {
    type Small = Model<2, 4, 2>;
    let mut buffer = [0; 1024];
    let length = rigid_rotor().encode(&mut buffer).unwrap();
    for place in 0..length {
        for bit in [1, 0x10] {
            let mut damaged = buffer;
            damaged[place] ^= bit;
            let error = Small::decode(&damaged[..length]).unwrap_err();
            let expected: &[ModelError] = match place {
                0..4 => &[ModelError::Schema],
                4 => &[ModelError::BasisSize],
                5 => &[ModelError::Probes, ModelError::Encoding],
                6 => &[ModelError::Planes, ModelError::Encoding],
                // the length of a list may be what is damaged, and is read before the checksum
                _ => &[ModelError::Encoding, ModelError::Supports, ModelError::Knots, ModelError::Forcings],
            };
            assert!(expected.contains(&error), "byte {place}: {error:?}");
        }
        assert!(Small::decode(&buffer[..place]).is_err());
    }
    assert_eq!(Model::<3, 4, 2>::decode(&buffer[..length]), Err(ModelError::BasisSize));
}

#[test]
fn each_fault_of_a_model_is_named() {
    assert_eq!(rigid_rotor().check(), Ok(()));
    assert_eq!(full().check(), Ok(()));
    let knot = |speed_rad_s| Knot { speed_rad_s, stiffness_n_m: [[1e6; 2]; 2], damping_n_s_m: [[1e3; 2]; 2] };
    let with_table = move |m: &mut Model<2, 4, 2>, speeds: &[f32], count| {
        m.knots = speeds.iter().copied().map(knot).collect();
        m.supports[0].table = Some(KnotRange { first: 0, count });
    };
    type Fault = (std::boxed::Box<dyn Fn(&mut Model<2, 4, 2>)>, ModelError);
    fn fault(spoil: impl Fn(&mut Model<2, 4, 2>) + 'static, error: ModelError) -> Fault {
        (std::boxed::Box::new(spoil), error)
    }
    let faults: vec::Vec<Fault> = vec![
        fault(|m| m.shaft.forward_s2[1] = f32::NAN, ModelError::NotFinite),
        fault(|m| m.probes[3].gain[1] = f32::INFINITY, ModelError::NotFinite),
        fault(|m| m.supports[1].damping_n_s_m[0][1] = f32::NAN, ModelError::NotFinite),
        fault(|m| m.noise.floor_um = f32::NAN, ModelError::NotFinite),
        fault(move |m| with_table(m, &[1.0, f32::INFINITY], 2), ModelError::NotFinite),
        fault(|m| m.planes.clear(), ModelError::Planes),
        fault(|m| m.initial_unbalance_g_mm.truncate(1), ModelError::Planes),
        fault(|m| m.probes.clear(), ModelError::Probes),
        fault(|m| m.masked = 0b1111, ModelError::Probes),
        fault(|m| m.masked = 0b1_0000, ModelError::Probes),
        fault(|m| m.supports[1].shape.backward[0] = f32::NAN, ModelError::NotFinite),
        fault(|m| m.supports.truncate(1), ModelError::Supports),
        fault(|m| m.shaft.springs_n_m.push(1.0).unwrap(), ModelError::Supports),
        fault(|m| m.shaft.backward_s2[1] = 0.0, ModelError::Mass),
        fault(
            |m| {
                let [stiffness_n_m, damping_n_s_m, mass_kg] = [[1e8; 2], [0.0; 2], [5.0, -1.0]];
                m.supports[0].pedestal = Some(Pedestal { stiffness_n_m, damping_n_s_m, mass_kg });
            },
            ModelError::Mass,
        ),
        fault(
            |m| {
                let [stiffness_n_m, damping_n_s_m, mass_kg] = [[1e8, -1.0], [0.0; 2], [5.0; 2]];
                m.supports[0].pedestal = Some(Pedestal { stiffness_n_m, damping_n_s_m, mass_kg });
            },
            ModelError::Mass,
        ),
        fault(|m| m.probes[1].bearing = 7, ModelError::Bearing),
        fault(|m| m.supports[0].stiffness_n_m = [[-1e9, 0.0], [0.0, -1e9]], ModelError::NotHeld),
        fault(|m| m.supports[1].stiffness_n_m = [[5e7, 0.0], [0.0, -6e7]], ModelError::NotHeld),
        fault(|m| m.unbalance_floor_g_mm = -1.0, ModelError::UnbalanceFloor),
        fault(|m| m.noise.floor_um = -0.1, ModelError::Noise),
        fault(|m| m.speed_range_rpm = [2000.0, 1000.0], ModelError::SpeedRange),
        fault(|m| m.speed_range_rpm = [0.0, 1000.0], ModelError::SpeedRange),
        fault(|m| m.planes[0] *= 1e36, ModelError::Response),
        fault(move |m| with_table(m, &[100.0, 100.0], 2), ModelError::Knots),
        fault(move |m| with_table(m, &[200.0, 100.0], 2), ModelError::Knots),
        fault(move |m| with_table(m, &[100.0, 200.0], 1), ModelError::Knots),
        fault(move |m| with_table(m, &[100.0, 200.0], 3), ModelError::Knots),
        fault(|m| m.probes[1].mount = Some(0), ModelError::Mount),
        fault(|m| m.probes[1].mount = Some(9), ModelError::Mount),
        fault(|m| m.probes[2].gain = [0.0; 2], ModelError::ProbeGain),
        fault(|m| m.probes[2].direction = [1.0, 1.0], ModelError::ProbeGain),
    ];
    for (number, (spoil, error)) in faults.into_iter().enumerate() {
        let mut model = rigid_rotor();
        spoil(&mut model);
        assert_eq!(model.check(), Err(error), "fault {number}");
        assert_eq!(ModelError::from_code(error as u8), Some(error));
    }
}

/// Anisotropic bearings, fluid films with cross-coupling and magnets that pull, as long as the shaft stays.
#[test]
fn supports_that_hold_the_shaft_together_are_taken() {
    for stiffness_n_m in [
        [[9e7, 0.0], [0.0, -2e7]],
        [[1.3e7, 1.6e7], [-2.5e7, 0.9e7]],
        [[5e7, -4e8], [4e8, 5e7]],
        [[1e3, 0.0], [0.0, 1e3]],
    ] {
        let mut model = rigid_rotor();
        model.supports[1].stiffness_n_m = stiffness_n_m;
        assert_eq!(model.check(), Ok(()), "{stiffness_n_m:?}");
        // a magnet of −1e7 N/m beside bearings of 5e7
        let pull = Support::isotropic(model.supports[0].shape, -1e7, 0.0);
        model.supports.push(pull).unwrap();
        assert_eq!(model.check(), Ok(()), "{stiffness_n_m:?} and a magnet");
    }
}

#[test]
fn more_entries_than_there_is_room_for_are_refused_by_name() {
    let model = rigid_rotor();
    let description = model.description();
    let knot = Knot { speed_rad_s: 1.0, stiffness_n_m: [[0.0; 2]; 2], damping_n_s_m: [[0.0; 2]; 2] };
    let forcing = Forcing { shape: description.planes[0], amplitude: [0.0; 2], law: ForcingLaw::Constant };
    let supports = vec![description.supports[0].clone(); MAX_SUPPORTS + 1];
    let (probes, planes) = (vec![description.probes[0].clone(); 5], vec![description.planes[0]; 3]);
    let of = |description: &Description<2>| Model::<2, 4, 2>::new(description);
    assert_eq!(of(&description).as_ref(), Ok(&model));
    assert_eq!(of(&Description { supports: &supports, ..description }), Err(ModelError::Supports));
    assert_eq!(of(&Description { probes: &probes, ..description }), Err(ModelError::Probes));
    assert_eq!(of(&Description { planes: &planes, ..description }), Err(ModelError::Planes));
    let knots = vec![knot; MAX_KNOTS + 1];
    assert_eq!(of(&Description { knots: &knots, ..description }), Err(ModelError::Knots));
    let forcings = vec![forcing; MAX_FORCINGS + 1];
    assert_eq!(of(&Description { forcings: &forcings, ..description }), Err(ModelError::Forcings));
}

#[test]
fn speed_range_includes_its_ends_and_excludes_not_a_number() {
    let model = rigid_rotor();
    assert!(model.covers(600.0) && model.covers(12_000.0));
    assert!(!model.covers(599.0) && !model.covers(f32::NAN));
}
