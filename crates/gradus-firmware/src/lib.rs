//! The firmware of a TMCL module.
//!
//! [`Module`] is a whole module: direct mode, the interpreter of stored programs, axis and global parameters, the EEPROM,
//! motion. Time is an argument and the hardware is a set of small traits, so that the same code runs on a chip, behind a
//! pseudo-terminal and at a thousand times real time in a test.
//!
//! Not here: byte order and numbers of the protocol (`gradus-tmcl`), the mathematics of ramps (`gradus-motion`), motors and
//! switches (`gradus-plant`).

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

#[cfg(test)]
extern crate std;

mod capture;
mod commands;
mod direct_mode;
mod drive;
mod links;
mod module;
mod ports;
mod program;
mod storage;

pub use drive::servo::servo::Servo;
pub use drive::stepper::search_failure::SearchFailure;
pub use drive::stepper::steppers::Steppers;
pub use links::line_rates::LineRates;
pub use links::link::{Link, LinkKind};
pub use module::Module;
pub use ports::{
    AxisInputs, Bridge, CoolStep, DriverSettings, DriverState, InputCircuit, Io, NullEvent, Ports, RotorInputs,
    StealthChop, StepperStage, Store, Supply, Switches,
};
pub use program::program::State as ProgramState;
pub use program::view::{FlagView, InterruptedView, ProgramView, Register, RegisterView, WaitView};
pub use storage::records::store_size;
