//! What a fuzzer of the server's text protocols calls.

use gradus_tmcl::catalogue::TMCM_3351;

use super::adapter::Adapter;
use super::protocol::Protocol;
use super::socketcand::Socketcand;
use crate::{Bench, BusKind, Can, Rig};

/// Takes any bytes as what a host sends to an slcan adapter (first byte even) or a socketcand server (odd), in pieces with time
/// between them. Nothing may panic, and the answers may not grow without bound.
pub fn fuzz_adapters(data: &[u8]) {
    let Some((kind, bytes)) = data.split_first() else { return };
    let mut rig = Rig::from(Bench::rigid(&TMCM_3351));
    let bus = rig.add_bus("can", BusKind::Can(Can::DEFAULT));
    rig.connect(0, bus);
    let host = rig.attach(bus);
    let mut protocol = match kind % 2 {
        0 => Protocol::Slcan(Adapter::default()),
        _ => Protocol::Socketcand(Socketcand::default()),
    };
    for piece in bytes.chunks(usize::from(*kind) / 2 + 1) {
        let mut answers = Vec::new();
        protocol.receive(piece, &mut rig, host, &mut answers);
        rig.run_for(500);
        protocol.collect(&mut rig, host, &mut answers);
        assert!(answers.len() < 100 * (piece.len() + 100), "{} bytes answer {}", answers.len(), piece.len());
    }
}
