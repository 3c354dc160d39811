//! The stored program: memory, registers, interpreter, interrupts.

#![allow(clippy::module_inception)] // the type that the room is named for

pub(crate) mod cpu;
pub(crate) mod interpreter;
pub(crate) mod interrupts;
pub(crate) mod program;
pub(crate) mod view;
