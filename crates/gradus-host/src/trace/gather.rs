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
