//! Any bytes to a simulated slcan adapter and to a simulated socketcand server.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_sim::fuzz_adapters(data));
