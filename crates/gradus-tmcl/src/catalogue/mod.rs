//! The catalogue: what each module has, one row a thing.
//!
//! Range checks, EEPROM layout, names on the command line, symbols of the assembler and the documentation are all read from
//! these rows. The firmware names a parameter by its [`Ap`] or [`Gp`], never by its number.
//!
//! The rows follow the manuals (TMCM-3351 V1.06, TMCM-1617 V1.03, TMCM-351 V1.03 and, where it says so, Rev. 1.06). A description
//! ends with the manual's section; "ERRATA" marks a row in which the manual is wrong.

mod availability;
mod command;
mod commands;
mod effect;
mod meaning;
mod module;
mod modules;
mod parameter;
mod tmcm1617;
mod tmcm3351;
mod tmcm351;

pub use availability::Mode;
pub(crate) use command::encode;
pub use command::{Ascii, Command, EncodeError, Field, Impact, Keyword, Modes, Operand, OperandKind};
pub use commands::COMMANDS;
pub(crate) use commands::FIELDS;
pub use effect::Effect;
pub use meaning::{Ap, Gp};
pub use module::{Direction, Interrupt, InterruptKind, Model, Module, MotionChip, Port};
pub use modules::{ANY, MODULES};
pub use parameter::{Access, AxisParameter, Choice, GlobalParameter, Unit, Values};
pub use tmcm351::TMCM_351;
pub use tmcm1617::TMCM_1617;
pub use tmcm3351::TMCM_3351;
