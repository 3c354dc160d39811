//! Bytes into a module: commands on three kinds of line, changes of the surroundings, steps of time.
//! `cargo +nightly fuzz run datagrams`

#![no_main]

#[allow(dead_code)] // words of the tests that this target does without
#[path = "../../crates/gradus-firmware/tests/behaviour/support.rs"]
mod support;

libfuzzer_sys::fuzz_target!(|data: &[u8]| support::fuzz_datagrams(data));
