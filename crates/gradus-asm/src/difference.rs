//! How the program in a module differs from the one that should be there.

use gradus_tmcl::{Instruction, Opcode};

use crate::identity::used;

/// What is different, in the words of somebody who stands at a machine.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Difference {
    /// Nothing.
    None,
    /// The one has a STOP at its end that the other lacks.
    StopAppended,
    /// The module has the whole program that many addresses further on; its jumps are moved as well.
    Shifted(usize),
    /// At these addresses only numbers differ: speeds, positions, times.
    Constants(Vec<usize>),
    /// At these addresses the commands differ, or only one of the two has one.
    Commands(Vec<usize>),
}

impl Difference {
    /// Compares a program with the memory of a module.
    pub fn between(program: &[Instruction], memory: &[Instruction]) -> Self {
        let (program, memory) = (used(program), used(memory));
        if program == memory {
            return Self::None;
        }
        if without_stop(program) == memory || program == without_stop(memory) {
            return Self::StopAppended;
        }
        if let Some(by) = shifted(program, memory) {
            return Self::Shifted(by);
        }
        let addresses = 0..program.len().max(memory.len());
        let differs: Vec<_> = addresses.filter(|address| program.get(*address) != memory.get(*address)).collect();
        let only_value = |address: &usize| match (program.get(*address), memory.get(*address)) {
            (Some(ours), Some(theirs)) => !jumps(ours) && with_value(ours, theirs.value) == *theirs,
            _ => false,
        };
        if differs.iter().all(only_value) { Self::Constants(differs) } else { Self::Commands(differs) }
    }
}

fn without_stop(program: &[Instruction]) -> &[Instruction] {
    match program {
        [before @ .., last] if last.opcode == Opcode::STOP => before,
        program => program,
    }
}

/// Addresses between the starts of the two, if the memory holds the program further on.
fn shifted(program: &[Instruction], memory: &[Instruction]) -> Option<usize> {
    let by = memory.len().checked_sub(program.len()).filter(|by| *by > 0 && !program.is_empty())?;
    let offset = i32::try_from(by).ok()?;
    let moved = |instruction: &Instruction| match jumps(instruction) {
        true => with_value(instruction, instruction.value.wrapping_add(offset)),
        false => *instruction,
    };
    program.iter().map(moved).eq(memory[by..].iter().copied()).then_some(by)
}

/// True if the value of a command is an address.
fn jumps(instruction: &Instruction) -> bool {
    use gradus_tmcl::catalogue::{Command, Field, OperandKind};
    let operands = Command::of(instruction.opcode).map_or(&[][..], |row| row.operands);
    operands.iter().any(|operand| operand.kind == OperandKind::Address && operand.field == Field::Value)
}

fn with_value(instruction: &Instruction, value: i32) -> Instruction {
    Instruction { value, ..*instruction }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STOP: Instruction = Instruction::new(Opcode::STOP, 0, 0, 0);
    const NOP: Instruction = Instruction::new(Opcode::NOP, 0, 0, 0);

    fn ror(speed: i32) -> Instruction {
        Instruction::new(Opcode::ROR, 0, 0, speed)
    }

    fn ja(address: i32) -> Instruction {
        Instruction::new(Opcode::JA, 0, 0, address)
    }

    #[test]
    fn differences_have_names() {
        for (ours, theirs, expected) in [
            (vec![ror(1), STOP], vec![ror(1), STOP, NOP, NOP], Difference::None),
            (vec![ror(1), STOP], vec![ror(1)], Difference::StopAppended),
            (vec![ror(1), ja(0)], vec![ror(1), ja(0), STOP], Difference::StopAppended),
            (vec![ror(1), ja(0)], vec![STOP, NOP, ror(1), ja(2)], Difference::Shifted(2)),
            (vec![ror(1), ja(0)], vec![STOP, NOP, ror(1), ja(0)], Difference::Commands(vec![0, 1, 2, 3])),
            (vec![ror(1), ror(3), STOP], vec![ror(2), ror(3), STOP], Difference::Constants(vec![0])),
            (vec![ror(1), ja(0)], vec![ror(1), ja(1)], Difference::Commands(vec![1])),
            (vec![ror(1)], vec![], Difference::Commands(vec![0])),
        ] {
            assert_eq!(Difference::between(&ours, &theirs), expected, "{ours:?} {theirs:?}");
        }
    }
}
