//! Command lines of the ASCII interface (TMCM-351 manual §5.6): `A MVP ABS, 1, 50000`, answered by `BA 100 0`.
//!
//! A line begins with the letter of the module's address, spaces may follow, then a command as in programs, and CR ends it.
//! Besides the commands that the catalogue marks for it there are the words `RUN`, `STOP`, and `BIN`, which leads back to
//! datagrams; `MST` alone stops motor 0. A reply has the letters of host and module, then status and value as decimal numbers.
//!
//! Both ends are here: [`Editor`] and [`Line`] for what a person types, [`Reply`] and [`Text`] for what a module answers.
//!
//! Where the manual is silent:
//! - `A` to `Z` are the addresses 1 to 26; the letters go on along the ASCII table in both directions, `@` is 0 and `~` is 62.
//!   Higher addresses have no letter.
//! - Commands are read in letters of either case, and `DATA` gives one by its fields, as in programs; the address letter counts
//!   as it is.
//! - What a line cannot say has the status that a datagram would get: an unknown command 2, operands that do not fit 4, a command
//!   that ASCII mode lacks 6.

use core::str::from_utf8;

use crate::catalogue::{Ascii, Command, Module};
use crate::{Instruction, Opcode, ParseError, Status};

/// Ends every line.
pub const CR: u8 = b'\r';

/// Most characters of a command line.
pub const MAX_LINE: usize = 64;

/// `~~ 255 -2147483648` and its end.
const MAX_REPLY: usize = 19;

/// The letter of a host whose address has none.
pub const NO_LETTER: u8 = b'?';

/// The letter of an address, if it has one: 0 to 62.
pub fn letter(address: u8) -> Option<u8> {
    b'@'.checked_add(address).filter(|letter| *letter <= b'~')
}

/// The address of a letter, if it is one.
pub fn address(letter: u8) -> Option<u8> {
    letter.checked_sub(b'@').filter(|address| *address <= b'~' - b'@')
}

/// What a line asks for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Line {
    /// A command; `RUN` and `STOP` are the control commands 129 and 128, `MST` alone is `MST 0`.
    Command(Instruction),
    /// `BIN`: datagrams again.
    Binary,
}

/// Why a line is none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum LineError {
    /// It is no command.
    #[error(transparent)]
    Parse(#[from] ParseError),
    /// A command that only datagrams and programs have.
    #[error("ASCII mode does not have this command")]
    NotInAscii,
}

impl LineError {
    /// The status in the module's answer.
    pub fn status(self) -> Status {
        match self {
            Self::Parse(ParseError::Command) => Status::INVALID_COMMAND,
            Self::Parse(_) => Status::INVALID_VALUE,
            Self::NotInAscii => Status::NOT_AVAILABLE,
        }
    }
}

/// The words of ASCII mode alone.
const WORDS: [(&str, Line); 4] = [
    ("MST", Line::Command(Instruction::new(Opcode::MST, 0, 0, 0))),
    ("BIN", Line::Binary),
    ("RUN", Line::Command(Instruction::new(Opcode::RUN_APPLICATION, 0, 0, 0))),
    ("STOP", Line::Command(Instruction::new(Opcode::STOP_APPLICATION, 0, 0, 0))),
];

impl Line {
    /// Reads what follows the address letter.
    ///
    /// # Errors
    /// When it is no command of the module's ASCII mode.
    pub fn parse(text: &[u8], module: &Module) -> Result<Self, LineError> {
        let text = from_utf8(text).map_err(|_| ParseError::Command)?.trim();
        if let Some((_, line)) = WORDS.iter().find(|(word, _)| word.eq_ignore_ascii_case(text)) {
            return Ok(*line);
        }
        let instruction = Instruction::parse(text, module)?;
        match Command::of(instruction.opcode) {
            Some(command) if command.ascii == Ascii::Yes => Ok(Self::Command(instruction)),
            _ => Err(LineError::NotInAscii),
        }
    }
}

/// What a character did to a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Key {
    /// It stands at the end of the line now.
    Typed,
    /// It took the last one away.
    Erased,
    /// It ended the line.
    Ended,
    /// Nothing.
    Ignored,
}

/// Collects a line, in which backspace and delete take characters back. LF means nothing, so that CR LF ends a line as well.
#[derive(Clone, Debug)]
pub struct Editor {
    bytes: [u8; MAX_LINE],
    /// Characters typed, also those that found no room.
    len: usize,
}

impl Editor {
    /// An empty line.
    pub const fn new() -> Self {
        Self { bytes: [0; MAX_LINE], len: 0 }
    }

    /// Takes the next character.
    pub fn push(&mut self, byte: u8) -> Key {
        match byte {
            CR => Key::Ended,
            b'\n' => Key::Ignored,
            0x08 | 0x7f if self.len == 0 => Key::Ignored,
            0x08 | 0x7f => {
                self.len -= 1;
                Key::Erased
            }
            _ => {
                if let Some(next) = self.bytes.get_mut(self.len) {
                    *next = byte;
                }
                self.len = self.len.saturating_add(1);
                Key::Typed
            }
        }
    }

    /// The line so far, as much of it as there is room for.
    pub fn line(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }

    /// True when more was typed than there is room for.
    pub fn is_too_long(&self) -> bool {
        self.len > MAX_LINE
    }

    /// Begins the next line.
    pub fn clear(&mut self) {
        self.len = 0;
    }
}

impl Default for Editor {
    fn default() -> Self {
        Self::new()
    }
}

/// A module's answer to a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reply {
    /// Letter of the host's address.
    pub host: u8,
    /// Letter of the module's address.
    pub module: u8,
    /// What became of the command.
    pub status: Status,
    /// Its value.
    pub value: i32,
}

impl Reply {
    /// Reads a line without its end; `None` if it is no reply.
    pub fn parse(line: &[u8]) -> Option<Self> {
        let &[host, module, b' ', ref numbers @ ..] = line else { return None };
        let (status, value) = from_utf8(numbers).ok()?.split_once(' ')?;
        Some(Self { host, module, status: Status(status.parse().ok()?), value: value.parse().ok()? })
    }

    /// The line with its end.
    pub fn text(&self) -> Text {
        let mut text = Text { bytes: [0; MAX_REPLY], len: 0 };
        text.push(self.host);
        text.push(self.module);
        text.push(b' ');
        text.decimal(self.status.0.into());
        text.push(b' ');
        text.decimal(self.value);
        text.push(CR);
        text
    }
}

/// A reply as it goes over the line.
#[derive(Clone, Copy, Debug)]
pub struct Text {
    bytes: [u8; MAX_REPLY],
    len: usize,
}

impl Text {
    /// The bytes of the line.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }

    /// Without `core::fmt`, which a module has no room for.
    fn decimal(&mut self, number: i32) {
        if number < 0 {
            self.push(b'-');
        }
        let magnitude = number.unsigned_abs();
        let mut place = 1_000_000_000;
        while place > 1 && place > magnitude {
            place /= 10;
        }
        while place > 0 {
            self.push(b'0' + (magnitude / place % 10) as u8);
            place /= 10;
        }
    }

    fn push(&mut self, byte: u8) {
        if let Some(next) = self.bytes.get_mut(self.len) {
            *next = byte;
            self.len += 1;
        }
    }
}
