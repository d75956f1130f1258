//! A probe that shows too much, too little, or in the wrong direction.

use nalgebra::Complex;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Gain and phase of one probe: it shows `gain · e^{i phase}` times what is there.
pub struct ProbeCalibration;

impl Effect for ProbeCalibration {
    fn name(&self) -> &'static str {
        "probe_calibration"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        (0..rotor.probe.len()).map(Place::Probe).collect()
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        let turn = std::f64::consts::TAU;
        vec![
            Parameter { name: "gain", unit: "", scale: Scale::Logarithmic, bounds: [0.05, 20.0] },
            Parameter { name: "phase", unit: "rad", scale: Scale::Linear(1.0), bounds: [-turn, turn] },
        ]
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        [0.0, 1.6, -1.6, 3.1].map(|phase| vec![1.0, phase]).to_vec()
    }

    fn typical(&self, _: &Scales) -> Vec<f64> {
        vec![1.1, 0.1]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let (Place::Probe(p), &[gain, phase]) = (place, parameters) else { return };
        terms.gains[p] *= Complex::from_polar(gain, phase);
    }

    fn misreading(&self, rotor: &Rotor, place: Place, parameters: &[f64]) -> Option<String> {
        let &[gain, phase_rad] = parameters else { return None };
        // no "-0°"
        let off_deg = Complex::from_polar(1.0, phase_rad).arg().to_degrees().round() + 0.0;
        Some(format!(
            "Probe {} does not show what the others do: gain {gain:.2}, {off_deg:.0}° off",
            place.name(rotor)?
        ))
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "One probe shows the motion too large or too small, or turned by an angle, at every speed alike; the \
                   others are right.",
            means: "A wrong scale factor, a probe mounted at another angle, swapped or reversed wiring, a damaged tip.",
            inspect: "Calibrate the probe against its target material; check its angle, cable length and channel.",
        }
    }
}
