//! The linker's scripts.

use std::env;
use std::fs;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=memory.x");
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = env::var("OUT_DIR").expect("cargo sets it");
    if env::var_os("CARGO_FEATURE_PARTS").is_some() {
        // parts are measured and not flashed: they may be larger than what the examples have room for
        let memory = fs::read_to_string(own.join("memory.x")).expect("it is here");
        fs::write(Path::new(&out).join("memory.x"), memory.replace("96K", "512K")).expect("it can be written");
        println!("cargo::rustc-link-search={out}");
    } else {
        println!("cargo::rustc-link-search={}", own.display());
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
}
