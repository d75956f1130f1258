//! Which machine a file is of, in four bytes that a deployed model carries: against a mix-up, not against an attack.
//!
//! A file that states a `serial` is known by that alone, whatever is corrected in its drawing. Otherwise it is known by its
//! name, by what its shaft's pieces are as no tolerance moves them, and by the names of what is on it: `add`, `improve` and
//! [`Rotor::as_stated`] change sizes, places, bearings, planes and effects, and leave all of these as they are.

use crc::{CRC_32_ISO_HDLC, Crc};

use super::drawing::Rotor;

impl Rotor {
    /// The identity: the same for every file of one machine.
    pub fn identity(&self) -> [u8; 4] {
        Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(self.told_apart_by().join("\0").as_bytes()).to_be_bytes()
    }

    fn told_apart_by(&self) -> Vec<String> {
        if let Some(serial) = &self.serial {
            return vec![format!("serial {serial}")];
        }
        let pieces = self.shaft.iter().map(|s| format!("piece {:e} {:e}", s.length_m, s.inner_diameter_m));
        let disks = self.disk.iter().map(|disk| format!("disk {}", disk.name));
        let bearings = self.bearing.iter().map(|bearing| format!("bearing {}", bearing.name));
        let whole = self.whole();
        let probes = whole.probe.iter().map(|probe| format!("probe {}", probe.name));
        let name = std::iter::once(format!("name {}", self.name));
        name.chain(pieces).chain(disks).chain(bearings).chain(probes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Rotor;
    use super::super::tolerance::Deviation;
    use crate::testing;

    fn changed(change: impl Fn(&mut Rotor)) -> Rotor {
        let mut rotor = testing::sample_rotor();
        change(&mut rotor);
        rotor
    }

    #[test]
    fn identity_ignores_fitted_values_and_changes_with_machine() {
        let same = testing::sample_rotor().identity();
        let fitted = changed(|rotor| {
            for deviation in Deviation::all(&rotor.clone()) {
                deviation.change(rotor, 1.01, 1e-4);
            }
            rotor.effect.clear();
            rotor.plane.truncate(1);
            rotor.noise = None;
            rotor.fastest_rpm = Some(4321.0);
        });
        assert_eq!(fitted.identity(), same);
        let others = [
            changed(|r| r.name.push('2')),
            changed(|r| r.shaft[0].length_m *= 1.001),
            changed(|r| r.disk[0].name.push('2')),
            changed(|r| r.bearing[0].name.push('2')),
            changed(|r| r.probe[0].name.push('2')),
            changed(|r| r.serial = Some("A-1".into())),
        ];
        for other in &others {
            assert_ne!(other.identity(), same);
        }
    }

    #[test]
    fn a_serial_alone_says_which_machine_it_is() {
        let stated = |serial: &str| changed(|rotor| rotor.serial = Some(serial.into()));
        let mut redrawn = stated("A-1");
        redrawn.name = "the same, drawn again".into();
        redrawn.shaft[0].length_m *= 1.1;
        assert_eq!(redrawn.identity(), stated("A-1").identity());
        assert_ne!(stated("A-1").identity(), stated("A-2").identity());
    }
}
