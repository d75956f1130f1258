//! The dynamic stiffness at one speed, solved once: influence of the unbalance, and what is there without it.
//!
//! # Forward and backward whirl
//! With `p = (X + iY)/2` and `m = (X − iY)/2`, forward and backward whirl, the equations of the shaft fall apart: the rows
//! of the dynamic stiffness of [`Matrices`](crate::model::Matrices), taken as `(Fx ± iFy)/2`, are
//!
//! ```text
//! (K − W²M + W²G)         p = Fp      real: internal damping does nothing on forward synchronous whirl
//! (K − W²M − W²G + 2iWηK) m = Fm
//! ```
//!
//! On nominal springs they are diagonal in modes that no speed changes ([`Modes`](crate::model::Modes)). A force that turns
//! with the shaft (`Fx = F`, `Fy = −iF`) is `Fp = F`, `Fm = 0`.
//! A support `[[xx, xy], [yx, yy]]` adds `φφᵀ` times
//!
//! ```text
//! pp = (xx + yy + i(yx − xy))/2    pm = (xx − yy + i(yx + xy))/2
//! mp = (xx − yy − i(yx + xy))/2    mm = (xx + yy − i(yx − xy))/2
//! ```
//!
//! less its nominal spring: a correction as small as the supports are few.

mod correction;
mod elimination;
mod equations;
mod motion;
mod read;
mod solve;
#[cfg(test)]
mod tests;

use core::error::Error;
use core::fmt;

use nalgebra::Complex;

use crate::model::{MAX_SUPPORTS, Model, Pair};
use crate::reading::ProbeVector;
pub(crate) use motion::Motion;

pub(crate) type C = Complex<f32>;

/// Amplitude of the shaft along x and y at each support, µm zero-to-peak: what hardening supports depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SupportAmplitudes(pub [Pair; MAX_SUPPORTS]);

/// Why there is no response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResponseError {
    /// The dynamic stiffness is singular at this speed.
    Singular,
    /// A number overflowed or was not one.
    NotFinite,
}

impl fmt::Display for ResponseError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Singular => "the dynamic stiffness is singular at this speed",
            Self::NotFinite => "the response at this speed is infinite or not a number",
        })
    }
}

impl Error for ResponseError {}

/// A motion that is linear in the unbalance, as phasors: `fixed + Σ per_unbalance·u`, `u = U e^{iα}` of each plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear<const PLANES: usize> {
    /// µm per g·mm of each plane.
    pub per_unbalance: [C; PLANES],
    /// µm, from forcings (and runout, for a probe).
    pub fixed: C,
}

impl<const PLANES: usize> Linear<PLANES> {
    /// Phasor for an unbalance `[U cos α, U sin α]` of each plane, µm.
    #[inline]
    pub fn phasor(&self, unbalance_g_mm: &[Pair]) -> C {
        let mut sum = self.fixed;
        for (influence, &[x, y]) in self.per_unbalance.iter().zip(unbalance_g_mm) {
            sum += influence * C::new(x, y);
        }
        sum
    }

    fn is_finite(&self) -> bool {
        self.per_unbalance.iter().chain([&self.fixed]).all(|z| z.re.is_finite() && z.im.is_finite())
    }
}

/// Response of the model at one speed.
///
/// ```
/// # use rotor_edge_core::model::{Description, Matrices, Model, Modes, Probe, Spring, Support};
/// # use nalgebra::{Matrix1, SVector};
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// use rotor_edge_core::response::{SupportAmplitudes, response};
/// // a disk of 10 kg on two springs of 5e6 N/m: far above resonance it moves by −U/m
/// # let matrices = Matrices {
/// #     stiffness: Matrix1::new(0.0), mass: Matrix1::new(10.0), polar_inertia: Matrix1::new(0.0),
/// # };
/// # let place = SVector::from([1.0]);
/// # let modes = Modes::new(&matrices, &[Spring { shape: place, stiffness_n_m: 5e6 }; 2])?;
/// # let one = modes.shape(&place);
/// # let model = Model::<1, 2, 1>::new(&Description {
/// #     machine: [0; 4], shaft: &modes.shaft(), internal_damping_s: 0.0,
/// #     planes: &[modes.forward(&place)], initial_unbalance_g_mm: &[[1000.0, 0.0]],
/// #     supports: &[Support::isotropic(one, 5e6, 100.0), Support::isotropic(one, 5e6, 100.0)],
/// #     knots: &[], forcings: &[],
/// #     probes: &[Probe::plain(one, [1.0, 0.0], 0), Probe::plain(one, [0.0, 1.0], 0)], masked: 0,
/// #     unbalance_floor_g_mm: 1.0, noise: Default::default(), speed_range_rpm: [100.0, 2e5],
/// # })?;
/// let at_speed = response(&model, 20_000.0, &SupportAmplitudes::default())?;
/// let along_x = at_speed.probes()[0].phasor(&[[1000.0, 0.0]]);
/// assert!((along_x.re + 100.0).abs() < 1.0);
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const PROBES: usize, const PLANES: usize> {
    probes: [Linear<PLANES>; PROBES],
    count: u8,
}

/// Solves the model at one speed.
///
/// Errors: [`ResponseError::Singular`], [`ResponseError::NotFinite`].
pub fn response<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
    speed_rad_s: f32,
    support_amplitudes_um: &SupportAmplitudes,
) -> Result<Response<PROBES, PLANES>, ResponseError> {
    let mut motion = Motion::forces(model, speed_rad_s);
    motion.solve(model, speed_rad_s, support_amplitudes_um)?;
    // One variable, returned as it is: a copy would cost as much as a probe.
    let at_speed = Ok(motion.read(model, speed_rad_s, support_amplitudes_um));
    if let Ok(at_speed) = &at_speed {
        at_speed.check()?;
    }
    at_speed
}

/// Amplitudes of the shaft at the hardening supports, µm zero-to-peak (zero at the others), for an unbalance
/// `[U cos α, U sin α]` of each plane in g·mm, while the supports are as stiff as at `support_amplitudes_um`.
///
/// Errors: [`ResponseError::Singular`].
pub fn support_amplitudes<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
    speed_rad_s: f32,
    support_amplitudes_um: &SupportAmplitudes,
    unbalance_g_mm: &[Pair],
) -> Result<SupportAmplitudes, ResponseError> {
    let mut motion = Motion::forces(model, speed_rad_s);
    motion.solve(model, speed_rad_s, support_amplitudes_um)?;
    Ok(motion.support_amplitudes(model, unbalance_g_mm))
}

impl<const PROBES: usize, const PLANES: usize> Response<PROBES, PLANES> {
    /// What each probe of the model shows.
    pub fn probes(&self) -> &[Linear<PLANES>] {
        self.probes.get(..usize::from(self.count)).unwrap_or_default()
    }

    /// Errors: [`ResponseError::NotFinite`].
    pub(crate) fn check(&self) -> Result<(), ResponseError> {
        if self.probes().iter().all(Linear::is_finite) { Ok(()) } else { Err(ResponseError::NotFinite) }
    }

    /// What each probe of the model shows for an unbalance `[U cos α, U sin α]` of each plane in g·mm.
    pub fn vectors(&self, unbalance_g_mm: &[Pair]) -> impl Iterator<Item = ProbeVector> {
        self.probes().iter().map(|linear| ProbeVector::from_phasor(linear.phasor(unbalance_g_mm)))
    }
}
