//! Probes that a machine has and no fit uses, `used = false` in its file: they are set aside while the machine is computed
//! with, and stand in their places again where it is written or deployed.

use super::drawing::{ParameterValue, Probe, Rotor};

/// The effect with a vector for each probe, which must have as many as there are probes.
const BY_PROBE: &str = "runout";

/// A probe that is set aside.
#[derive(Debug, Clone, PartialEq)]
pub struct UnusedProbe {
    /// Its place among all probes of the file.
    place: usize,
    probe: Probe,
}

impl UnusedProbe {
    pub fn name(&self) -> &str {
        &self.probe.name
    }
}

impl Rotor {
    /// The machine with all its probes, those that are not used in their places.
    pub fn whole(&self) -> Self {
        let mut whole = self.clone();
        for unused in std::mem::take(&mut whole.unused) {
            whole.probe.insert(unused.place.min(whole.probe.len()), unused.probe);
            for vectors in whole.by_probe() {
                vectors.insert(unused.place.min(vectors.len()), [0.0; 2]);
            }
        }
        whole
    }

    /// The machine with its used probes alone; what a file states of the others' runout is dropped.
    pub(crate) fn set_aside(mut self) -> Self {
        let used: Vec<bool> = self.probe.iter().map(|probe| probe.used).collect();
        for vectors in self.by_probe().filter(|vectors| vectors.len() == used.len()) {
            let mut used = used.iter();
            vectors.retain(|_| used.next().is_some_and(|used| *used));
        }
        for (place, probe) in std::mem::take(&mut self.probe).into_iter().enumerate() {
            match probe.used {
                true => self.probe.push(probe),
                false => self.unused.push(UnusedProbe { place, probe }),
            }
        }
        self
    }

    /// The lists that have an entry for each probe.
    fn by_probe(&mut self) -> impl Iterator<Item = &mut Vec<[f64; 2]>> {
        let entries = self.effect.iter_mut().filter(|entry| entry.kind == BY_PROBE);
        entries.flat_map(|entry| entry.parameters.values_mut()).filter_map(|value| match value {
            ParameterValue::Phasors(vectors) => Some(vectors),
            _ => None,
        })
    }
}
