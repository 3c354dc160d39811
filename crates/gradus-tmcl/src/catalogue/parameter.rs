//! Rows of the parameter tables.

use core::ops::RangeInclusive;

use super::{Ap, Gp};

/// Who may do what with a parameter (TMCM-3351 manual, tables 15 and 16).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Access {
    /// Read only.
    R,
    /// Read and write.
    Rw,
    /// Read and write; STAP or STGP stores, RSAP or RSGP restores.
    Rwe,
    /// Read and write; every write is stored.
    Rwa,
}

impl Access {
    /// True when SAP or SGP may write it.
    pub fn writable(self) -> bool {
        self != Self::R
    }

    /// As the manuals print it.
    pub fn text(self) -> &'static str {
        match self {
            Self::R => "R",
            Self::Rw => "RW",
            Self::Rwe => "RWE",
            Self::Rwa => "RWA",
        }
    }
}

/// Unit of a parameter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)] // `text` says them
pub enum Unit {
    Plain,
    Microsteps,
    Pps,
    PpsPerSecond,
    PpsPerSecond2,
    CountsPerTurn,
    EncoderSteps,
    FullStepsPerTurn,
    TenMs,
    Ms,
    Milliampere,
    Rpm,
    RpmPerSecond,
    Hertz,
    Decivolt,
    Celsius,
    PerSecond,
    Tmc428Speed,
    Tmc428Acceleration,
}

impl Unit {
    /// As tables print it; empty for a plain number.
    pub fn text(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Microsteps => "usteps",
            Self::Pps => "pps",
            Self::PpsPerSecond => "pps^2",
            Self::PpsPerSecond2 => "pps^3",
            Self::CountsPerTurn => "counts/round",
            Self::EncoderSteps => "encoder steps",
            Self::FullStepsPerTurn => "fullsteps/round",
            Self::TenMs => "10ms",
            Self::Ms => "ms",
            Self::Milliampere => "mA",
            Self::Rpm => "rpm",
            Self::RpmPerSecond => "rpm/s",
            Self::Hertz => "Hz",
            Self::Decivolt => "0.1V",
            Self::Celsius => "degC",
            Self::PerSecond => "1/s",
            Self::Tmc428Speed => "16MHz/65536*2^-PD usteps/s",
            Self::Tmc428Acceleration => "16MHz^2/(536870912*2^(PD+RD)) usteps/s^2",
        }
    }
}

/// One line of a list of values: the numbers or bits `first..=last` and what they mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Choice {
    /// First number or bit.
    pub first: i64,
    /// Last number or bit.
    pub last: i64,
    /// What it means.
    pub text: &'static str,
}

/// What the values of a parameter mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Values {
    /// A quantity.
    Any,
    /// A quantity with some special values.
    Notes(&'static [Choice]),
    /// Only the listed values are accepted.
    Only(&'static [Choice]),
    /// Bits with a meaning each.
    Bits(&'static [Choice]),
    /// Only the values of the first list are accepted, with any of the bits of the second added.
    Flagged(&'static [Choice], &'static [Choice]),
    /// Only the keys of the first list may be written, whatever the range; the second list is what is read.
    Keys(&'static [Choice], &'static [Choice]),
}

impl Values {
    /// The list, empty for a quantity; the values that may be written where there are two.
    pub fn choices(self) -> &'static [Choice] {
        match self {
            Self::Any => &[],
            Self::Notes(list) | Self::Only(list) | Self::Bits(list) => list,
            Self::Flagged(list, _) | Self::Keys(list, _) => list,
        }
    }

    fn accepts(self, range: RangeInclusive<i64>, value: i64) -> bool {
        match self {
            Self::Any | Self::Notes(_) | Self::Bits(_) => range.contains(&value),
            Self::Only(list) => range.contains(&value) && listed(list, value),
            Self::Flagged(list, flags) => range.contains(&value) && listed(list, value & !mask(flags)),
            Self::Keys(keys, _) => listed(keys, value),
        }
    }

    /// The same for a value that is read.
    fn shows(self, range: RangeInclusive<i64>, value: i64) -> bool {
        match self {
            Self::Keys(_, states) => listed(states, value),
            _ => self.accepts(range, value),
        }
    }
}

fn listed(list: &[Choice], value: i64) -> bool {
    list.iter().any(|choice| (choice.first..=choice.last).contains(&value))
}

/// The bits of a list, set.
fn mask(flags: &[Choice]) -> i64 {
    flags.iter().flat_map(|choice| choice.first..=choice.last).fold(0, |mask, bit| mask | 1 << bit)
}

/// An axis parameter of a module.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AxisParameter {
    /// What it means.
    pub id: Ap,
    /// Number in SAP and GAP.
    pub number: u8,
    /// Name as in the manual.
    pub name: &'static str,
    /// Name in TMCL programs (`TMCLParam.tmc`).
    pub symbol: &'static str,
    /// Smallest value.
    pub min: i64,
    /// Largest value.
    pub max: i64,
    /// Unit of the value.
    pub unit: Unit,
    /// Value after a restore of factory settings; `None` for values of run time.
    pub default: Option<i64>,
    /// Who may do what.
    pub access: Access,
    /// What the values mean.
    pub values: Values,
    /// What it is, with the manual's section.
    pub description: &'static str,
}

impl AxisParameter {
    /// True if the value may be written: it is in range, and listed where only listed ones are accepted. The value is what a datagram carries: parameters whose range passes
    /// 2^31 take it as unsigned.
    pub fn accepts(&self, value: i32) -> bool {
        accepts(self.min, self.max, self.values, value)
    }
}

/// A global parameter of a module, or a run of them with the same meaning.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GlobalParameter {
    /// What it means.
    pub id: Gp,
    /// Bank in SGP and GGP.
    pub bank: u8,
    /// First number.
    pub first: u8,
    /// Last number.
    pub last: u8,
    /// Name as in the manual.
    pub name: &'static str,
    /// Name in assembly programs; in a run of parameters each has its number behind it.
    pub symbol: &'static str,
    /// Smallest value.
    pub min: i64,
    /// Largest value.
    pub max: i64,
    /// Value after a restore of factory settings; `None` for values of run time.
    pub default: Option<i64>,
    /// Who may do what.
    pub access: Access,
    /// What the values mean.
    pub values: Values,
    /// What it is, with the manual's section.
    pub description: &'static str,
}

impl GlobalParameter {
    /// As [`AxisParameter::accepts`].
    pub fn accepts(&self, value: i32) -> bool {
        accepts(self.min, self.max, self.values, value)
    }

    /// True if the parameter may have this value when it is read: what was written, or the state that a key has set.
    pub fn shows(&self, value: i32) -> bool {
        self.values.shows(self.min..=self.max, carried(self.max, value))
    }
}

fn accepts(min: i64, max: i64, values: Values, value: i32) -> bool {
    values.accepts(min..=max, carried(max, value))
}

/// The value that a datagram carries, unsigned where the range passes 2^31.
fn carried(max: i64, value: i32) -> i64 {
    if max > i64::from(i32::MAX) { i64::from(value as u32) } else { i64::from(value) }
}

#[allow(clippy::too_many_arguments)] // one line of a table
pub(super) const fn axis(
    id: Ap,
    number: u8,
    name: &'static str,
    symbol: &'static str,
    min: i64,
    max: i64,
    unit: Unit,
    default: Option<i64>,
    access: Access,
    values: Values,
    description: &'static str,
) -> AxisParameter {
    AxisParameter { id, number, name, symbol, min, max, unit, default, access, values, description }
}

#[allow(clippy::too_many_arguments)] // one line of a table
pub(super) const fn global(
    id: Gp,
    bank: u8,
    first: u8,
    last: u8,
    name: &'static str,
    symbol: &'static str,
    min: i64,
    max: i64,
    default: Option<i64>,
    access: Access,
    values: Values,
    description: &'static str,
) -> GlobalParameter {
    GlobalParameter { id, bank, first, last, name, symbol, min, max, default, access, values, description }
}

pub(super) const fn one(value: i64, text: &'static str) -> Choice {
    Choice { first: value, last: value, text }
}

pub(super) const fn span(first: i64, last: i64, text: &'static str) -> Choice {
    Choice { first, last, text }
}

pub(super) const fn bits(first: i64, last: i64, text: &'static str) -> Choice {
    Choice { first, last, text }
}

// Lists that several rows share.

/// State of a switch input.
pub(super) const LEVELS: Values = Values::Only(&[one(0, "low"), one(1, "high")]);

/// Edges that raise an interrupt.
pub(super) const EDGES: Values = Values::Only(&[one(0, "off"), one(1, "low-high"), one(2, "high-low"), one(3, "both")]);

/// Serial bit rates.
pub(super) const BAUD_RATES: Values = Values::Only(&[
    one(0, "9600"),
    one(1, "14400"),
    one(2, "19200"),
    one(3, "28800"),
    one(4, "38400"),
    one(5, "57600"),
    one(6, "76800"),
    one(7, "115200"),
    one(8, "230400"),
    one(9, "250000"),
    one(10, "500000"),
    one(11, "1000000"),
]);

/// Bit rates of the CAN bus.
pub(super) const CAN_BIT_RATES: Values = Values::Only(&[
    one(2, "20 kBit/s"),
    one(3, "50 kBit/s"),
    one(4, "100 kBit/s"),
    one(5, "125 kBit/s"),
    one(6, "250 kBit/s"),
    one(7, "500 kBit/s"),
    one(8, "1000 kBit/s"),
]);

/// Whether the program starts with the module.
pub(super) const AUTO_START: Values = Values::Only(&[one(0, "wait for a command"), one(1, "start after power-up")]);

/// What may not be done with the stored program.
pub(super) const PROTECTION: Values = Values::Only(&[
    one(0, "none"),
    one(1, "against reading"),
    one(2, "against overwriting"),
    one(3, "against reading and overwriting"),
]);

/// Whether user variables begin as stored.
pub(super) const RESTORE: Values = Values::Only(&[one(0, "restored at start"), one(1, "zero at start")]);

/// State of the program.
pub(super) const RUN_STATES: Values = Values::Only(&[one(0, "stop"), one(1, "run"), one(2, "step"), one(3, "reset")]);

/// Whether commands are executed or stored.
pub(super) const DOWNLOAD: Values = Values::Only(&[one(0, "commands are executed"), one(1, "commands are stored")]);

/// Whether commands without a result are answered.
pub(super) const REPLY: Values = Values::Only(&[one(0, "reply"), one(1, "no reply")]);

/// Where coordinates are kept.
pub(super) const COORDINATE_STORAGE: Values = Values::Only(&[one(0, "RAM"), one(1, "RAM and EEPROM")]);
