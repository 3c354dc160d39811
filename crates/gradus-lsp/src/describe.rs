//! What the catalogue knows, in words: for hover, completion and signature help.

use std::fmt::Write;

use gradus_tmcl::catalogue::{
    Access, AxisParameter, Choice, Command, GlobalParameter, MODULES, Mode, Module, OperandKind, Values,
};
use gradus_tmcl::{Instruction, Opcode};

/// How many special values a text lists.
const LISTED: usize = 12;

/// Describes a command: its form, what it does, where it may stand, and which modules have it.
pub fn command(row: &Command, module: &Module) -> String {
    let mut text = format!("```tmcl\n{row}\n```\n{}.", capital(row.name));
    let mode = module.mode(row.opcode);
    let place = match mode {
        Mode::Both => "In direct mode and in programs.",
        Mode::Direct => "In direct mode only.",
        Mode::Standalone => "In programs only.",
        Mode::None => "",
    };
    let _ = match mode {
        Mode::None => write!(text, " The {} does not have it.", module.name),
        _ => write!(text, " {place}"),
    };
    if let Some(flags) = flags(row.opcode) {
        let _ = write!(text, " {flags}");
    }
    if let Some((major, minor)) = row.since {
        let _ = write!(text, " Since firmware {major}.{minor:02}.");
    }
    let has = MODULES.iter().filter(|other| other.mode(row.opcode) != Mode::None).map(|other| other.name);
    let _ = write!(text, "\n\nModules: {}.", has.collect::<Vec<_>>().join(", "));
    text
}

/// What a command does to the comparison flags in a program.
fn flags(opcode: Opcode) -> Option<&'static str> {
    match opcode {
        Opcode::COMP => Some("Sets the flags to the comparison of the accumulator with its operand."),
        Opcode::GAP | Opcode::GGP | Opcode::GIO | Opcode::GCO | Opcode::GAPX | Opcode::GIV | Opcode::CALC => {
            Some("Loads the accumulator and compares it with 0.")
        }
        Opcode::CALCX | Opcode::CALCAV | Opcode::CALCVA | Opcode::CALCVV | Opcode::CALCVX | Opcode::CALCXV => {
            Some("Compares its result with 0; COMP compares its two operands.")
        }
        Opcode::CALCV => Some("Compares its result with 0; COMP compares its two operands."),
        Opcode::CLE => Some("Clears error flags."),
        _ => None,
    }
}

/// Describes an axis parameter.
pub fn axis_parameter(row: &AxisParameter, module: &Module) -> String {
    let mut text = format!("**{}** (axis parameter {}, `{}`)\n\n{}", row.name, row.number, row.symbol, row.description);
    quantity(&mut text, (row.min, row.max), row.unit.text(), row.default, row.access);
    values(&mut text, row.values);
    let _ = write!(text, "\n\n{}", module.name);
    text
}

/// Describes a global parameter, one of a run by its number.
pub fn global_parameter(row: &GlobalParameter, number: u8, module: &Module) -> String {
    let run = if row.first == row.last { String::new() } else { format!(" {number}") };
    let mut text =
        format!("**{}{run}** (global parameter {number}, bank {})\n\n{}", row.name, row.bank, row.description);
    quantity(&mut text, (row.min, row.max), "", row.default, row.access);
    values(&mut text, row.values);
    let _ = write!(text, "\n\n{}", module.name);
    text
}

fn quantity(text: &mut String, (min, max): (i64, i64), unit: &str, default: Option<i64>, access: Access) {
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let _ = write!(text, "\n\nRange {min} to {max}{unit}");
    if let Some(default) = default {
        let _ = write!(text, ", default {default}");
    }
    let _ = write!(text, ". {}", storage(access));
}

/// Where the value lives.
fn storage(access: Access) -> &'static str {
    match access {
        Access::R => "Read only.",
        Access::Rw => "Read and write; lost at power-off.",
        Access::Rwe => "Read and write; STAP or STGP stores it in the EEPROM.",
        Access::Rwa => "Read and write; every write is stored in the EEPROM.",
    }
}

fn values(text: &mut String, values: Values) {
    let choices = values.choices();
    if choices.is_empty() {
        return;
    }
    text.push('\n');
    for choice in choices.iter().take(LISTED) {
        let _ = write!(text, "\n- {}: {}", span(choice), choice.text);
    }
    if choices.len() > LISTED {
        let _ = write!(text, "\n- and {} more", choices.len() - LISTED);
    }
}

fn span(choice: &Choice) -> String {
    if choice.first == choice.last { choice.first.to_string() } else { format!("{} to {}", choice.first, choice.last) }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Describes the operand of a command at its value: a parameter, a port, an interrupt, a keyword.
pub fn operand(kind: OperandKind, value: i64, instruction: &Instruction, module: &Module) -> Option<String> {
    let number = u8::try_from(value).ok()?;
    match kind {
        OperandKind::AxisParameter => module.axis_parameter(number).map(|row| axis_parameter(row, module)),
        OperandKind::GlobalParameter => {
            let row = module.global_parameter(instruction.motor, number)?;
            Some(global_parameter(row, number, module))
        }
        OperandKind::Port => {
            let port = module.port(instruction.motor, number)?;
            Some(format!("**{}**, port {number} of bank {}", port.name, port.bank))
        }
        OperandKind::Interrupt => {
            let row = module.interrupt(number)?;
            Some(format!("**{}**, interrupt {number} (`{}`)", row.name, row.symbol))
        }
        OperandKind::Keyword(words) => {
            words.iter().find(|word| word.number == number).map(|word| format!("`{}` = {number}", word.text))
        }
        _ => None,
    }
}

/// Returns `5 s` for ticks of a WAIT.
pub fn ticks(ticks: i64) -> String {
    let ms = ticks * 10;
    if ms < 1000 { format!("{ms} ms") } else { format!("{} s", ms as f64 / 1000.0) }
}
