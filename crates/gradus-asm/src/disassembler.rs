//! From a program to source text that gives the same program again.
//!
//! Addresses that are jumped to get labels (`L_10:`). What the module's language cannot say, such as unknown commands or
//! numbers in fields that are not used, is written in plain numbers: `#data 0, 0, 0, 0`. If the program does not end with a STOP,
//! a comment keeps the assembler from appending one.
//!
//! Comments name the parameters: `// AP 4: maximum positioning speed, pps`.

use std::collections::BTreeSet;
use std::fmt::Write;

use gradus_tmcl::catalogue::{Command, Module, Operand, OperandKind};
use gradus_tmcl::{Instruction, Opcode};

use crate::check::check;
use crate::comments::NO_STOP;
use crate::encoder::encode;
use crate::names::Names;
use crate::parser::{self, Body, DATA};
use crate::problem::Span;

/// Letters of a command before the comments begin.
const COMMENT_COLUMN: usize = 27;

/// Source text for a program.
pub fn disassemble(program: &[Instruction], module: &'static Module) -> String {
    let lines: Vec<_> = program.iter().map(|instruction| line(instruction, module, program.len())).collect();
    let targets: BTreeSet<_> = lines.iter().filter_map(|line| line.target).collect();
    let mut text = String::new();
    for (address, line) in lines.iter().enumerate() {
        if targets.contains(&address) {
            let _ = writeln!(text, "L_{address}:"); // a string takes everything
        }
        let target = line.target.map_or_else(String::new, |target| format!("L_{target}"));
        let code = format!("{}{target}", line.head);
        let _ = match &line.comment {
            Some(comment) => writeln!(text, "    {code:<COMMENT_COLUMN$} // {comment}"),
            None => writeln!(text, "    {code}"),
        };
    }
    if program.last().is_none_or(|last| last.opcode != Opcode::STOP) {
        let _ = writeln!(text, "// gradus: {NO_STOP}");
    }
    text
}

struct Line {
    head: String,
    /// An address within the program, the last operand.
    target: Option<usize>,
    comment: Option<String>,
}

fn line(instruction: &Instruction, module: &'static Module, length: usize) -> Line {
    let Some(row) = Command::of(instruction.opcode).filter(|row| !row.mnemonic.is_empty()) else {
        return plain(instruction, "");
    };
    let operands = operands(instruction, row, module);
    let head = format!("{} {}", row.mnemonic, operands.join(", "));
    let head = head.trim_end();
    if !means(head, instruction, module) {
        return plain(instruction, row.mnemonic);
    }
    let target = row.operands.last().filter(|operand| operand.kind == OperandKind::Address);
    match (target.and(usize::try_from(instruction.value).ok()), operands.last()) {
        (Some(target), Some(number)) if target < length => {
            Line { head: head[..head.len() - number.len()].to_owned(), target: Some(target), comment: None }
        }
        _ => Line { head: head.to_owned(), target: None, comment: parameter(instruction, row, module) },
    }
}

/// What the number of a parameter stands for: `AP 4: maximum positioning speed, pps`. Variables have no names to tell.
fn parameter(instruction: &Instruction, row: &Command, module: &Module) -> Option<String> {
    let is_parameter = |kind| matches!(kind, OperandKind::AxisParameter | OperandKind::GlobalParameter);
    let operand = row.operands.iter().find(|operand| is_parameter(operand.kind))?;
    let number = u8::try_from(operand.get(instruction)).ok()?;
    if operand.kind == OperandKind::AxisParameter {
        let row = module.axis_parameter(number)?;
        let unit = row.unit.text();
        return Some(format!("AP {number}: {}{}{unit}", row.name, if unit.is_empty() { "" } else { ", " }));
    }
    let row = module.global_parameter(instruction.motor, number).filter(|row| row.first == row.last)?;
    Some(format!("GP {number}, bank {}: {}", row.bank, row.name))
}

/// In plain numbers, with a comment.
fn plain(instruction: &Instruction, mnemonic: &str) -> Line {
    let Instruction { opcode, kind, motor, value } = instruction;
    let comment = (!mnemonic.is_empty()).then(|| mnemonic.to_owned());
    Line { head: format!("{DATA} {}, {kind}, {motor}, {value}", opcode.0), target: None, comment }
}

fn operands(instruction: &Instruction, row: &Command, module: &Module) -> Vec<String> {
    let used = row.operands.iter().rposition(|operand| !operand.optional || operand.get(instruction) != 0);
    let given = row.operands.iter().take(used.map_or(0, |last| last + 1));
    given.map(|operand| text(operand, instruction, module)).collect()
}

fn text(operand: &Operand, instruction: &Instruction, module: &Module) -> String {
    match operand.keyword_of(instruction.kind, module) {
        Some(keyword) => keyword.text.to_owned(),
        None => operand.get(instruction).to_string(),
    }
}

/// True if the text is a command of the module and gives this instruction.
fn means(text: &str, instruction: &Instruction, module: &'static Module) -> bool {
    let mut problems = Vec::new();
    let span = Span { source: 0, start: 0, end: text.len() };
    let Some(Body::Command(command)) = parser::line(text, span, &mut problems).body else { return false };
    let Some(encoded) = encode(&command, &Names::new(module), &mut problems) else { return false };
    let memory = module.memory();
    encoded.instruction == *instruction && !check(&encoded, module, memory).iter().any(|problem| problem.is_error())
}
