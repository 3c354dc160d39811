//! Exit statuses besides 0 (all well), 1 (something failed) and 2 (the command line was wrong).

use std::fmt;
use std::process::ExitCode;

/// A command of the program was refused, or the program had a fault.
pub const REFUSED: u8 = 3;
/// The time was up before the program stopped, and it had to.
pub const TIME_UP: u8 = 4;
/// What shells add to the number of a signal that ended a program.
pub const SIGNAL: u8 = 128;

/// An end with a status of its own. All that there is to say may have been said before.
#[derive(Debug)]
pub struct Exit {
    status: u8,
    message: String,
}

impl Exit {
    /// An end with a last line for people; empty for none.
    pub fn with(status: u8, message: impl Into<String>) -> anyhow::Error {
        Self { status, message: message.into() }.into()
    }

    /// The status that an error ends the program with.
    pub fn status(error: &anyhow::Error) -> ExitCode {
        error.downcast_ref::<Self>().map_or(ExitCode::FAILURE, |exit| exit.status.into())
    }
}

impl fmt::Display for Exit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Exit {}
