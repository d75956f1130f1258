//! The corpus of the fuzz targets for files, replayed by the same functions on the stable compiler, and mutations of it:
//! `ROTOR_EDGE_MUTATIONS=100000 cargo test --release -p rotor-edge-tests --test integration fuzz_readers::` makes so many of each target's.
//! One that fails is written to `target/fuzz-failures`.

#[path = "../../host-sim/fuzz/readers/mod.rs"]
mod readers;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use readers::Reader;
use rotor_edge_tests::repository;

/// The files of a target, by name.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let entries =
        fs::read_dir(repository("host-sim/fuzz/corpus").join(target)).expect("every target has a corpus");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Whether the reader takes it without a panic.
fn takes(target: &str, number: u64, read: Reader, bytes: &[u8]) -> bool {
    let is_taken = catch_unwind(AssertUnwindSafe(|| read(bytes))).is_ok();
    if !is_taken {
        let folder = repository("target/fuzz-failures");
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join(format!("{target}-{number}"));
        fs::write(&path, bytes).unwrap();
        println!("{}", path.display());
    }
    is_taken
}

#[test]
fn corpus_and_mutations_are_read_or_refused_in_one_sentence() {
    let number: u64 = std::env::var("ROTOR_EDGE_MUTATIONS").map_or(200, |text| text.parse().unwrap());
    let mut failed = 0;
    for (target, read) in readers::ALL {
        let seeds = corpus(target);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(17);
        for (seed, bytes) in (0..).zip(&seeds) {
            failed += u64::from(!takes(target, seed, read, bytes));
        }
        for number in 0..number {
            let seed = &seeds[number as usize % seeds.len()];
            let bytes = crate::mutation::mutated(seed, &mut random);
            failed += u64::from(!takes(target, seeds.len() as u64 + number, read, &bytes));
        }
    }
    assert_eq!(failed, 0, "of {number} mutations a target, in target/fuzz-failures");
}

#[test]
fn every_reader_is_a_program_of_the_fuzzer_and_accepts_a_seed() {
    let manifest = fs::read_to_string(repository("host-sim/fuzz/Cargo.toml")).unwrap();
    for (target, _) in readers::ALL {
        let program =
            fs::read_to_string(repository("host-sim/fuzz/fuzz_targets").join(format!("{target}.rs")));
        assert!(program.unwrap().contains("(bytes)"), "{target}");
        assert!(manifest.contains(&format!("name = \"{target}\"")), "{target}");
    }
    assert_eq!(manifest.matches("[[bin]]").count(), readers::ALL.len());
}
