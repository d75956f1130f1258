//! Where a report comes from: the program, the day, the command line, and every file that it names.

use std::path::Path;

use jiff::Timestamp;
use sha2::{Digest as _, Sha256};

use super::shell;
use crate::node::to_hex;
use crate::render::{PageTable, Section};

/// The last section of a report that is written to `own`.
pub fn section(own: &Path) -> Section {
    let words: Vec<String> = std::env::args().skip(1).collect();
    // a path may stand by itself or behind an option's equals sign
    let paths = words.iter().map(|word| word.rsplit_once('=').map_or(word.as_str(), |(_, path)| path));
    let files = paths.filter(|path| Path::new(path) != own).filter_map(|path| {
        // a file that was written just now is as much a part of it as one that was read
        let bytes = std::fs::read(path).ok()?;
        Some(vec![path.to_string(), bytes.len().to_string(), to_hex(&Sha256::digest(&bytes))])
    });
    let table = PageTable {
        caption: "Files".into(),
        columns: ["file", "bytes", "SHA-256"].map(String::from).to_vec(),
        rows: files.collect(),
    };
    let now = Timestamp::now().strftime("%Y-%m-%d %H:%M UTC");
    Section {
        heading: "Where this comes from".into(),
        paragraphs: vec![
            format!("rotor-edge {}, {now}.", env!("ROTOR_EDGE_VERSION")),
            format!("Command: rotor-edge {}", words.iter().map(|w| shell::word(w)).collect::<Vec<_>>().join(" ")),
            "An unbalance at angle α pulls along x cos α + y sin α at the moment of the keyphasor's mark, x turning into y. A \
             residual is the sum over all probes of |model − measurement| per component, 0-pk; figures say themselves \
             where an amplitude is pk-pk. ± is a 95 % half-width."
                .into(),
        ],
        tables: if table.rows.is_empty() { Vec::new() } else { vec![table] },
        figures: Vec::new(),
    }
}
