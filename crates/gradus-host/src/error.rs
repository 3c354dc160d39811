//! What can go wrong between a host and a module, in words that say what, where and what to do.

use std::io;
use std::time::Duration;

use gradus_tmcl::Status;

use crate::{NameError, UrlError};

/// An error of a session.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The port's name is wrong.
    #[error(transparent)]
    Url(#[from] UrlError),
    /// The port does not open.
    #[error("cannot open {port}: {reason}")]
    Open {
        /// The port.
        port: String,
        /// Why, and what helps.
        reason: String,
    },
    /// The line broke.
    #[error("{port}: the connection broke: {error}")]
    Broken {
        /// The port.
        port: String,
        /// What the system said.
        error: io::Error,
    },
    /// Nothing answers at all.
    #[error("{port}: no module answers at {address}; check {check}")]
    NoModule {
        /// The port.
        port: String,
        /// The address asked, in words: `address 1`, `CAN ID 1`.
        address: String,
        /// What to check on this kind of line.
        check: &'static str,
    },
    /// The line is stopped.
    #[error("{port} is stopped: nothing that acts goes out until the stop is released (`gradus stop --release`)")]
    Stopped {
        /// The port.
        port: String,
    },
    /// The other end never stops sending, so that no answer can be told apart.
    #[error(
        "{port}: the other end has been sending for {} ms without a pause and answers nothing; is it a TMCL module, and is the \
         baud rate right?", waited.as_millis()
    )]
    Babble {
        /// The port.
        port: String,
        /// How long the session listened.
        waited: Duration,
    },
    /// A request got no answer in time. It may have been executed.
    #[error(
        "{port}: no answer to `{request}` within {} ms{}; it may have been executed, and its reply suppressed \
         (global parameter 255)",
        waited.as_millis(), other(*foreign)
    )]
    Silent {
        /// The port.
        port: String,
        /// The request as text.
        request: String,
        /// How long the session waited.
        waited: Duration,
        /// Datagrams that came and were no answer to the request.
        foreign: usize,
    },
    /// An answer came damaged. The request was executed.
    #[error("{port}: the answer to `{request}` came damaged ({bytes:02x?}); check cable and baud rate")]
    Garbled {
        /// The port.
        port: String,
        /// The request as text.
        request: String,
        /// What came.
        bytes: Vec<u8>,
    },
    /// The module got a request damaged and did not execute it.
    #[error("{port}: `{request}` reached the module damaged and was not executed; check the cable, and send it again")]
    GarbledRequest {
        /// The port.
        port: String,
        /// The request as text.
        request: String,
    },
    /// The module answered with an error status. Nothing has changed.
    #[error("`{request}` was refused: {}{}", status.text(), because(reason))]
    Refused {
        /// The request as text.
        request: String,
        /// What the module said.
        status: Status,
        /// What the catalogue knows about it; may be empty.
        reason: String,
    },
    /// The module is none of the catalogue's.
    #[error("the catalogue has no module that calls itself `{text}`")]
    UnknownModule {
        /// Its version text, `3351V111` on a TMCM-3351.
        text: String,
    },
    /// There is no such parameter.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The program does not fit.
    #[error("the program has {len} commands, the {module} holds {room}")]
    ProgramTooLong {
        /// Commands of the program.
        len: usize,
        /// Name of the module.
        module: &'static str,
        /// Commands of its memory.
        room: u16,
    },
    /// The program has a control command, which the module would execute instead of storing it.
    #[error("program address {address}: `{request}` is a control command; it cannot stand in a program")]
    NotStorable {
        /// Address of the command.
        address: u16,
        /// The command as text.
        request: String,
    },
    /// What was read back differs from what was written.
    #[error("program address {address}: wrote `{wrote}`, read back `{read}`{}", protected(*blank))]
    Verify {
        /// Address of the first difference.
        address: u16,
        /// The command of the program.
        wrote: String,
        /// The command in the module.
        read: String,
        /// True when only zeros came back.
        blank: bool,
    },
}

impl Error {
    /// True for what a noisy or slow line does to a single request.
    pub fn is_passing(&self) -> bool {
        matches!(self, Self::Silent { .. } | Self::Garbled { .. } | Self::GarbledRequest { .. })
    }
}

fn other(foreign: usize) -> String {
    match foreign {
        0 => String::new(),
        count => format!(" ({count} datagrams came that answer something else; does another program use the port?)"),
    }
}

fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!("; {reason}") }
}

fn protected(blank: bool) -> &'static str {
    if blank { "; the module may be protected against reading back (global parameter 81)" } else { "" }
}
