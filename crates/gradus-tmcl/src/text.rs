//! Instructions as text: `MVP ABS, 0, 51200`.
//!
//! A line is a mnemonic and operands with commas between them. An operand is a keyword of the command or a number: decimal,
//! `$FF` or `0xFF`, `%1010` or `0b1010`, with a sign. A value has 32 bits; past 2147483647 it is accepted where it stands for
//! bits (CALC, COMP, ...) or for an unsigned parameter, and an error elsewhere. What no command of the module stands for is
//! written with its four fields: `DATA 99, 1, 2, -3`. Text and bytes are inverse to each other, for every instruction.
//!
//! Not here: labels, names, expressions, comments; see `gradus-asm`.

use core::fmt;

use crate::catalogue::{self, Command, EncodeError, Mode, Module, Operand, OperandKind};
use crate::{Instruction, Opcode};

/// The word in front of the four fields of an instruction that the module does not know.
const DATA: &str = "DATA";

/// Most operands of a line, those of `DATA`.
const MAX_OPERANDS: usize = 4;

/// Why a line is not an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum ParseError {
    /// The module has no command of that name.
    #[error("unknown command")]
    Command,
    /// Neither a number nor a keyword of the command; the number counts operands from 1.
    #[error("operand {0} is neither a number nor a keyword of the command")]
    Operand(usize),
    /// The operands do not fit the command.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

impl Instruction {
    /// Reads one line; letters of either case.
    ///
    /// # Errors
    /// When the module has no such command, or the operands do not fit it.
    pub fn parse(text: &str, module: &Module) -> Result<Self, ParseError> {
        let text = text.trim();
        let (mnemonic, operands) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        if mnemonic.eq_ignore_ascii_case(DATA) {
            return data(Values::read(operands, |_, operand| number(operand))?.get(MAX_OPERANDS)?);
        }
        let command = module.command(mnemonic).ok_or(ParseError::Command)?;
        let values = Values::read(operands, |i, operand| value(command.operands.get(i), operand, module))?;
        let values = values.get(command.operands.len())?;
        let instruction = command.encode(values)?;
        keeps_sign(&instruction, values, module)?;
        Ok(instruction)
    }

    /// The instruction as a line of text that [`parse`](Self::parse) reads back.
    pub fn display<'a>(&'a self, module: &'a Module) -> Text<'a> {
        Text { instruction: self, module }
    }
}

/// A number past 2^31 would arrive as a negative one: `MVP ABS, 0, 2147483648` would run the other way.
///
/// # Errors
/// [`EncodeError::Range`] then.
fn keeps_sign(instruction: &Instruction, values: &[i64], module: &Module) -> Result<(), EncodeError> {
    let (Some(value), max) = (values.last().copied(), largest_value(instruction, module)) else { return Ok(()) };
    if value <= max {
        return Ok(());
    }
    Err(EncodeError::Range { name: "value", value, min: i32::MIN.into(), max })
}

/// The largest value of a command: that of 32 bits for what computes with bits and for parameters that are unsigned.
fn largest_value(instruction: &Instruction, module: &Module) -> i64 {
    let Instruction { opcode, kind, motor, .. } = *instruction;
    let signed = i64::from(i32::MAX);
    match opcode {
        Opcode::MVP | Opcode::ROR | Opcode::ROL | Opcode::SCO | Opcode::SIO | Opcode::WAIT => signed,
        Opcode::SAP | Opcode::SAPX => module.axis_parameter(kind).map_or(signed, |row| row.max.max(signed)),
        Opcode::SGP => module.global_parameter(motor, kind).map_or(signed, |row| row.max.max(signed)),
        _ => u32::MAX.into(),
    }
}

/// The operands of a line.
#[derive(Default)]
struct Values {
    values: [i64; MAX_OPERANDS],
    count: usize,
}

impl Values {
    /// What `read` makes of each operand in `text`; what there is no room for is only counted.
    fn read(text: &str, read: impl Fn(usize, &str) -> Option<i64>) -> Result<Self, ParseError> {
        let mut list = Self::default();
        if text.trim().is_empty() {
            return Ok(list);
        }
        // An array of one: the search for a single character has a way to panic that the optimizer does not see through.
        for (i, operand) in text.split([',']).enumerate() {
            if let Some(place) = list.values.get_mut(i) {
                *place = read(i, operand.trim()).ok_or(ParseError::Operand(i + 1))?;
            }
            list.count = i + 1;
        }
        Ok(list)
    }

    /// The values, for a command that has up to `want` of them.
    fn get(&self, want: usize) -> Result<&[i64], EncodeError> {
        self.values.get(..self.count).ok_or(EncodeError::Count { got: self.count, want })
    }
}

/// The value of an operand, a keyword or a number.
fn value(operand: Option<&Operand>, text: &str, module: &Module) -> Option<i64> {
    let keyword = operand.and_then(|operand| operand.keyword(text, module));
    keyword.map(|keyword| i64::from(keyword.number)).or_else(|| number(text))
}

/// A number with a sign and a base, which may stand apart from each other.
fn number(text: &str) -> Option<i64> {
    match text.strip_prefix('-') {
        Some(rest) => unsigned(rest.trim_start()).map(|number| -number),
        None => unsigned(text.strip_prefix('+').unwrap_or(text).trim_start()),
    }
}

fn unsigned(text: &str) -> Option<i64> {
    const BASES: [(&str, u8); 6] = [("$", 16), ("0x", 16), ("0X", 16), ("%", 2), ("0b", 2), ("0B", 2)];
    let based = BASES.iter().find_map(|(prefix, base)| Some((text.strip_prefix(prefix)?, *base)));
    let (digits, base) = based.unwrap_or((text, 10));
    if digits.is_empty() {
        return None;
    }
    digits.chars().try_fold(0_i64, |number, digit| {
        let digit = digit.to_digit(16).filter(|digit| *digit < base.into())?;
        number.checked_mul(base.into())?.checked_add(digit.into())
    })
}

/// An instruction from its four fields.
fn data(fields: &[i64]) -> Result<Instruction, ParseError> {
    let &[opcode, kind, motor, value] = fields else {
        return Err(EncodeError::Count { got: fields.len(), want: MAX_OPERANDS }.into());
    };
    let range = EncodeError::Range { name: "opcode", value: opcode, min: 0, max: 255 };
    let opcode = Opcode(u8::try_from(opcode).map_err(|_| range)?);
    Ok(catalogue::encode(opcode, &catalogue::FIELDS, &[kind, motor, value])?)
}

/// An [`Instruction`] that prints itself in the words of a module.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    instruction: &'a Instruction,
    module: &'a Module,
}

impl Text<'_> {
    /// The command and how many of its operands say all there is to say; none if the fields hold more than that.
    fn command(&self) -> Option<(&'static Command, usize)> {
        let command = Command::of(self.instruction.opcode)?;
        if command.mnemonic.is_empty() || self.module.mode(command.opcode) == Mode::None {
            return None;
        }
        let mut values = Values::default();
        for (place, operand) in values.values.iter_mut().zip(command.operands) {
            *place = operand.get(self.instruction);
        }
        let given = |count: &usize| command.encode(&values.values[..*count]).as_ref() == Ok(self.instruction);
        let shortest = (command.required()..=command.operands.len()).find(given)?;
        Some((command, shortest))
    }

    fn operand(&self, operand: &Operand, f: &mut fmt::Formatter) -> fmt::Result {
        let value = operand.get(self.instruction);
        if let Some(keyword) = operand.keyword_of(self.instruction.kind, self.module) {
            return f.write_str(keyword.text);
        }
        match operand.kind {
            OperandKind::AxisOrMask if value >= 0x40 => write!(f, "${value:02X}"),
            _ => write!(f, "{value}"),
        }
    }
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Some((command, count)) = self.command() else {
            let Instruction { opcode, kind, motor, value } = self.instruction;
            return write!(f, "{DATA} {}, {kind}, {motor}, {value}", opcode.0);
        };
        f.write_str(command.mnemonic)?;
        for (i, operand) in command.operands.iter().take(count).enumerate() {
            f.write_str(if i == 0 { " " } else { ", " })?;
            self.operand(operand, f)?;
        }
        Ok(())
    }
}
