//! A receiver of serial bytes that is set to another rate than the sender.
//!
//! It does what a UART does: the first falling edge is a start bit, then it looks at the middle of each bit as long as it takes its
//! bits to be. A byte without a stop bit is dropped, and the line must be high before the next one begins. So rates that
//! are close understand each other, and others hear noise or nothing.

use std::borrow::Cow;

/// A start bit, eight of data, a stop bit.
const BITS: u64 = 10;

/// What a receiver of `to` bits a second makes of bytes that are sent one right after the other at `from`. A rate of 0 is always
/// the other one's.
pub(crate) fn received(bytes: &[u8], from: u32, to: u32) -> Cow<'_, [u8]> {
    if from == to || from == 0 || to == 0 {
        return Cow::Borrowed(bytes);
    }
    let mut receiver = Receiver { bytes, sent_bit: 2 * u64::from(to), half_bit: from.into(), now: 0 };
    let mut heard = Vec::new();
    while receiver.find(false) {
        heard.extend(receiver.byte());
    }
    Cow::Owned(heard)
}

struct Receiver<'a> {
    bytes: &'a [u8],
    /// Length of a bit on the line, in units in which half a bit of the receiver has a whole length too.
    sent_bit: u64,
    half_bit: u64,
    now: u64,
}

impl Receiver<'_> {
    /// The line at this moment; high where nothing is sent.
    fn level(&self) -> bool {
        let bit = self.now / self.sent_bit;
        let byte = self.bytes.get((bit / BITS) as usize).copied().unwrap_or(0xff);
        match bit % BITS {
            0 => (bit / BITS) as usize >= self.bytes.len(),
            9 => true,
            place => byte >> (place - 1) & 1 == 1,
        }
    }

    /// Goes on to where the line has that level; false if it never has.
    fn find(&mut self, level: bool) -> bool {
        while self.level() != level {
            self.now = (self.now / self.sent_bit + 1) * self.sent_bit;
            if self.now / self.sent_bit > BITS * self.bytes.len() as u64 {
                return false;
            }
        }
        true
    }

    /// From a falling edge on; `None` if it was no start bit or the stop bit is missing.
    fn byte(&mut self) -> Option<u8> {
        self.now += self.half_bit;
        if self.level() {
            return None;
        }
        let mut byte = 0;
        for place in 0..8 {
            self.now += 2 * self.half_bit;
            byte |= u8::from(self.level()) << place;
        }
        self.now += 2 * self.half_bit;
        let stopped = self.level();
        self.find(true);
        stopped.then_some(byte)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [u8; 6] = [0x00, 0xff, 0x55, 0xaa, 0x01, 0x80];

    #[test]
    fn close_rates_understand_each_other() {
        for rate in [9600, 9300, 9900] {
            assert_eq!(*received(&ALL, rate, 9600), ALL, "{rate}");
        }
        assert_ne!(*received(&ALL, 9600, 10_400), ALL, "half a bit off at the stop bit");
    }

    #[test]
    fn a_slow_receiver_misses_bytes_and_a_fast_one_hears_more_or_others() {
        // Twice as fast: each bit is seen twice. Start bit 0 0, then 1 1 1 1 1 1 1 and no second falling edge.
        assert_eq!(*received(&[0xff], 9600, 19_200), [0xfe]);
        // Eight low bits and the start bit: no stop bit where it is looked for.
        assert_eq!(*received(&[0x00], 9600, 19_200), []);
        let telegram = [1, 6, 1, 0, 0, 0, 0, 0, 8];
        let slow = received(&telegram, 115_200, 9600);
        assert!(slow.len() <= 1, "nine bytes pass while it receives one: {slow:02x?}");
        assert_ne!(*received(&telegram, 9600, 115_200), telegram);
    }

    #[test]
    fn every_pair_of_rates_ends() {
        for from in gradus_tmcl::rates::BAUD_RATES {
            for to in gradus_tmcl::rates::BAUD_RATES {
                let heard = received(&ALL, from, to);
                assert_eq!(*heard == ALL, from.abs_diff(to) * 25 <= from, "{from} to {to}: {heard:02x?}");
            }
        }
    }
}
