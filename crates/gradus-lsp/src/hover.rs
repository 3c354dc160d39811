//! What is under the mouse.

use std::fmt::Write;

use gradus_asm::{Defined, Span};
use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{Field, OperandKind};

use crate::analysis::{Analysis, NameAt};
use crate::describe;
use crate::symbols::{self, SymbolKind};

/// A text about a place, in Markdown.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Hover {
    /// What it is about.
    pub span: Span,
    /// The text.
    pub text: String,
}

/// Returns what is known about the mnemonic, operand or name at a byte of a file.
pub fn hover(analysis: &Analysis, source: usize, offset: usize) -> Option<Hover> {
    let address = analysis.command_at(source, offset);
    let operand = address.and_then(|address| operand_at(analysis, address, offset));
    if let Some(name) = analysis.name_at(source, offset) {
        let mut text = of_name(analysis, name);
        if let Some((_, about)) = operand {
            let _ = write!(text, "\n\n---\n\n{about}");
        }
        return Some(Hover { span: name.span, text });
    }
    if let Some((span, text)) = operand {
        return Some(Hover { span, text });
    }
    let text = analysis.assembly.commands.get(address?)?;
    let on_mnemonic = (text.mnemonic.start..=text.mnemonic.end).contains(&offset);
    let (_, row) = analysis.command(address?).filter(|_| on_mnemonic)?;
    Some(Hover { span: text.mnemonic, text: describe::command(row, analysis.module()) })
}

/// The operand at a byte, with what its value means.
fn operand_at(analysis: &Analysis, address: usize, offset: usize) -> Option<(Span, String)> {
    let text = analysis.assembly.commands.get(address)?;
    let index = text.operands.iter().position(|span| (span.start..=span.end).contains(&offset))?;
    let (instruction, row) = analysis.command(address)?;
    let operand = row.operands.get(index)?;
    let (span, value) = (text.operands[index], operand.get(instruction));
    let about = describe::operand(operand.kind, value, instruction, analysis.module());
    let about = about.or_else(|| number(analysis, address, operand.kind, operand.field, value))?;
    Some((span, about))
}

/// A plain number: in hexadecimal, and as a quantity of the parameter that it is for.
fn number(analysis: &Analysis, address: usize, kind: OperandKind, field: Field, value: i64) -> Option<String> {
    let (instruction, _) = analysis.command(address)?;
    match kind {
        OperandKind::Ticks => Some(format!("{value} ticks = {}", describe::ticks(value))),
        OperandKind::Address => symbols::label_at(analysis, usize::try_from(value).ok()?)
            .map(|label| format!("address {value} (`{}`)", analysis.label(label).name)),
        OperandKind::Number if field == Field::Value => {
            let mut text = format!("{value} = 0x{:X}", value as u32);
            if matches!(instruction.opcode, Opcode::SAP | Opcode::SAPX)
                && let Some(row) = analysis.module().axis_parameter(instruction.kind)
            {
                let _ = write!(text, "\n\nfor {}", describe::axis_parameter(row, analysis.module()));
            }
            Some(text)
        }
        _ => None,
    }
}

fn of_name(analysis: &Analysis, name: NameAt) -> String {
    match name.of {
        Defined::Label(index) => of_label(analysis, index),
        Defined::Constant(index) => of_constant(analysis, index),
    }
}

fn of_label(analysis: &Analysis, index: usize) -> String {
    let label = analysis.label(index);
    let kind = match symbols::label_kind(analysis, label.address) {
        SymbolKind::Routine => "routine",
        SymbolKind::Handler => "interrupt handler",
        _ => "label",
    };
    let mut text = format!("**{}**: {kind} at address {}", label.name, label.address);
    let callers = symbols::incoming(analysis, label.address);
    if !callers.is_empty() {
        let from = |calls: &symbols::Calls| calls.label.map_or("main", |label| &*analysis.label(label).name).to_owned();
        let _ = write!(text, "\n\nCalled from {}", callers.iter().map(from).collect::<Vec<_>>().join(", "));
        let _ = match symbols::depth(analysis, index) {
            Some(depth) => write!(text, "; calls nest {depth} deep below it"),
            None => write!(text, "; it calls itself"),
        };
    }
    text
}

fn of_constant(analysis: &Analysis, index: usize) -> String {
    let constant = analysis.constant(index);
    let value = symbols::value_text(constant.value);
    let mut text = format!("**{}** {value}", constant.name);
    if constant.value.fract() == 0.0 && constant.value.abs() < 4_294_967_296.0 {
        let _ = write!(text, " = 0x{:X}", constant.value as i64 as u32);
    }
    let uses = used_as(analysis, Defined::Constant(index));
    if !uses.is_empty() {
        let _ = write!(text, "\n\nUsed as {}", uses.join(", "));
    }
    text
}

/// The parameters and variables that a name stands for where commands use it.
fn used_as(analysis: &Analysis, of: Defined) -> Vec<String> {
    let mut found = Vec::new();
    for span in analysis.references(of) {
        let Some(role) = role(analysis, span) else { continue };
        if !found.contains(&role) {
            found.push(role);
        }
    }
    found
}

fn role(analysis: &Analysis, span: Span) -> Option<String> {
    let (instruction, operand) = analysis.operand_around(span)?;
    let number = u8::try_from(operand.get(instruction)).ok()?;
    let module = analysis.module();
    match operand.kind {
        OperandKind::AxisParameter => module.axis_parameter(number).map(|row| format!("axis parameter {}", row.name)),
        OperandKind::GlobalParameter => {
            let row = module.global_parameter(instruction.motor, number)?;
            let run = if row.first == row.last { String::new() } else { format!(" {number}") };
            Some(format!("{}{run}", row.name))
        }
        OperandKind::Variable => Some(format!("user variable {number}")),
        OperandKind::Axis | OperandKind::AxisOrMask | OperandKind::AxisOrEeprom => Some(format!("axis {number}")),
        OperandKind::Port => module.port(instruction.motor, number).map(|port| port.name.to_owned()),
        OperandKind::Interrupt => module.interrupt(number).map(|row| format!("interrupt {}", row.name)),
        _ => None,
    }
}
