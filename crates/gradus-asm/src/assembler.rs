//! From source text to a program.

use std::path::{Path, PathBuf};

use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Instruction, Opcode};

use crate::builtin::BUILT_IN;
use crate::check::check;
use crate::code::Code;
use crate::comments::appends_no_stop;
use crate::encoder::{Encoded, encode};
use crate::names::Names;
use crate::parser::{self, Body, Command};
use crate::problem::{Problem, Span};
use crate::reader::{Load, Placed, Reader};
use crate::source::Source;
use crate::uses::{Use, uses};

/// What can be chosen about an assembly.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// Append no STOP.
    pub no_stop: bool,
    /// Folders to look in for included files, after the folder of the including file.
    pub include_dirs: Vec<PathBuf>,
    /// Constants from outside, each written as in a program: `Speed = 1000`.
    pub constants: Vec<String>,
}

/// What messages and listings call the constants of [`Options::constants`].
pub(crate) const OUTSIDE: &str = "constants from outside";

/// A label with its address.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Label {
    /// As it is written where it is defined.
    pub name: String,
    /// Address of the command behind it.
    pub address: usize,
    /// Where it is defined.
    pub span: Span,
}

/// A constant with its value.
#[derive(Clone, PartialEq, Debug)]
pub struct Constant {
    /// As it is written where it is defined.
    pub name: String,
    /// Not rounded.
    pub value: f64,
    /// Where it is defined.
    pub span: Span,
}

/// A command as it stands in the text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CommandText {
    /// The whole line.
    pub line: Span,
    /// The mnemonic.
    pub mnemonic: Span,
    /// The operands, as many as are written.
    pub operands: Vec<Span>,
    /// False for a command with an error, of which the program holds only its place.
    pub is_valid: bool,
}

impl CommandText {
    /// The command without labels and comment.
    pub fn span(&self) -> Span {
        self.operands.last().map_or(self.mnemonic, |last| self.mnemonic.to(*last))
    }
}

/// A program with all that is known about it.
#[derive(Clone, Debug)]
pub struct Assembly {
    /// The module that it is for.
    pub module: &'static Module,
    /// The commands. One with an error stands here as a command 0, so that the others keep their addresses.
    pub program: Vec<Instruction>,
    /// The text of each command; an appended STOP has none.
    pub commands: Vec<CommandText>,
    /// The labels in the order of the text.
    pub labels: Vec<Label>,
    /// The constants in the order of the text, those of built-in files included.
    pub constants: Vec<Constant>,
    /// Where labels and constants are used, in the order of the text.
    pub uses: Vec<Use>,
    /// The comments with their `//`, in the order of the text; not those of built-in files.
    pub comments: Vec<Span>,
    /// What is wrong, in the order of the text.
    pub problems: Vec<Problem>,
    /// The files, the program's own first.
    pub sources: Vec<Source>,
}

impl Assembly {
    /// True when the program should not be used.
    pub fn has_errors(&self) -> bool {
        self.problems.iter().any(Problem::is_error)
    }
}

/// Assembles the text of the file `path` for a module. `load` gives the files that it includes.
pub fn assemble(
    path: impl Into<PathBuf>,
    text: &[u8],
    module: &'static Module,
    options: &Options,
    load: &Load,
) -> Assembly {
    let mut problems = Vec::new();
    let reader = Reader::new(module, &options.include_dirs, load, &mut problems);
    let outside = options.constants.join("\n");
    let outside = (!outside.is_empty()).then(|| Source::new(OUTSIDE, outside.as_bytes()));
    let mut text = reader.read(Source::new(path, text), outside);
    text.names.resolve(&mut problems);

    let encoded: Vec<_> = text.commands.iter().map(|line| encode(&line.command, &text.names, &mut problems)).collect();
    let mut program: Vec<_> = encoded.iter().map(instruction).collect();
    let stopped = program.last().is_some_and(|last| last.opcode == Opcode::STOP) && !text.label_at_end;
    let no_stop = options.no_stop || appends_no_stop(&text.comments, &text.sources);
    if !stopped && !no_stop {
        program.push(Instruction::new(Opcode::STOP, 0, 0, 0));
    }
    problems.extend(encoded.iter().flatten().flat_map(|encoded| check(encoded, module, program.len())));
    problems.extend(too_long(&program, &text.commands, module));
    problems.sort_by_key(|problem| (problem.span.source, problem.span.start));

    let commands = text.commands.iter().zip(&encoded).map(|(placed, encoded)| command_text(placed, encoded.is_some()));
    Assembly {
        module,
        program,
        commands: commands.collect(),
        labels: labels(&text.names),
        constants: constants(&text.names),
        uses: uses(&text),
        comments: text.comments,
        problems,
        sources: text.sources,
    }
}

fn command_text(placed: &Placed, is_valid: bool) -> CommandText {
    let Command { mnemonic, operands } = &placed.command;
    let operands = operands.iter().map(|operand| operand.span).collect();
    CommandText { line: placed.line, mnemonic: mnemonic.span, operands, is_valid }
}

fn instruction(encoded: &Option<Encoded>) -> Instruction {
    encoded.as_ref().map_or(Instruction::default(), |encoded| encoded.instruction)
}

fn too_long(program: &[Instruction], commands: &[Placed], module: &Module) -> Option<Problem> {
    let memory = module.memory();
    if program.len() <= memory {
        return None;
    }
    let at = commands.get(memory).or(commands.last())?.command.mnemonic.span;
    let message = format!("the program has {} commands, the {} holds {memory}", program.len(), module.name);
    Some(Problem::error(Code::ProgramTooLong, at, message))
}

fn labels(names: &Names) -> Vec<Label> {
    let label = |name: &parser::Name, address| Label { name: name.text.clone(), address, span: name.span };
    names.labels().map(|(name, address)| label(name, address as usize)).collect()
}

fn constants(names: &Names) -> Vec<Constant> {
    names.constants().map(|(name, value)| Constant { name: name.text.clone(), value, span: name.span }).collect()
}

/// Assembles one command for direct mode, with the names of the built-in files at hand.
///
/// What the module has is not looked at: the module itself answers that.
///
/// # Errors
/// When the text is not one command, or a malformed one. The spans are those of a source that has only this text.
pub fn assemble_line(text: &str, module: &'static Module) -> Result<Instruction, Vec<Problem>> {
    let mut problems = Vec::new();
    let prelude: String = BUILT_IN.iter().map(|file| format!("#include {file}\n")).collect();
    let nothing = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
    let mut names =
        Reader::new(module, &[], &nothing, &mut problems).read(Source::new("", prelude.as_bytes()), None).names;
    names.resolve(&mut problems);

    let span = Span { source: 0, start: 0, end: text.len() };
    let instruction = command(text, span, &mut problems).and_then(|command| encode(&command, &names, &mut problems));
    match instruction {
        Some(encoded) if problems.is_empty() => Ok(encoded.instruction),
        _ => Err(problems),
    }
}

/// The command that is all of a text.
fn command(text: &str, span: Span, problems: &mut Vec<Problem>) -> Option<Command> {
    let line = parser::line(text, span, problems);
    match line.body {
        Some(Body::Command(command)) if line.labels.is_empty() => Some(command),
        _ if problems.is_empty() => {
            problems.push(Problem::error(Code::Syntax, span, "one command is expected here"));
            None
        }
        _ => None,
    }
}
