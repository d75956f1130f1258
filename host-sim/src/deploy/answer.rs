//! What a monitor's answer means, in a sentence.

use anyhow::{Result, bail};
use rotor_edge_core::command::{Answer, Detail, MAX_COUNTER_STEP, Outcome};
use rotor_edge_core::model::ModelError;
use rotor_edge_core::state::Reason;
use rotor_edge_core::thresholds::ThresholdError;
use serde_json::{Value, json};

use crate::bus::numbers::bearing_number;
use crate::bus::states::name;
use crate::watch::reasons::why;

/// The answer to a command that was carried out.
///
/// # Errors
/// If it was refused: why, and what to do.
pub(super) fn judge(node: u8, counter: u64, answer: Option<(Answer, bool)>) -> Result<Answer> {
    let Some((answer, confirmed)) = answer else {
        bail!(
            "monitor {node} answers in another version of the protocol; update its firmware or this program"
        );
    };
    let refusal = match answer.outcome {
        Outcome::NoKey => format!("monitor {node} was given no key, so it takes no commands"),
        // its answer carries the code of the monitor's own key, which is not ours
        _ if !confirmed => format!(
            "monitor {node} has another key (or somebody else answers in its name): use the key that was made for it"
        ),
        Outcome::Accepted => return Ok(answer),
        Outcome::Replayed => format!(
            "monitor {node} has accepted command {} already and {counter} is not above it: \
             set this machine's clock right, or give --counter {}",
            answer.counter,
            answer.counter.saturating_add(1)
        ),
        Outcome::Counter => format!(
            "monitor {node} has accepted command {} and {counter} is too far above it: numbers may rise by {MAX_COUNTER_STEP} at most, give --counter {}",
            answer.counter,
            answer.counter.saturating_add(1)
        ),
        Outcome::Model => {
            format!("monitor {node} refuses the model{}; the old one stays", why_model(answer.detail))
        }
        Outcome::Machine => format!(
            "monitor {node} holds the model of another machine (by its serial, or else by its name, the pieces of its shaft \
             and what its disks, bearings and probes are called), which stays; if the monitor watches this machine now, \
             give --another-machine"
        ),
        Outcome::Thresholds => {
            let which = match answer.detail {
                Detail::Thresholds(error) => out_of_bounds(error),
                _ => "they are out of their bounds".into(),
            };
            format!("monitor {node} refuses the thresholds: {which}; the old ones stay")
        }
        Outcome::Malformed => format!(
            "monitor {node} does not know this command: its firmware is older or newer than this program"
        ),
        Outcome::Storage => format!("monitor {node} could not store the command; nothing was changed"),
        outcome => format!("monitor {node} refuses the command: {outcome:?}"),
    };
    bail!(refusal)
}

/// What a model that was accepted ended, in a sentence; nothing if there was no model before, or the monitor does not say.
pub fn ended(node: u8, detail: Detail) -> Option<String> {
    match detail {
        Detail::Unchanged => Some(format!(
            "Monitor {node} runs this model already: nothing changed, neither its flag nor the reference of the residual."
        )),
        Detail::Replaced { lowered: Reason::None, .. } => Some(format!(
            "Monitor {node} dropped the reference of the old model and takes a new one; no flag was up."
        )),
        Detail::Replaced { lowered, suspect } => Some(format!(
            "Monitor {node} lowered its flag ({}{}), dropped the reference of the old model and takes a new one.",
            why(lowered, 0).what,
            suspected(suspect)
        )),
        _ => None,
    }
}

/// The same for programs.
pub fn ended_json(detail: Detail) -> [(&'static str, Value); 3] {
    let (changed, dropped, lowered) = match detail {
        Detail::Unchanged => (false, false, None),
        Detail::Replaced { lowered, suspect } => {
            let flag = || json!({ "cause": name(lowered), "suspect": suspect.map(bearing_number) });
            (true, true, (lowered != Reason::None).then(flag))
        }
        _ => (true, false, None),
    };
    [("changed", changed.into()), ("reference_dropped", dropped.into()), ("lowered", json!(lowered))]
}

/// A suspected bearing behind a cause.
pub fn suspected(suspect: Option<u8>) -> String {
    suspect.map_or(String::new(), |bearing| format!(", suspect bearing {}", bearing_number(bearing)))
}

fn why_model(detail: Detail) -> String {
    let Detail::Model { error, asked, held } = detail else { return String::new() };
    match error {
        ModelError::Probes => format!(": it has {asked} probes, the firmware holds {held}"),
        ModelError::Planes if held > 0 && asked > held => {
            format!(": it has {asked} planes, the firmware holds {held}")
        }
        ModelError::BasisSize => {
            format!(": it has {asked} basis shapes a plane, the firmware needs {held}")
        }
        ModelError::Schema => {
            ": the firmware speaks another version of models; update the older of the two".into()
        }
        error => format!(": {error}"),
    }
}

/// Which threshold is out of its bounds, and what they are.
pub fn out_of_bounds(error: ThresholdError) -> String {
    let bounds = match error {
        ThresholdError::Encoding => "they are those of another version",
        ThresholdError::Rise => "rise is to be from 0 to 100",
        ThresholdError::RatioLimit => "ratio_limit is to be from 0 to 10",
        ThresholdError::RatioFloor => "ratio_floor is to be from 0 to 1",
        ThresholdError::Floor => "floor_um is to be from 0 to 1000 µm",
        ThresholdError::Average => "average_s is to be from 0 s to an hour",
        ThresholdError::Persistence => {
            "persistence_s is to be from 0 s to 30 days, persistence_readings from 1 to 255"
        }
        ThresholdError::Level => "level_s is to be above 0 s and up to 10 years",
        ThresholdError::Learning => {
            "learning_s is to be from 0 s to 30 days, learning_readings from 1 to 255"
        }
        ThresholdError::Growth => "growth is to be from 1 to 10, growth_s above 0 s and up to a year",
        ThresholdError::AgeLimit => "age_limit_s is to be from 0.1 s to 10 years",
        ThresholdError::GapRange => "gap_range_v is to be two ascending voltages within ±100 V",
        _ => return format!("{error:?} is out of its bounds"),
    };
    bounds.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answer_to_accepted_model_says_what_ended() {
        let flag = Detail::Replaced { lowered: Reason::Rise, suspect: Some(1) };
        let quiet = Detail::Replaced { lowered: Reason::None, suspect: None };
        let newer = Detail::Replaced { lowered: Reason::Unknown(30), suspect: None };
        let said = |detail| ended(4, detail).unwrap();
        assert!(said(Detail::Unchanged).starts_with("Monitor 4 runs this model already: nothing changed"));
        let lowered =
            "lowered its flag (the residual rose above its level, suspect bearing 2), dropped the reference";
        assert!(said(flag).contains(lowered), "{}", said(flag));
        assert!(said(quiet).contains("no flag was up"));
        assert!(said(newer).contains("(reason 30, which this program does not know)"), "{}", said(newer));
        assert_eq!(ended(4, Detail::None), None, "a monitor without a model, or one of before");
        let rise = json!({ "cause": "rise", "suspect": 2 });
        let unknown = json!({ "cause": "reason_30", "suspect": null });
        for (detail, changed, dropped, lowered) in [
            (Detail::Unchanged, false, false, Value::Null),
            (quiet, true, true, Value::Null),
            (flag, true, true, rise),
            (newer, true, true, unknown),
            (Detail::None, true, false, Value::Null),
        ] {
            let told =
                [("changed", changed.into()), ("reference_dropped", dropped.into()), ("lowered", lowered)];
            assert_eq!(ended_json(detail), told);
        }
    }
}
