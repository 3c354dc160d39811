//! What a command reads and writes: one table, which a test holds against the firmware.
//!
//! It knows the hidden readers of the accumulator: `SIO 255, 2, -1`, `WAIT ..., -1`, `SAC` with bit 7 of its bus, AAPX, MVPA,
//! ROLA and their relatives, AIV.

use bitflags::bitflags;
use gradus_tmcl::catalogue::{Ap, Module};
use gradus_tmcl::{Instruction, MoveKind, Opcode, Operation, Search, WaitFor};

bitflags! {
    /// Where a program keeps something.
    #[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
    pub struct Places: u16 {
        /// The accumulator.
        const ACCUMULATOR = 1;
        /// The X register.
        const X = 1 << 1;
        /// The result of the last comparison.
        const FLAGS = 1 << 2;
        /// The error flags of CLE.
        const ERRORS = 1 << 3;
        /// User variables.
        const VARIABLES = 1 << 4;
        /// Other global parameters.
        const GLOBALS = 1 << 5;
        /// Axis parameters.
        const AXES = 1 << 6;
        /// Outputs; read: inputs too.
        const PORTS = 1 << 7;
        /// Coordinates.
        const COORDINATES = 1 << 8;
        /// The EEPROM.
        const EEPROM = 1 << 9;
        /// Motors that turn.
        const MOTION = 1 << 10;
        /// The return addresses.
        const STACK = 1 << 11;
        /// Interrupts: vectors and what is enabled.
        const INTERRUPTS = 1 << 12;
    }
}

/// What a command reads and writes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Effects {
    /// What it looks at.
    pub reads: Places,
    /// What it may change.
    pub writes: Places,
}

/// Bank of the user variables.
pub(crate) const VARIABLES: u8 = 2;
/// In place of an axis: the EEPROM.
pub(crate) const EEPROM: u8 = 255;
/// In place of a number: the accumulator.
const ACCUMULATOR: i32 = -1;
/// Banks of ports.
const OUTPUTS: u8 = 2;
/// All ports of a bank.
const ALL: u8 = 255;
/// The global parameter that keeps coordinates in the EEPROM.
const COORDINATE_STORAGE: u8 = 84;

const A: Places = Places::ACCUMULATOR;
const X: Places = Places::X;
const FLAGS: Places = Places::FLAGS;
const LOADS: Places = A.union(FLAGS);
const NONE: Places = Places::empty();
const V: Places = Places::VARIABLES;

impl Effects {
    const fn new(reads: Places, writes: Places) -> Self {
        Self { reads, writes }
    }

    /// Everything that one of the two does.
    pub fn union(self, other: Self) -> Self {
        Self { reads: self.reads | other.reads, writes: self.writes | other.writes }
    }

    /// What a command does. One that the module refuses does less.
    pub fn of(instruction: &Instruction) -> Self {
        let Instruction { opcode, kind, motor, value } = *instruction;
        match opcode {
            Opcode::CALC if kind == Operation::LOAD.0 => Self::new(NONE, LOADS),
            Opcode::CALC => Self::new(A, LOADS),
            Opcode::COMP => Self::new(A, FLAGS),
            Opcode::CALCX => calcx(Operation(kind)),
            Opcode::CALCAV => calculation(Operation(kind), A, V),
            Opcode::CALCVA => calculation(Operation(kind), V, A),
            Opcode::CALCXV => calculation(Operation(kind), X, V),
            Opcode::CALCVX => calculation(Operation(kind), V, X),
            Opcode::CALCVV => calculation(Operation(kind), V, V),
            Opcode::CALCV => calculation(Operation(kind), V, NONE),
            Opcode::DJNZ => Self::new(V, V),
            Opcode::SIV => Self::new(X, V),
            Opcode::AIV => Self::new(A.union(X), V),
            Opcode::GIV => Self::new(X.union(V), LOADS),
            Opcode::JC | Opcode::CALL => {
                let flags = if kind < FIRST_ERROR { FLAGS } else { Places::ERRORS };
                Self::new(flags, if opcode == Opcode::CALL { Places::STACK } else { NONE })
            }
            Opcode::CSUB => Self::new(NONE, Places::STACK),
            Opcode::RSUB => Self::new(Places::STACK, Places::STACK),
            Opcode::RETI => Self::new(Places::INTERRUPTS, A | X | FLAGS),
            Opcode::RST => Self::new(NONE, A | X | FLAGS | Places::ERRORS | Places::STACK),
            Opcode::CLE => Self::new(NONE, Places::ERRORS),
            Opcode::EI | Opcode::DI | Opcode::VECT => Self::new(NONE, Places::INTERRUPTS),
            Opcode::WAIT => wait(WaitFor(kind), value),
            Opcode::SGP | Opcode::AGP | Opcode::GGP | Opcode::STGP | Opcode::RSGP => global(opcode, kind, motor),
            Opcode::SCO | Opcode::GCO | Opcode::CCO | Opcode::ACO => coordinate(opcode, motor),
            Opcode::SIO if motor == OUTPUTS && kind == ALL && value == ACCUMULATOR => Self::new(A, Places::PORTS),
            Opcode::SIO => Self::new(NONE, Places::PORTS),
            Opcode::GIO => Self::new(Places::PORTS, LOADS),
            Opcode::SAC => Self::new(A, LOADS.union(Places::PORTS)),
            _ => axis(opcode, kind),
        }
    }
}

/// The first condition of JC that is an error flag.
pub(crate) const FIRST_ERROR: u8 = 8;

/// `to = to op from`.
fn calculation(operation: Operation, to: Places, from: Places) -> Effects {
    match operation {
        Operation::COMP => Effects::new(to | from, FLAGS),
        Operation::LOAD => Effects::new(from, to | FLAGS),
        Operation::NOT if to == V && from == NONE => Effects::new(to, to | FLAGS),
        Operation::NOT => Effects::new(from, to | FLAGS),
        Operation::SWAP => Effects::new(to | from, to | from | FLAGS),
        _ => Effects::new(to | from, to | FLAGS),
    }
}

/// CALCX works on the accumulator, but NOT and LOAD on the X register, and they leave the flags.
fn calcx(operation: Operation) -> Effects {
    match operation {
        Operation::LOAD => Effects::new(A, X),
        Operation::NOT => Effects::new(X, X),
        _ => calculation(operation, A, X),
    }
}

fn wait(condition: WaitFor, ticks: i32) -> Effects {
    let time = if ticks == ACCUMULATOR { A } else { NONE };
    match condition {
        WaitFor::TICKS => Effects::new(time, NONE),
        _ => Effects::new(time | Places::AXES, Places::ERRORS),
    }
}

fn global(opcode: Opcode, number: u8, bank: u8) -> Effects {
    let place = if bank == VARIABLES { V } else { Places::GLOBALS };
    let kept = if opcode != Opcode::STGP && is_kept(number, bank) { Places::EEPROM } else { NONE };
    match opcode {
        Opcode::SGP => Effects::new(NONE, place | kept),
        Opcode::AGP => Effects::new(A, place | kept),
        Opcode::GGP => Effects::new(place, LOADS),
        Opcode::STGP => Effects::new(place, Places::EEPROM),
        _ => Effects::new(Places::EEPROM, place),
    }
}

/// True for the global parameters of bank 0 whose every write goes to the EEPROM.
fn is_kept(number: u8, bank: u8) -> bool {
    bank == 0 && (64..=127).contains(&number)
}

/// Coordinates go to the EEPROM as well if global parameter 84 says so.
fn coordinate(opcode: Opcode, axis: u8) -> Effects {
    let stored = Places::COORDINATES.union(Places::EEPROM);
    match (opcode, axis) {
        (Opcode::SCO, EEPROM) => Effects::new(Places::COORDINATES, Places::EEPROM),
        (Opcode::GCO, EEPROM) => Effects::new(Places::EEPROM, Places::COORDINATES),
        (Opcode::GCO, _) => Effects::new(Places::COORDINATES, LOADS),
        (Opcode::CCO, _) => Effects::new(Places::AXES, stored),
        (Opcode::ACO, _) => Effects::new(A, stored),
        _ => Effects::new(NONE, stored),
    }
}

/// Commands of an axis. Commands that nobody knows read and write everything.
fn axis(opcode: Opcode, kind: u8) -> Effects {
    const MOVES: Places = Places::MOTION.union(Places::AXES);
    let coordinates = if kind == MoveKind::COORD.0 { Places::COORDINATES } else { NONE };
    match opcode {
        Opcode::NOP | Opcode::JA | Opcode::STOP => Effects::default(),
        Opcode::ROR | Opcode::ROL | Opcode::MST => Effects::new(NONE, MOVES),
        Opcode::ROLA | Opcode::RORA => Effects::new(A, MOVES),
        Opcode::ROLXA | Opcode::RORXA => Effects::new(A | X, MOVES),
        Opcode::MSTX => Effects::new(X, MOVES),
        Opcode::MVP => Effects::new(Places::AXES | coordinates, MOVES),
        Opcode::MVPA => Effects::new(A | Places::AXES | coordinates, MOVES),
        Opcode::MVPXA => Effects::new(A | X | Places::AXES | coordinates, MOVES),
        Opcode::RFS if kind == Search::STATUS.0 => Effects::new(Places::AXES, NONE),
        Opcode::RFS => Effects::new(NONE, MOVES),
        Opcode::SAP => Effects::new(NONE, MOVES),
        Opcode::SAPX => Effects::new(X, MOVES),
        Opcode::AAP => Effects::new(A, MOVES),
        Opcode::AAPX => Effects::new(A | X, MOVES),
        Opcode::GAP => Effects::new(Places::AXES, LOADS),
        Opcode::GAPX => Effects::new(X | Places::AXES, LOADS),
        Opcode::STAP => Effects::new(Places::AXES, Places::EEPROM),
        Opcode::RSAP => Effects::new(Places::EEPROM, MOVES),
        _ => Effects::new(Places::all(), Places::all()),
    }
}

/// A user variable, or all of them where the X register chooses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Variable {
    One(u8),
    Any,
}

/// The user variables that a command reads; STGP reads what it stores.
pub(crate) fn variables_read(instruction: &Instruction) -> [Option<Variable>; 2] {
    let Instruction { opcode, kind, motor, value } = *instruction;
    let loads = kind == Operation::LOAD.0;
    let one = |number: u8| Some(Variable::One(number));
    match opcode {
        Opcode::GGP | Opcode::STGP if motor == VARIABLES => [one(kind), None],
        Opcode::DJNZ => [one(kind), None],
        Opcode::GIV => [Some(Variable::Any), None],
        Opcode::CALCAV | Opcode::CALCXV => [one(motor), None],
        Opcode::CALCVA | Opcode::CALCVX | Opcode::CALCV if !loads => [one(motor), None],
        Opcode::CALCVV => [one(motor).filter(|_| !loads), one(value as u8)],
        _ => [None, None],
    }
}

/// The user variable that a command overwrites whatever it was, without calculating from it.
pub(crate) fn variable_set(instruction: &Instruction) -> Option<u8> {
    let Instruction { opcode, kind, motor, .. } = *instruction;
    let loads = kind == Operation::LOAD.0;
    match opcode {
        Opcode::SGP | Opcode::AGP if motor == VARIABLES => Some(kind),
        Opcode::CALCVA | Opcode::CALCVX | Opcode::CALCV | Opcode::CALCVV if loads => Some(motor),
        _ => None,
    }
}

/// True if a command writes the EEPROM. `coordinates` says whether coordinates are kept there (global parameter 84).
pub(crate) fn stores(instruction: &Instruction, coordinates: bool) -> bool {
    match instruction.opcode {
        Opcode::STGP | Opcode::STAP => true,
        Opcode::SGP | Opcode::AGP => is_kept(instruction.kind, instruction.motor),
        Opcode::SCO => coordinates || instruction.motor == EEPROM,
        Opcode::CCO | Opcode::ACO => coordinates,
        _ => false,
    }
}

/// True if a command may switch on that coordinates are kept in the EEPROM.
pub(crate) fn keeps_coordinates(instruction: &Instruction) -> bool {
    let Instruction { opcode, kind, motor, value } = *instruction;
    let written = opcode == Opcode::SGP && value != 0 || opcode == Opcode::AGP;
    written && (kind, motor) == (COORDINATE_STORAGE, 0)
}

/// What an axis parameter means. Of modules that the catalogue lacks, only the numbers that are the same on all of its
/// modules are known.
pub(crate) fn meaning(module: &Module, number: u8) -> Option<Ap> {
    let common = || match number {
        0 => Some(Ap::TargetPosition),
        1 => Some(Ap::ActualPosition),
        2 => Some(Ap::TargetSpeed),
        3 => Some(Ap::ActualSpeed),
        4 => Some(Ap::MaxSpeed),
        5 => Some(Ap::MaxAcceleration),
        8 => Some(Ap::PositionReached),
        207 => Some(Ap::ExtendedErrorFlags),
        209 => Some(Ap::EncoderPosition),
        _ => None,
    };
    if module.is_any() { common() } else { module.axis_parameter(number).map(|row| row.id) }
}
