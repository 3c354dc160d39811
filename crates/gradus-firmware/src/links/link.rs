//! A host's end of the line: framing of what comes, waiting of what goes.

use gradus_tmcl::ascii::{CR, Editor, MAX_LINE};
use gradus_tmcl::{Bulk, Framer, Instruction, Reply, Status, can};
use heapless::Deque;

/// What kind of line it is (BEHAVIOUR: USB-like, RS-485-like, CAN).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LinkKind {
    /// Point to point: USB, TCP, a pseudo-terminal. Every datagram is answered, whatever its address.
    Usb,
    /// A segment with several modules, RS485 or RS232: only the own addresses are answered, after the telegram pause time.
    Rs485,
    /// CAN: the identifier is the address.
    Can,
}

/// Bytes besides datagrams that come at once: a line of the ASCII interface makes an echo and a reply, a bulk download a block.
const MAX_BYTES: usize = if Bulk::MAX_LEN > MAX_LINE + 32 { Bulk::MAX_LEN } else { MAX_LINE + 32 };

/// One client of a module. The caller owns it, one for each client, and gives it to every call.
#[derive(Clone, Debug)]
pub struct Link {
    pub(crate) id: u32,
    pub(crate) kind: LinkKind,
    /// Samples may follow a reply as raw bytes.
    pub(crate) carries_bulk: bool,
    pub(crate) framer: Framer,
    /// The line of the ASCII interface that is being typed.
    pub(crate) editor: Editor,
    outgoing: Deque<Outgoing, 4>,
    /// Text of the ASCII interface, or the samples behind a reply, and when they go out: after the datagrams.
    bytes: Deque<u8, MAX_BYTES>,
    bytes_at_us: u64,
    /// The CAN frame of the latest command 138: events are answers to it.
    pub(crate) event_request: Option<can::Frame>,
}

/// A reply that waits to be taken.
#[derive(Clone, Copy, Debug)]
struct Outgoing {
    not_before_us: u64,
    telegram: Telegram,
}

/// A reply as it goes over the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Telegram {
    /// Nine bytes of a serial line.
    Serial([u8; 9]),
    /// A frame of a CAN bus.
    Can(can::Frame),
}

/// The contents of an answer, before it is put into bytes or a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Answer {
    /// Nothing is sent.
    None,
    /// Status and value.
    Plain(Status, i32),
    /// What follows the host address in a special reply: commands 134 and 136.
    Special([u8; 8]),
}

impl Link {
    /// A link with a number that no other link of the module has. A pause of more than `gap_us` microseconds inside a
    /// datagram throws its beginning away; 0 switches that off.
    pub fn new(id: u32, kind: LinkKind, gap_us: u32) -> Self {
        Self {
            id,
            kind,
            carries_bulk: kind == LinkKind::Usb,
            framer: Framer::new(gap_us),
            editor: Editor::new(),
            outgoing: Deque::new(),
            bytes: Deque::new(),
            bytes_at_us: 0,
            event_request: None,
        }
    }

    /// Refuses bulk downloads from now on: for hosts that take nothing but datagrams.
    pub fn refuse_bulk(&mut self) {
        self.carries_bulk = false;
    }

    /// When the next waiting reply may go out, if one waits.
    pub fn ready_at(&self) -> Option<u64> {
        let bytes = (!self.bytes.is_empty()).then_some(self.bytes_at_us);
        self.outgoing.front().map(|reply| reply.not_before_us).or(bytes)
    }

    /// Throws the beginning of a datagram away.
    pub fn forget_beginning(&mut self) {
        self.framer.reset();
    }

    /// True when what waits must go out first: four datagrams, bytes that are none, and before text any
    /// datagram, so that nothing overtakes.
    pub(crate) fn is_full(&self, ascii: bool) -> bool {
        !self.bytes.is_empty() || if ascii { !self.outgoing.is_empty() } else { self.outgoing.is_full() }
    }

    pub(crate) fn send(&mut self, telegram: Telegram, not_before_us: u64) {
        // `receive` takes no datagram while the queue is full.
        let _ = self.outgoing.push_back(Outgoing { not_before_us, telegram });
    }

    /// Bytes for the host. There is room for what one character or datagram sets off, and no next one is taken before it has gone.
    pub(crate) fn say(&mut self, bytes: &[u8], not_before_us: u64) {
        self.bytes_at_us = not_before_us;
        for byte in bytes {
            let _ = self.bytes.push_back(*byte);
        }
    }

    /// Gives the line that has been typed back.
    pub(crate) fn echo_line(&mut self, not_before_us: u64) {
        self.bytes_at_us = not_before_us;
        for byte in self.editor.line().iter().chain(&[CR]) {
            let _ = self.bytes.push_back(*byte);
        }
    }

    pub(crate) fn take_byte(&mut self, now: u64) -> Option<u8> {
        let waits = !self.outgoing.is_empty() || self.bytes_at_us > now;
        if waits { None } else { self.bytes.pop_front() }
    }

    pub(crate) fn take(&mut self, now: u64) -> Option<Telegram> {
        if self.outgoing.front()?.not_before_us > now {
            return None;
        }
        self.outgoing.pop_front().map(|reply| reply.telegram)
    }
}

impl Telegram {
    /// The nine bytes of a serial telegram.
    pub(crate) fn serial(self) -> Option<[u8; 9]> {
        match self {
            Self::Serial(bytes) => Some(bytes),
            Self::Can(_) => None,
        }
    }

    /// The frame of a CAN telegram.
    pub(crate) fn frame(self) -> Option<can::Frame> {
        match self {
            Self::Can(frame) => Some(frame),
            Self::Serial(_) => None,
        }
    }
}

/// The addresses that stand in an answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Addresses {
    pub(crate) host: u8,
    pub(crate) module: u8,
}

/// The serial bytes of an answer, `None` when nothing is sent.
pub(crate) fn serial_answer(answer: Answer, request: &Instruction, addresses: Addresses) -> Option<[u8; 9]> {
    match answer {
        Answer::None => None,
        Answer::Plain(status, value) => Some(reply(status, value, request, addresses).emit()),
        Answer::Special(body) => {
            let mut bytes = [addresses.host; 9];
            bytes[1..].copy_from_slice(&body);
            Some(bytes)
        }
    }
}

/// The frame of an answer to `frame`, `None` when nothing is sent.
pub(crate) fn can_answer(
    answer: Answer,
    request: &Instruction,
    frame: &can::Frame,
    reply_id: u32,
    module: u8,
) -> Option<can::Frame> {
    match answer {
        Answer::None => None,
        Answer::Plain(status, value) => {
            Some(frame.answer(reply_id, &reply(status, value, request, Addresses { host: 0, module })))
        }
        Answer::Special(body) => can::Frame::new(reply_id, frame.extended, body.get(..frame.data().len())?),
    }
}

fn reply(status: Status, value: i32, request: &Instruction, addresses: Addresses) -> Reply {
    Reply { host: addresses.host, module: addresses.module, status, command: request.opcode, value }
}
