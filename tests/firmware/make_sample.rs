//! Writes `boards/sample`: `cargo run --release -p rotor-edge-tests --example make_board_sample`.

use std::fs;

use anyhow::Result;
use rotor_edge_tests::firmware::{BoardSample, model_bytes};
use rotor_edge_tests::repository;

fn main() -> Result<()> {
    let sample = BoardSample::make()?;
    let folder = repository("boards/sample");
    fs::create_dir_all(&folder)?;
    for (name, bytes) in [
        ("model.bin", model_bytes(&sample.model)),
        ("better.bin", model_bytes(&sample.better)),
        ("readings.bin", sample.reading_bytes()),
    ] {
        println!("{name}: {} bytes", bytes.len());
        fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}
