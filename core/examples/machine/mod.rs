//! A machine to try things on: a stiff shaft on two supports, four probes, two planes.

use nalgebra::{Matrix2, Vector2};
use rotor_edge_core::model::{Description, Matrices, Model, Modes, Noise, Pair, Probe, Spring, Support};
use rotor_edge_core::reading::{ProbeVector, Reading, rad_s};
use rotor_edge_core::response::{SupportAmplitudes, response};

/// Two shapes (translation and tilt), four probes, two planes: what this firmware holds.
pub type MachineModel = Model<2, 4, 2>;

/// What a host would have deployed: usually many kilograms of finite elements, condensed to a few shapes.
pub fn model() -> MachineModel {
    let at = |place: f64| Vector2::new(1.0, place);
    let shaft = Matrices {
        stiffness: Matrix2::zeros(),
        mass: Matrix2::new(60.0, 3.0, 3.0, 20.0),
        polar_inertia: Matrix2::new(0.0, 0.0, 0.0, 4.0),
    };
    let springs = [-1.0, 1.0].map(|place| Spring { shape: at(place), stiffness_n_m: 1e8 });
    let modes = Modes::new(&shaft, &springs).expect("both ends are held");
    let support = |place| Support::isotropic(modes.shape(&at(place)), 5e7, 3e4);
    let probe = |place, direction, bearing| Probe::plain(modes.shape(&at(place)), direction, bearing);
    Model::new(&Description {
        machine: *b"P-1 ",
        shaft: &modes.shaft(),
        internal_damping_s: 0.0,
        planes: &[-0.5, 0.6].map(|place| modes.forward(&at(place))),
        supports: &[-1.0, 1.0].map(support),
        knots: &[],
        forcings: &[],
        probes: &[
            probe(-0.9, [1.0, 0.0], 0),
            probe(-0.9, [0.0, 1.0], 0),
            probe(0.9, [1.0, 0.0], 1),
            probe(0.9, [0.0, 1.0], 1),
        ],
        masked: 0,
        initial_unbalance_g_mm: &[[3000.0, 4000.0], [-1000.0, 2000.0]],
        unbalance_floor_g_mm: 100.0,
        noise: Noise { relative: 0.0, floor_um: 0.05 },
        speed_range_rpm: [600.0, 12_000.0],
    })
    .expect("it describes a machine")
}

/// An unbalance as it is seen at reading `number`: two readings of a machine are never the same to the bit, and data that
/// repeat are taken for stale.
pub fn seen(unbalance_g_mm: [Pair; 2], number: u64) -> [Pair; 2] {
    let factor = 1.0 + 1e-4 * ((number * 40_503 % 65_536) as f32 / 65_536.0);
    unbalance_g_mm.map(|[x, y]| [factor * x, factor * y])
}

/// What the probes of such a machine show.
pub fn reading(model: &MachineModel, speed_rpm: f32, unbalance_g_mm: &[Pair]) -> Reading {
    let response = response(model, rad_s(speed_rpm), &SupportAmplitudes::default()).expect("damped");
    let shown = |probe: usize| ProbeVector::from_phasor(response.probes()[probe].phasor(unbalance_g_mm));
    Reading::new(speed_rpm, &[0, 1, 2, 3].map(shown)).expect("four probes")
}

/// Returns the machine with half the stiffness upwards at its second bearing.
#[allow(dead_code, reason = "one example of three has no use for it")]
pub fn with_softer_bearing(machine: &MachineModel) -> MachineModel {
    let description = machine.description();
    let [first, second] = description.supports else { panic!("two supports") };
    let second = Support { stiffness_n_m: [[5e7, 0.0], [0.0, 2.5e7]], ..second.clone() };
    Model::new(&Description { supports: &[first.clone(), second], ..description }).expect("still a machine")
}
