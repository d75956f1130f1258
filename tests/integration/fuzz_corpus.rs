//! The corpus of the core's fuzz targets, replayed by the same functions on the stable compiler, and mutations of it:
//! `ROTOR_EDGE_MUTATIONS=10000000 cargo test --release -p rotor-edge-tests --test integration fuzz_corpus::` makes so many of each target's.
//! Seeds follow the formats, and `ROTOR_EDGE_WRITE_SEEDS=1` writes them anew.

#[path = "../../core/fuzz/decoders/mod.rs"]
mod decoders;
mod seeds;

use std::collections::BTreeMap;
use std::fs;
use std::panic::{catch_unwind, resume_unwind};
use std::path::PathBuf;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge_tests::repository;

fn folder(target: &str) -> PathBuf {
    repository("core/fuzz/corpus").join(target)
}

fn corpus(target: &str) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder(target)).expect("every target has a corpus");
    let files = entries.map(|entry| entry.unwrap());
    files.map(|file| (file.file_name().into_string().unwrap(), fs::read(file.path()).unwrap())).collect()
}

#[test]
fn corpus_and_truncated_seeds_decode_without_panic() {
    for (target, decode) in decoders::ALL {
        for (name, bytes) in corpus(target) {
            decode(&bytes);
            if name.starts_with(seeds::PREFIX) {
                (0..bytes.len()).step_by(1 + bytes.len() / 40).for_each(|length| decode(&bytes[..length]));
            }
        }
    }
}

#[test]
fn mutations_of_the_corpus_are_taken_without_a_panic() {
    let number: usize = std::env::var("ROTOR_EDGE_MUTATIONS").map_or(2_000, |text| text.parse().unwrap());
    for (target, decode) in decoders::ALL {
        let seeds: Vec<Vec<u8>> = corpus(target).into_values().collect();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(17);
        for seed in seeds.iter().cycle().take(number) {
            let bytes = crate::mutation::mutated(seed, &mut random);
            if let Err(panic) = catch_unwind(|| decode(&bytes)) {
                println!("{target} by {bytes:02x?}");
                resume_unwind(panic);
            }
        }
    }
}

#[test]
fn seeds_of_every_target_match_present_formats() {
    let write = std::env::var_os("ROTOR_EDGE_WRITE_SEEDS").is_some();
    for (target, _) in decoders::ALL {
        let expected = seeds::of(target);
        assert!(!expected.is_empty(), "{target}");
        if write {
            fs::create_dir_all(folder(target)).unwrap();
            let old = corpus(target).into_keys().filter(|name| name.starts_with(seeds::PREFIX));
            old.for_each(|name| fs::remove_file(folder(target).join(name)).unwrap());
            expected.iter().for_each(|(name, bytes)| fs::write(folder(target).join(name), bytes).unwrap());
        }
        let found: BTreeMap<_, _> =
            corpus(target).into_iter().filter(|(name, _)| name.starts_with(seeds::PREFIX)).collect();
        assert!(found == expected, "{target}: ROTOR_EDGE_WRITE_SEEDS=1 writes them anew");
    }
}

#[test]
fn every_target_is_a_program_of_the_fuzzer() {
    let manifest = fs::read_to_string(repository("core/fuzz/Cargo.toml")).unwrap();
    for (target, _) in decoders::ALL {
        let program = fs::read_to_string(repository("core/fuzz/fuzz_targets").join(format!("{target}.rs")));
        assert!(program.unwrap().contains(&format!("::{target}(bytes)")), "{target}");
        assert!(manifest.contains(&format!("name = \"{target}\"")), "{target}");
    }
    assert_eq!(manifest.matches("[[bin]]").count(), decoders::ALL.len());
}
