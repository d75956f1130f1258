//! Names of probes: as the rotor's file has them, or as the export writes them.

use std::collections::BTreeSet;

use super::table::ReadingTable;
use super::words::order;

/// The probes that may be in an export.
#[derive(Debug, Clone, Default)]
pub struct Probes {
    /// Of the rotor, if one was given.
    pub of_rotor: Option<Vec<String>>,
    /// Words of the headers that are probes although they look like an order: `2X` beside `2Y`.
    pub pairs: Vec<String>,
}

impl Probes {
    pub fn new(of_rotor: Option<Vec<String>>, table: &ReadingTable) -> Self {
        let words: BTreeSet<String> = table
            .columns
            .iter()
            .flat_map(|c| {
                c.text().split(|c: char| !c.is_alphanumeric()).map(str::to_uppercase).collect::<Vec<_>>()
            })
            .collect();
        let has_pair = |word: &&String| order(word).is_some() && words.contains(&word.replace('X', "Y"));
        let pairs = words.iter().filter(has_pair).cloned().collect();
        Self { of_rotor, pairs }
    }

    /// Whether a word is a probe for sure.
    pub fn is_probe(&self, word: &str) -> bool {
        let of_rotor = self.of_rotor.iter().flatten();
        of_rotor.chain(&self.pairs).any(|probe| probe.eq_ignore_ascii_case(word))
    }

    /// The probe that a name means; nothing if it is none of the rotor's.
    pub fn named(&self, name: &str) -> Option<String> {
        let Some(of_rotor) = &self.of_rotor else {
            return Some(name.to_string()).filter(|name| !name.is_empty());
        };
        let name = letters(name);
        if let ([only], "") = (&of_rotor[..], name.as_str()) {
            return Some(only.clone());
        }
        let exact = of_rotor.iter().find(|probe| letters(probe) == name);
        let mut within = of_rotor.iter().filter(|probe| name.contains(&letters(probe)));
        exact.or_else(|| within.next().filter(|_| within.next().is_none())).cloned()
    }
}

fn letters(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_uppercase).collect()
}
