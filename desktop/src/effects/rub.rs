//! A disk that touches what is around it.

use nalgebra::Matrix2;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, disks};
use crate::bearing::rub::RubContact;
use crate::bearing::support::SupportLaw;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Contact all round at one disk beyond a clearance, with friction.
pub struct Rub;

impl Effect for Rub {
    fn name(&self) -> &'static str {
        "rub"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        disks(rotor)
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        let any = f64::INFINITY;
        let positive =
            |name, unit, most| Parameter { name, unit, scale: Scale::Logarithmic, bounds: [0.0, most] };
        // friction always acts against the rotation, and of dry metals it does not exceed the normal force
        vec![positive("k", "N/m", any), positive("clearance", "m", any), positive("mu", "", 1.0)]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        // between bearings a disk moves several times as far as the shaft at them
        let at_peaks = [1.0, 3.0, 10.0].map(|far| [0.1, far]);
        // what touches at every speed is seen by its friction, which stands against damping and not against stiffness
        let everywhere = [0.001, 0.3];
        let start =
            |[stiff, far]: [f64; 2]| vec![stiff * scales.stiffness_n_m, far * scales.amplitude_m, 0.15];
        at_peaks.into_iter().chain([everywhere]).map(start).collect()
    }

    /// A stiffer stator at the same clearance.
    fn strengthened(&self, _: &Scales, parameters: &[f64], strength: f64) -> Vec<f64> {
        let mut stronger = parameters.to_vec();
        stronger.iter_mut().take(1).for_each(|stiffness_n_m| *stiffness_n_m *= strength);
        stronger
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let &[stiffness_n_m, clearance_m, friction] = parameters else { return };
        let rub = Some(RubContact { stiffness_n_m, clearance_m, friction });
        terms
            .supports
            .push((place, SupportLaw { rub, ..SupportLaw::linear(Matrix2::zeros(), Matrix2::zeros()) }));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The rotor touches the stator at one disk where it moves further than the clearance: held back there \
                   and pushed against the rotation, near a resonance only, and more with more weight.",
            means: "A seal, blade tip or oil guard with too little clearance, a casing that is distorted or has moved, \
                    too large an unbalance or bow.",
            inspect: "Rub marks and clearances at this disk; orbits that are flat on one side, whole multiples and \
                      fractions of running speed in the spectrum.",
        }
    }
}
