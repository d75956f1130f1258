//! What only `tests/all` runs.

mod large;
