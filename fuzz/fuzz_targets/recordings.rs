//! Any bytes as a pcapng file; what is read is put in words, matched, and written and read again.

#![no_main]

use gradus_host::trace::{Decoder, PcapngWriter, exchanges, read_pcapng};
use gradus_tmcl::catalogue::TMCM_3351;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Ok(records) = read_pcapng(data) else { return };
    let mut decoder = Decoder::new(&TMCM_3351);
    let mut file = Vec::new();
    let mut writer = PcapngWriter::new(&mut file).unwrap();
    for record in &records {
        decoder.line(record);
        writer.write(record).unwrap();
    }
    exchanges(&records);
    let again = read_pcapng(&file).unwrap();
    assert_eq!(again.len(), records.len());
    assert!(again.iter().zip(&records).all(|(new, old)| (&new.packet, new.direction) == (&old.packet, old.direction)));
});
