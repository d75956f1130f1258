//! Bearing coefficients, film and table parameters of a fit with their uncertainty.

use nalgebra::DMatrix;

use crate::machine::bearings::{BearingUnknown, Bearings};
use crate::machine::drawing::Rotor;
use crate::statistics::contradiction::{ContradictedNumber, StatedNumber, contradicted};
use crate::statistics::interval::interval_95;

/// What the data said about a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Identifiability {
    /// The data fix it at least twice as well as the starting guess did.
    FromData,
    /// The data say little or nothing; it stayed near its start.
    StayedAtStart,
    /// The search range ended here.
    AtBound,
}

#[derive(Debug, Clone, PartialEq)]
pub struct BearingParameter {
    pub bearing: String,
    /// `k_xx`, `k_yy`, `c_xx`, `c_yy`, or what else the law leaves open.
    pub symbol: String,
    /// SI unit.
    pub unit: &'static str,
    pub value: f64,
    /// Where the search began.
    pub start: f64,
    /// Standard deviation relative to the value, prior included; of a number that may vanish, relative to its unit.
    pub relative_sd: f64,
    /// Ends of the 95 % interval, prior included; `None` at a bound and where no covariance is known.
    pub interval_95: Option<[f64; 2]>,
    /// Whether the data decided it.
    pub identified: Identifiability,
    /// The same by the data alone, where they contradict what is stated.
    pub departure: Option<Departure>,
}

/// A number of a bearing that is not as stated: the 95 % interval of the data does not reach the 95 % range of the stated number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// By the data alone, SI unit.
    pub value: f64,
    /// Ends of its 95 % interval.
    pub interval_95: [f64; 2],
    /// Ends of the 95 % range of the stated number.
    pub stated_95: [f64; 2],
}

impl BearingParameter {
    /// All of a rotor's at search coordinates whose covariance leads `covariance`.
    pub(crate) fn all(
        rotor: &Rotor,
        bearings: &Bearings,
        x: &[f64],
        covariance: Option<&DMatrix<f64>>,
        at_bound: impl Fn(usize) -> bool,
    ) -> Vec<Self> {
        let departures = covariance.map_or_else(Vec::new, |c| departures(rotor, bearings, x, c));
        let one = |(i, BearingUnknown { bearing, law }): (usize, &BearingUnknown)| {
            let sd = covariance.map_or(f64::INFINITY, |c| c[(i, i)].max(0.0).sqrt());
            let interval = interval_95(x[i], sd).map(|end| law.scale.to_si(end));
            let identified = match at_bound(i) {
                true => Identifiability::AtBound,
                false if sd < 0.5 * law.prior_sd => Identifiability::FromData,
                false => Identifiability::StayedAtStart,
            };
            let is_known = sd.is_finite() && identified != Identifiability::AtBound;
            Self {
                bearing: rotor.bearing[*bearing].name.clone(),
                symbol: law.symbol.clone(),
                unit: law.unit,
                value: law.scale.to_si(x[i]),
                start: law.scale.to_si(law.stated),
                relative_sd: sd,
                interval_95: is_known.then_some(interval),
                identified,
                departure: departures.iter().find(|(place, _)| is_known && *place == i).map(|(_, d)| *d),
            }
        };
        bearings.unknowns().iter().enumerate().map(one).collect()
    }
}

/// The numbers that are not as stated, with their places, of bearings that state a tolerance.
fn departures(
    rotor: &Rotor,
    bearings: &Bearings,
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<(usize, Departure)> {
    let unknowns = bearings.unknowns();
    let stated = |(place, u): (usize, &BearingUnknown)| {
        let number = StatedNumber { place, mean: u.law.stated, sd: u.law.prior_sd };
        rotor.bearing[u.bearing].states_tolerance().then_some(number)
    };
    let stated: Vec<StatedNumber> = unknowns.iter().enumerate().filter_map(stated).collect();
    let departure = |found: ContradictedNumber| {
        let law = &unknowns[found.place].law;
        let departure = Departure {
            value: law.scale.to_si(found.value),
            interval_95: found.interval_95.map(|end| law.scale.to_si(end)),
            stated_95: interval_95(law.stated, law.prior_sd).map(|end| law.scale.to_si(end)),
        };
        (found.place, departure)
    };
    contradicted(&x[..unknowns.len()], covariance, &stated).into_iter().map(departure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    #[test]
    fn stiffness_interval_is_a_factor_either_way() {
        let rotor = sample_rotor();
        let bearings = Bearings::of(&rotor);
        let covariance = DMatrix::from_diagonal_element(bearings.count(), bearings.count(), 0.01);
        let x = bearings.stated();
        let all = BearingParameter::all(&rotor, &bearings, &x, Some(&covariance), |i| i == 1);
        let [low, high] = all[0].interval_95.unwrap();
        assert!((low * high / all[0].value.powi(2) - 1.0).abs() < 1e-9);
        assert!(((high / low).ln() - 0.392).abs() < 1e-9);
        assert_eq!((all[1].interval_95, all[1].identified), (None, Identifiability::AtBound));
        let open = BearingParameter::all(&rotor, &bearings, &x, None, |_| false);
        assert!(open.iter().all(|p| p.interval_95.is_none()));
    }
}
