//! `acknowledge`: lowers the flag that a monitor holds up, and begins a new reference of the unbalance.

use anyhow::Result;
use clap::Args;
use rotor_edge_core::state::{Reason, Status};
use serde_json::{Value, json};

use super::command_target::CommandTarget;
use super::output;
use crate::bus::numbers::bearing_number;
use crate::bus::states::name;
use crate::deploy::{acknowledge, suspected};
use crate::say;
use crate::watch::reasons::why;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    monitor: CommandTarget,
    /// Also if no flag is up: the unbalance is about to change, by a balancing weight, a washed rotor or an exchanged coupling. To
    /// be sent while the machine stands still
    #[arg(long)]
    announce: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut authority = arguments.monitor.authority()?;
    let node = authority.node();
    let mut bus = arguments.monitor.open()?;
    let [before, now] = acknowledge(&mut authority, &mut *bus, arguments.announce)?;
    if arguments.json {
        return output::json(&summary(node, &before, &now));
    }
    let Status { cause, suspect, .. } = before;
    match cause {
        Reason::None => say!("Monitor {node} held no flag; it is {} now.", name(now.state)),
        cause => say!(
            "Monitor {node} lowered its flag ({}{}); it is {} now.",
            why(cause, 0).what,
            suspected(suspect),
            name(now.state)
        ),
    }
    say!(
        "The next unbalance that it finds becomes its new reference, as after a balancing weight, a washed rotor or an exchanged \
         coupling. A misfit that persists is flagged again."
    );
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
    use rotor_edge_core::state::NodeState;

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
