//! The command line of rotor-edge, and what joins the controller's core with the desktop crate.
//!
//! | module | holds |
//! |---|---|
//! | [`bus`] | CAN buses, simulated and real |
//! | [`clock`] | where a monitor's time comes from |
//! | [`node`] | a monitor as a process: the core on a real bus |
//! | [`watch`] | what a listener learns of all monitors on a bus, and a terminal that shows it |
//! | [`deploy`] | commands to a monitor over a real bus |
//! | [`edge`] | a desktop model, made small enough for the controller |
//! | [`ingest`] | exports of other systems and raw samples, made into measurements |
//! | [`replay`] | a record, played over the bus into the core, every result checked |
//! | [`answers`] | one JSON type a command |
//! | [`render`] | answers as terminal text and as one HTML file with figures |
//! | [`sample`] | the machine that the main job runs on |
//! | [`terminal`] | text for people, at the width of the terminal |
//! | [`scale`](mod@scale) | ranges of axes, and numbers as people write them |
//! | [`command`] | one file a command: arguments in, table or JSON out |

pub mod answers;
pub mod bus;
pub mod clock;
pub mod command;
pub mod deploy;
pub mod edge;
pub mod ingest;
pub mod node;
pub mod render;
pub mod replay;
pub mod sample;
pub mod scale;
pub mod terminal;
pub mod watch;
