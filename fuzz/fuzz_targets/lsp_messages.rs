//! Any bytes as the messages of an editor, and as the text that it has open.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_lsp::fuzz_messages(data));
