//! A fit with some parameters held where a file has them.

use super::base::{BaseModel, FitInStatedNoise, same};
use crate::effects::entry;
use crate::error::Error;
use crate::fit::hypothesis::PlacedEffect;
use crate::fit::within::Bounds;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::Rotor;

/// A parameter that a fit leaves as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HeldParameter {
    /// Of a bearing, by its number in the file and its symbol, as `k_xx`.
    Bearing { number: usize, symbol: String },
    /// Of an effect, by its number in the file and its name; one that is solved for, as a phasor, cannot be held.
    Effect { number: usize, name: String },
}

impl BaseModel<'_> {
    /// The same model with these parameters held at what `file` says, everything else fitted to them.
    ///
    /// # Errors
    /// If the file has no such parameter, or the machine is singular with it.
    pub fn holding(mut self, file: &Rotor, held: &[HeldParameter]) -> Result<Self, Error> {
        if held.is_empty() {
            return Ok(self);
        }
        let size = self.hypothesis.size();
        let (mut low, mut high) = (vec![f64::NEG_INFINITY; size], vec![f64::INFINITY; size]);
        let mut start = self.fit.x.clone();
        for parameter in held {
            let (at, x) = self.coordinate(file, parameter)?;
            (low[at], high[at], start[at]) = (x, x, x);
        }
        let bounds = Bounds { low: &low, high: &high };
        let fit = self
            .fitter
            .trial(&self.hypothesis, &self.drawing, Some(&self.fit.amplitudes))?
            .fit_within(&start, bounds)?;
        // the search is another fit without the held parameters
        self.search.1 = fit.clone();
        self.in_stated_noise = FitInStatedNoise::as_it_is(&fit);
        self.fit = fit;
        Ok(self)
    }

    /// Number and value of a parameter among the search coordinates.
    fn coordinate(&self, file: &Rotor, parameter: &HeldParameter) -> Result<(usize, f64), Error> {
        let found = match parameter {
            HeldParameter::Bearing { number, symbol } => self.of_bearing(file, *number, symbol),
            HeldParameter::Effect { number, name } => self.of_effect(file, *number, name),
        };
        let found = found.filter(|(_, x)| x.is_finite());
        found.ok_or_else(|| {
            let name = match parameter {
                HeldParameter::Bearing { symbol, .. } => symbol,
                HeldParameter::Effect { name, .. } => name,
            };
            Error::Unsuitable(format!("the parameter {name} cannot be held, expected one that is fitted"))
        })
    }

    fn of_bearing(&self, file: &Rotor, number: usize, symbol: &str) -> Option<(usize, f64)> {
        let (stated, now) = (&self.hypothesis.bearings, Bearings::of(file));
        let place = |all: &Bearings| {
            all.unknowns().iter().position(|u| u.bearing == number && u.law.symbol == symbol)
        };
        let (at, from) = (place(stated)?, place(&now)?);
        let law = &now.unknowns()[from].law;
        Some((at, stated.unknowns()[at].law.scale.from_si(law.scale.to_si(law.stated))))
    }

    fn of_effect(&self, file: &Rotor, number: usize, name: &str) -> Option<(usize, f64)> {
        let entry = file.effect.get(number)?;
        let (effect, place) = entry::resolve(file, &entry.kind, entry.at.as_deref()).ok()?;
        let placed = PlacedEffect { effect, place };
        let scales = &self.hypothesis.scales;
        let own = self.hypothesis.effects.iter().position(|e| same(e, &placed))?;
        let before: usize =
            self.hypothesis.effects[..own].iter().map(|e| e.effect.parameters(scales).len()).sum();
        let parameters = effect.parameters(scales);
        let k = parameters.iter().position(|p| p.name == name)?;
        let value = entry::real_parameters(effect, entry, scales)[k];
        Some((self.hypothesis.bearings.count() + before + k, parameters[k].scale.from_si(value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{best_fit, fit_holding};
    use crate::simulate::{SimulationRequest, simulate};
    use crate::testing::sample_rotor;

    #[test]
    fn held_stiffness_stays_and_the_others_make_up_for_it() {
        let rotor = sample_rotor();
        let speeds_rpm: Vec<f64> = (0..40).map(|k| 2000.0 + 230.0 * f64::from(k)).collect();
        let readings =
            simulate(&rotor, &SimulationRequest { speeds_rpm, ..Default::default() }).unwrap().readings;
        let free = best_fit(&rotor, &readings).unwrap();
        let mut moved = free.rotor.clone();
        let xx = |rotor: &Rotor| rotor.bearing[0].constants().unwrap().stiffness_n_m.xx;
        moved.bearing[0].constants_mut().unwrap().stiffness_n_m.xx *= 1.3;
        let held = [HeldParameter::Bearing { number: 0, symbol: "k_xx".into() }];
        let found = fit_holding(&moved, &readings, &held).unwrap();
        assert!((xx(&found.rotor) / xx(&moved) - 1.0).abs() < 1e-9);
        let yy = |rotor: &Rotor| rotor.bearing[0].constants().unwrap().stiffness_n_m.yy;
        assert!((yy(&found.rotor) / yy(&free.rotor) - 1.0).abs() > 1e-6);
        assert!(found.chi2_per_value > free.chi2_per_value);
        // what is held where the free fit ends changes nothing
        let same = fit_holding(&free.rotor, &readings, &held).unwrap();
        assert!((same.chi2_per_value / free.chi2_per_value - 1.0).abs() < 1e-3);
    }

    #[test]
    fn unknown_parameter_is_refused_by_name() {
        let rotor = sample_rotor();
        let speeds_rpm: Vec<f64> = (0..40).map(|k| 2000.0 + 230.0 * f64::from(k)).collect();
        let readings =
            simulate(&rotor, &SimulationRequest { speeds_rpm, ..Default::default() }).unwrap().readings;
        let held = [HeldParameter::Bearing { number: 0, symbol: "k_zz".into() }];
        assert!(fit_holding(&rotor, &readings, &held).unwrap_err().to_string().contains("k_zz"));
    }
}
