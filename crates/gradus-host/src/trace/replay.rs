//! Requests of a record with their answers, to be sent again.

use std::time::Duration;

use gradus_tmcl::Instruction;

use super::decode::{answers, nine};
use super::{Decoder, Direction, Record};

/// A request that was recorded, and its answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Exchange {
    /// When the request was sent, since the first record.
    pub at: Duration,
    /// Address or identifier that it was sent to.
    pub address: u32,
    /// The request.
    pub request: Instruction,
    /// The nine bytes of its answer; `None` if none came.
    pub answer: Option<[u8; 9]>,
}

/// Finds the requests of a record and the answer to each. Damaged datagrams and events are left out.
pub fn exchanges(records: &[Record]) -> Vec<Exchange> {
    let mut found: Vec<Exchange> = Vec::new();
    let start = records.first().map(|record| record.at).unwrap_or_default();
    // The decoder follows requests and replies on a shared line.
    let mut decoder = Decoder::new(&gradus_tmcl::catalogue::TMCM_3351);
    for record in records {
        let asked = found.last().map(|latest| (latest.address as u8, latest.request));
        let Some((address, bytes)) = nine(&record.packet, asked) else { continue };
        let direction = decoder.direction(record.direction, &bytes);
        decoder.line(record);
        if direction == Direction::Reply {
            let waiting = found.iter_mut().rev().find(|earlier| answers(earlier.request, &bytes));
            if let Some(exchange) = waiting.filter(|exchange| exchange.answer.is_none()) {
                exchange.answer = Some(bytes);
            }
        } else if gradus_tmcl::checksum(&bytes[..8]) == bytes[8] {
            let [_, command @ .., _] = bytes;
            let (at, request) = (record.at.saturating_sub(start), Instruction::from_bytes(command));
            found.push(Exchange { at, address, request, answer: None });
        }
    }
    found
}

impl Exchange {
    /// True if another answer says the same; the addresses in it do not matter.
    pub fn agrees(&self, other: &[u8; 9]) -> bool {
        const BODY: std::ops::Range<usize> = 2..8;
        self.answer.is_none_or(|answer| answer.get(BODY) == other.get(BODY))
    }
}
