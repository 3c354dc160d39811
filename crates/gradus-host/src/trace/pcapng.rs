//! pcapng files, as Wireshark and tshark read and write them.
//!
//! A file has two interfaces. Serial datagrams have the link type USER0 (147), which `tools/wireshark/tmcl.lua` understands; CAN frames
//! have SocketCAN's (227), which every Wireshark understands. The flags of a packet tell its direction, seen from the host:
//! outbound is a request, inbound a reply. What a virtual module says by itself is the comment of an empty packet. Times are microseconds since 1970.

use std::io::{self, Write};
use std::time::Duration;

use gradus_tmcl::can::Frame;

use super::{Direction, Packet, Record};

const SECTION: u32 = 0x0a0d_0d0a;
const INTERFACE: u32 = 1;
const PACKET: u32 = 6;
const MAGIC: u32 = 0x1a2b_3c4d;
const END_OF_OPTIONS: u16 = 0;
const COMMENT: u16 = 1;
const INTERFACE_NAME: u16 = 2;
const TIME_RESOLUTION: u16 = 9;
/// The resolution of an interface that names none: 10^-6 s.
const MICROSECONDS: u8 = 6;
const PACKET_FLAGS: u16 = 2;
const INBOUND: u32 = 1;
const OUTBOUND: u32 = 2;
const USER0: u16 = 147;
const SOCKETCAN: u16 = 227;
/// Set in the identifier of a 29-bit CAN frame.
const EXTENDED: u32 = 1 << 31;

/// Writes records into a pcapng file.
pub struct PcapngWriter<W: Write> {
    file: W,
}

impl<W: Write> PcapngWriter<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn new(mut file: W) -> io::Result<Self> {
        let section: Vec<u8> = [MAGIC.to_le_bytes().as_slice(), &[1, 0, 0, 0], &u64::MAX.to_le_bytes()].concat();
        file.write_all(&block(SECTION, &section))?;
        for (link_type, name) in [(USER0, "serial"), (SOCKETCAN, "can")] {
            let head = [link_type.to_le_bytes().as_slice(), &[0; 6]].concat();
            file.write_all(&block(INTERFACE, &[head, option(INTERFACE_NAME, name.as_bytes()), end()].concat()))?;
        }
        file.flush()?;
        Ok(Self { file })
    }

    /// Adds a record, and brings it to the file at once, so that a trace that is cut off is readable.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&mut self, record: &Record) -> io::Result<()> {
        let (interface, data, comment) = match &record.packet {
            Packet::Serial(bytes) => (0_u32, bytes.clone(), vec![]),
            Packet::Can(frame) => (1, socketcan(frame), vec![]),
            Packet::Notice(text) => (0, vec![], option(COMMENT, text.as_bytes())),
        };
        let us = u64::try_from(record.at.as_micros()).unwrap_or(u64::MAX);
        let len = data.len() as u32;
        let head = [interface, (us >> 32) as u32, us as u32, len, len];
        let flags = match record.direction {
            Direction::Request => OUTBOUND,
            Direction::Reply => INBOUND,
            Direction::Unknown => 0,
        };
        let head: Vec<u8> = head.iter().flat_map(|word| word.to_le_bytes()).collect();
        let options = [option(PACKET_FLAGS, &flags.to_le_bytes()), comment, end()].concat();
        self.file.write_all(&block(PACKET, &[head, padded(&data), options].concat()))?;
        self.file.flush()
    }
}

fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let len = (body.len() as u32 + 12).to_le_bytes();
    [kind.to_le_bytes().as_slice(), &len, body, &len].concat()
}

fn option(code: u16, value: &[u8]) -> Vec<u8> {
    [code.to_le_bytes().to_vec(), (value.len() as u16).to_le_bytes().to_vec(), padded(value)].concat()
}

fn end() -> Vec<u8> {
    option(END_OF_OPTIONS, &[])
}

/// Filled up to whole words.
fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

fn socketcan(frame: &Frame) -> Vec<u8> {
    let id = frame.id | if frame.extended { EXTENDED } else { 0 };
    [id.to_be_bytes().as_slice(), &[frame.data().len() as u8, 0, 0, 0], frame.data()].concat()
}

/// What is wrong with a file.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum PcapngError {
    /// It does not begin as one.
    #[error("this is no pcapng file")]
    NoPcapng,
    /// A block is shorter or longer than it says.
    #[error("byte {at}: a damaged block")]
    Damaged {
        /// Where it begins.
        at: usize,
    },
}

/// A file that is being read.
struct Reader<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    /// Link types of the section, with their resolution of time.
    interfaces: Vec<(u16, u8)>,
    records: Vec<Record>,
}

/// Reads the TMCL traffic of a pcapng file; packets of other link types are left out. A last block that is cut off ends it.
///
/// # Errors
/// When it is no pcapng file or a block is damaged.
pub fn read_pcapng(bytes: &[u8]) -> Result<Vec<Record>, PcapngError> {
    let mut reader = Reader { bytes, big_endian: false, interfaces: Vec::new(), records: Vec::new() };
    if reader.word(0) != Some(SECTION) {
        return Err(PcapngError::NoPcapng);
    }
    let mut at = 0;
    while let Some(len) = reader.block_len(at)? {
        reader.block(at, len).ok_or(PcapngError::Damaged { at })?;
        at += len;
    }
    Ok(reader.records)
}

impl Reader<'_> {
    fn word(&self, at: usize) -> Option<u32> {
        let word = self.bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    fn half(&self, at: usize) -> Option<u16> {
        let half = self.bytes.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if self.big_endian { u16::from_be_bytes(half) } else { u16::from_le_bytes(half) })
    }

    /// Length of the block at a place; `None` at the end and where the rest is cut off.
    fn block_len(&mut self, at: usize) -> Result<Option<usize>, PcapngError> {
        if self.word(at) == Some(SECTION) {
            self.big_endian = self.bytes.get(at + 8..at + 12) == Some(MAGIC.to_be_bytes().as_slice());
            self.interfaces.clear();
        }
        let Some(len) = self.word(at + 4).map(|len| len as usize) else { return Ok(None) };
        if len < 12 || !len.is_multiple_of(4) {
            return Err(PcapngError::Damaged { at });
        }
        Ok((self.bytes.len() - at >= len).then_some(len))
    }

    fn block(&mut self, at: usize, len: usize) -> Option<()> {
        match self.word(at)? {
            INTERFACE => {
                let resolution = self.option(at + 16, at + len - 4, TIME_RESOLUTION);
                let resolution = resolution.and_then(|value| self.bytes.get(value)).unwrap_or(&MICROSECONDS);
                self.interfaces.push((self.half(at + 8)?, *resolution));
            }
            PACKET => {
                let record = self.packet(at, len)?;
                self.records.extend(record);
            }
            _ => {}
        }
        Some(())
    }

    /// The inner `None` is a packet of another link type.
    fn packet(&self, at: usize, len: usize) -> Option<Option<Record>> {
        let (link_type, resolution) = *self.interfaces.get(self.word(at + 8)? as usize)?;
        let ticks = u64::from(self.word(at + 12)?) << 32 | u64::from(self.word(at + 16)?);
        let captured = self.word(at + 20)? as usize;
        let start = at + 28;
        let data = self.bytes.get(start..start.checked_add(captured)?.min(at + len))?;
        let (options, end) = (start + captured.next_multiple_of(4), at + len - 4);
        let packet = match link_type {
            USER0 if data.is_empty() => {
                self.notice(options, end).map_or_else(|| Packet::Serial(vec![]), Packet::Notice)
            }
            USER0 => Packet::Serial(data.to_vec()),
            SOCKETCAN => Packet::Can(frame(data)?),
            _ => return Some(None),
        };
        let flags = self.option(options, end, PACKET_FLAGS);
        let direction = match flags.and_then(|value| self.word(value)).unwrap_or_default() & 3 {
            INBOUND => Direction::Reply,
            OUTBOUND => Direction::Request,
            _ => Direction::Unknown,
        };
        Some(Some(Record { at: time(ticks, resolution), direction, packet }))
    }

    /// The comment of a packet.
    fn notice(&self, options: usize, end: usize) -> Option<String> {
        let value = self.option(options, end, COMMENT)?;
        let text = self.bytes.get(value..value + usize::from(self.half(value - 2)?))?;
        Some(String::from_utf8_lossy(text).into_owned())
    }

    /// Where the value of an option stands among those from `at` to `end`.
    fn option(&self, mut at: usize, end: usize, wanted: u16) -> Option<usize> {
        while at + 4 <= end {
            match (self.half(at)?, self.half(at + 2)?) {
                (END_OF_OPTIONS, _) => return None,
                (code, _) if code == wanted => return Some(at + 4),
                (_, len) => at += 4 + usize::from(len).next_multiple_of(4),
            }
        }
        None
    }
}

/// The time of so many ticks of 10^-n s, or, with the highest bit of the resolution set, 2^-n s.
fn time(ticks: u64, resolution: u8) -> Duration {
    const BINARY: u8 = 0x80;
    let exponent = u32::from(resolution & !BINARY);
    let base: u128 = if resolution & BINARY == 0 { 10 } else { 2 };
    let ns = base.checked_pow(exponent).map_or(0, |second| u128::from(ticks) * 1_000_000_000 / second);
    Duration::from_nanos(u64::try_from(ns).unwrap_or(u64::MAX))
}

fn frame(data: &[u8]) -> Option<Frame> {
    let (head, rest) = data.split_first_chunk::<8>()?;
    let [a, b, c, d, len, ..] = *head;
    let id = u32::from_be_bytes([a, b, c, d]);
    Frame::new(id & 0x1fff_ffff, id & EXTENDED != 0, rest.get(..usize::from(len))?)
}
