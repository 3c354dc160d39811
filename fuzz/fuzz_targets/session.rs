//! A session, an slcan port and a socketcand port against a peer without manners.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| gradus_host::fuzz_session(data));
