//! Samples that follow a reply as raw bytes (command 142, type 22): the reply's value says how many there are, each is four
//! bytes, least significant first, and behind them stands their CRC-32, least significant byte first.

use crate::{CaptureAction, Instruction, Opcode};

/// A block of samples as it goes over the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bulk {
    bytes: [u8; Self::MAX_LEN],
    len: usize,
}

impl Bulk {
    /// Samples of the longest block.
    pub const MAX_SAMPLES: usize = 64;

    /// Bytes of the longest block.
    pub const MAX_LEN: usize = 4 * Self::MAX_SAMPLES + 4;

    /// True for the command whose reply a block follows.
    pub fn is_asked_by(request: &Instruction) -> bool {
        request.opcode == Opcode::CAPTURE && CaptureAction(request.kind) == CaptureAction::BULK_DOWNLOAD
    }

    /// Puts samples into a block; what finds no room is left out.
    pub fn new(samples: impl IntoIterator<Item = i32>) -> Self {
        let mut block = Self { bytes: [0; Self::MAX_LEN], len: 0 };
        for sample in samples.into_iter().take(Self::MAX_SAMPLES) {
            block.push(sample.to_le_bytes());
        }
        block.push(crc32(block.bytes()).to_le_bytes());
        block
    }

    /// All bytes of the block.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    fn push(&mut self, word: [u8; 4]) {
        if let Some(place) = self.bytes.get_mut(self.len..self.len + word.len()) {
            place.copy_from_slice(&word);
            self.len += word.len();
        }
    }
}

/// The CRC-32 of Ethernet and zlib.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| shifted(crc)))
}

/// One step of the division by the polynomial, bits reversed.
fn shifted(crc: u32) -> u32 {
    let subtracted = if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
    crc >> 1 ^ subtracted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_the_one_of_zlib() {
        for (bytes, crc) in [(b"123456789".as_slice(), 0xcbf4_3926), (b"", 0), (&[0; 4], 0x2144_df1c)] {
            assert_eq!(crc32(bytes), crc, "{bytes:?}");
        }
    }

    #[test]
    fn a_block_is_its_samples_and_their_checksum() {
        assert_eq!(Bulk::new([0]).bytes(), [0, 0, 0, 0, 0x1c, 0xdf, 0x44, 0x21]);
        assert_eq!(Bulk::new([-2, 0x0403_0201]).bytes()[..8], [0xfe, 0xff, 0xff, 0xff, 1, 2, 3, 4]);
        assert_eq!(Bulk::new(0..1000).bytes().len(), Bulk::MAX_LEN);
    }
}
