//! The bench: a module's firmware bolted to a simulated machine.
//!
//! A [`Bench`] runs in virtual time, as fast as the computer can. A `Server` lets its time follow the wall clock and offers
//! it to real hosts on pseudo-terminals and TCP, with a [`console`] to work the machine by hand; it needs a Unix system. A
//! [`BenchFile`] describes a machine and what happens to it.
//!
//! Not here: what a module does with a datagram (`gradus-firmware`) and what a motor does with its current
//! (`gradus-plant`).

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bench;
pub mod bench_file;
mod can_bus;
pub mod console;
mod current_noise;
mod drive;
mod eeprom;
mod faults;
mod firmware;
mod io;
mod machine;
mod notices;
mod passed;
mod problem;
mod quantity;
mod rig;
pub mod rig_console;
#[cfg(unix)]
pub mod rig_file;
mod segment;
#[cfg(unix)]
mod serve;
mod slots;
mod spi;
mod uart;
mod wakes;

pub use bench::{Bench, VIRTUAL_MODULES, is_virtual, virtual_names};
pub use bench_file::{BenchFile, BenchFileError};
pub use can_bus::Can;
pub use drive::ServoDrive;
pub use eeprom::{Eeprom, EepromError};
pub use faults::{PROFILES, Profile, ProfileError};
pub use firmware::Firmware;
pub use gradus_firmware::{LineRates, Link, LinkKind};
pub use gradus_plant::{Bridge as Switches, Readings, ServoMachine, ServoSetup, StepperAxis, Vane};
pub use io::{Adc, MachineIo};
pub use machine::{DriverChip, Machine, MachineAxis};
pub use notices::Notice;
pub use passed::{Content, Passed};
pub use problem::Problem;
pub use rig::{BusChange, BusKind, HostId, Rig};
#[cfg(unix)]
pub use rig_file::RigFile;
pub use segment::Serial;
#[cfg(unix)]
pub use serve::{
    Console, Endpoint, EndpointError, EndpointParseError, Options, ServeError, Server, Speed, SpeedError, Stopper,
    address, allow_many_endpoints, fuzz_adapters,
};
pub use spi::{Exchange, SpiDevice};
