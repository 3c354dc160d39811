//! Modules, their ports and their interrupts.

use super::availability::Mode;
use super::parameter::{AxisParameter, GlobalParameter};
use crate::Opcode;

/// Whether a port is read or written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Direction {
    /// GIO reads it.
    In,
    /// SIO writes it, GIO reads it back.
    Out,
}

/// A port of SIO and GIO.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Port {
    /// 0 digital inputs, 1 analogue inputs, 2 digital outputs.
    pub bank: u8,
    /// Number of the port.
    pub number: u8,
    /// Name as in the manual.
    pub name: &'static str,
    /// Read or written.
    pub direction: Direction,
    /// Smallest and largest value, where the manual prints them.
    pub range: Option<(i32, i32)>,
}

/// What raises an interrupt.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum InterruptKind {
    /// A timer's period has passed.
    Timer,
    /// A motor has reached its target.
    Position,
    /// StallGuard has stopped a motor.
    Stall,
    /// A motor has been stopped by a deviation from its encoder.
    Deviation,
    /// A stop switch has changed; the index counts left 0, right 0, left 1, ...
    StopSwitch,
    /// An input has changed.
    Input,
    /// Not an interrupt: the number that EI and DI take for all of them.
    Global,
}

/// An interrupt of a module.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Interrupt {
    /// Number in EI, DI and VECT; a lower one goes first.
    pub number: u8,
    /// Name as in the manual.
    pub name: &'static str,
    /// Name in TMCL programs (`Interrupts.inc`).
    pub symbol: &'static str,
    /// What raises it.
    pub kind: InterruptKind,
    /// Timer, axis, switch or input.
    pub index: u8,
}

/// The modules of the catalogue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Model {
    /// Three stepper axes, closed loop.
    Tmcm3351,
    /// One servo axis.
    Tmcm1617,
    /// Three stepper axes, units of the TMC428.
    Tmcm351,
    /// A module that the catalogue lacks.
    Any,
}

/// What makes the motion of a module. It decides the units of its axes, how their switches are wired, and how its driver
/// chips report.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionChip {
    /// Ramps in microsteps and seconds.
    Tmc4361,
    /// Ramps in units of its own, see axis parameters 153 and 154 of the TMCM-351.
    Tmc428,
    /// Field-oriented control.
    Tmc4671,
}

/// A module: its identity, its sizes and its tables.
#[derive(Debug)]
pub struct Module {
    /// Which of the modules it is.
    pub model: Model,
    /// As on the label: `TMCM-3351`.
    pub name: &'static str,
    /// The number that commands 136 and 157 answer.
    pub number: u16,
    /// Firmware version, major and minor.
    pub version: (u8, u8),
    /// The eight characters that command 136 type 0 answers.
    pub version_text: &'static [u8; 8],
    /// What makes its motion.
    pub chip: MotionChip,
    /// Number of axes.
    pub axes: u8,
    /// Commands of program memory.
    pub program_len: u16,
    /// Coordinates of SCO and GCO, number 0 included; 0 where there are none.
    pub coordinates: u8,
    /// Volts of the supply below which it does not run: the least that the manual names, 9 V for a TMCM-3351. Those of TMCM-351
    /// (7 V) and TMCM-1617 (8 V) report a supply below that, so their logic runs on a little.
    pub least_supply_v: u8,
    /// Microseconds between two control ticks.
    pub tick_us: u32,
    /// Microseconds that a program instruction takes.
    pub instruction_us: u32,
    /// Axis parameters, ascending numbers.
    pub axis_parameters: &'static [AxisParameter],
    /// Global parameters, ascending banks and numbers.
    pub global_parameters: &'static [GlobalParameter],
    /// Ports of SIO and GIO.
    pub ports: &'static [Port],
    /// Interrupts, ascending numbers.
    pub interrupts: &'static [Interrupt],
    /// Index of the row by number, [`NO_ROW`] where there is none.
    pub(super) axis_rows: Rows,
    /// The same by bank.
    pub(super) global_rows: [Rows; 4],
    /// Where each command may stand, by opcode.
    pub(super) modes: [Mode; 256],
}

impl Module {
    /// True for [`ANY`](super::ANY), of which nothing is known.
    pub fn is_any(&self) -> bool {
        self.model == Model::Any
    }

    /// Commands of program memory; for [`ANY`](super::ANY) as many as a jump can reach.
    pub fn memory(&self) -> usize {
        if self.is_any() { 1 << 16 } else { usize::from(self.program_len) }
    }

    /// True if its axis is a servo; else its axes are steppers.
    pub fn is_servo(&self) -> bool {
        self.model == Model::Tmcm1617
    }

    /// The axis parameter of that number.
    pub fn axis_parameter(&self, number: u8) -> Option<&'static AxisParameter> {
        self.axis_parameters.get(usize::from(self.axis_rows[usize::from(number)]))
    }

    /// The global parameter of that number in a bank.
    pub fn global_parameter(&self, bank: u8, number: u8) -> Option<&'static GlobalParameter> {
        let rows = self.global_rows.get(usize::from(bank))?;
        self.global_parameters.get(usize::from(rows[usize::from(number)]))
    }

    /// The port that GIO reads. Where an input and an output share a number (the pull-up resistors of the TMCM-351), this is
    /// the input.
    pub fn port(&self, bank: u8, number: u8) -> Option<&'static Port> {
        self.ports.iter().find(|row| row.bank == bank && row.number == number)
    }

    /// The port that SIO writes.
    pub fn output(&self, bank: u8, number: u8) -> Option<&'static Port> {
        let is_output = |row: &&Port| row.bank == bank && row.number == number && row.direction == Direction::Out;
        self.ports.iter().find(is_output)
    }

    /// The interrupt of that number.
    pub fn interrupt(&self, number: u8) -> Option<&'static Interrupt> {
        self.interrupts.iter().find(|row| row.number == number)
    }

    /// Where a command may stand.
    pub fn mode(&self, opcode: Opcode) -> Mode {
        self.modes[usize::from(opcode.0)]
    }
}

/// Index of a row by number.
type Rows = [u8; 256];

/// An index past the end of every table.
const NO_ROW: u8 = 255;

pub(super) const fn axis_rows(rows: &[AxisParameter]) -> Rows {
    assert!(rows.len() <= NO_ROW as usize);
    let mut by_number = [NO_ROW; 256];
    let mut i = 0;
    while i < rows.len() {
        by_number[rows[i].number as usize] = i as u8;
        i += 1;
    }
    by_number
}

pub(super) const fn global_rows(rows: &[GlobalParameter]) -> [Rows; 4] {
    assert!(rows.len() <= NO_ROW as usize);
    let mut by_bank = [[NO_ROW; 256]; 4];
    let mut i = 0;
    while i < rows.len() {
        let mut number = rows[i].first as usize;
        while number <= rows[i].last as usize {
            by_bank[rows[i].bank as usize][number] = i as u8;
            number += 1;
        }
        i += 1;
    }
    by_bank
}

pub(super) const fn port(
    bank: u8,
    number: u8,
    name: &'static str,
    direction: Direction,
    range: Option<(i32, i32)>,
) -> Port {
    Port { bank, number, name, direction, range }
}

pub(super) const fn interrupt(
    number: u8,
    name: &'static str,
    symbol: &'static str,
    kind: InterruptKind,
    index: u8,
) -> Interrupt {
    Interrupt { number, name, symbol, kind, index }
}
