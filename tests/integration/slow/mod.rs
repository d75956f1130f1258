//! What only `tests/all` runs.

mod live;
