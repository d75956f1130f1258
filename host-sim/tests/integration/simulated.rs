//! Bus, monitors and the commands to them in one process on a simulated clock: each waits as in real time, and nothing sleeps.

mod conflict;
mod deployment;
mod flag;
mod forger;
pub mod lab;
mod outage;
mod trial;
