//! The ASCII interface from the host's side: command lines instead of datagrams.
//!
//! A [`Terminal`] switches the module over with command 139 before its first line; one that is in ASCII mode already does not
//! answer that, and is taken as it is. [`close`](Terminal::close) leaves the mode as it was found. What is no reply, the echo
//! above all, is passed over. Nothing is sent twice: a line carries no sum, and nobody knows what a module made of a damaged one.

use std::time::Duration;

use gradus_sim::Bench;
use gradus_tmcl::ascii::{CR, Line, LineError, Reply, letter};
use gradus_tmcl::catalogue::{MODULES, Module};
use gradus_tmcl::{Instruction, Opcode, Status};

use crate::line::stream;
use crate::link::{Framed, GRACE};
use crate::refusal::reason;
use crate::sim::SimStream;
use crate::{Address, Error, Heard, Link, Stream, Url};

/// The longest line that can be a reply; what is longer is no line of a module.
const LONGEST: usize = 256;

/// Command 139.
const ENTER: Instruction = Instruction::new(Opcode::ASCII_MODE, 0, 0, 0);

/// A conversation in command lines.
pub struct Terminal {
    framed: Framed<Box<dyn Stream>>,
    port: String,
    address: Address,
    timeout: Duration,
    mode: Mode,
}

/// What the module takes at present.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mode {
    Datagrams,
    /// Text, since this terminal asked for it.
    Entered,
    /// Text, as far as one can tell.
    Found,
}

impl Terminal {
    /// Opens a port. Nothing is sent yet.
    ///
    /// # Errors
    /// When the port does not open, or is one of CAN, which carries no text.
    pub fn open(url: &Url) -> Result<Self, Error> {
        let stream = stream(url).map_err(|reason| Error::Open { port: url.to_string(), reason })?;
        Ok(Self::over(Framed::new(stream, url.echo), url))
    }

    /// A conversation with the module of a bench, in virtual time.
    pub fn on_bench(bench: Bench) -> Self {
        let url = Url::sim(bench.catalogue());
        Self::over(Framed::new(Box::new(SimStream::to(bench)), false), &url)
    }

    fn over(framed: Framed<Box<dyn Stream>>, url: &Url) -> Self {
        let Url { address, timeout, .. } = *url;
        Self { framed, port: url.to_string(), address, timeout, mode: Mode::Datagrams }
    }

    /// The module of the catalogue whose commands such lines are.
    pub fn module() -> Option<&'static Module> {
        MODULES.iter().copied().find(|module| module.mode(ENTER.opcode).direct())
    }

    /// Reads a line as the module would.
    ///
    /// # Errors
    /// When it is no command of ASCII mode.
    pub fn check(text: &str) -> Result<Line, LineError> {
        let module = Self::module().ok_or(LineError::NotInAscii)?;
        Line::parse(text.as_bytes(), module)
    }

    /// What the catalogue knows about a line that was refused; may be empty.
    pub fn reason(line: Line, status: Status) -> String {
        match (line, Self::module()) {
            (Line::Command(instruction), Some(module)) => reason(module, instruction, status),
            _ => String::new(),
        }
    }

    /// Sends a line, without address letter and end, and gives back the answer, whatever its status is.
    ///
    /// # Errors
    /// When the module has no ASCII interface, its address has no letter, no answer comes in time, or the line is broken.
    pub fn ask(&mut self, text: &str) -> Result<Reply, Error> {
        if self.mode == Mode::Datagrams {
            self.enter()?;
        }
        let mut line = vec![self.letter()?];
        line.extend_from_slice(text.as_bytes());
        line.push(CR);
        self.send(&line)?;
        let reply = self.hear(text)?;
        if Self::check(text) == Ok(Line::Binary) && reply.status.is_ok() {
            self.mode = Mode::Datagrams;
        }
        Ok(reply)
    }

    /// Leads the module back to datagrams if this terminal led it away from them.
    ///
    /// # Errors
    /// As [`ask`](Self::ask).
    pub fn close(mut self) -> Result<(), Error> {
        if self.mode == Mode::Entered {
            self.ask("BIN")?;
        }
        Ok(())
    }

    fn enter(&mut self) -> Result<(), Error> {
        self.letter()?;
        self.framed.send(self.address, ENTER).map_err(|error| self.broken(error))?;
        let deadline = self.framed.now() + self.timeout;
        self.mode = match self.framed.receive(deadline).map_err(|error| self.broken(error))? {
            Heard::Datagram(bytes) => self.entered(&bytes)?,
            Heard::Nothing | Heard::Fragment(_) => {
                // For a module in ASCII mode the datagram was the beginning of a line that is not its own.
                self.send(&[CR])?;
                Mode::Found
            }
        };
        Ok(())
    }

    fn entered(&self, bytes: &[u8; 9]) -> Result<Mode, Error> {
        match gradus_tmcl::Reply::parse(bytes) {
            Ok(reply) if reply.command == ENTER.opcode && reply.status.is_ok() => Ok(Mode::Entered),
            Ok(reply) if reply.command == ENTER.opcode => Err(Error::Refused {
                request: "DATA 139, 0, 0, 0".into(),
                status: reply.status,
                reason: "this module has no ASCII interface".into(),
            }),
            _ => Err(Error::Garbled {
                port: self.port.clone(),
                request: "DATA 139, 0, 0, 0".into(),
                bytes: bytes.to_vec(),
            }),
        }
    }

    /// The next line that is a reply.
    fn hear(&mut self, request: &str) -> Result<Reply, Error> {
        let deadline = self.framed.now() + self.timeout;
        let mut line = Vec::new();
        while self.framed.now() <= deadline + GRACE {
            let mut byte = [0];
            match self.framed.stream.receive(&mut byte, deadline).map_err(|error| self.broken(error))? {
                0 if self.framed.now() < deadline => {}
                0 => break,
                _ if byte == [CR] => match Reply::parse(&line) {
                    Some(reply) => return Ok(reply),
                    None => line.clear(),
                },
                _ if line.len() < LONGEST => line.extend(byte),
                _ => {}
            }
        }
        Err(self.silent(request))
    }

    fn letter(&self) -> Result<u8, Error> {
        let own = u8::try_from(self.address.module).ok().and_then(letter);
        own.ok_or_else(|| Error::Open {
            port: self.port.clone(),
            reason: format!("address {} has no letter; command lines reach the addresses 0 to 62", self.address.module),
        })
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.framed.stream.send(bytes).map_err(|error| self.broken(error))
    }

    fn broken(&self, error: std::io::Error) -> Error {
        Error::Broken { port: self.port.clone(), error }
    }

    fn silent(&self, request: &str) -> Error {
        if self.mode == Mode::Found {
            let (address, check) = (format!("address {}", self.address.module), self.framed.nature().check);
            return Error::NoModule { port: self.port.clone(), address, check };
        }
        let (port, request) = (self.port.clone(), request.into());
        Error::Silent { port, request, waited: self.timeout, foreign: 0 }
    }
}
