//! Tests across the crates: core against desktop, desktop against ROSS, what stands on both.

mod absurd;
mod check_ross;
mod check_textbook;
mod conventions;
mod equivalence;
mod extraction;
mod faults;
mod firmware;
mod forecast;
mod fuzz_corpus;
mod fuzz_readers;
mod import_ross;
mod machines;
mod mutation;
mod readers;
mod report;
mod rk4;
mod rk4_run_up;
mod ross;
mod ross_simulated;
mod rubs;
mod scenarios;
mod slow;
mod special_cases;
mod wire;
mod with_effect;
