//! `rotor-edge-plant` with real buses, servers and kills.

mod common;
mod compatibility;
mod export;
mod file;
mod fleet;
mod live;
mod slow;
