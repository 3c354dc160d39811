//! The ASCII interface: command lines instead of datagrams (TMCM-351 manual §5.6, global parameter 67).
//!
//! Where the manual is silent:
//! - The mode is the module's and holds for all its serial lines; CAN carries datagrams in either mode.
//! - A module whose address has no letter, 63 or more, could not be told `BIN`: it refuses command 139 with status 6, and
//!   speaks datagrams as long as it has such an address.
//! - A line is addressed by the letter of the address or of the secondary address. Characters are echoed while the line
//!   begins with such a letter, itself included; backspace is echoed as backspace, space, backspace; an empty line is ignored.
//! - `BIN` is answered, like any other line, in text. A line that changes an address is answered under the old one, as a
//!   datagram is. A host whose address has no letter is `?`.
//! - A line of more than 64 characters has status 2.
//! - Events of command 138 wait until datagrams are back.
//! - On RS-485 the telegram pause comes before the reply and before the echo of a whole line, not before that of a character.

use gradus_tmcl::ascii::{CR, Key, Line, LineError, NO_LETTER, Reply, address, letter};
use gradus_tmcl::catalogue::Gp;
use gradus_tmcl::{Opcode, ParseError, Status};

use crate::links::link::{Answer, Link};
use crate::module::Module;
use crate::ports::{Ports, Store};

/// What backspace does to a terminal.
const RUB_OUT: &[u8] = b"\x08 \x08";

/// Bits 4 and 5 of global parameter 67.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Echo {
    /// Each character at once.
    Characters,
    /// The line when it has ended.
    Line,
    None,
}

impl<P: Ports, S: Store> Module<P, S> {
    /// Command 139.
    pub(crate) fn enter_ascii(&mut self) -> Result<(), Status> {
        letter(self.own_address()).ok_or(Status::NOT_AVAILABLE)?;
        self.ascii = true;
        Ok(())
    }

    /// Whether serial lines carry text.
    pub(crate) fn speaks_ascii(&self) -> bool {
        self.ascii && letter(self.own_address()).is_some()
    }

    /// Whether the module starts in ASCII mode.
    pub(crate) fn starts_in_ascii(&self) -> bool {
        self.globals.get(Gp::AsciiMode) & 1 != 0
    }

    fn echo(&self) -> Echo {
        match self.globals.get(Gp::AsciiMode) >> 4 & 3 {
            0 => Echo::Characters,
            1 => Echo::Line,
            _ => Echo::None,
        }
    }

    /// Takes a character of a line.
    pub(crate) fn receive_character(&mut self, link: &mut Link, byte: u8) {
        let was_addressed = self.is_called(link.editor.line());
        let key = link.editor.push(byte);
        let echoes = self.echo() == Echo::Characters;
        match key {
            Key::Typed if echoes && self.is_called(link.editor.line()) => link.say(&[byte], self.now),
            Key::Erased if echoes && was_addressed => link.say(RUB_OUT, self.now),
            Key::Ended if was_addressed => self.obey_line(link),
            _ => {}
        }
        if key == Key::Ended {
            link.editor.clear();
        }
    }

    fn is_called(&self, line: &[u8]) -> bool {
        line.first().and_then(|first| address(*first)).is_some_and(|address| self.is_addressed(address))
    }

    fn obey_line(&mut self, link: &mut Link) {
        let at_us = self.now.saturating_add(self.pause_us(link.kind));
        match self.echo() {
            Echo::Characters => link.say(&[CR], at_us),
            Echo::Line => link.echo_line(at_us),
            Echo::None => {}
        }
        let (host, module) = (self.globals.get(Gp::HostAddress) as u8, self.own_address());
        if let Answer::Plain(status, value) = self.answer_line(link) {
            let [host, module] = [host, module].map(|address| letter(address).unwrap_or(NO_LETTER));
            link.say(Reply { host, module, status, value }.text().bytes(), at_us);
        }
    }

    fn answer_line(&mut self, link: &Link) -> Answer {
        match self.line(link) {
            Ok(Line::Command(instruction)) => self.obey(link, &instruction),
            Ok(Line::Binary) => {
                self.ascii = false;
                self.plain(Opcode::ASCII_MODE, Status::OK, 0)
            }
            Err(error) => self.plain(Opcode::NOP, error.status(), 0),
        }
    }

    fn line(&self, link: &Link) -> Result<Line, LineError> {
        if link.editor.is_too_long() {
            return Err(ParseError::Command.into());
        }
        Line::parse(link.editor.line().get(1..).unwrap_or(&[]), self.catalogue)
    }
}
