//! The SPI bus of the TMCM-351: SAC.
//!
//! Where the manual is silent: fewer than four bytes are the low ones of the value, the most significant first, and what comes
//! back is a number without sign.

use gradus_tmcl::Status;

use crate::module::Module;
use crate::ports::{Ports, Store};

/// Added to the number of a bus: the accumulator is sent.
const ACCUMULATOR: u8 = 128;

impl<P: Ports, S: Store> Module<P, S> {
    /// SAC: sends bytes to the device on a bus, gives back what it has sent meanwhile.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for an unknown bus, [`Status::INVALID_VALUE`] for a number of bytes but 1 to 4.
    pub(crate) fn exchange(&mut self, bus: u8, count: u8, value: i32) -> Result<i32, Status> {
        let chip_select = match bus & !ACCUMULATOR {
            0 => 0,
            2 => 1,
            3 => 2,
            _ => return Err(Status::WRONG_TYPE),
        };
        let sent = if bus & ACCUMULATOR != 0 { self.program.cpu.registers.accumulator } else { value };
        let mut bytes = sent.to_be_bytes();
        let unused = bytes.len().checked_sub(usize::from(count)).ok_or(Status::INVALID_VALUE)?;
        let used = bytes.get_mut(unused..).filter(|used| !used.is_empty()).ok_or(Status::INVALID_VALUE)?;
        self.ports.exchange(chip_select, used);
        Ok(used.iter().fold(0, |value, byte| value << 8 | i32::from(*byte)))
    }
}
