//! The protocol of socketcand, CAN over TCP: `< send 1 7 6 1 0 0 0 0 0 >`.
//!
//! A client gets `< hi >`, opens a bus of any name, and may then send; in raw mode it gets every frame as
//! `< frame 002 12.345678 01640600000000 >`, with the seconds of virtual time. Identifiers of eight digits are those of 29 bits.
//!
//! Not here: the broadcast manager (`add`, `subscribe` and the like), control mode, and the beacon.

use std::fmt::Write as _;

use gradus_tmcl::can::Frame;

use crate::{HostId, Rig};

/// What a server says first.
pub(crate) const GREETING: &[u8] = b"< hi >";

/// A longer message is none.
const MAX_LEN: usize = 128;

#[derive(Debug, Default)]
pub(crate) struct Socketcand {
    /// The message so far.
    message: Vec<u8>,
    state: State,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    #[default]
    NoBus,
    /// Sends, but has not asked to hear.
    Open,
    Raw,
}

impl Socketcand {
    pub(crate) fn receive(&mut self, bytes: &[u8], rig: &mut Rig, host: HostId, answers: &mut Vec<u8>) {
        for byte in bytes {
            match byte {
                b'<' => self.message.clear(),
                b'>' => {
                    let message = String::from_utf8_lossy(&self.message).into_owned();
                    answers.extend_from_slice(self.obey(&message, rig, host));
                    self.message.clear();
                }
                _ if self.message.len() < MAX_LEN => self.message.push(*byte),
                _ => {}
            }
        }
    }

    fn obey(&mut self, message: &str, rig: &mut Rig, host: HostId) -> &'static [u8] {
        let words: Vec<&str> = message.split_whitespace().collect();
        match (words.as_slice(), self.state) {
            (["open", _], State::NoBus) => self.enter(State::Open),
            (["rawmode"], State::Open | State::Raw) => self.enter(State::Raw),
            (["echo"], _) => b"< echo >",
            (["send", id, len, bytes @ ..], State::Open | State::Raw) => match frame(id, len, bytes) {
                Some(frame) => {
                    rig.send_frame(host, frame);
                    b""
                }
                None => b"< error Syntax error in send command >",
            },
            ([_, ..], State::NoBus) => b"< error no bus is open >",
            _ => b"< error unknown command >",
        }
    }

    fn enter(&mut self, state: State) -> &'static [u8] {
        self.state = state;
        b"< ok >"
    }

    /// What the bus has for the host.
    pub(crate) fn collect(&self, rig: &mut Rig, host: HostId, into: &mut Vec<u8>) {
        let (seconds, micros) = (rig.now() / 1_000_000, rig.now() % 1_000_000);
        while let Some(frame) = rig.take_frame(host) {
            if self.state == State::Raw {
                let mut text = String::new();
                let digits = if frame.extended { 8 } else { 3 };
                // A string takes everything.
                let _ = write!(text, "< frame {:0digits$X} {seconds}.{micros:06} ", frame.id);
                for byte in frame.data() {
                    let _ = write!(text, "{byte:02X}");
                }
                into.extend_from_slice(text.as_bytes());
                into.extend_from_slice(b" >");
            }
        }
    }
}

fn frame(id: &str, len: &str, bytes: &[&str]) -> Option<Frame> {
    let byte = |text: &&str| u8::from_str_radix(text, 16).ok();
    let data: Vec<u8> = bytes.iter().map(byte).collect::<Option<_>>()?;
    let extended = id.len() > 3;
    let number = u32::from_str_radix(id, 16).ok().filter(|id| *id <= if extended { 0x1fff_ffff } else { 0x7ff })?;
    if usize::from_str_radix(len, 16).ok() != Some(data.len()) {
        return None;
    }
    Frame::new(number, extended, &data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_to_send_are_read() {
        let cases = [
            ("1", "2", "6 ff", Some(Frame::new(1, false, &[6, 255]))),
            ("00000001", "0", "", Some(Frame::new(1, true, &[]))),
            ("800", "0", "", None),
            ("1", "3", "1 2", None),
            ("1", "9", "1 2 3 4 5 6 7 8 9", None),
            ("1", "1", "100", None),
            ("x", "0", "", None),
        ];
        for (id, len, bytes, expected) in cases {
            let bytes: Vec<&str> = bytes.split_whitespace().collect();
            assert_eq!(frame(id, len, &bytes), expected.flatten(), "{id} {len} {bytes:?}");
        }
    }
}
