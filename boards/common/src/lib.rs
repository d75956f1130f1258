//! What boards share: everything around the core's node that touches no hardware, so that the host's tests run the code
//! that is flashed.
//!
//! | module | what it is |
//! |---|---|
//! | [`sampling`] | probes' counts to numbered 1x readings, losses noticed |
//! | [`monitor`] | the node with its storage |
//! | [`settings`] | number and key of a device |
//! | [`slots`] | model, thresholds and counter in flash, whole after a cut in power at any write |
//! | [`journal`] | what changes often in flash, record after record, as safe |
//! | [`flash`] | flash that is read like memory |
//! | [`filter`] | the identifiers that a node must hear |
//! | [`watchdog`] | when the watchdog may be fed |
//! | [`recovery`] | when to join a bus again that the controller was thrown off |
//! | [`light`] | what the status light shows |

#![no_std]

#[cfg(test)]
extern crate std;

pub mod filter;
pub mod flash;
pub mod journal;
pub mod light;
pub mod monitor;
pub mod recovery;
pub mod sampling;
pub mod settings;
pub mod slots;
#[cfg(test)]
mod testing;
pub mod watchdog;
