//! `deploy --trial`: the model is tried, and confirmed only if its residual is no worse than that of the model before.

use std::time::Duration;

use anyhow::Result;

use super::Arguments;
use crate::bus::CanBus;
use crate::command::output;
use crate::deploy::Authority;
use crate::deploy::trial::{Candidate, run};
use crate::say;

/// Tries a model, and prints how the trial ended.
pub fn try_out(
    arguments: &Arguments,
    authority: &mut Authority,
    bus: &mut dyn CanBus,
    candidate: &Candidate,
    left_out: &[String],
    time: Duration,
) -> Result<()> {
    let counter = authority.counter();
    let bar = output::progress("trial", 2 * time.as_secs() as usize);
    let result = run(authority, bus, candidate, time, |since| bar.set_position(since.as_secs()))?;
    bar.finish_and_clear();
    if arguments.json {
        let mut json = result.json();
        json["bytes"] = candidate.bytes.len().into();
        json["counter"] = counter.into();
        json["left_out"] = left_out.into();
        output::json(&json)?;
    }
    let sentence = result.sentence(arguments.rotor.display())?;
    if !arguments.json {
        say!("{sentence}");
    }
    Ok(())
}
