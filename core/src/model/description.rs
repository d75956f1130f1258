//! The parts of a model, and a model made of them.

use heapless::Vec;
use nalgebra::SVector;

use super::{Forcing, Knot, Model, ModelError, Noise, Pair, Probe, Shaft, Support};

/// The parts of a [`Model`], as slices: what [`Model::new`] makes one from and [`Model::description`] shows of it.
///
/// A changed model is a description with other parts, checked anew:
///
/// ```
/// # use rotor_edge_core::model::{Description, Matrices, Model, ModelError, Modes, Noise, Probe, Spring, Support};
/// # use rotor_edge_core::nalgebra::{Matrix1, SVector};
/// # let matrices = Matrices {
/// #     stiffness: Matrix1::new(0.0), mass: Matrix1::new(10.0), polar_inertia: Matrix1::new(0.0),
/// # };
/// # let place = SVector::from([1.0]);
/// # let modes = Modes::new(&matrices, &[Spring { shape: place, stiffness_n_m: 5e6 }; 2]).unwrap();
/// # let one = modes.shape(&place);
/// # let machine = Model::<1, 2, 1>::new(&Description {
/// #     machine: [0; 4], shaft: &modes.shaft(), internal_damping_s: 0.0,
/// #     planes: &[modes.forward(&place)], initial_unbalance_g_mm: &[[1000.0, 0.0]],
/// #     supports: &[Support::isotropic(one, 5e6, 100.0), Support::isotropic(one, 5e6, 100.0)],
/// #     knots: &[], forcings: &[],
/// #     probes: &[Probe::plain(one, [1.0, 0.0], 0), Probe::plain(one, [0.0, 1.0], 0)], masked: 0,
/// #     unbalance_floor_g_mm: 1.0, noise: Noise::default(), speed_range_rpm: [100.0, 5000.0],
/// # }).unwrap();
/// let description = machine.description();
/// let softer: [Support<1>; 2] = [0, 1].map(|i| {
///     let mut support = description.supports[i].clone();
///     support.stiffness_n_m = [[2e6, 0.0], [0.0, 2e6]];
///     support
/// });
/// let machine = Model::<1, 2, 1>::new(&Description { supports: &softer, ..description });
/// assert!(machine.is_ok());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Description<'a, const SHAPES: usize> {
    /// The machine's identity, the same in every model of one machine. A monitor that holds a model takes those of its own
    /// machine only, unless it is told otherwise.
    pub machine: [u8; 4],
    /// The shaft on its nominal springs, from [`Modes::shaft`](super::Modes::shaft). The terms of the supports are whole:
    /// what a nominal spring adds is taken off again.
    pub shaft: &'a Shaft<SHAPES>,
    /// Rotating internal damping of the shaft: stress in phase with the rate of strain, relative to its stiffness, s.
    pub internal_damping_s: f32,
    /// Forward shape at each plane whose unbalance is tracked: one to `PLANES`.
    pub planes: &'a [SVector<f32, SHAPES>],
    /// Unbalance that phase I found in each plane, `[U cos α, U sin α]`, g·mm.
    pub initial_unbalance_g_mm: &'a [Pair],
    /// Bearings and seals, which tie the shaft to the ground: two to [`MAX_SUPPORTS`](super::MAX_SUPPORTS).
    pub supports: &'a [Support<SHAPES>],
    /// Entries of the supports' speed tables, each support's in a row: up to [`MAX_KNOTS`](super::MAX_KNOTS).
    pub knots: &'a [Knot],
    /// Excitation beside the tracked unbalance (bow, skew, coupling force, further planes): up to
    /// [`MAX_FORCINGS`](super::MAX_FORCINGS).
    pub forcings: &'a [Forcing<SHAPES>],
    /// One to `PROBES`, in the order of a reading's.
    pub probes: &'a [Probe<SHAPES>],
    /// Bit i: probe i is never used. At least one is.
    pub masked: u8,
    /// The bound on a plane's unbalance never falls below this, g·mm, so that a well balanced plane can grow again.
    pub unbalance_floor_g_mm: f32,
    /// Scatter from reading to reading.
    pub noise: Noise,
    /// Lowest and highest speed the model was made for, rpm.
    pub speed_range_rpm: [f32; 2],
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Model<SHAPES, PROBES, PLANES> {
    /// Makes a model and checks it.
    ///
    /// Errors: [`ModelError::Planes`], [`ModelError::Supports`], [`ModelError::Knots`], [`ModelError::Forcings`] and
    /// [`ModelError::Probes`] for more entries than there is room for; otherwise the first fault found: a number that is not
    /// finite, no plane, no probe in use, fewer than two supports, a mass that is not positive, a speed range or table out of
    /// order, a bearing or mount that does not exist, supports that do not hold the shaft, a response that is not finite or
    /// is ill-conditioned.
    pub fn new(description: &Description<SHAPES>) -> Result<Self, ModelError> {
        let model = Self {
            machine: description.machine,
            shaft: description.shaft.clone(),
            internal_damping_s: description.internal_damping_s,
            planes: held(description.planes, ModelError::Planes)?,
            supports: held(description.supports, ModelError::Supports)?,
            knots: held(description.knots, ModelError::Knots)?,
            forcings: held(description.forcings, ModelError::Forcings)?,
            probes: held(description.probes, ModelError::Probes)?,
            masked: description.masked,
            initial_unbalance_g_mm: held(description.initial_unbalance_g_mm, ModelError::Planes)?,
            unbalance_floor_g_mm: description.unbalance_floor_g_mm,
            noise: description.noise,
            speed_range_rpm: description.speed_range_rpm,
        };
        model.check()?;
        Ok(model)
    }

    /// The parts of the model.
    pub fn description(&self) -> Description<'_, SHAPES> {
        Description {
            machine: self.machine,
            shaft: &self.shaft,
            internal_damping_s: self.internal_damping_s,
            planes: &self.planes,
            initial_unbalance_g_mm: &self.initial_unbalance_g_mm,
            supports: &self.supports,
            knots: &self.knots,
            forcings: &self.forcings,
            probes: &self.probes,
            masked: self.masked,
            unbalance_floor_g_mm: self.unbalance_floor_g_mm,
            noise: self.noise,
            speed_range_rpm: self.speed_range_rpm,
        }
    }
}

fn held<T: Clone, const MOST: usize>(
    entries: &[T],
    too_many: ModelError,
) -> Result<Vec<T, MOST>, ModelError> {
    Vec::from_slice(entries).map_err(|_| too_many)
}
