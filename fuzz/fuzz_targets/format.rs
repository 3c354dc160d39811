//! Any bytes as source text into the formatter: the same program, and once is enough.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_asm::fuzz_format(data));
