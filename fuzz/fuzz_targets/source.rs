//! Any bytes as source text, as program memory and as a `.bin` file into the assembler, and back.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_asm::fuzz_source(data));
