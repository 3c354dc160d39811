//! Nine bytes out of a stream.

/// Collects datagrams from a stream of bytes; a pause inside a datagram throws the beginning away.
#[derive(Clone, Debug)]
pub struct Framer {
    bytes: [u8; 9],
    len: usize,
    last_us: u64,
    gap_us: u32,
}

impl Framer {
    /// A framer that forgets an unfinished datagram after a pause of more than `gap_us` microseconds; 0: never.
    pub fn new(gap_us: u32) -> Self {
        Self { bytes: [0; 9], len: 0, last_us: 0, gap_us }
    }

    /// Takes the next byte, which came at `now_us`; gives back nine of them when they are together.
    pub fn push(&mut self, byte: u8, now_us: u64) -> Option<[u8; 9]> {
        if self.gap_us != 0 && now_us.saturating_sub(self.last_us) > u64::from(self.gap_us) {
            self.len = 0;
        }
        self.last_us = now_us;
        if let Some(next) = self.bytes.get_mut(self.len) {
            *next = byte;
        }
        self.len = (self.len + 1) % self.bytes.len();
        (self.len == 0).then_some(self.bytes)
    }

    /// Bytes of an unfinished datagram.
    pub fn pending(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    /// Forgets an unfinished datagram.
    pub fn reset(&mut self) {
        self.len = 0;
    }
}
