//! `rotor-edge-plant` with real buses, servers and kills.

mod access;
mod common;
mod export;
mod file;
mod fleet;
mod jobs;
mod kills;
mod live;
mod nats;
mod rate;
mod scale;
