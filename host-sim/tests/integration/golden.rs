//! Golden answers: today's output of the program, recorded in `tests/golden`, and the comparer.
//!
//! `tests/golden/check` shows differences; `tests/golden/accept` records the present output.

mod answer;
mod compare_json;
mod compare_text;
mod cut;
mod difference;
mod interval;
pub mod manifest;
mod mask;
mod page;
mod quick;
mod session;
mod slow;
mod table;
mod token;
mod tolerance;
mod value;
