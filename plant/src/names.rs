//! What a machine's own file calls it and its parts.

use rotor_edge_desktop::machine::drawing::Rotor;

/// Names of a machine that was stated; of another, numbers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// Of the machine itself.
    pub machine: Option<String>,
    bearings: Vec<String>,
    probes: Vec<String>,
    planes: Vec<String>,
}

/// A number of things, as in `1 job` and `3 jobs`.
pub fn counted(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

impl Names {
    pub fn of(rotor: Option<&Rotor>) -> Self {
        let Some(rotor) = rotor else { return Self::default() };
        Self {
            machine: Some(rotor.name.trim().to_string()).filter(|name| !name.is_empty()),
            bearings: rotor.bearing.iter().map(|b| b.name.clone()).collect(),
            probes: rotor.probe.iter().map(|p| p.name.clone()).collect(),
            planes: rotor.plane.iter().map(|p| p.name.clone()).collect(),
        }
    }

    /// The bearing with this number, which counts from 1, as in `bearing NDE`.
    pub fn bearing(&self, number: u8) -> String {
        let name = at(&self.bearings, number).map_or_else(|| number.to_string(), String::from);
        format!("bearing {name}")
    }

    /// The probe with this number, which counts from 1, as in `15X`; without a name as in `probe 1`.
    pub fn probe(&self, number: u8) -> String {
        at(&self.probes, number).map_or_else(|| format!("probe {number}"), String::from)
    }

    /// The plane with this number, which counts from 1, as in `plane A`.
    pub fn plane(&self, number: u8) -> String {
        let name = at(&self.planes, number).map_or_else(|| number.to_string(), String::from);
        format!("plane {name}")
    }

    /// How many probes and planes it has; nothing where it was not stated.
    pub fn counts(&self) -> [usize; 2] {
        [self.probes.len(), self.planes.len()]
    }
}

fn at(names: &[String], number: u8) -> Option<&str> {
    names.get(usize::from(number).checked_sub(1)?).map(String::as_str)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_without_a_name_have_their_number() {
        let named = Names {
            machine: Some("pump 3".into()),
            bearings: vec!["NDE".into(), "DE".into()],
            probes: vec!["NDEX".into()],
            planes: vec!["A".into()],
        };
        assert_eq!([named.bearing(2), named.bearing(3)], ["bearing DE", "bearing 3"]);
        assert_eq!([named.probe(1), named.plane(1)], ["NDEX", "plane A"]);
        let none = Names::of(None);
        assert_eq!([none.probe(1), none.plane(2), none.bearing(0)], ["probe 1", "plane 2", "bearing 0"]);
    }
}
