//! Status codes of replies.

use core::fmt;

/// What a module says about a command (TMCM-3351 manual, table 4). Unknown codes are kept by value.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Status(pub u8);

impl Status {
    /// The datagram's checksum was wrong.
    pub const WRONG_CHECKSUM: Self = Self(1);
    /// There is no such command.
    pub const INVALID_COMMAND: Self = Self(2);
    /// No such type, parameter, port or bank, or not readable or writable that way.
    pub const WRONG_TYPE: Self = Self(3);
    /// The value or the axis is out of range.
    pub const INVALID_VALUE: Self = Self(4);
    /// The EEPROM is locked (global parameter 73).
    pub const EEPROM_LOCKED: Self = Self(5);
    /// The command exists, but not now or not in this mode.
    pub const NOT_AVAILABLE: Self = Self(6);
    /// Executed.
    pub const OK: Self = Self(100);
    /// Stored in program memory (download mode).
    pub const LOADED: Self = Self(101);
    /// Second reply of command 138: the position is reached.
    pub const POSITION_REACHED: Self = Self(128);

    /// True for the codes that report success.
    pub fn is_ok(self) -> bool {
        matches!(self, Self::OK | Self::LOADED | Self::POSITION_REACHED)
    }

    /// A few plain words.
    pub fn text(self) -> &'static str {
        match self {
            Self::WRONG_CHECKSUM => "wrong checksum",
            Self::INVALID_COMMAND => "invalid command",
            Self::WRONG_TYPE => "wrong type",
            Self::INVALID_VALUE => "invalid value",
            Self::EEPROM_LOCKED => "EEPROM locked",
            Self::NOT_AVAILABLE => "command not available",
            Self::OK => "ok",
            Self::LOADED => "command loaded",
            Self::POSITION_REACHED => "position reached",
            _ => "unknown status",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} ({})", self.0, self.text())
    }
}
