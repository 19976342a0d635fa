//! Any bytes as a program: `cargo +nightly fuzz run program -- -max_len=400`, seeded with `seeds/`.
#![no_main]

#[path = "../../tests/round_trip/mod.rs"]
mod round_trip;

libfuzzer_sys::fuzz_target!(|data: &[u8]| round_trip::check(data));
