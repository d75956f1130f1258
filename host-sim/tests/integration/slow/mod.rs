//! Real programs in real time for longer than a quick run should take: only `tests/all` runs these.

mod chaos;
mod crowd;
mod large;
