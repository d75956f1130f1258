//! A monitor's flag, lowered.

use anyhow::{Context, Result, bail};
use rotor_edge_core::command::Command;
use rotor_edge_core::state::{Reason, Status};

use super::{Authority, await_status};
use crate::bus::CanBus;
use crate::bus::states::name;
use crate::watch::reasons::why;

/// Lowers the flag that a monitor holds up and has it take a new reference of the unbalance; its status before and after.
/// `is_announced`: also if no flag is up.
///
/// # Errors
/// If it holds no flag and nothing is announced, it refuses the command or says nothing.
pub fn acknowledge(
    authority: &mut Authority,
    bus: &mut dyn CanBus,
    is_announced: bool,
) -> Result<[Status; 2]> {
    let node = authority.node();
    let before = await_status(bus, node)?;
    if before.cause == Reason::None && !is_announced {
        bail!(
            "monitor {node} holds no flag; it is {}: {}; give --announce if the unbalance is about to change",
            name(before.state),
            why(before.reason, before.missing_mask).what
        );
    }
    authority.command(bus, Command::Acknowledge, &[], |_| ())?;
    let now = await_status(bus, node).context("the flag was acknowledged, but the monitor fell silent")?;
    Ok([before, now])
}
