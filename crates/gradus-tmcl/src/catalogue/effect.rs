//! What executing a command once more does.

use super::{Command, Impact};
use crate::{Instruction, MoveKind, Opcode, Search};

/// What a command does to the module, as far as repeating it goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Effect {
    /// It changes nothing.
    Read,
    /// It leads to the same state however often it is executed, if nothing else comes between.
    Set,
    /// Executing it twice is not the same as once, or nobody knows.
    Act,
}

/// Commands that change nothing.
const READS: &[Opcode] = &[
    Opcode::GAP,
    Opcode::GGP,
    Opcode::GIO,
    Opcode::GCO,
    Opcode::READ_MEMORY,
    Opcode::APPLICATION_STATUS,
    Opcode::FIRMWARE_VERSION,
    Opcode::READ_REGISTER,
    Opcode::GET_INFO,
];

/// Commands that name the state they lead to.
const SETS: &[Opcode] = &[
    Opcode::ROR,
    Opcode::ROL,
    Opcode::MST,
    Opcode::SAP,
    Opcode::STAP,
    Opcode::RSAP,
    Opcode::SGP,
    Opcode::STGP,
    Opcode::RSGP,
    Opcode::SIO,
    Opcode::SCO,
];

/// The motor of a coordinate command that means the copy of all axes in the EEPROM.
const WHOLE_EEPROM: u8 = 255;

impl Instruction {
    /// What it does as far as a stop goes, by the catalogue's column. Two commands depend on their operands: RFS STATUS reads,
    /// and GCO with motor 255 copies coordinates. What no row describes acts.
    pub fn impact(&self) -> Impact {
        let impact = Command::of(self.opcode).map_or(Impact::Acts, |command| command.impact);
        match self.opcode {
            Opcode::RFS if self.kind == Search::STATUS.0 => Impact::Reads,
            Opcode::GCO if self.motor == WHOLE_EEPROM => Impact::Acts,
            _ => impact,
        }
    }

    /// What sending it once more does. This is the one table of what a host may repeat by itself: reads, and writes of absolute
    /// values. Everything else acts: relative moves, the start of a reference search, control of programs, arithmetic in
    /// registers, and what no manual describes. A coordinate for all axes (GCO with motor 255) is copied, not read.
    pub fn effect(&self) -> Effect {
        match (self.opcode, self.kind) {
            (Opcode::MVP, kind) if kind == MoveKind::ABS.0 || kind == MoveKind::COORD.0 => Effect::Set,
            (Opcode::RFS, kind) if kind == Search::STATUS.0 => Effect::Read,
            (Opcode::RFS, kind) if kind == Search::STOP.0 => Effect::Set,
            (Opcode::GCO, _) if self.motor == WHOLE_EEPROM => Effect::Set,
            (opcode, _) if READS.contains(&opcode) => Effect::Read,
            (opcode, _) if SETS.contains(&opcode) => Effect::Set,
            _ => Effect::Act,
        }
    }
}
