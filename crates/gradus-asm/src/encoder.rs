//! From a command as written to its numbers, as far as this needs no knowledge of the module.
//!
//! Every command and keyword of every module is taken here; whether the module has them is looked at in `check`.

use gradus_tmcl::catalogue::{COMMANDS, Command as Row, Keyword, Operand};
use gradus_tmcl::{Instruction, Opcode};

use crate::code::Code;
use crate::dialects;
use crate::expression::Expression;
use crate::names::Names;
use crate::nearest;
use crate::parser::{Command, DATA};
use crate::problem::{Problem, Span};

/// A command in numbers.
pub(crate) struct Encoded {
    pub instruction: Instruction,
    /// Its row in the catalogue; `None` for a command in plain numbers.
    pub row: Option<&'static Row>,
    /// Its operands as far as they are given.
    pub operands: Vec<Given>,
    /// Place of the mnemonic.
    pub span: Span,
}

/// An operand with its value.
#[derive(Clone, Copy)]
pub(crate) struct Given {
    pub operand: &'static Operand,
    pub value: i64,
    pub span: Span,
}

/// Encodes a command; `None` if something is wrong with it, which is reported.
pub(crate) fn encode(command: &Command, names: &Names, problems: &mut Vec<Problem>) -> Option<Encoded> {
    if is_data(&command.mnemonic.text) {
        return data(command, names, problems);
    }
    let Some(row) = find(&command.mnemonic.text) else {
        problems.push(unknown(command));
        return None;
    };
    if !(row.required()..=row.operands.len()).contains(&command.operands.len()) {
        // A malformed operand, which has been reported, may have hidden others.
        problems.extend((!command.operands.iter().any(Expression::is_broken)).then(|| count(command, row)));
        return None;
    }
    let values = command.operands.iter().zip(row.operands);
    let operands: Vec<_> = values.map(|(text, operand)| value(text, operand, row, names, problems)).collect();
    let operands: Vec<Given> = operands.into_iter().collect::<Option<_>>()?;
    let numbers: Vec<i64> = operands.iter().map(|given| given.value).collect();
    let instruction = row.encode(&numbers).ok()?; // count and ranges hold
    Some(Encoded { instruction, row: Some(row), operands, span: command.mnemonic.span })
}

/// The command of that mnemonic, on whatever module.
pub(crate) fn find(mnemonic: &str) -> Option<&'static Row> {
    COMMANDS.iter().find(|row| row.mnemonic.eq_ignore_ascii_case(mnemonic))
}

/// `#data`, or `DATA` as in direct mode.
fn is_data(mnemonic: &str) -> bool {
    mnemonic == DATA || mnemonic.eq_ignore_ascii_case("DATA")
}

fn unknown(command: &Command) -> Problem {
    let name = &command.mnemonic.text;
    let mnemonics = COMMANDS.iter().map(|row| row.mnemonic).filter(|mnemonic| !mnemonic.is_empty());
    let problem = Problem::error(Code::UnknownCommand, command.mnemonic.span, format!("no command named `{name}`"));
    problem.maybe_help(dialects::hint(name).or_else(|| nearest::hint(name, mnemonics)))
}

fn count(command: &Command, row: &Row) -> Problem {
    let (least, most) = (row.required(), row.operands.len());
    let takes = match (least, most) {
        (_, 0) => "no operands".into(),
        (1, 1) => "1 operand".into(),
        (least, most) if least == most => format!("{most} operands"),
        _ => format!("{least} to {most} operands"),
    };
    let message = format!("`{}` takes {takes}, not {}", row.mnemonic, command.operands.len());
    let last = command.operands.last().map_or(command.mnemonic.span, |operand| operand.span);
    Problem::error(Code::OperandCount, command.mnemonic.span.to(last), message).help(syntax(command, row))
}

/// How a command is written that has a wrong number of operands.
fn syntax(command: &Command, row: &Row) -> String {
    let without_condition = row.opcode == Opcode::CALL && command.operands.len() == 1;
    let other = if without_condition { "; without a condition it is `CSUB <label>`" } else { "" };
    format!("it is written `{row}`{other}")
}

/// An operand: a keyword where one may stand, else an expression.
fn value(
    text: &Expression,
    operand: &'static Operand,
    row: &Row,
    names: &Names,
    problems: &mut Vec<Problem>,
) -> Option<Given> {
    let word = text.as_name().filter(|_| !operand.kind.keywords().is_empty());
    let keyword = word.and_then(|word| keyword(word, operand));
    if let (Some(word), None, false) = (word, keyword, word.is_some_and(|word| names.contains(word))) {
        problems.push(unknown_keyword(word, text.span, operand, row));
        return None;
    }
    let value = match keyword {
        Some(keyword) => i64::from(keyword.number),
        None => number(text, operand.name, operand.range(), names, problems)?,
    };
    Some(Given { operand, value, span: text.span })
}

/// The keyword of that word, in any case, on whatever module.
pub(crate) fn keyword(word: &str, operand: &Operand) -> Option<&'static Keyword> {
    operand.kind.keywords().iter().find(|keyword| keyword.text.eq_ignore_ascii_case(word))
}

/// True if an operand is a keyword, so that it is no name.
pub(crate) fn is_keyword(text: &Expression, operand: &Operand) -> bool {
    text.as_name().is_some_and(|word| keyword(word, operand).is_some())
}

fn unknown_keyword(word: &str, span: Span, operand: &Operand, row: &Row) -> Problem {
    let words = || operand.kind.keywords().iter().map(|keyword| keyword.text);
    let message = format!("`{}` has no {} `{word}`", row.mnemonic, operand.name);
    let all = || words().collect::<Vec<_>>().join(", ");
    let help = nearest::hint(word, words()).unwrap_or_else(|| format!("it takes {}", all()));
    Problem::error(Code::UnknownName, span, message).help(help)
}

/// The value of an expression, rounded, within the range of its field.
fn number(
    text: &Expression,
    name: &str,
    (min, max): (i64, i64),
    names: &Names,
    problems: &mut Vec<Problem>,
) -> Option<i64> {
    let value = names.value(text, problems)?.round();
    if (min as f64..=max as f64).contains(&value) {
        return Some(value as i64);
    }
    let message = if min == max {
        format!("this operand is not used and must be {min}")
    } else {
        format!("the {name} is {value}, its field takes {min}...{max}")
    };
    problems.push(Problem::error(Code::OutOfRange, text.span, message));
    None
}

/// `#data opcode, type, motor, value`, with or without the sign.
fn data(command: &Command, names: &Names, problems: &mut Vec<Problem>) -> Option<Encoded> {
    const BYTE: (i64, i64) = (0, u8::MAX as i64);
    let [opcode, kind, motor, value] = command.operands.as_slice() else {
        let name = command.mnemonic.text.as_str();
        let message = format!("`{name}` takes 4 operands, not {}", command.operands.len());
        let problem = Problem::error(Code::OperandCount, command.mnemonic.span, message);
        problems.push(problem.help(format!("it is written `{name} <opcode>, <type>, <motor>, <value>`")));
        return None;
    };
    let opcode = number(opcode, "opcode", BYTE, names, problems);
    let kind = number(kind, "type", BYTE, names, problems);
    let motor = number(motor, "motor", BYTE, names, problems);
    let value = number(value, "value", (i32::MIN.into(), u32::MAX.into()), names, problems);
    let instruction = Instruction::new(Opcode(opcode? as u8), kind? as u8, motor? as u8, value? as i32);
    Some(Encoded { instruction, row: None, operands: Vec::new(), span: command.mnemonic.span })
}
