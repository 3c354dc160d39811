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

mod ascii;
mod axes;
mod axis;
mod capture;
mod closed_loop;
mod coordinates;
mod cpu;
mod driver;
mod eeprom;
mod encoder;
mod events;
mod execute;
mod globals;
mod heartbeat;
mod interpreter;
mod interrupts;
mod io;
mod link;
mod module;
mod motion;
mod ports;
mod program;
mod protection;
mod reference_search;
mod search_modes;
mod servo;
mod servo_encoder;
mod servo_parameters;
mod servo_registers;
mod servo_settings;
mod settings;
mod speed;
mod spi;
mod stap;
mod steppers;
mod supervision;
mod ticks;
mod tmc428;
mod units;
mod view;

pub use eeprom::store_size;
pub use link::{Link, LinkKind};
pub use module::Module;
pub use ports::{
    AxisInputs, Bridge, CoolStep, DriverSettings, DriverState, InputCircuit, Io, NullEvent, Ports, RotorInputs,
    StealthChop, StepperStage, Store, Supply, Switches,
};
pub use program::State as ProgramState;
pub use reference_search::SearchFailure;
pub use servo::Servo;
pub use steppers::Steppers;
pub use view::{FlagView, InterruptedView, ProgramView, Register, RegisterView, WaitView};
