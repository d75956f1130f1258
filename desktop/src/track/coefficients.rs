//! The bearing coefficients that change from day to day: the direct ones of each bearing.

pub use crate::bearing::law::PRIOR_LOG_SD;
use crate::effects::entry;
use crate::error::{Error, TrackError};
use crate::machine::drawing::{Bearing, Rotor};

/// Direct coefficients of one bearing: k_xx k_yy c_xx c_yy.
pub const PER_BEARING: usize = 4;

/// Bearing, axis (0 for x) of coefficient `i` of `count`, and whether it is damping. The order is that of phase I:
/// k_xx k_yy of each bearing, then c_xx c_yy of each.
pub fn coefficient(i: usize, count: usize) -> (usize, usize, bool) {
    let half = count / 2;
    ((i % half) / 2, i % 2, i >= half)
}

/// Place of a coefficient among `count`.
pub fn index(bearing: usize, axis: usize, damping: bool, count: usize) -> usize {
    2 * bearing + axis + if damping { count / 2 } else { 0 }
}

/// What a record can be followed on: two bearings whose coefficients are stated as constants, and probes that see the
/// shaft's own motion.
///
/// # Errors
/// If this machine has others.
pub fn can_follow(rotor: &Rotor) -> Result<(), Error> {
    let given = rotor.bearing.len();
    if given != 2 {
        return Err(TrackError::Bearings { given }.into());
    }
    let constant = |b: &&Bearing| b.constants().is_some_and(|k| k.learned.is_none());
    if let Some(b) = rotor.bearing.iter().find(|b| !constant(b)) {
        return Err(TrackError::VaryingBearing { bearing: b.name.clone() }.into());
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
    use crate::testing::sample_rotor;

    #[test]
    fn untrackable_machine_is_refused_with_its_part_named() {
        assert!(can_follow(&sample_rotor()).is_ok());
        let refused = |change: fn(&mut Rotor)| {
            let mut rotor = sample_rotor();
            change(&mut rotor);
            can_follow(&rotor).unwrap_err()
        };
        let one = refused(|r| r.bearing.truncate(1));
        assert_eq!(one, TrackError::Bearings { given: 1 }.into());
        // a message of the part is that of the whole
        assert!(one.to_string().contains("the rotor has 1"), "{one}");
        let magnets = refused(|r| {
            r.bearing[1].law = Law::Magnetic(Magnetic { stiffness_n_m: -1e6, damping_n_s_m: 0.0 });
        });
        assert_eq!(magnets, TrackError::VaryingBearing { bearing: "B".into() }.into());
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
}
