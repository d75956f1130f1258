//! A model is checked before it is taken: from its bytes, or as it is.

use crate::model::{MAX_BEARINGS, MAX_PLANES, Model, ModelError, Pedestal};
use crate::numerics::{InPlace, Numerics};
use crate::packed::{self, Packed};
use crate::reading::{MAX_PROBES, rad_s};
use crate::response::SupportAmplitudes;
use crate::scalar;

/// Relative step in speed that tries a model's conditioning, and the largest relative change of the response it may
/// cause: room for a resonance of quality 5,000; a shaft on fluid films stays below 100.
const SPEED_STEP: f32 = 1e-6;
const LARGEST_CHANGE: f32 = 1e-2;

/// Part of the stiffness on nominal springs by which rounding may make the stiffness on the supports negative.
const HELD: f32 = 1e-4;

/// A direction is a cosine and a sine; their squares may add up to one within this.
const DIRECTION: f32 = 0.02;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize> Model<SHAPES, PROBES, PLANES> {
    /// Reads what [`Model::encode`] wrote and checks it. Bytes after the checksum are ignored, so that a whole page of
    /// flash may be handed in.
    ///
    /// Errors: [`ModelError::Schema`], [`ModelError::BasisSize`], [`ModelError::Probes`] and [`ModelError::Planes`] (more
    /// than fit; see [`Counts::read`](crate::model::Counts::read)), [`ModelError::Supports`], [`ModelError::Knots`] and
    /// [`ModelError::Forcings`] (more than fit), [`ModelError::Encoding`], and those of [`Model::new`].
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, ModelError> {
        // One variable, returned as it is: a model is not small, and a second copy would be on the stack.
        let mut decoded = Ok(Self::EMPTY);
        if let Ok(model) = &mut decoded
            && let Err(error) = model.read(bytes).and_then(|_| model.check())
        {
            decoded = Err(error);
        }
        decoded
    }

    /// Which machine these bytes are of, if [`Model::decode`] would take them; the model that is tried is on the stack only
    /// as long.
    ///
    /// Errors: those of [`Model::decode`].
    #[inline(never)]
    pub(crate) fn verify<C: Numerics<SHAPES, PROBES, PLANES>>(bytes: &[u8]) -> Result<[u8; 4], ModelError> {
        let mut model = Self::EMPTY;
        model.read(bytes)?;
        model.check_by::<C>()?;
        Ok(model.machine)
    }

    /// Every number finite, at least a plane, a probe in use and two supports, positive masses, a speed range and speed tables
    /// in order, bearings and mounts that exist, supports that hold the shaft, and a finite, well-conditioned response at the
    /// range's ends and middle.
    ///
    /// Errors: the first fault found.
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        self.check_by::<InPlace>()
    }

    pub(crate) fn check_by<C: Numerics<SHAPES, PROBES, PLANES>>(&self) -> Result<(), ModelError> {
        let planes = self.planes.len();
        if planes == 0 || planes > MAX_PLANES || self.initial_unbalance_g_mm.len() != planes {
            return Err(ModelError::Planes);
        }
        let probes = self.probes.iter().fold(0, |mask, _| mask << 1 | 1_u8);
        if self.probes.is_empty() || self.probes.len() > MAX_PROBES || self.masked >= probes {
            return Err(ModelError::Probes);
        }
        if self.supports.len() < 2 || self.shaft.springs_n_m.len() > self.supports.len() {
            return Err(ModelError::Supports);
        }
        if !packed::is_finite(self) {
            return Err(ModelError::NotFinite);
        }
        if self.has_bad_mass() {
            return Err(ModelError::Mass);
        }
        if self.unbalance_floor_g_mm < 0.0 {
            return Err(ModelError::UnbalanceFloor);
        }
        if !(0.0..1.0).contains(&self.noise.relative) || self.noise.floor_um < 0.0 {
            return Err(ModelError::Noise);
        }
        let [lowest, highest] = self.speed_range_rpm;
        if !(lowest > 0.0 && highest >= lowest) {
            return Err(ModelError::SpeedRange);
        }
        self.check_terms()?;
        for speed_rpm in [lowest, 0.5 * (lowest + highest), highest] {
            if !self.is_held(rad_s(speed_rpm)) {
                return Err(ModelError::NotHeld);
            }
            self.try_out::<C>(rad_s(speed_rpm))?;
        }
        Ok(())
    }

    fn has_bad_mass(&self) -> bool {
        let light = |pedestal: &Pedestal| {
            let parts = [pedestal.mass_kg, pedestal.stiffness_n_m, pedestal.damping_n_s_m];
            parts.as_flattened().iter().any(|&part| part < 0.0)
        };
        self.shaft.backward_s2.iter().any(|&square| square <= 0.0)
            || self.supports.iter().any(|support| support.pedestal.as_ref().is_some_and(light))
    }

    fn check_terms(&self) -> Result<(), ModelError> {
        for table in self.supports.iter().filter_map(|support| support.table) {
            let knots = self.knots_of(table);
            let ascending =
                knots.iter().zip(knots.iter().skip(1)).all(|(a, b)| a.speed_rad_s < b.speed_rad_s);
            if knots.len() < 2 || !ascending {
                return Err(ModelError::Knots);
            }
        }
        for probe in &self.probes {
            if probe.bearing >= MAX_BEARINGS {
                return Err(ModelError::Bearing);
            }
            let [cos, sin] = probe.direction;
            if probe.gain == [0.0; 2] || (cos * cos + sin * sin - 1.0).abs() > DIRECTION {
                return Err(ModelError::ProbeGain);
            }
            let housing =
                |mount: u8| self.supports.get(usize::from(mount)).and_then(|support| support.pedestal);
            if probe.mount.is_some_and(|mount| housing(mount).is_none()) {
                return Err(ModelError::Mount);
            }
        }
        Ok(())
    }

    /// The static stiffness of the shaft on its supports, averaged over x and y, is positive definite at this speed. In the
    /// forward modes the shaft on its nominal springs is one, `ΨᵀK'Ψ = I`, from which each support takes its spring and adds
    /// its own. The mean does not depend on the axes, and the cross-coupling that fluid films have does not enter it.
    #[inline(never)]
    fn is_held(&self, speed_rad_s: f32) -> bool {
        let mut matrix = [[0.0; SHAPES]; SHAPES];
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = 1.0 + HELD;
        }
        for (place, support) in self.supports.iter().enumerate() {
            let knots = support.table.map_or(&[][..], |table| self.knots_of(table));
            let [[kxx, _], [_, kyy]] = support.static_stiffness_n_m(knots, speed_rad_s);
            let spring = self.shaft.springs_n_m.get(place).copied().unwrap_or_default();
            let beyond = 0.5 * (kxx + kyy) - spring;
            let [shape] = &support.shape.forward.data.0;
            for (row, &here) in matrix.iter_mut().zip(shape) {
                for (cell, &there) in row.iter_mut().zip(shape) {
                    *cell += beyond * here * there;
                }
            }
        }
        is_positive_definite(&mut matrix)
    }

    /// A response that a millionth of the speed turns over is one of rounding errors, not of the machine.
    fn try_out<C: Numerics<SHAPES, PROBES, PLANES>>(&self, speed_rad_s: f32) -> Result<(), ModelError> {
        let at =
            |speed| C::response(self, speed, &SupportAmplitudes::default()).map_err(|_| ModelError::Response);
        let (here, beside) = (at(speed_rad_s)?, at(speed_rad_s * (1.0 + SPEED_STEP))?);
        let (mut largest, mut change) = (0.0, 0.0);
        for (here, beside) in here.probes().iter().zip(beside.probes()) {
            // what is finite for a gram millimetre may not be for the unbalance that is there
            let shown = here.phasor(&self.initial_unbalance_g_mm);
            if !(shown.re.is_finite() && shown.im.is_finite()) {
                return Err(ModelError::Response);
            }
            for (here, beside) in here.per_unbalance.iter().zip(&beside.per_unbalance) {
                largest = scalar::greater(largest, scalar::size(*here));
                change = scalar::greater(change, scalar::size(here - beside));
            }
        }
        if change <= LARGEST_CHANGE * largest { Ok(()) } else { Err(ModelError::IllConditioned) }
    }
}

/// By elimination without pivoting: every pivot is positive exactly if the symmetric matrix is positive definite (Golub and
/// Van Loan 2013, section 4.2).
fn is_positive_definite<const SHAPES: usize>(matrix: &mut [[f32; SHAPES]; SHAPES]) -> bool {
    for column in 0..SHAPES {
        let pivot = matrix[column];
        let lead = pivot[column];
        if !(lead > 0.0 && lead.is_finite()) {
            return false;
        }
        for row in matrix.iter_mut().skip(column + 1) {
            let factor = row[column] / lead;
            for (cell, above) in row.iter_mut().zip(&pivot) {
                *cell -= factor * above;
            }
        }
    }
    true
}
