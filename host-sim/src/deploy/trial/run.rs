//! A whole trial: listen to the model in use, try the new one for as long, and confirm it or end it.

use std::fmt::Display;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use rotor_edge_core::command::Command;
use serde_json::{Value, json};

use super::{ModelState, Observation, PARTS, TrialVerdict, begin, compare, end, listen, median};
use crate::bus::CanBus;
use crate::deploy::Authority;

/// The model that is tried.
pub struct Candidate {
    /// As [`encoded`](crate::edge::encoded).
    pub bytes: Vec<u8>,
    pub checksum: u32,
}

#[derive(Debug)]
pub struct TrialResult {
    node: u8,
    /// Residuals with the model in use before.
    pub before: Observation,
    /// Residuals with the candidate.
    pub during: Observation,
    pub verdict: TrialVerdict,
    /// Checksum of the model that stays.
    pub checksum: u32,
    /// The monitor said that the model before is in use again.
    pub is_back: bool,
}

/// Tries a model for `time`, after listening to the one in use for as long; `progress` hears how much of both is over.
///
/// # Errors
/// If there is nothing to compare, the monitor refuses, or it does not use the candidate throughout.
pub fn run(
    authority: &mut Authority,
    bus: &mut dyn CanBus,
    candidate: &Candidate,
    time: Duration,
    progress: impl Fn(Duration),
) -> Result<TrialResult> {
    let node = authority.node();
    let before = listen(bus, node, time, None, &progress)?;
    let Some(old) = before.model.filter(|model| model.checksum != 0) else {
        bail!("monitor {node} holds no model to compare with; nothing was sent: deploy without --trial");
    };
    if old.on_trial {
        bail!("monitor {node} has a model on trial already; nothing was sent");
    }
    if old.checksum == candidate.checksum {
        let (during, verdict) = (Observation::default(), TrialVerdict::Unchanged);
        return Ok(TrialResult { node, before, during, verdict, checksum: old.checksum, is_back: false });
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
    let new = ModelState { checksum: candidate.checksum, on_trial: true };
    if answer.model_checksum != new.checksum {
        bail!("monitor {node} tries another model than the one sent, and returns to the old model by itself");
    }
    let during = listen(bus, node, time, Some(new), |since| progress(time + since))
        .context("the trial was aborted, and the monitor returns to the old model by itself")?;
    let verdict = match during.model {
        Some(model) if model != new => {
            bail!("monitor {node} restarted during the trial and holds the old model again; repeat the trial")
        }
        _ => compare(&before.ratios, &during.ratios),
    };
    let is_confirmed = verdict == TrialVerdict::NoWorse;
    let is_back = if is_confirmed {
        let confirmed = authority.command(bus, Command::Deploy, &candidate.bytes, |_| ());
        confirmed.context("the new model's residual is no worse, but the confirmation failed")?;
        false
    } else {
        end(authority, bus, &candidate.bytes, old)?
    };
    let checksum = if is_confirmed { new.checksum } else { old.checksum };
    Ok(TrialResult { node, before, during, verdict, checksum, is_back })
}

impl TrialResult {
    pub fn json(&self) -> Value {
        let (outcome, compared) = match self.verdict {
            TrialVerdict::Unchanged => ("unchanged", false),
            TrialVerdict::NoWorse => ("confirmed", true),
            TrialVerdict::Worse => ("reverted", true),
            TrialVerdict::TooFewReadings => ("reverted", false),
        };
        json!({
            "node": self.node,
            "outcome": outcome,
            "compared": compared,
            "before": summary(&self.before),
            "during": summary(&self.during),
            "model_checksum": self.checksum,
        })
    }

    /// In one sentence; `rotor` is the candidate's file.
    ///
    /// # Errors
    /// The sentence, if the candidate was not confirmed.
    pub fn sentence(&self, rotor: impl Display) -> Result<String> {
        let Self { node, before, during, .. } = self;
        let [old_percent, new_percent] = [before, during].map(|observed| 100.0 * median(&observed.ratios));
        let (old_readings, new_readings) = (before.ratios.len(), during.ratios.len());
        let back =
            if self.is_back { "returned to the old model" } else { "returns to the old model by itself" };
        match self.verdict {
            TrialVerdict::Unchanged => {
                Ok(format!("Monitor {node} runs the model of {rotor} already; nothing was sent."))
            }
            TrialVerdict::NoWorse => Ok(format!(
                "Monitor {node} keeps the model of {rotor}: its residual is {new_percent:.2} % of the vibration, that of the \
                 old model was {old_percent:.2} % (medians of {new_readings} and {old_readings} readings)."
            )),
            TrialVerdict::Worse => bail!(
                "monitor {node} {back}: with that of {rotor} the residual was {new_percent:.2} % of the vibration, with its own \
                 {old_percent:.2} % (medians of {new_readings} and {old_readings} readings)"
            ),
            TrialVerdict::TooFewReadings => bail!(
                "monitor {node} {back}: it judged {new_readings} readings with that of {rotor}, expected at least {PARTS} to \
                 compare models by; give --trial a longer time"
            ),
        }
    }
}

/// A time's readings for programs.
fn summary(observed: &Observation) -> Value {
    let median = (!observed.ratios.is_empty()).then(|| median(&observed.ratios));
    json!({"readings": observed.ratios.len(), "residual_ratio": median})
}
