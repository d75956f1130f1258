//! The linker's scripts.

use std::env;
use std::fs;
use std::path::Path;

/// Not beside the manifest, where the linker would find it first.
const MEMORY: &str = "link/memory.x";

fn main() {
    println!("cargo::rerun-if-changed={MEMORY}");
    let out = env::var("OUT_DIR").expect("cargo sets it");
    let mut memory = fs::read_to_string(MEMORY).expect("it is in the package");
    if env::var_os("CARGO_FEATURE_PARTS").is_some() {
        // parts are measured and not flashed: they may be larger than what the examples have room for
        memory = memory.replace("96K", "512K");
    }
    fs::write(Path::new(&out).join("memory.x"), memory).expect("cargo made the folder");
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
}
