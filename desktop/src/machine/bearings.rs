//! The bearings of a machine together: what data may decide about them, in one list.

use super::drawing::{Bearing, Rotor};
use crate::bearing::Law;
use crate::bearing::law::{LawUnknown, PRIOR_LOG_SD, Role};
use crate::bearing::support::{Pedestal, SupportLaw};

/// A number of one bearing that data may decide.
#[derive(Debug, Clone, PartialEq)]
pub struct BearingUnknown {
    /// Number of the bearing in the file.
    pub bearing: usize,
    pub law: LawUnknown,
}

/// All bearings of a machine, with their unknowns in one order: direct stiffness of every bearing, then direct
/// damping, then everything else.
#[derive(Debug, Clone, PartialEq)]
pub struct Bearings {
    laws: Vec<Law>,
    pedestals: Vec<Option<Pedestal>>,
    unknowns: Vec<BearingUnknown>,
    /// Place of each bearing's own unknowns, in the order of its law, among all.
    places: Vec<Vec<usize>>,
}

impl Bearings {
    pub fn of(rotor: &Rotor) -> Self {
        let each = |(bearing, b): (usize, &Bearing)| {
            let trust = b.coefficients_relative.map_or(1.0, |relative| relative / PRIOR_LOG_SD);
            let own = b.law.as_law().unknowns().into_iter().enumerate();
            own.map(move |(number, law)| {
                (bearing, number, LawUnknown { prior_sd: trust * law.prior_sd, ..law })
            })
            .collect::<Vec<_>>()
        };
        let mut all: Vec<(usize, usize, LawUnknown)> =
            rotor.bearing.iter().enumerate().flat_map(each).collect();
        all.sort_by_key(|(_, _, law)| law.role);
        let mut places: Vec<Vec<usize>> =
            rotor.bearing.iter().map(|b| vec![0; b.law.as_law().unknowns().len()]).collect();
        for (place, (bearing, number, _)) in all.iter().enumerate() {
            places[*bearing][*number] = place;
        }
        Self {
            laws: rotor.bearing.iter().map(|b| b.law.clone()).collect(),
            pedestals: rotor.bearing.iter().map(|b| b.pedestal).collect(),
            unknowns: all.into_iter().map(|(bearing, _, law)| BearingUnknown { bearing, law }).collect(),
            places,
        }
    }

    /// How many numbers data may decide.
    pub fn count(&self) -> usize {
        self.unknowns.len()
    }

    pub fn unknowns(&self) -> &[BearingUnknown] {
        &self.unknowns
    }

    /// Search coordinates of what the file states.
    pub fn stated(&self) -> Vec<f64> {
        self.unknowns.iter().map(|u| u.law.stated).collect()
    }

    /// The stated coordinates with every direct stiffness and damping times factors, given by their logarithms.
    pub fn shifted(&self, from: &[f64], stiffness: f64, damping: f64) -> Vec<f64> {
        let by = |u: &BearingUnknown| match u.law.role {
            Role::Stiffness => stiffness,
            Role::Damping => damping,
            Role::Other => 0.0,
        };
        from.iter().zip(&self.unknowns).map(|(x, u)| x + by(u)).collect()
    }

    /// Deviations from what the file states, in standard deviations of the prior.
    pub fn prior_residuals<'x>(&'x self, x: &'x [f64]) -> impl Iterator<Item = f64> + 'x {
        self.unknowns.iter().zip(x).map(|(u, x)| (x - u.law.stated) / u.law.prior_sd)
    }

    /// The supports at these search coordinates, in the order of the file.
    pub fn supports(&self, x: &[f64]) -> Vec<SupportLaw> {
        let own = |bearing: usize| self.places[bearing].iter().map(|p| x[*p]).collect::<Vec<f64>>();
        let support = |(bearing, law): (usize, &Law)| SupportLaw {
            pedestal: self.pedestals[bearing],
            ..law.as_law().support(&own(bearing))
        };
        self.laws.iter().enumerate().map(support).collect()
    }

    /// The supports as the file states them, in its order.
    pub fn drawn(&self) -> Vec<SupportLaw> {
        let support = |(law, pedestal): (&Law, &Option<Pedestal>)| SupportLaw {
            pedestal: *pedestal,
            ..law.as_law().drawn()
        };
        self.laws.iter().zip(&self.pedestals).map(support).collect()
    }

    /// Writes these search coordinates into a rotor with the same bearings.
    pub fn assign(&self, rotor: &mut Rotor, x: &[f64]) {
        for (b, places) in rotor.bearing.iter_mut().zip(&self.places) {
            let own: Vec<f64> = places.iter().map(|p| x[*p]).collect();
            b.law.as_law_mut().assign(&own);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    #[test]
    fn unknowns_list_all_stiffness_before_all_damping() {
        let bearings = Bearings::of(&sample_rotor());
        let named: Vec<(usize, &str)> =
            bearings.unknowns().iter().map(|u| (u.bearing, u.law.symbol.as_str())).collect();
        let four = |a, b| [(0, a), (0, b), (1, a), (1, b)];
        assert_eq!(named, [four("k_xx", "k_yy"), four("c_xx", "c_yy")].concat());
    }

    #[test]
    fn what_is_assigned_is_what_is_stated_next() {
        let mut rotor = sample_rotor();
        let bearings = Bearings::of(&rotor);
        let x = bearings.shifted(&bearings.stated(), 0.3, -0.2);
        bearings.assign(&mut rotor, &x);
        let again = Bearings::of(&rotor).stated();
        assert!(x.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-12));
        assert_eq!(bearings.supports(&x), Bearings::of(&rotor).supports(&again));
    }

    #[test]
    fn prior_sd_is_stated_tolerance_or_default_half() {
        let mut rotor = sample_rotor();
        rotor.bearing[0].coefficients_relative = Some(0.1);
        let sd = |bearing: usize| {
            let all = Bearings::of(&rotor);
            let own = all.unknowns().iter().filter(|u| u.bearing == bearing);
            own.map(|u| u.law.prior_sd).collect::<Vec<f64>>()
        };
        assert!(
            sd(0).iter().all(|sd| (sd - 0.1).abs() < 1e-12) && sd(1).iter().all(|sd| *sd == PRIOR_LOG_SD)
        );
    }
}
