//! A model against measurements: where it misses, which effect is missing, and the better model.
//!
//! `cargo run --release -p rotor-edge-desktop --example missing_effect [ROTOR.toml MEASURED.csv]`

use std::path::PathBuf;

use rotor_edge_desktop::diagnose::{DiagnosisVerdict, add, diagnose};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::{Error, measurement};

fn main() -> Result<(), Error> {
    let mut given = std::env::args_os().skip(1).map(PathBuf::from);
    let machine = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/machines/single/case-008");
    let rotor = given.next().unwrap_or_else(|| machine.join("rotor.toml"));
    let data = given.next().unwrap_or_else(|| machine.join("measured.csv"));

    let rotor = rotor_file::read(&rotor)?;
    let readings = measurement::read(&data, &rotor)?;
    let found = diagnose(&rotor, &readings)?;
    println!("{}", found.summary);
    for advice in &found.advice {
        println!("  {}", advice.measurement);
    }
    let Some(first) = found.candidates.first().filter(|_| found.verdict != DiagnosisVerdict::Adequate) else {
        return Ok(());
    };
    println!("{}", first.explanation());
    let better = add(&rotor, &readings, first.effect, first.at.as_deref())?;
    println!(
        "error {:.2} % → {:.2} % with {}",
        100.0 * better.error_before,
        100.0 * better.error_after,
        better.added.label()
    );
    Ok(())
}
