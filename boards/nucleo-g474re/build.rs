//! The linker's scripts, so that a change of them links anew; number and key of the device.

fn main() {
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-env-changed=ROTOR_EDGE_NODE");
    println!("cargo::rerun-if-env-changed=ROTOR_EDGE_KEY");
    println!("cargo::rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    for script in ["link.x", "defmt.x"] {
        println!("cargo::rustc-link-arg-bins=-T{script}");
    }
}
