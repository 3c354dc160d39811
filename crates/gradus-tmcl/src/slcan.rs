//! CAN frames as lines of text: the protocol of serial CAN adapters ("slcan", after Lawicel).
//!
//! A line ends with CR. `t1237010406...` is a frame with an 11-bit identifier (three hexadecimal digits), `T` one with 29 bits
//! (eight digits); then the number of data bytes, the bytes, and from an adapter four digits of time, if it was told to send them.
//! `r` and `R` are remote frames: TMCL has none, so they are recognised and carry nothing. The other lines work the adapter, see
//! [`Command`]. An adapter answers a command with [`OK`] or [`ERROR`]; digits of either case are read, capitals are written.
//!
//! Both ends are here: [`LineReader`] and [`Command::parse`] for what comes, [`Text`] for what goes.

use crate::can::Frame;

/// Ends every line; alone it says that a command was done.
pub const OK: u8 = b'\r';

/// An adapter's answer to what it cannot do.
pub const ERROR: u8 = 0x07;

/// A frame of eight bytes with a 29-bit identifier and a time, and the end of the line.
const MAX_LEN: usize = 31;

/// Bits a second for `S0` to `S8`.
pub const BIT_RATES: [u32; 9] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

/// What a line says, to an adapter or from one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Command {
    /// `t`, `T`: a frame; to an adapter: send it.
    Frame(Frame),
    /// `r`, `R`: a remote frame.
    Remote {
        /// True for a 29-bit identifier.
        extended: bool,
    },
    /// `S0` to `S8`: bits a second, see [`BIT_RATES`].
    BitRate(u32),
    /// `s`: bits a second by the registers of the adapter's chip.
    BitTiming,
    /// `O`: take part in the bus.
    Open,
    /// `L`: listen, send nothing.
    Listen,
    /// `C`: leave the bus.
    Close,
    /// `V`, `v`: version of the adapter.
    Version,
    /// `N`: serial number of the adapter.
    SerialNumber,
    /// `F`: flags of the adapter's state.
    Flags,
    /// `Z0`, `Z1`: whether frames come with their time.
    Timestamps(bool),
    /// `z`, `Z`: from an adapter: the frame was taken.
    Sent,
    /// An empty line; from an adapter: the command was done.
    Empty,
}

impl Command {
    /// Reads a line without its end; `None` if it is none of the commands.
    pub fn parse(line: &[u8]) -> Option<Self> {
        let Some((letter, rest)) = line.split_first() else { return Some(Self::Empty) };
        match (letter, rest) {
            (b't', _) => frame(rest, false).map(Self::Frame),
            (b'T', _) => frame(rest, true).map(Self::Frame),
            (b'r' | b'R', _) => Some(Self::Remote { extended: *letter == b'R' }),
            (b'S', [digit]) => BIT_RATES.get(usize::from(digit.wrapping_sub(b'0'))).copied().map(Self::BitRate),
            (b's', _) => number(rest).map(|_| Self::BitTiming),
            (b'O', []) => Some(Self::Open),
            (b'L', []) => Some(Self::Listen),
            (b'C', []) => Some(Self::Close),
            (b'V' | b'v', []) => Some(Self::Version),
            (b'N', []) => Some(Self::SerialNumber),
            (b'F', []) => Some(Self::Flags),
            (b'Z', [digit @ (b'0' | b'1')]) => Some(Self::Timestamps(*digit == b'1')),
            (b'z' | b'Z', []) => Some(Self::Sent),
            _ => None,
        }
    }
}

/// Identifier, length, data, and perhaps a time.
fn frame(digits: &[u8], extended: bool) -> Option<Frame> {
    let (id, rest) = digits.split_at_checked(if extended { 8 } else { 3 })?;
    let (len, rest) = rest.split_first()?;
    let id = number(id).filter(|id| *id <= if extended { 0x1fff_ffff } else { 0x7ff })?;
    let len = usize::from(len.wrapping_sub(b'0'));
    let mut data = [0; 8];
    let data = data.get_mut(..len)?;
    let (digits, time) = rest.split_at_checked(2 * len)?;
    for (byte, pair) in data.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = number(pair)? as u8;
    }
    if !matches!(time.len(), 0 | 4) {
        return None;
    }
    Frame::new(id, extended, data)
}

/// Up to eight hexadecimal digits.
fn number(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() || digits.len() > 8 {
        return None;
    }
    digits.iter().try_fold(0, |number, digit| Some(number << 4 | char::from(*digit).to_digit(16)?))
}

/// Collects lines from a stream of bytes. One that is too long for any command is dropped as a whole.
#[derive(Clone, Debug)]
pub struct LineReader {
    bytes: [u8; MAX_LEN],
    /// Bytes of the line so far, also those that found no room.
    len: usize,
}

impl LineReader {
    /// A reader at the beginning of a line.
    pub const fn new() -> Self {
        Self { bytes: [0; MAX_LEN], len: 0 }
    }

    /// Takes the next byte. At the end of a line ([`OK`] or [`ERROR`]) gives back what it says; `Err` if that is nothing.
    pub fn push(&mut self, byte: u8) -> Option<Result<Command, BadLine>> {
        match byte {
            OK | ERROR => {
                let len = core::mem::take(&mut self.len);
                let line = self.bytes.get(..len).filter(|_| byte == OK);
                Some(line.and_then(Command::parse).ok_or(BadLine))
            }
            b'\n' => None,
            _ => {
                if let Some(next) = self.bytes.get_mut(self.len) {
                    *next = byte;
                }
                self.len = self.len.saturating_add(1);
                None
            }
        }
    }
}

impl Default for LineReader {
    fn default() -> Self {
        Self::new()
    }
}

/// A line that is no command; an adapter's "no".
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("no command of a serial CAN adapter")]
pub struct BadLine;

/// A line with its end.
#[derive(Clone, Copy, Debug)]
pub struct Text {
    bytes: [u8; MAX_LEN],
    len: usize,
}

impl Text {
    /// The line of a frame, with its time in milliseconds (0..=59999) if the host has asked for times.
    pub fn frame(frame: &Frame, time_ms: Option<u16>) -> Self {
        let mut text = Self { bytes: [0; MAX_LEN], len: 0 };
        text.push(if frame.extended { b'T' } else { b't' });
        text.hex(frame.id, if frame.extended { 8 } else { 3 });
        text.hex(frame.data().len() as u32, 1);
        for byte in frame.data() {
            text.hex(u32::from(*byte), 2);
        }
        if let Some(time_ms) = time_ms {
            text.hex(time_ms.into(), 4);
        }
        text.push(OK);
        text
    }

    /// The line that sets bits a second; `None` if no adapter knows the rate.
    pub fn bit_rate(rate: u32) -> Option<Self> {
        let index = BIT_RATES.iter().position(|known| *known == rate)?;
        let mut text = Self { bytes: [0; MAX_LEN], len: 0 };
        text.push(b'S');
        text.hex(index as u32, 1);
        text.push(OK);
        Some(text)
    }

    /// The bytes of the line.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }

    fn hex(&mut self, number: u32, digits: u32) {
        for place in (0..digits).rev() {
            let digit = char::from_digit(number >> (4 * place) & 15, 16).unwrap_or('0');
            self.push(digit.to_ascii_uppercase() as u8);
        }
    }

    fn push(&mut self, byte: u8) {
        if let Some(next) = self.bytes.get_mut(self.len) {
            *next = byte;
            self.len += 1;
        }
    }
}
