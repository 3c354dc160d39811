//! A serial CAN adapter (slcan) as a host sees it.
//!
//! It answers what it has done with CR, a frame with `z` or `Z` before it, and what it cannot do with BEL: sending while it is
//! closed or listens only, another bit rate while it is open. It may be opened twice, as hosts do. It neither hears
//! nor is heard by nodes of another bit rate than it is set to; one that was never set to any has that of the bus. Remote frames are taken and
//! reach nobody, since TMCL has none.

use gradus_tmcl::slcan::{Command, ERROR, LineReader, OK, Text};

use crate::{HostId, Rig};

/// A version of hardware and software as adapters tell it.
const VERSION: &[u8] = b"V1010\r";

const SERIAL_NUMBER: &[u8] = b"N0001\r";

/// No error, nothing lost.
const FLAGS: &[u8] = b"F00\r";

/// Time stamps of adapters start anew every minute.
const MINUTE_MS: u64 = 60_000;

#[derive(Debug, Default)]
pub(crate) struct Adapter {
    reader: LineReader,
    state: State,
    timestamps: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    #[default]
    Closed,
    Listening,
    Open,
}

impl Adapter {
    pub(crate) fn receive(&mut self, bytes: &[u8], rig: &mut Rig, host: HostId, answers: &mut Vec<u8>) {
        for byte in bytes {
            if let Some(line) = self.reader.push(*byte) {
                let answer = line.ok().and_then(|command| self.obey(command, rig, host));
                answers.extend_from_slice(answer.unwrap_or(&[ERROR]));
            }
        }
    }

    /// The answer; `None`: that cannot be done.
    fn obey(&mut self, command: Command, rig: &mut Rig, host: HostId) -> Option<&'static [u8]> {
        let closed = self.state == State::Closed;
        match command {
            Command::Frame(frame) if self.state == State::Open => {
                rig.send_frame(host, frame);
                return Some(if frame.extended { b"Z\r" } else { b"z\r" });
            }
            Command::Remote { extended } if self.state == State::Open => {
                return Some(if extended { b"Z\r" } else { b"z\r" });
            }
            Command::BitRate(rate) if closed => rig.set_host_rate(host, rate),
            Command::BitTiming if closed => rig.set_host_rate(host, rig.can_bit_rate(host.bus()).unwrap_or(1)),
            Command::Open => self.state = State::Open,
            Command::Listen => self.state = State::Listening,
            Command::Close => self.state = State::Closed,
            Command::Version => return Some(VERSION),
            Command::SerialNumber => return Some(SERIAL_NUMBER),
            Command::Flags => return Some(FLAGS),
            Command::Timestamps(on) => self.timestamps = on,
            Command::Empty => {}
            _ => return None,
        }
        Some(&[OK])
    }

    /// What the bus has for the host.
    pub(crate) fn collect(&self, rig: &mut Rig, host: HostId, into: &mut Vec<u8>) {
        let hears = self.state != State::Closed;
        let time_ms = self.timestamps.then(|| (rig.now() / 1000 % MINUTE_MS) as u16);
        while let Some(frame) = rig.take_frame(host) {
            if hears {
                into.extend_from_slice(Text::frame(&frame, time_ms).bytes());
            }
        }
    }
}
