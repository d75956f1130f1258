//! Where a linker wants every symbol to be there, as on macOS, it is told that the interpreter brings its own.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
