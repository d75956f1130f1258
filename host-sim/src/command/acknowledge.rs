//! `acknowledge`: lowers the flag that a monitor holds up.

use anyhow::Result;
use clap::Args;
use rotor_edge_core::state::Status;
use serde_json::{Value, json};

use super::command_target::CommandTarget;
use super::output;
use crate::bus::numbers::bearing_number;
use crate::bus::states::name;
use crate::deploy::acknowledge;
use crate::watch::reasons::why;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    monitor: CommandTarget,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut authority = arguments.monitor.authority()?;
    let node = authority.node();
    let mut bus = arguments.monitor.open()?;
    let [before, now] = acknowledge(&mut authority, &mut *bus)?;
    if arguments.json {
        return output::json(&summary(node, &before, &now));
    }
    let Status { cause, suspect, .. } = before;
    let suspect =
        suspect.map_or(String::new(), |bearing| format!(", suspect bearing {}", bearing_number(bearing)));
    println!(
        "Monitor {node} lowered its flag ({}{suspect}); it is {} now.",
        why(cause, 0).what,
        name(now.state)
    );
    println!("What still misfits will be flagged again.");
    Ok(())
}

/// The flag that was lowered, and the state since, for programs.
fn summary(node: u8, before: &Status, now: &Status) -> Value {
    json!({
        "node": node,
        "cause": name(before.cause),
        "suspect": before.suspect.map(bearing_number),
        "state": name(now.state),
        "reason": name(now.reason),
    })
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::state::{NodeState, Reason};

    use super::*;

    #[test]
    fn acknowledged_flag_is_told_with_cause_bearing_and_new_state() {
        let before = Status { cause: Reason::Rise, suspect: Some(1), ..Status::default() };
        let now = Status { state: NodeState::Waiting, reason: Reason::NoReading, ..Status::default() };
        let expected =
            json!({"node": 4, "cause": "rise", "suspect": 2, "state": "waiting", "reason": "no_reading"});
        assert_eq!(summary(4, &before, &now), expected);
    }
}
