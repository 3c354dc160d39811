//! What a command is: its operands, where it may stand, and how it becomes an instruction.

use core::fmt;

use super::availability::Mode;
use super::module::{Model, Module};
use crate::{Instruction, Opcode};

/// Where a command may stand, by manual.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Modes {
    /// TMCM-3351, manual V1.06 (firmware 1.11).
    pub tmcm3351: Mode,
    /// TMCM-1617.
    pub tmcm1617: Mode,
    /// TMCM-351, manual V1.03.
    pub tmcm351: Mode,
    /// TMCM-351, manual Rev. 1.06 (firmware 4.45), which the module of the catalogue follows.
    pub tmcm351_rev106: Mode,
}

impl Modes {
    /// The column of a module.
    pub const fn of(&self, model: Model) -> Mode {
        match model {
            Model::Tmcm3351 => self.tmcm3351,
            Model::Tmcm1617 => self.tmcm1617,
            Model::Tmcm351 => self.tmcm351_rev106,
            Model::Any => self.tmcm3351.or(self.tmcm1617).or(self.tmcm351).or(self.tmcm351_rev106),
        }
    }
}

/// Whether the TMCM-351 takes a command in ASCII mode.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ascii {
    /// Not at all.
    No,
    /// As the assembler writes it.
    Yes,
    /// As a word of its own: `RUN`, `STOP`.
    Special,
}

/// What a command does as far as a stop goes: from a stop until its release a host lets nothing pass that acts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Impact {
    /// It changes nothing.
    Reads,
    /// It ends something and begins nothing: a motor's motion, the program, a download.
    Stops,
    /// Everything else.
    Acts,
}

/// The field of an instruction that holds an operand.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Field {
    /// The type field, 0..=255.
    Kind,
    /// The motor or bank field, 0..=255.
    Motor,
    /// The value field, 32 bits.
    Value,
}

/// What an operand stands for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum OperandKind {
    /// Number of an axis.
    Axis,
    /// Number of an axis; with COORD also a mask of axes (bits 0..=2) with bit 6 or bit 7 set.
    AxisOrMask,
    /// Number of an axis, or 255 for the EEPROM.
    AxisOrEeprom,
    /// Number of an axis parameter.
    AxisParameter,
    /// Number of a global parameter in the bank of the next operand.
    GlobalParameter,
    /// Bank of global parameters.
    ParameterBank,
    /// Number of a port in the bank of the next operand.
    Port,
    /// Bank of ports.
    PortBank,
    /// Number of a stored coordinate.
    Coordinate,
    /// Number of an interrupt.
    Interrupt,
    /// Number of a user variable.
    Variable,
    /// Address of a command in program memory, a label in assembly language.
    Address,
    /// Ticks of 10 ms.
    Ticks,
    /// A number without further meaning to the language.
    Number,
    /// Means nothing and must be 0.
    Zero,
    /// One of some words.
    Keyword(&'static [Keyword]),
}

/// A word for a number in the type field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Keyword {
    /// The word.
    pub text: &'static str,
    /// Its number.
    pub number: u8,
    /// The modules that have it.
    pub models: &'static [Model],
}

/// An operand of a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Operand {
    /// Name, as in a syntax line.
    pub name: &'static str,
    /// Where it is put.
    pub field: Field,
    /// What it stands for.
    pub kind: OperandKind,
    /// True when it may be left out, which means 0.
    pub optional: bool,
}

/// A command of the language.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Command {
    /// Its number.
    pub opcode: Opcode,
    /// Its word in programs; empty for control commands, which only the host sends.
    pub mnemonic: &'static str,
    /// What it does, in a few words.
    pub name: &'static str,
    /// Its operands in the order of a program line.
    pub operands: &'static [Operand],
    /// Where it may stand.
    pub modes: Modes,
    /// Whether ASCII mode has it.
    pub ascii: Ascii,
    /// Firmware version, major and minor, that it came with; `None` where it has always been there.
    pub since: Option<(u8, u8)>,
    /// What it does; RFS and GCO can do something else too, see [`Instruction::impact`].
    pub impact: Impact,
}

/// Why operands do not make an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum EncodeError {
    /// Too few or too many.
    #[error("{got} operands, expected {want}")]
    Count {
        /// How many came.
        got: usize,
        /// How many the command has at most.
        want: usize,
    },
    /// A value that its field cannot hold.
    #[error("{name} {value} out of range {min}..={max}")]
    Range {
        /// Name of the operand.
        name: &'static str,
        /// What came.
        value: i64,
        /// Smallest value.
        min: i64,
        /// Largest value.
        max: i64,
    },
}

impl Keyword {
    /// True if the module has it.
    pub fn is_on(&self, module: &Module) -> bool {
        module.model == Model::Any || self.models.contains(&module.model)
    }
}

impl OperandKind {
    /// The words that stand for numbers, empty where only numbers do.
    pub const fn keywords(self) -> &'static [Keyword] {
        match self {
            Self::Keyword(list) => list,
            _ => &[],
        }
    }
}

impl Operand {
    /// The same, but it may be left out.
    pub(super) const fn optional(self) -> Self {
        Self { optional: true, ..self }
    }

    /// The keyword of that text, in any case, if the module has it.
    pub fn keyword(&self, text: &str, module: &Module) -> Option<&'static Keyword> {
        let is_it = |word: &&Keyword| word.text.eq_ignore_ascii_case(text) && word.is_on(module);
        self.kind.keywords().iter().find(is_it)
    }

    /// The keyword of that number, if the module has it.
    pub fn keyword_of(&self, number: u8, module: &Module) -> Option<&'static Keyword> {
        let is_it = |word: &&Keyword| word.number == number && word.is_on(module);
        self.kind.keywords().iter().find(is_it)
    }

    /// Smallest and largest value that the operand's field takes; the value field takes signed and unsigned numbers.
    pub const fn range(&self) -> (i64, i64) {
        match (self.kind, self.field) {
            (OperandKind::Zero, _) => (0, 0),
            (_, Field::Value) => (i32::MIN as i64, u32::MAX as i64),
            _ => (0, u8::MAX as i64),
        }
    }

    /// The operand's value in an instruction.
    pub fn get(&self, instruction: &Instruction) -> i64 {
        match self.field {
            Field::Kind => i64::from(instruction.kind),
            Field::Motor => i64::from(instruction.motor),
            Field::Value => i64::from(instruction.value),
        }
    }

    fn put(&self, instruction: &mut Instruction, value: i64) -> Result<(), EncodeError> {
        let (min, max) = self.range();
        if !(min..=max).contains(&value) {
            return Err(EncodeError::Range { name: self.name, value, min, max });
        }
        match self.field {
            Field::Kind => instruction.kind = value as u8,
            Field::Motor => instruction.motor = value as u8,
            Field::Value => instruction.value = value as i32,
        }
        Ok(())
    }
}

impl Command {
    /// How many operands must be given.
    pub fn required(&self) -> usize {
        required(self.operands)
    }

    /// Puts operand values into their fields.
    ///
    /// # Errors
    /// When there are too few or too many of them, or one does not fit its field.
    pub fn encode(&self, values: &[i64]) -> Result<Instruction, EncodeError> {
        encode(self.opcode, self.operands, values)
    }
}

fn required(operands: &[Operand]) -> usize {
    operands.iter().filter(|operand| !operand.optional).count()
}

/// As [`Command::encode`], for any list of operands.
pub(crate) fn encode(opcode: Opcode, operands: &[Operand], values: &[i64]) -> Result<Instruction, EncodeError> {
    if !(required(operands)..=operands.len()).contains(&values.len()) {
        return Err(EncodeError::Count { got: values.len(), want: operands.len() });
    }
    let mut instruction = Instruction { opcode, ..Instruction::default() };
    for (operand, value) in operands.iter().zip(values) {
        operand.put(&mut instruction, *value)?;
    }
    Ok(instruction)
}

impl fmt::Display for Command {
    /// The syntax line: `SAP <parameter>, <axis>, <value>`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.mnemonic)?;
        for (i, operand) in self.operands.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            let (open, close) = if operand.optional { ("[", "]") } else { ("<", ">") };
            write!(f, "{comma} {open}{}{close}", operand.name)?;
        }
        Ok(())
    }
}
