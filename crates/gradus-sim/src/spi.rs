//! Devices on the SPI bus of a simulated module.

/// What a chip select selects.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum SpiDevice {
    /// Nothing: zeros come back.
    #[default]
    None,
    /// A wire from output to input: what is sent comes back.
    Loopback,
    /// An output chip like the 74HC595: it shifts bits in and at its other end out, and shows them when it is no longer
    /// selected.
    Outputs(u8),
    /// A recording: the exchanges in their order. One that does not send what comes next in it gets zeros.
    Script {
        /// What is sent and what comes back, of the same length.
        exchanges: Vec<Exchange>,
        /// The next one.
        next: usize,
    },
}

/// An exchange of a recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Exchange {
    /// What the module sends.
    pub sent: Vec<u8>,
    /// What comes back.
    pub received: Vec<u8>,
}

impl SpiDevice {
    /// Exchanges bytes.
    pub fn exchange(&mut self, bytes: &mut [u8]) {
        match self {
            Self::None => bytes.fill(0),
            Self::Loopback => {}
            Self::Outputs(shown) => {
                for byte in bytes {
                    std::mem::swap(byte, shown);
                }
            }
            Self::Script { exchanges, next } => match exchanges.get(*next) {
                Some(exchange) if exchange.sent == bytes => {
                    bytes.copy_from_slice(&exchange.received);
                    *next += 1;
                }
                _ => bytes.fill(0),
            },
        }
    }

    /// What the loss of power does.
    pub(crate) fn lose_power(&mut self) {
        match self {
            Self::Outputs(shown) => *shown = 0,
            Self::Script { next, .. } => *next = 0,
            Self::None | Self::Loopback => {}
        }
    }
}

/// An exchange in hexadecimal digits, `SENT: RECEIVED`, each one to four bytes and as many.
impl std::str::FromStr for Exchange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected two times 1 to 4 bytes as in `9F000000: 00C22017`, not `{text}`");
        let (sent, received) = text.split_once(':').ok_or_else(wrong)?;
        let bytes = |digits: &str| hexadecimal(&digits.replace(' ', ""));
        let exchange = Self { sent: bytes(sent).ok_or_else(wrong)?, received: bytes(received).ok_or_else(wrong)? };
        let fits = (1..=4).contains(&exchange.sent.len()) && exchange.sent.len() == exchange.received.len();
        if fits { Ok(exchange) } else { Err(wrong()) }
    }
}

fn hexadecimal(digits: &str) -> Option<Vec<u8>> {
    let pairs = digits.as_bytes().chunks(2);
    pairs
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?, 16).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exchanged(device: &mut SpiDevice, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        device.exchange(&mut bytes);
        bytes
    }

    #[test]
    fn loop_back_answers_what_is_sent_and_nothing_answers_zeros() {
        assert_eq!(exchanged(&mut SpiDevice::Loopback, &[1, 2, 3]), [1, 2, 3]);
        assert_eq!(exchanged(&mut SpiDevice::None, &[1, 2, 3]), [0, 0, 0]);
    }

    #[test]
    fn output_chip_shows_the_last_byte_and_shifts_out_the_one_before() {
        let mut chip = SpiDevice::Outputs(0);
        assert_eq!(exchanged(&mut chip, &[0xa5]), [0]);
        assert_eq!(exchanged(&mut chip, &[1, 2]), [0xa5, 1]);
        assert_eq!(chip, SpiDevice::Outputs(2));
        chip.lose_power();
        assert_eq!(chip, SpiDevice::Outputs(0));
    }

    #[test]
    fn script_goes_on_with_what_it_expects() {
        let exchanges = ["9F00: 00C2", "05: 01"].map(|line| line.parse().unwrap()).to_vec();
        let mut script = SpiDevice::Script { exchanges, next: 0 };
        assert_eq!(exchanged(&mut script, &[5]), [0]);
        assert_eq!(exchanged(&mut script, &[0x9f, 0]), [0, 0xc2]);
        assert_eq!(exchanged(&mut script, &[5]), [1]);
        assert_eq!(exchanged(&mut script, &[5]), [0]);
    }

    #[test]
    fn wrong_lines_of_a_script_are_refused() {
        for line in ["9F", "9F: 0", "9F: 0000", "xx: 00", ": ", "0011223344: 0011223344"] {
            assert!(line.parse::<Exchange>().is_err(), "{line}");
        }
    }
}
