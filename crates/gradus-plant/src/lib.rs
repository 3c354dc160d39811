//! Simulated machines: what hangs on the connectors of a motion-control module.
//!
//! A [`StepperAxis`] is a driver chip with a motor, its load, the [`Travel`] with switches and end stops, and an
//! [`Encoder`] with an index. Its rotor is rigid, which turns with the coil vector, or that of a [`Motor`] with inertia,
//! friction and load, which loses steps. Lengths are microsteps of 1/256 full step.
//!
//! A [`ServoMachine`] is the bridge of a servo module with its supply and what the bridge drives: a three-phase or a
//! direct-current motor with hall sensors, an encoder and a load.
//!
//! Everything is deterministic, and equal to the bit on every machine: floating-point numbers are only added, multiplied,
//! divided, and their square roots taken.

mod axis;
mod coil_vector;
mod coils;
mod contacts;
mod driver;
mod encoder;
mod equations;
mod field;
mod hall;
mod microsteps;
mod motors;
mod noise;
mod rigid;
mod servo_machine;
mod servo_motors;
mod servo_setup;
mod stall_guard;
mod stealth_chop;
mod stepper;
mod stepper_gains;
mod supply;
mod surroundings;
mod travel;
mod trigonometry;
mod winding;

pub use axis::{Readings, StepperAxis};
pub use contacts::STEP_US;
pub use driver::{CoilFault, CoolStep, DriverSettings, DriverState};
pub use encoder::{Channels, Encoder, NullEvent};
pub use field::Coil;
pub use hall::{HallOrder, HallSensors};
pub use microsteps::MICROSTEPS_PER_FULL_STEP;
pub use motors::{MOTORS, Mechanics, Motor};
pub use servo_machine::{Bridge, Powers, ServoMachine};
pub use servo_motors::{Phases, SERVO_MOTORS, ServoMotor};
pub use servo_setup::{BridgeData, ServoSetup};
pub use stall_guard::STALLGUARD_NOISE;
pub use stealth_chop::StealthChop;
pub use stepper::Currents;
pub use supply::{HIGHEST_V, Supply};
pub use surroundings::Surroundings;
pub use travel::{Switch, Travel, Vane};
