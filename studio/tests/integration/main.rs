//! `rotor-edge-studio` in a real browser and by its requests, against the running program.

mod browser;
mod client;
mod kept;
mod look;
mod own_files;
mod page_of_book;
mod program;
mod refusals;
mod slow;
mod trials;
mod workflow;
