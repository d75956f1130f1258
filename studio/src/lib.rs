//! The studio: a local web page on which a person opens a machine and its measurements, sees where the model fails, tries effects,
//! and watches the error fall.
//!
//! | module | holds |
//! |---|---|
//! | [`command`] | the command line |
//! | [`session`] | what is tried: files, steps with their models, readings that are left out, a hidden machine |
//! | [`workbench`] | the session of this process, and what is worked out in the background |
//! | [`recovery`] | sessions that were never saved |
//! | `trial` | effects that are looked at, fitted on a worker |
//! | `view` | the session as the page shows it |
//! | `report` | the report of a session |
//! | [`server`] | the page and its requests, for this computer alone |
//!
//! All numbers come from the desktop crate, all sentences and figures from the program's own.

pub mod command;
pub mod recovery;
mod report;
pub mod server;
pub mod session;
mod trial;
mod view;
pub mod workbench;
