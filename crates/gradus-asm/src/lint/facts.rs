//! What every rule may ask.

use gradus_tmcl::catalogue::Module;
use gradus_tmcl::{Instruction, Opcode};

use super::options::LintOptions;
use crate::assembler::Assembly;
use crate::flow::{Flow, MAIN, Step};
use crate::loops::{Loop, loops};
use crate::pragma::Pragmas;
use crate::problem::{Edit, Span};
use crate::values::Values;

/// A program with all that its analysis knows.
pub(crate) struct Facts<'a> {
    pub assembly: &'a Assembly,
    pub options: &'a LintOptions,
    pub pragmas: Pragmas,
    pub flow: Flow,
    pub values: Values,
    /// The loops of each part.
    pub loops: Vec<Vec<Loop>>,
    /// The labels by address.
    labels: Vec<Vec<usize>>,
}

impl<'a> Facts<'a> {
    pub fn new(assembly: &'a Assembly, options: &'a LintOptions) -> Self {
        let pragmas = Pragmas::of(assembly);
        let flow = Flow::new(assembly, &pragmas.entries);
        let parts = if flow.is_complete { flow.parts.len() } else { 0 };
        let values = Values::new(assembly, &flow, parts);
        let loops = (0..parts).map(|part| loops(&flow, part)).collect();
        let mut labels = vec![Vec::new(); assembly.program.len() + 1];
        for (index, label) in assembly.labels.iter().enumerate() {
            labels[label.address].push(index);
        }
        Self { assembly, options, pragmas, flow, values, loops, labels }
    }

    pub fn module(&self) -> &'static Module {
        self.assembly.module
    }

    /// The addresses of the commands of the text, with their instructions; not those with errors.
    pub fn commands(&self) -> impl Iterator<Item = (usize, &'a Instruction)> {
        let commands = self.assembly.commands.iter().zip(&self.assembly.program).enumerate();
        commands.filter(|(_, (text, _))| text.is_valid).map(|(address, (_, instruction))| (address, instruction))
    }

    /// Those that some way leads to.
    pub fn reached(&self) -> impl Iterator<Item = (usize, &'a Instruction)> {
        self.commands().filter(|(address, _)| !self.flow.is_complete || self.flow.is_reached(*address))
    }

    /// The instruction at an address.
    pub fn at(&self, address: usize) -> &'a Instruction {
        &self.assembly.program[address]
    }

    pub fn opcode(&self, address: usize) -> Opcode {
        self.at(address).opcode
    }

    /// The place of a command; of an appended STOP the end of the program.
    pub fn span(&self, address: usize) -> Span {
        let last = self.assembly.commands.last().map(|last| last.span());
        self.assembly.commands.get(address).map(|command| command.span()).or(last).unwrap_or_default()
    }

    /// The text of a span.
    pub fn text(&self, span: Span) -> &'a str {
        self.assembly.sources[span.source].slice(span)
    }

    /// The text of a command without label and comment.
    pub fn command(&self, address: usize) -> &'a str {
        self.text(self.span(address))
    }

    /// `line 12`, with the file if that is not the one of `from`.
    pub fn place(&self, address: usize, from: Span) -> String {
        let span = self.span(address);
        let (line, _) = self.assembly.sources[span.source].position(span.start);
        if span.source == from.source {
            return format!("line {line}");
        }
        format!("{}:{line}", self.assembly.sources[span.source].path.display())
    }

    /// The place of an operand by its number; of the whole command if it is not written.
    pub fn operand(&self, address: usize, number: usize) -> Span {
        let operands = self.assembly.commands.get(address).map(|command| &command.operands);
        operands.and_then(|operands| operands.get(number)).copied().unwrap_or_else(|| self.span(address))
    }

    /// The name of what begins at an address: its label, or the address.
    pub fn name(&self, address: usize) -> String {
        match self.label(address) {
            Some(label) => format!("`{}`", self.assembly.labels[label].name),
            None => format!("address {address}"),
        }
    }

    /// The first label of an address.
    pub fn label(&self, address: usize) -> Option<usize> {
        self.labels.get(address)?.first().copied()
    }

    /// True if some label of an address is a way in that is meant: a pragma, or the jump table at the start.
    pub fn is_entry(&self, address: usize) -> bool {
        self.flow.parts[MAIN].entries.binary_search(&address).is_ok()
    }

    /// Where a part begins.
    pub fn start(&self, part: usize) -> usize {
        self.flow.parts[part].entries.first().copied().unwrap_or(0)
    }

    /// Where calls of a command lead.
    pub fn callee(&self, address: usize) -> Option<usize> {
        match self.flow.steps[address] {
            Step::Call(target) | Step::CallIf(target) => self.flow.routines.get(&target).copied(),
            _ => None,
        }
    }

    /// Edits that delete commands, each with its whole line if nothing else stands there.
    pub fn delete(&self, address: usize) -> Vec<Edit> {
        let Some(command) = self.assembly.commands.get(address) else { return Vec::new() };
        let span = command.span();
        let line = self.text(command.line).trim();
        let whole = self.text(span) == line;
        let end = self.assembly.sources[span.source].text.len().min(command.line.end + 1);
        let span = if whole { Span { start: command.line.start, end, ..span } } else { span };
        vec![Edit { span, text: String::new() }]
    }

    /// An edit that inserts a line in front of a command, indented as it is.
    pub fn insert(&self, address: usize, text: &str) -> Vec<Edit> {
        let span = self.span(address);
        let line = self.text(self.assembly.commands[address].line);
        let indent: String = line.chars().take_while(|c| c.is_whitespace()).collect();
        let at = Span { end: span.start, ..span };
        let own = &line[..span.start - self.assembly.commands[address].line.start];
        let text = if own.trim().is_empty() { format!("{text}\n{indent}") } else { format!("{text}\n    ") };
        vec![Edit { span: at, text }]
    }
}
