//! Traffic of a served rig as records: bytes that come in pieces become datagrams.

use std::collections::HashMap;
use std::time::Duration;

use gradus_sim::{Content, Passed};
use gradus_tmcl::Framer;

use super::{Direction, Packet, Record, time_of_day};

/// A pause inside a datagram that ends it, as on a module's TCP port, in microseconds.
const GAP_US: u32 = 50_000;

/// Makes records of what passes on the buses of a rig.
pub struct Gatherer {
    /// The time of day at which the rig's time stood at zero.
    began: Duration,
    /// What has come of the next datagram, by bus, host and direction.
    framers: HashMap<(usize, usize, bool), Framer>,
}

impl Gatherer {
    /// For a rig that begins now.
    pub fn new() -> Self {
        Self { began: time_of_day(), framers: HashMap::new() }
    }

    /// Takes what has passed; `sink` gets the records that are complete by it.
    pub fn take(&mut self, passed: &Passed, mut sink: impl FnMut(&Record)) {
        let direction = if passed.from_module { Direction::Reply } else { Direction::Request };
        let at = self.began + Duration::from_micros(passed.at_us);
        match &passed.what {
            Content::Frame(frame) => sink(&Record { at, direction, packet: Packet::Can(*frame) }),
            Content::Notice(text) => sink(&Record { at, direction, packet: Packet::Notice(text.clone()) }),
            Content::Loose(bytes) => sink(&Record { at, direction, packet: Packet::Serial(bytes.clone()) }),
            Content::Bytes(bytes) => {
                let key = (passed.bus, passed.host, passed.from_module);
                let framer = self.framers.entry(key).or_insert_with(|| Framer::new(GAP_US));
                for nine in bytes.iter().filter_map(|byte| framer.push(*byte, passed.at_us)) {
                    sink(&Record { at, direction, packet: Packet::Serial(nine.to_vec()) });
                }
            }
        }
    }
}

impl Default for Gatherer {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_datagram_does_not_put_what_follows_out_of_step() {
        let nine = |first| (first..first + 9).collect::<Vec<u8>>();
        let passed = [
            Content::Bytes(nine(0)[..4].to_vec()),
            Content::Bytes(nine(0)[4..].to_vec()),
            Content::Loose(vec![0x55; 84]),
            Content::Bytes(nine(9)),
        ];
        let (mut gatherer, mut packets) = (Gatherer::new(), Vec::new());
        for what in passed {
            let passed = Passed { at_us: 0, bus: 0, host: 0, from_module: true, what };
            gatherer.take(&passed, |record| packets.push(record.packet.clone()));
        }
        assert_eq!(packets, [nine(0), vec![0x55; 84], nine(9)].map(Packet::Serial));
    }
}
