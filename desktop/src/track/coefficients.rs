//! The numbers of bearings that change from day to day, each a logarithm: those that the data may decide of a bearing's law.

pub use crate::bearing::law::PRIOR_LOG_SD;
use crate::bearing::law::{LawUnknown, Role};
use crate::effects::entry;
use crate::error::{Error, TrackError};
use crate::machine::drawing::Rotor;
use crate::statistics::scale::Scale;

/// Logarithms of the followed numbers of all bearings, in the order of phase I.
pub type Logs = Vec<f64>;

/// A number of a bearing that a record is followed in.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedNumber {
    /// Number of the bearing in the file.
    pub bearing: usize,
    /// Its place among the unknowns of the bearing's law.
    pub place: usize,
    /// Its name, unit and role, the stated logarithm, and the standard deviation of that.
    pub law: LawUnknown,
}

impl FollowedNumber {
    pub fn is_damping(&self) -> bool {
        self.law.role == Role::Damping
    }

    /// Standard deviation of its logarithm by the prior, relative to that of a direct coefficient.
    pub fn width(&self) -> f64 {
        self.law.prior_sd / PRIOR_LOG_SD
    }
}

/// The followed numbers of all bearings, in the order of phase I: direct stiffness of every bearing, then direct damping, then the
/// rest. A law with direct coefficients, or factors on them, is followed in these; one of other numbers, as an oil film, in all of
/// them that are positive. Numbers that may change sign are held as they are stated.
pub fn followed(rotor: &Rotor) -> Vec<FollowedNumber> {
    let of = |(bearing, b): (usize, &crate::machine::drawing::Bearing)| {
        let all = b.law.as_law().unknowns().into_iter().enumerate();
        let positive: Vec<(usize, LawUnknown)> =
            all.filter(|(_, law)| law.scale == Scale::Logarithmic).collect();
        let is_direct = |law: &LawUnknown| law.role != Role::Other;
        let has_direct = positive.iter().any(|(_, law)| is_direct(law));
        let chosen = positive.into_iter().filter(move |(_, law)| is_direct(law) || !has_direct);
        chosen.map(move |(place, law)| FollowedNumber { bearing, place, law })
    };
    let mut all: Vec<FollowedNumber> = rotor.bearing.iter().enumerate().flat_map(of).collect();
    all.sort_by_key(|n| n.law.role);
    all
}

/// Logarithms of the followed numbers as a rotor's file states them.
pub fn logs_of(rotor: &Rotor) -> Logs {
    followed(rotor).into_iter().map(|n| n.law.stated).collect()
}

/// What a record can be followed on: bearings of which some number may change, and probes that see the shaft's own motion.
///
/// # Errors
/// If this machine has others.
pub fn can_follow(rotor: &Rotor) -> Result<(), Error> {
    if followed(rotor).is_empty() {
        return Err(TrackError::NothingToFollow.into());
    }
    if rotor.foundation.is_some() {
        return Err(TrackError::Foundation.into());
    }
    let terms = entry::terms_of(rotor);
    match (0..rotor.probe.len()).find(|p| terms.mount(rotor, *p).is_some()) {
        Some(p) => Err(TrackError::MovingProbe { probe: rotor.probe[p].name.clone() }.into()),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bearing::Law;
    use crate::bearing::magnetic::Magnetic;
    use crate::bearing::support::Pedestal;
    use crate::machine::drawing::Mount;
    use crate::testing::{film, sample_rotor, table, train};

    fn magnets() -> Law {
        Law::Magnetic(Magnetic { stiffness_n_m: -1e6, damping_n_s_m: 0.0 })
    }

    #[test]
    fn untrackable_machine_is_refused_with_its_part_named() {
        assert!(can_follow(&sample_rotor()).is_ok());
        let refused = |change: fn(&mut Rotor)| {
            let mut rotor = sample_rotor();
            change(&mut rotor);
            can_follow(&rotor).unwrap_err()
        };
        let magnetic = refused(|r| r.bearing.iter_mut().for_each(|b| b.law = magnets()));
        assert_eq!(magnetic, TrackError::NothingToFollow.into());
        // a message of the part is that of the whole
        assert!(magnetic.to_string().contains("needs a bearing"), "{magnetic}");
        let housing = refused(|r| {
            r.bearing[1].pedestal = Some(Pedestal::isotropic(1e9, 0.0, 50.0));
            r.probe[3].mount = Mount::Housing;
        });
        assert_eq!(housing, TrackError::MovingProbe { probe: "BY".into() }.into());
    }

    #[test]
    fn housing_probe_without_pedestal_motion_can_be_tracked() {
        let mut rotor = sample_rotor();
        rotor.probe[3].mount = Mount::Housing;
        assert!(can_follow(&rotor).is_ok());
    }

    #[test]
    fn any_number_of_bearings_is_followed_in_phase_one_order() {
        let mut one = sample_rotor();
        one.bearing.truncate(1);
        for rotor in [one, sample_rotor(), train()] {
            assert!(can_follow(&rotor).is_ok());
            let numbers = followed(&rotor);
            assert_eq!(numbers.len(), 4 * rotor.bearing.len());
            let bearings = crate::machine::bearings::Bearings::of(&rotor);
            for (ours, theirs) in numbers.iter().zip(bearings.unknowns()) {
                assert_eq!((ours.bearing, &ours.law), (theirs.bearing, &theirs.law));
            }
        }
    }

    #[test]
    fn each_law_is_followed_in_its_own_positive_numbers() {
        let mut rotor = train();
        rotor.bearing[0].law = table(9000.0);
        rotor.bearing[1].law = film(3000.0);
        rotor.bearing[2].law = magnets();
        let named: Vec<(usize, String)> =
            followed(&rotor).into_iter().map(|n| (n.bearing, n.law.symbol)).collect();
        let expected = [
            (0, "factor on k_xx"),
            (0, "factor on k_yy"),
            (3, "k_xx"),
            (3, "k_yy"),
            (0, "factor on c_xx"),
            (0, "factor on c_yy"),
            (3, "c_xx"),
            (3, "c_yy"),
            (1, "clearance"),
            (1, "viscosity"),
            (1, "load"),
        ];
        assert_eq!(named, expected.map(|(b, s)| (b, s.to_string())));
        assert!(can_follow(&rotor).is_ok());
    }
}
