//! The table of commands, one row each, for all modules.

use super::availability::Mode;
use super::availability::Mode::{Both, Direct, None as Absent, Standalone};
use super::command::Ascii::{No, Special, Yes};
use super::command::Field::{Kind, Motor, Value};
use super::command::{Ascii, Command, Field, Impact, Keyword, Modes, Operand, OperandKind};
use super::module::Model::{Tmcm351, Tmcm1617, Tmcm3351};
use super::module::{Model, Module};
use crate::{MoveKind, Opcode, Operation, Search, WaitFor};

const fn operand(name: &'static str, field: Field, kind: OperandKind) -> Operand {
    Operand { name, field, kind, optional: false }
}

const fn word(text: &'static str, number: u8, models: &'static [Model]) -> Keyword {
    Keyword { text, number, models }
}

const AXIS: Operand = operand("axis", Motor, OperandKind::Axis);
const AXIS_OR_MASK: Operand = operand("axis", Motor, OperandKind::AxisOrMask);
const AXIS_OR_EEPROM: Operand = operand("axis", Motor, OperandKind::AxisOrEeprom);
const PARAMETER: Operand = operand("parameter", Kind, OperandKind::AxisParameter);
const GLOBAL: Operand = operand("parameter", Kind, OperandKind::GlobalParameter);
const BANK: Operand = operand("bank", Motor, OperandKind::ParameterBank);
const PORT: Operand = operand("port", Kind, OperandKind::Port);
const PORT_BANK: Operand = operand("bank", Motor, OperandKind::PortBank);
const COORDINATE: Operand = operand("coordinate", Kind, OperandKind::Coordinate);
const INTERRUPT: Operand = operand("interrupt", Kind, OperandKind::Interrupt);
const VARIABLE: Operand = operand("variable", Motor, OperandKind::Variable);
const COUNTER: Operand = operand("variable", Kind, OperandKind::Variable);
const SECOND_VARIABLE: Operand = operand("variable", Value, OperandKind::Variable);
const LABEL: Operand = operand("label", Value, OperandKind::Address);
const VALUE: Operand = operand("value", Value, OperandKind::Number);
const VELOCITY: Operand = operand("velocity", Value, OperandKind::Number);
const POSITION: Operand = operand("position", Value, OperandKind::Number);
const TICKS: Operand = operand("ticks", Value, OperandKind::Ticks);
const MASK: Operand = operand("mask", Value, OperandKind::Number);
const ZERO: Operand = operand("0", Value, OperandKind::Zero).optional();
const MOVE: Operand = operand("kind", Kind, OperandKind::Keyword(MOVES));
const SEARCH: Operand = operand("action", Kind, OperandKind::Keyword(SEARCHES));
const EVENT: Operand = operand("event", Kind, OperandKind::Keyword(EVENTS));
const CONDITION: Operand = operand("condition", Kind, OperandKind::Keyword(CONDITIONS));
const FLAG: Operand = operand("flag", Kind, OperandKind::Keyword(FLAGS));

/// The three fields as they are.
pub(crate) const FIELDS: [Operand; 3] = [
    operand("type", Kind, OperandKind::Number),
    operand("motor", Motor, OperandKind::Number),
    operand("value", Value, OperandKind::Number),
];
const REGISTER: [Operand; 3] = [
    operand("register", Kind, OperandKind::Number),
    operand("chip", Motor, OperandKind::Number),
    operand("value", Value, OperandKind::Number),
];
const USER: &[Operand] = &[FIELDS[0].optional(), FIELDS[1].optional(), FIELDS[2].optional()];

const ALL: &[Model] = &[Tmcm3351, Tmcm1617, Tmcm351];
const STEPPERS: &[Model] = &[Tmcm3351, Tmcm351];

const MOVES: &[Keyword] =
    &[word("ABS", MoveKind::ABS.0, ALL), word("REL", MoveKind::REL.0, ALL), word("COORD", MoveKind::COORD.0, STEPPERS)];

const SEARCHES: &[Keyword] = &[
    word("START", Search::START.0, STEPPERS),
    word("STOP", Search::STOP.0, STEPPERS),
    word("STATUS", Search::STATUS.0, STEPPERS),
];

const EVENTS: &[Keyword] = &[
    word("TICKS", WaitFor::TICKS.0, ALL),
    word("POS", WaitFor::POS.0, ALL),
    word("REFSW", WaitFor::REFSW.0, ALL),
    word("LIMSW", WaitFor::LIMSW.0, ALL),
    word("RFS", WaitFor::RFS.0, STEPPERS),
];

const CONDITIONS: &[Keyword] = &[
    word("ZE", 0, ALL),
    word("NZ", 1, ALL),
    word("EQ", 2, ALL),
    word("NE", 3, ALL),
    word("GT", 4, ALL),
    word("GE", 5, ALL),
    word("LT", 6, ALL),
    word("LE", 7, ALL),
    word("ETO", 8, ALL),
    word("EAL", 9, ALL),
    word("EDV", 10, &[Tmcm3351, Tmcm1617]),
    word("EPO", 11, &[Tmcm3351, Tmcm1617]),
    word("ESD", 12, &[Tmcm351]),
];

const FLAGS: &[Keyword] = &[
    word("ALL", 0, ALL),
    word("ETO", 1, ALL),
    word("EAL", 2, ALL),
    word("EDV", 3, ALL),
    word("EPO", 4, ALL),
    word("ESD", 5, ALL),
];

/// SWAP and COMP stand at the ends so that the operations of each command are one slice.
const OPERATIONS: &[Keyword] = &[
    word("SWAP", Operation::SWAP.0, ALL),
    word("ADD", Operation::ADD.0, ALL),
    word("SUB", Operation::SUB.0, ALL),
    word("MUL", Operation::MUL.0, ALL),
    word("DIV", Operation::DIV.0, ALL),
    word("MOD", Operation::MOD.0, ALL),
    word("AND", Operation::AND.0, ALL),
    word("OR", Operation::OR.0, ALL),
    word("XOR", Operation::XOR.0, ALL),
    word("NOT", Operation::NOT.0, ALL),
    word("LOAD", Operation::LOAD.0, ALL),
    word("COMP", Operation::COMP.0, ALL),
];

const fn operation(list: &'static [Keyword]) -> Operand {
    operand("operation", Kind, OperandKind::Keyword(list))
}

const CALC: Operand = operation(OPERATIONS.split_at(11).0.split_at(1).1);
const CALCX: Operand = operation(OPERATIONS.split_at(11).0);
const CALCV: Operand = operation(OPERATIONS.split_at(1).1);
const CALCVV: Operand = operation(OPERATIONS);

const RUN_FROM: Operand =
    operand("start", Kind, OperandKind::Keyword(&[word("CURRENT", 0, ALL), word("ADDRESS", 1, ALL)]));
const ADDRESS: Operand = operand("address", Value, OperandKind::Address);
const STATE: Operand = operand(
    "state",
    Kind,
    OperandKind::Keyword(&[
        word("MEMORY POINTER", 0, &[Tmcm3351, Tmcm1617]),
        word("PROGRAM COUNTER", 1, &[Tmcm3351, Tmcm1617]),
        word("ACCUMULATOR", 2, &[Tmcm3351, Tmcm1617]),
        word("X REGISTER", 3, &[Tmcm3351, Tmcm1617]),
    ]),
);
const FORMAT: Operand =
    operand("format", Kind, OperandKind::Keyword(&[word("STRING", 0, ALL), word("BINARY", 1, ALL)]));
const REPEAT: Operand =
    operand("moves", Kind, OperandKind::Keyword(&[word("NEXT", 0, &[Tmcm3351]), word("EVERY", 1, &[Tmcm3351])]));
const ACTION: Operand = operand("action", Kind, OperandKind::Number);
const ENTRY: Operand = operand("entry", Kind, OperandKind::Number);
const BUS: Operand = operand("bus", Kind, OperandKind::Number);
const LENGTH: Operand = operand("bytes", Motor, OperandKind::Number);
const CODE: Operand = operand("code", Value, OperandKind::Number);

const fn row(
    opcode: Opcode,
    mnemonic: &'static str,
    name: &'static str,
    operands: &'static [Operand],
    [tmcm3351, tmcm1617, tmcm351, tmcm351_rev106]: [Mode; 4],
    ascii: Ascii,
) -> Command {
    let modes = Modes { tmcm3351, tmcm1617, tmcm351, tmcm351_rev106 };
    Command { opcode, mnemonic, name, operands, modes, ascii, since: None, impact: Impact::Acts }
}

/// A command that came with firmware 1.11 of the TMCM-3351 (manual, section 3.5.7); no other module has it.
const fn new(
    opcode: Opcode,
    mnemonic: &'static str,
    name: &'static str,
    operands: &'static [Operand],
    modes: [Mode; 4],
    ascii: Ascii,
) -> Command {
    Command { since: Some((1, 11)), ..row(opcode, mnemonic, name, operands, modes, ascii) }
}

const EVERYWHERE: [Mode; 4] = [Both; 4];
const PROGRAMS: [Mode; 4] = [Standalone; 4];
const HOST: [Mode; 4] = [Direct; 4];
/// Only on the TMCM-3351.
const NEW: [Mode; 4] = [Both, Absent, Absent, Absent];
const NEW_PROGRAMS: [Mode; 4] = [Standalone, Absent, Absent, Absent];

/// Every command, ascending numbers. The four modes are those of the TMCM-3351, the TMCM-1617, and the TMCM-351 by manual
/// V1.03 and by manual Rev. 1.06. A command acts unless its row says that it
/// reads or stops.
#[rustfmt::skip]
pub const COMMANDS: &[Command] = &[
    row(Opcode::ROR, "ROR", "rotate right", &[AXIS, VELOCITY], EVERYWHERE, Yes),
    row(Opcode::ROL, "ROL", "rotate left", &[AXIS, VELOCITY], EVERYWHERE, Yes),
    row(Opcode::MST, "MST", "motor stop", &[AXIS], EVERYWHERE, Yes).stops(),
    row(Opcode::MVP, "MVP", "move to position", &[MOVE, AXIS_OR_MASK, POSITION], EVERYWHERE, Yes),
    row(Opcode::SAP, "SAP", "set axis parameter", &[PARAMETER, AXIS, VALUE], EVERYWHERE, Yes),
    row(Opcode::GAP, "GAP", "get axis parameter", &[PARAMETER, AXIS, ZERO], EVERYWHERE, Yes).reads(),
    row(Opcode::STAP, "STAP", "store axis parameter", &[PARAMETER, AXIS], [Absent, Both, Both, Both], Yes),
    row(Opcode::RSAP, "RSAP", "restore axis parameter", &[PARAMETER, AXIS], [Absent, Both, Both, Both], Yes),
    row(Opcode::SGP, "SGP", "set global parameter", &[GLOBAL, BANK, VALUE], EVERYWHERE, Yes),
    row(Opcode::GGP, "GGP", "get global parameter", &[GLOBAL, BANK, ZERO], EVERYWHERE, Yes).reads(),
    row(Opcode::STGP, "STGP", "store global parameter", &[GLOBAL, BANK], EVERYWHERE, Yes),
    row(Opcode::RSGP, "RSGP", "restore global parameter", &[GLOBAL, BANK], EVERYWHERE, Yes),
    row(Opcode::RFS, "RFS", "reference search", &[SEARCH, AXIS], [Both, Absent, Both, Both], Yes),
    row(Opcode::SIO, "SIO", "set output", &[PORT, PORT_BANK, VALUE], EVERYWHERE, Yes),
    row(Opcode::GIO, "GIO", "get input", &[PORT, PORT_BANK, ZERO], EVERYWHERE, Yes).reads(),
    new(Opcode::SAPX, "SAPX", "set axis parameter, axis in X register", &[PARAMETER, VALUE], NEW, No),
    new(Opcode::GAPX, "GAPX", "get axis parameter, axis in X register", &[PARAMETER], NEW, No),
    new(Opcode::AAPX, "AAPX", "accu to axis parameter, axis in X register", &[PARAMETER], NEW, No),
    row(Opcode::CALC, "CALC", "calculate", &[CALC, VALUE], EVERYWHERE, No),
    row(Opcode::COMP, "COMP", "compare", &[VALUE], PROGRAMS, No),
    row(Opcode::JC, "JC", "jump conditional", &[CONDITION, LABEL], PROGRAMS, No),
    row(Opcode::JA, "JA", "jump always", &[LABEL], PROGRAMS, No),
    row(Opcode::CSUB, "CSUB", "call subroutine", &[LABEL], PROGRAMS, No),
    row(Opcode::RSUB, "RSUB", "return from subroutine", &[], PROGRAMS, No),
    row(Opcode::EI, "EI", "enable interrupt", &[INTERRUPT], [Both, Absent, Absent, Both], No),
    row(Opcode::DI, "DI", "disable interrupt", &[INTERRUPT], [Both, Absent, Absent, Both], No),
    row(Opcode::WAIT, "WAIT", "wait for an event", &[EVENT, AXIS, TICKS], PROGRAMS, No),
    row(Opcode::STOP, "STOP", "stop program execution", &[], PROGRAMS, Special),
    row(Opcode::SAC, "SAC", "SPI bus access", &[BUS, LENGTH, VALUE], [Absent, Absent, Both, Both], Yes),
    row(Opcode::SCO, "SCO", "set coordinate", &[COORDINATE, AXIS_OR_EEPROM, POSITION], [Both, Absent, Both, Both], Yes),
    row(Opcode::GCO, "GCO", "get coordinate", &[COORDINATE, AXIS_OR_EEPROM, ZERO], [Both, Absent, Both, Both], Yes).reads(),
    row(Opcode::CCO, "CCO", "capture coordinate", &[COORDINATE, AXIS], [Both, Absent, Both, Both], Yes),
    row(Opcode::CALCX, "CALCX", "calculate using the X register", &[CALCX], EVERYWHERE, No),
    row(Opcode::AAP, "AAP", "accu to axis parameter", &[PARAMETER, AXIS], EVERYWHERE, No),
    row(Opcode::AGP, "AGP", "accu to global parameter", &[GLOBAL, BANK], EVERYWHERE, No),
    row(Opcode::CLE, "CLE", "clear error flags", &[FLAG], [Both, Both, Standalone, Standalone], No),
    row(Opcode::VECT, "VECT", "define interrupt vector", &[INTERRUPT, LABEL], [Standalone, Absent, Absent, Standalone], No),
    row(Opcode::RETI, "RETI", "return from interrupt", &[], [Standalone, Absent, Absent, Standalone], No),
    row(Opcode::ACO, "ACO", "accu to coordinate", &[COORDINATE, AXIS], [Both, Absent, Both, Both], No),
    new(Opcode::CALCVV, "CALCVV", "calculate using two user variables", &[CALCVV, VARIABLE, SECOND_VARIABLE], NEW, No),
    new(Opcode::CALCVA, "CALCVA", "calculate using a user variable and the accumulator", &[CALCVV, VARIABLE], NEW, No),
    new(Opcode::CALCAV, "CALCAV", "calculate using the accumulator and a user variable", &[CALCVV, VARIABLE], NEW, No),
    new(Opcode::CALCVX, "CALCVX", "calculate using a user variable and the X register", &[CALCVV, VARIABLE], NEW, No),
    new(Opcode::CALCXV, "CALCXV", "calculate using the X register and a user variable", &[CALCVV, VARIABLE], NEW, No),
    new(Opcode::CALCV, "CALCV", "calculate using a user variable and a direct value", &[CALCV, VARIABLE, VALUE], NEW, No),
    new(Opcode::MVPA, "MVPA", "move to position in accumulator", &[MOVE, AXIS_OR_MASK], NEW, No),
    new(Opcode::MVPXA, "MVPXA", "move to position in accumulator, axis in X register", &[MOVE], NEW, No),
    new(Opcode::RST, "RST", "restart program", &[LABEL], NEW_PROGRAMS, No),
    new(Opcode::DJNZ, "DJNZ", "decrement and jump if not zero", &[COUNTER, LABEL], NEW_PROGRAMS, No),
    new(Opcode::ROLA, "ROLA", "rotate left, velocity in accumulator", &[AXIS], NEW, No),
    new(Opcode::RORA, "RORA", "rotate right, velocity in accumulator", &[AXIS], NEW, No),
    new(Opcode::ROLXA, "ROLXA", "rotate left, velocity in accumulator, axis in X register", &[], NEW, No),
    new(Opcode::RORXA, "RORXA", "rotate right, velocity in accumulator, axis in X register", &[], NEW, No),
    new(Opcode::MSTX, "MSTX", "stop motor, axis in X register", &[], NEW, No),
    new(Opcode::SIV, "SIV", "set indexed variable", &[VALUE], NEW, No),
    new(Opcode::GIV, "GIV", "get indexed variable", &[], NEW, No),
    new(Opcode::AIV, "AIV", "accu to indexed variable", &[], NEW, No),
    row(Opcode::UF0, "UF0", "user function 0", USER, EVERYWHERE, Yes),
    row(Opcode::UF1, "UF1", "user function 1", USER, EVERYWHERE, Yes),
    row(Opcode::UF2, "UF2", "user function 2", USER, EVERYWHERE, Yes),
    row(Opcode::UF3, "UF3", "user function 3", USER, EVERYWHERE, Yes),
    row(Opcode::UF4, "UF4", "user function 4", USER, EVERYWHERE, Yes),
    row(Opcode::UF5, "UF5", "user function 5", USER, EVERYWHERE, Yes),
    row(Opcode::UF6, "UF6", "user function 6", USER, EVERYWHERE, Yes),
    row(Opcode::UF7, "UF7", "user function 7", USER, EVERYWHERE, Yes),
    new(Opcode::CALL, "CALL", "conditional subroutine call", &[CONDITION, LABEL], NEW_PROGRAMS, No),
    row(Opcode::STOP_APPLICATION, "", "stop application", &[], HOST, Special).stops(),
    row(Opcode::RUN_APPLICATION, "", "run application", &[RUN_FROM, ADDRESS], HOST, Special),
    row(Opcode::STEP_APPLICATION, "", "step application", &[], HOST, No),
    row(Opcode::RESET_APPLICATION, "", "reset application", &[], HOST, No),
    row(Opcode::ENTER_DOWNLOAD, "", "enter download mode", &[ADDRESS], HOST, No),
    row(Opcode::EXIT_DOWNLOAD, "", "exit download mode", &[], HOST, No).stops(),
    row(Opcode::READ_MEMORY, "", "read program memory", &[ADDRESS], HOST, No).reads(),
    row(Opcode::APPLICATION_STATUS, "", "get application status", &[STATE], HOST, No).reads(),
    row(Opcode::FIRMWARE_VERSION, "", "get firmware version", &[FORMAT], HOST, No).reads(),
    row(Opcode::FACTORY_SETTINGS, "", "restore factory settings", &[CODE], HOST, No),
    row(Opcode::POSITION_EVENT, "", "request target position reached event", &[REPEAT, MASK], [Direct, Absent, Absent, Direct], No),
    row(Opcode::ASCII_MODE, "", "enter ASCII mode", &[], [Absent, Absent, Direct, Direct], No),
    row(Opcode::BREAKPOINT, "", "breakpoints", &[ACTION, ADDRESS], [Direct, Direct, Absent, Direct], No),
    row(Opcode::CAPTURE, "", "capture samples", &FIELDS, [Direct, Direct, Direct, Direct], No),
    row(Opcode::WRITE_REGISTER, "", "write a register of a chip", &REGISTER, [Absent, Direct, Absent, Absent], No),
    row(Opcode::READ_REGISTER, "", "read a register of a chip", &REGISTER, [Absent, Direct, Absent, Absent], No).reads(),
    row(Opcode::GET_INFO, "", "get information", &[ENTRY], [Direct, Direct, Absent, Direct], No).reads(),
    row(Opcode::SOFTWARE_RESET, "", "software reset", &[CODE], [Direct, Direct, Absent, Absent], No),
];

impl Command {
    /// The command of that number, whether or not some module has it.
    pub fn of(opcode: Opcode) -> Option<&'static Command> {
        COMMANDS.iter().find(|command| command.opcode == opcode)
    }

    /// The same, but it changes nothing.
    pub(super) const fn reads(self) -> Self {
        Self { impact: Impact::Reads, ..self }
    }

    /// The same, but it ends something and begins nothing.
    pub(super) const fn stops(self) -> Self {
        Self { impact: Impact::Stops, ..self }
    }
}

impl Module {
    /// The command of that mnemonic, in any case, if the module has it.
    pub fn command(&self, mnemonic: &str) -> Option<&'static Command> {
        let named = |command: &&Command| !mnemonic.is_empty() && command.mnemonic.eq_ignore_ascii_case(mnemonic);
        COMMANDS.iter().filter(named).find(|command| self.mode(command.opcode) != Mode::None)
    }
}

/// Where each command may stand on a module, by opcode.
pub(super) const fn modes(model: Model) -> [Mode; 256] {
    let mut by_opcode = [Mode::None; 256];
    let mut i = 0;
    while i < COMMANDS.len() {
        by_opcode[COMMANDS[i].opcode.0 as usize] = COMMANDS[i].modes.of(model);
        i += 1;
    }
    by_opcode
}
