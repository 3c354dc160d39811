//! Traffic: what passes over a line, as records, in words ([`Decoder`]), and in pcapng files ([`PcapngWriter`]).

mod decode;
mod gather;
mod pcapng;
mod replay;
mod sniffer;

use std::time::{Duration, SystemTime};

use gradus_tmcl::can::Frame;

pub use decode::Decoder;
pub use gather::Gatherer;
pub use pcapng::{PcapngError, PcapngWriter, read_pcapng};
pub use replay::{Exchange, exchanges};
pub use sniffer::Sniffer;

/// Which way a datagram goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Direction {
    /// From a host to a module.
    Request,
    /// From a module to a host.
    Reply,
    /// Nobody knows: it was heard on a line that both share.
    Unknown,
}

/// What passes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Packet {
    /// Bytes on a serial line; nine are a datagram, fewer what is left of one or text, more samples of a
    /// bulk download or text.
    Serial(Vec<u8>),
    /// A frame on a CAN bus.
    Can(Frame),
    /// Nothing on the line: what a virtual module says by itself, such as why a reference search has failed.
    Notice(String),
}

/// Something that has passed over a line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Record {
    /// When, since 1970.
    pub at: Duration,
    /// Which way.
    pub direction: Direction,
    /// What.
    pub packet: Packet,
}

/// Takes records, one by one.
pub type Sink = Box<dyn FnMut(&Record) + Send>;

/// The time of day, since 1970.
pub fn time_of_day() -> Duration {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default()
}

#[cfg(test)]
mod tests;
