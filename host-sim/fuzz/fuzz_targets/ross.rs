#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rotor_edge_fuzz::of_ross(bytes));
