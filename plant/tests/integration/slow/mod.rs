//! What only `tests/all` runs.

mod access;
mod jobs;
mod kills;
mod nats;
mod rate;
mod scale;
