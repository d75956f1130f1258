//! `deploy --trial`: the model is tried, and confirmed only if its residual is no worse than that of the model before.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use rotor_edge_core::command::Command;
use serde_json::{Value, json};

use super::Arguments;
use crate::bus::CanBus;
use crate::command::output;
use crate::deploy::Authority;
use crate::deploy::trial::{Heard, PARTS, Told, Verdict, begin, compare, end, listen, median};

/// What is tried.
pub struct Candidate {
    pub bytes: Vec<u8>,
    pub checksum: u32,
    pub left_out: Vec<String>,
}

/// Tries a model for a time, after listening to the one before for as long.
pub fn run(
    arguments: &Arguments,
    authority: &mut Authority,
    bus: &mut dyn CanBus,
    candidate: &Candidate,
    time: Duration,
) -> Result<()> {
    let (node, counter) = (authority.node(), authority.counter());
    let rotor = arguments.rotor.display();
    let bar = output::progress("trial", 2 * time.as_secs() as usize);
    let show = |since: Duration| bar.set_position(since.as_secs());
    let before = listen(bus, node, time, None, show)?;
    let Some(old) = before.model.filter(|model| model.checksum != 0) else {
        bail!("monitor {node} holds no model to compare with; nothing was sent: deploy without --trial");
    };
    if old.on_trial {
        bail!("monitor {node} has a model on trial already; nothing was sent");
    }
    if before.ratios.len() < PARTS {
        bail!(
            "monitor {node} judged {} readings in {} s, expected at least {PARTS} to compare models by; nothing was sent: \
             give --trial a longer time, or deploy without it",
            before.ratios.len(),
            time.as_secs_f64()
        );
    }
    let answer = begin(authority, bus, &candidate.bytes, time, |_| ())?;
    let new = Told { checksum: candidate.checksum, on_trial: true };
    if answer.model_checksum != new.checksum {
        bail!("monitor {node} tries another model than was sent, and takes the model before back by itself");
    }
    let during = listen(bus, node, time, Some(new), |since| show(time + since))
        .context("the trial was given up, and the monitor takes the model before back by itself")?;
    let verdict = match during.model {
        Some(told) if told != new => bail!(
            "monitor {node} started anew during the trial and holds the model before again; try once more"
        ),
        _ => compare(&before.ratios, &during.ratios),
    };
    let is_confirmed = verdict == Verdict::NoWorse;
    let is_back = if is_confirmed {
        let confirmed = authority.command(bus, Command::Deploy, &candidate.bytes, |_| ());
        confirmed.context("the new model's residual is no worse, but the confirmation failed")?;
        false
    } else {
        end(authority, bus, &candidate.bytes, old)?
    };
    bar.finish_and_clear();
    if arguments.json {
        let outcome = if is_confirmed { "confirmed" } else { "reverted" };
        output::json(&json!({
            "node": node,
            "outcome": outcome,
            "compared": verdict != Verdict::Untold,
            "before": told(&before),
            "during": told(&during),
            "bytes": candidate.bytes.len(),
            "counter": counter,
            "model_checksum": if is_confirmed { new.checksum } else { old.checksum },
            "left_out": candidate.left_out,
        }))?;
    }
    let [old_percent, new_percent] = [&before, &during].map(|heard| 100.0 * median(&heard.ratios));
    let (old_readings, new_readings) = (before.ratios.len(), during.ratios.len());
    let back = if is_back { "took the model before back" } else { "takes the model before back by itself" };
    match verdict {
        Verdict::NoWorse if arguments.json => {}
        Verdict::NoWorse => println!(
            "Monitor {node} keeps the model of {rotor}: its residual is {new_percent:.2} % of the vibration, that of the model \
             before was {old_percent:.2} % (medians of {new_readings} and {old_readings} readings)."
        ),
        Verdict::Worse => bail!(
            "monitor {node} {back}: with that of {rotor} the residual was {new_percent:.2} % of the vibration, with its own \
             {old_percent:.2} % (medians of {new_readings} and {old_readings} readings)"
        ),
        Verdict::Untold => bail!(
            "monitor {node} {back}: it judged {new_readings} readings with that of {rotor}, expected at least {PARTS} to compare \
             models by; give --trial a longer time"
        ),
    }
    Ok(())
}

/// A time's readings for programs.
fn told(heard: &Heard) -> Value {
    let median = (!heard.ratios.is_empty()).then(|| median(&heard.ratios));
    json!({"readings": heard.ratios.len(), "residual_ratio": median})
}
