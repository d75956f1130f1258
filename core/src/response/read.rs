//! What probes and hardening supports see of the shaft's motion.

use core::array;

use nalgebra::SVector;

use super::coupled::at;
use super::motion::{Motion, Whirl, whirling};
use super::{C, Linear, Response, SupportAmplitudes};
use crate::model::{Model, Pair, Probe};

/// Forward and backward whirl at one place of the shaft for each right-hand side.
#[derive(Clone, Copy)]
struct Place<const PLANES: usize> {
    planes: [[C; 2]; PLANES],
    forced: [C; 2],
}

impl<const PLANES: usize> Place<PLANES> {
    #[inline]
    fn new<const N: usize>(motion: &Motion<N, PLANES>, shape: &SVector<f32, N>, is_forced: bool) -> Self {
        let [shape] = &shape.data.0;
        let whirl = |whirl: &Whirl<N>| [at(shape, &whirl.plus), at(shape, &whirl.minus)];
        Self {
            planes: array::from_fn(|plane| motion.planes.get(plane).map_or([C::default(); 2], whirl)),
            forced: if is_forced { whirl(&motion.forced) } else { [C::default(); 2] },
        }
    }

    /// Less a part of another place's motion.
    fn subtract(&mut self, [[pp, pm], [mp, mm]]: [[C; 2]; 2], other: &Self) {
        let pairs = self.planes.iter_mut().zip(&other.planes).chain([(&mut self.forced, &other.forced)]);
        for ([plus, minus], [p, m]) in pairs {
            *plus -= pp * p + pm * m;
            *minus -= mp * p + mm * m;
        }
    }

    /// `cos·X + sin·Y` times a gain: with X = p + m and Y = −i(p − m) it is `(cos − i sin)·p + (cos + i sin)·m`.
    #[inline]
    fn along(&self, [cos, sin]: Pair, gain: C, is_forced: bool) -> Linear<PLANES> {
        let (forward, backward) = (gain * C::new(cos, -sin), gain * C::new(cos, sin));
        let read = |[p, m]: [C; 2]| forward * p + backward * m;
        Linear {
            per_unbalance: self.planes.map(read),
            fixed: if is_forced { read(self.forced) } else { C::default() },
        }
    }
}

impl<const PROBES: usize, const PLANES: usize> Response<PROBES, PLANES> {
    #[inline]
    pub(super) fn read<const N: usize>(
        model: &Model<N, PROBES, PLANES>,
        motion: &Motion<N, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Self {
        let is_forced = !model.forcings.is_empty();
        let mut response = Self {
            probes: [Linear::default(); PROBES],
            supports: [[Linear::default(); 2]; _],
            count: model.probes.len() as u8,
        };
        // Probes come in pairs at one place.
        let mut before: Option<(&Probe<N>, Place<PLANES>)> = None;
        for (probe, linear) in model.probes.iter().zip(&mut response.probes) {
            let place = match before {
                Some((other, place)) if other.shape == probe.shape && other.mount == probe.mount => place,
                _ => seen(model, motion, probe, speed, amplitudes),
            };
            before = Some((probe, place));
            let [re, im] = probe.gain;
            *linear = place.along(probe.direction, C::new(re, im), is_forced);
            let [re, im] = probe.runout_um;
            linear.fixed += C::new(re, im);
        }
        for (support, linear) in model.supports.iter().zip(&mut response.supports) {
            if support.hardening_per_um2 != 0.0 {
                let place = Place::new(motion, &support.shape, is_forced);
                let one = C::new(1.0, 0.0);
                *linear = [[1.0, 0.0], [0.0, 1.0]].map(|direction| place.along(direction, one, is_forced));
            }
        }
        response
    }
}

/// The motion a probe sees: of the shaft, less that of the housing it is mounted on.
#[inline]
fn seen<const N: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<N, PROBES, PLANES>,
    motion: &Motion<N, PLANES>,
    probe: &Probe<N>,
    speed: f32,
    SupportAmplitudes(amplitudes): &SupportAmplitudes,
) -> Place<PLANES> {
    let is_forced = !model.forcings.is_empty();
    let mut place = Place::new(motion, &probe.shape, is_forced);
    let mount = probe.mount.map(usize::from);
    let mounted = mount.and_then(|mount| model.supports.get(mount).zip(amplitudes.get(mount)));
    if let Some((support, &amplitude)) = mounted {
        let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
        let housing = whirling(&support.housing(knots, speed, amplitude));
        place.subtract(housing, &Place::new(motion, &support.shape, is_forced));
    }
    place
}
