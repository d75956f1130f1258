//! What probes and hardening supports see of the shaft's motion.

use core::array;

use super::correction::at;
use super::equations::whirling;
use super::motion::{Motion, Whirl};
use super::{C, Linear, Response, SupportAmplitudes};
use crate::model::{Model, Pair, Probe, Shape};
use crate::scalar;

/// Forward and backward whirl at one place of the shaft for each right-hand side.
#[derive(Clone, Copy)]
struct WhirlMotion<const PLANES: usize> {
    planes: [[C; 2]; PLANES],
    forced: Option<[C; 2]>,
}

/// Once in flash, not once for each right-hand side.
#[inline(never)]
fn whirl_at<const SHAPES: usize>(shape: &Shape<SHAPES>, whirl: &Whirl<SHAPES>) -> [C; 2] {
    let ([plus], [minus]) = (&shape.forward.data.0, &shape.backward.data.0);
    [at(plus, &whirl.plus), at(minus, &whirl.minus)]
}

/// Not by `==` of nalgebra, which takes three times the code.
fn is_same_place<const SHAPES: usize>(one: &Probe<SHAPES>, other: &Probe<SHAPES>) -> bool {
    let [one_cells, other_cells] =
        [one, other].map(|probe| (&probe.shape.forward.data.0, &probe.shape.backward.data.0));
    one_cells == other_cells && one.mount == other.mount
}

impl<const PLANES: usize> WhirlMotion<PLANES> {
    #[inline]
    fn new<const SHAPES: usize>(motion: &Motion<SHAPES, PLANES>, shape: &Shape<SHAPES>) -> Self {
        let whirl = |whirl: &Whirl<SHAPES>| whirl_at(shape, whirl);
        Self { planes: motion.planes.each_ref().map(whirl), forced: motion.forced.as_ref().map(whirl) }
    }

    /// Less a part of another place's motion.
    fn subtract(&mut self, [[pp, pm], [mp, mm]]: [[C; 2]; 2], other: &Self) {
        let pairs =
            self.planes.iter_mut().zip(&other.planes).chain(self.forced.iter_mut().zip(&other.forced));
        for ([plus, minus], [p, m]) in pairs {
            *plus -= pp * p + pm * m;
            *minus -= mp * p + mm * m;
        }
    }

    /// `cos·X + sin·Y` times a gain: with X = p + m and Y = −i(p − m) it is `(cos − i sin)·p + (cos + i sin)·m`.
    #[inline]
    fn along(&self, [cos, sin]: Pair, gain: C) -> Linear<PLANES> {
        let (forward, backward) = (gain * C::new(cos, -sin), gain * C::new(cos, sin));
        let read = |[p, m]: [C; 2]| forward * p + backward * m;
        Linear { per_unbalance: self.planes.map(read), fixed: self.forced.map_or(C::default(), read) }
    }
}

impl<const SHAPES: usize, const PLANES: usize> Motion<SHAPES, PLANES> {
    /// What the probes show of it, which may not be finite.
    #[inline(never)]
    pub fn read<const PROBES: usize>(
        &self,
        model: &Model<SHAPES, PROBES, PLANES>,
        speed: f32,
        amplitudes: &SupportAmplitudes,
    ) -> Response<PROBES, PLANES> {
        // Probes come in pairs at one place.
        let mut before: Option<(&Probe<SHAPES>, WhirlMotion<PLANES>)> = None;
        let shown = |number: usize| {
            let Some(probe) = model.probes.get(number) else {
                return Linear { per_unbalance: [C::default(); PLANES], fixed: C::default() };
            };
            let place = match &before {
                Some((other, place)) if is_same_place(other, probe) => place,
                _ => &before.insert((probe, self.seen(model, probe, speed, amplitudes))).1,
            };
            let [re, im] = probe.gain;
            let mut linear = place.along(probe.direction, C::new(re, im));
            let [re, im] = probe.runout_um;
            linear.fixed += C::new(re, im);
            linear
        };
        Response { probes: array::from_fn(shown), count: model.probes.len() as u8 }
    }

    /// The motion a probe sees: of the shaft, less that of the housing it is mounted on.
    #[inline]
    fn seen<const PROBES: usize>(
        &self,
        model: &Model<SHAPES, PROBES, PLANES>,
        probe: &Probe<SHAPES>,
        speed: f32,
        SupportAmplitudes(amplitudes): &SupportAmplitudes,
    ) -> WhirlMotion<PLANES> {
        let mut place = WhirlMotion::new(self, &probe.shape);
        let mount = probe.mount.map(usize::from);
        let mounted = mount.and_then(|mount| model.supports.get(mount).zip(amplitudes.get(mount)));
        if let Some((support, &amplitude)) = mounted {
            let knots = support.table.map_or(&[][..], |table| model.knots_of(table));
            let housing = whirling(&support.housing(knots, speed, amplitude));
            place.subtract(housing, &WhirlMotion::new(self, &support.shape));
        }
        place
    }

    /// Amplitudes of the shaft at the hardening supports (zero at the others) for an unbalance of each plane.
    #[inline(never)]
    pub fn support_amplitudes<const PROBES: usize>(
        &self,
        model: &Model<SHAPES, PROBES, PLANES>,
        unbalance_g_mm: &[Pair],
    ) -> SupportAmplitudes {
        let mut amplitudes = SupportAmplitudes::default();
        for (amplitude, support) in amplitudes.0.iter_mut().zip(&model.supports) {
            if support.hardening_per_um2 != 0.0 {
                let place = WhirlMotion::new(self, &support.shape);
                *amplitude = [[1.0, 0.0], [0.0, 1.0]].map(|direction| {
                    let y = place.along(direction, C::new(1.0, 0.0)).phasor(unbalance_g_mm);
                    scalar::length([y.re, y.im])
                });
            }
        }
        amplitudes
    }
}
