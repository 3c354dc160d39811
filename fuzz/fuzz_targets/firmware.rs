//! Bytes into the firmware of a stepper module: commands on three kinds of line, changes of the surroundings, steps of time.

#![no_main]

#[allow(dead_code)] // words of the tests that this target does without
#[path = "../../crates/gradus-firmware/tests/behaviour/support.rs"]
mod support;

#[allow(dead_code)]
#[path = "../../crates/gradus-firmware/tests/behaviour/rotor.rs"]
mod rotor;

libfuzzer_sys::fuzz_target!(|data: &[u8]| support::fuzz_datagrams(data));
