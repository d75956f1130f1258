//! What a board's firmware logged, as text: `rotor-edge-board-log IMAGE < BYTES`, a line a message.

use std::io::{Read, stdin};
use std::{env, fs};

use anyhow::{Context, Result};
use defmt_decoder::{DecodeError, Table};

fn main() -> Result<()> {
    let image = fs::read(env::args().nth(1).context("which image?")?)?;
    let table = Table::parse(&image)?.context("the image does not log with defmt")?;
    let mut bytes = Vec::new();
    stdin().read_to_end(&mut bytes)?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(&bytes);
    loop {
        match decoder.decode() {
            Ok(frame) => println!("{}", frame.display_message()),
            Err(DecodeError::Malformed) if table.encoding().can_recover() => (),
            Err(_) => return Ok(()),
        }
    }
}
