//! Any bytes as a program, and a last one that chooses the settings. In the crate's folder:
//! `cargo +nightly fuzz run -a -s none program fuzz/corpus fuzz/seeds -- -max_len=400`
#![no_main]

#[path = "../../tests/round_trip/mod.rs"]
mod round_trip;

libfuzzer_sys::fuzz_target!(|data: &[u8]| round_trip::check(data));
