//! The terms of a machine, before any shape functions are chosen: what its file and its effects say.

use nalgebra::Complex;

use crate::bearing::foundation::Footing;
use crate::bearing::support::SupportLaw;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{Mount, Physics, Rotor};
use crate::machine::place::{Pattern, Place};

/// Supports, forcings and readings of a machine, by place.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms {
    /// Switches of the beam theory.
    pub physics: Physics,
    /// True speed over that in the data.
    pub speed_factor: f64,
    /// Viscous damping inside the shaft, as a multiple of its stiffness, s.
    pub internal_damping_s: f64,
    /// Bearings first, in the order of the file, then what effects add.
    pub supports: Vec<(Place, SupportLaw)>,
    /// What some of the bearings stand on together.
    pub foundation: Option<Footing>,
    /// Rotating forces beside the planes that are sought: pattern and amplitude.
    pub forcings: Vec<(Pattern, Complex<f64>)>,
    /// The probe of the file whose motion each column of the data shows.
    pub shows: Vec<usize>,
    /// Gain of each column.
    pub gains: Vec<Complex<f64>>,
    /// Runout of each column, m.
    pub runout_m: Vec<Complex<f64>>,
}

impl Terms {
    /// The machine as drawn: its bearings and true probes, no effects.
    pub fn drawn(rotor: &Rotor) -> Self {
        Self::on(rotor, Bearings::of(rotor).drawn())
    }

    /// The machine on these bearings, in the order of the file.
    pub fn on(rotor: &Rotor, bearings: Vec<SupportLaw>) -> Self {
        let place = |(i, law)| (Place::Bearing(i), law);
        Self {
            physics: rotor.physics,
            speed_factor: 1.0,
            internal_damping_s: 0.0,
            supports: bearings.into_iter().enumerate().map(place).collect(),
            foundation: rotor.footing(),
            forcings: Vec::new(),
            shows: (0..rotor.probe.len()).collect(),
            gains: vec![Complex::from(1.0); rotor.probe.len()],
            runout_m: vec![Complex::from(0.0); rotor.probe.len()],
        }
    }

    /// The bearing on whose housing a probe is mounted, where that housing moves.
    pub fn mount(&self, rotor: &Rotor, probe: usize) -> Option<usize> {
        // asked for every probe at every speed: names are compared only where it matters
        let probe = Some(&rotor.probe[probe]).filter(|p| p.mount == Mount::Housing)?;
        let bearing = rotor.bearing_of(probe)?;
        let (_, law) = self.supports.iter().find(|(p, _)| *p == Place::Bearing(bearing))?;
        let stands = self.foundation.as_ref().is_some_and(|f| f.bearings.contains(&bearing));
        (stands || law.pedestal.is_some()).then_some(bearing)
    }

    /// The law of a bearing.
    pub fn bearing_mut(&mut self, place: Place) -> &mut SupportLaw {
        let found = self.supports.iter_mut().find(|(p, _)| *p == place);
        &mut found.expect("every bearing of a rotor is among its terms").1
    }

    /// The laws of all bearings.
    pub fn bearings_mut(&mut self) -> impl Iterator<Item = (Place, &mut SupportLaw)> {
        let bearing = |(p, _): &&mut (Place, SupportLaw)| matches!(p, Place::Bearing(_));
        self.supports.iter_mut().filter(bearing).map(|(p, law)| (*p, law))
    }
}

/// Position of a place that can hold the shaft, m.
pub fn position_m(rotor: &Rotor, place: Place) -> Option<f64> {
    match place {
        Place::Bearing(i) => Some(rotor.bearing[i].position_m),
        Place::Disk(i) => Some(rotor.disk[i].position_m),
        Place::LeftEnd | Place::Probe(_) | Place::Run(_) | Place::Machine => None,
        Place::Span(_) | Place::Strain(..) => None,
    }
}
