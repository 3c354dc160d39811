//! The nine-byte datagrams of RS232, RS485, USB and TCP.

use crate::{Instruction, Opcode, Status};

/// Sum of the bytes modulo 256, the last byte of every serial datagram.
pub fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// A datagram whose last byte is not the sum of the others.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("checksum {got:#04x}, expected {want:#04x}")]
pub struct ChecksumError {
    /// The byte that came.
    pub got: u8,
    /// The sum of the other eight.
    pub want: u8,
}

fn check(bytes: &[u8; 9]) -> Result<(), ChecksumError> {
    let (got, want) = (bytes[8], checksum(&bytes[..8]));
    if got == want { Ok(()) } else { Err(ChecksumError { got, want }) }
}

/// A command from the host (TMCM-3351 manual, table 2).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Request {
    /// Address of the module.
    pub address: u8,
    /// The command with its operands.
    pub instruction: Instruction,
}

impl Request {
    /// Reads nine bytes.
    ///
    /// # Errors
    /// When the checksum does not fit.
    pub fn parse(bytes: &[u8; 9]) -> Result<Self, ChecksumError> {
        check(bytes)?;
        let [address, b @ .., _] = *bytes;
        Ok(Self { address, instruction: Instruction::from_bytes(b) })
    }

    /// The nine bytes.
    pub fn emit(&self) -> [u8; 9] {
        let mut bytes = [0; 9];
        bytes[0] = self.address;
        bytes[1..8].copy_from_slice(&self.instruction.to_bytes());
        bytes[8] = checksum(&bytes[..8]);
        bytes
    }
}

/// An answer from the module (TMCM-3351 manual, table 3).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reply {
    /// Address of the host (global parameter 76).
    pub host: u8,
    /// Address of the module.
    pub module: u8,
    /// How it went.
    pub status: Status,
    /// The command that is answered.
    pub command: Opcode,
    /// The result, or the command's value.
    pub value: i32,
}

impl Reply {
    /// Reads nine bytes.
    ///
    /// # Errors
    /// When the checksum does not fit.
    pub fn parse(bytes: &[u8; 9]) -> Result<Self, ChecksumError> {
        check(bytes)?;
        let [host, module, status, command, v3, v2, v1, v0, _] = *bytes;
        let value = i32::from_be_bytes([v3, v2, v1, v0]);
        Ok(Self { host, module, status: Status(status), command: Opcode(command), value })
    }

    /// The nine bytes.
    pub fn emit(&self) -> [u8; 9] {
        let [v3, v2, v1, v0] = self.value.to_be_bytes();
        let mut bytes = [self.host, self.module, self.status.0, self.command.0, v3, v2, v1, v0, 0];
        bytes[8] = checksum(&bytes[..8]);
        bytes
    }
}
