//! TMCL, the motion-control language of the TRINAMIC modules.
//!
//! Datagrams on the wire, instructions as text and as bytes, and the catalogue: one table a module with every parameter,
//! port, interrupt and command. This crate alone knows byte order and the numbers of the protocol.
//!
//! Not here: what a command does, see `gradus-firmware`.

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod ascii;
mod bulk;
pub mod can;
pub mod catalogue;
mod datagram;
mod framer;
mod instruction;
mod operand;
pub mod rates;
pub mod slcan;
mod status;
mod text;

pub use bulk::Bulk;
pub use datagram::{ChecksumError, Reply, Request, checksum};
pub use framer::Framer;
pub use instruction::{Instruction, Opcode};
pub use operand::{
    CaptureAction, CaptureInfo, CaptureSource, CaptureState, CaptureTrigger, MoveKind, Operation, Search, WaitFor,
};
pub use status::Status;
pub use text::{ParseError, Text};
