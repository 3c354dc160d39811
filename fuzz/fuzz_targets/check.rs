//! Any bytes as source text into the linter: places of problems, and safe fixes.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_asm::fuzz_check(data));
