//! A program as the server knows it: assembled, linted, with the lines of its files.

use std::path::Path;

use gradus_asm::{Assembly, Constant, Defined, Label, Problem, Source, Span};
use gradus_tmcl::catalogue::{self, Command, Operand};
use gradus_tmcl::{Instruction, Opcode};

use crate::text::Lines;

/// A program with all that is known about it.
#[derive(Debug)]
pub struct Analysis {
    /// The program.
    pub assembly: Assembly,
    /// What assembler and linter have to say, in the order of the text.
    pub problems: Vec<Problem>,
    /// The lines of each file.
    pub lines: Vec<Lines>,
}

/// A name where it stands, at its definition or where it is used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NameAt {
    /// Where.
    pub span: Span,
    /// What it stands for.
    pub of: Defined,
}

/// A command that leads to a label: CSUB, CALL, or VECT.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Call {
    /// Address of the command.
    pub from: usize,
    /// Address that it leads to.
    pub to: usize,
}

impl Analysis {
    /// Puts together what is known about a program.
    pub fn new(assembly: Assembly, problems: Vec<Problem>) -> Self {
        let lines = assembly.sources.iter().map(|source| Lines::of(&source.text)).collect();
        Self { assembly, problems, lines }
    }

    /// Returns the number of a file of the program.
    pub fn source_at(&self, path: &Path) -> Option<usize> {
        self.assembly.sources.iter().position(|source| !source.built_in && source.path == path)
    }

    /// Returns a file of the program.
    pub fn source(&self, span: Span) -> &Source {
        &self.assembly.sources[span.source]
    }

    /// Returns the text of a span.
    pub fn slice(&self, span: Span) -> &str {
        self.source(span).slice(span)
    }

    /// Returns the module that the program is for.
    pub fn module(&self) -> &'static catalogue::Module {
        self.assembly.module
    }

    /// Returns a label.
    pub fn label(&self, index: usize) -> &Label {
        &self.assembly.labels[index]
    }

    /// Returns a constant.
    pub fn constant(&self, index: usize) -> &Constant {
        &self.assembly.constants[index]
    }

    /// Returns the name at a byte of a file.
    pub fn name_at(&self, source: usize, offset: usize) -> Option<NameAt> {
        let touches = |span: &Span| span.source == source && (span.start..=span.end).contains(&offset);
        let used = self.assembly.uses.iter().find(|used| touches(&used.span));
        used.map(|used| NameAt { span: used.span, of: used.of })
            .or_else(|| self.definitions().find(|(span, _)| touches(span)).map(|(span, of)| NameAt { span, of }))
    }

    /// Returns all definitions with their places; constants from outside have none that counts.
    pub fn definitions(&self) -> impl Iterator<Item = (Span, Defined)> {
        let labels = self.assembly.labels.iter().enumerate().map(|(index, label)| (label.span, Defined::Label(index)));
        let constants = self.assembly.constants.iter().enumerate();
        labels.chain(constants.map(|(index, constant)| (constant.span, Defined::Constant(index))))
    }

    /// Returns where a name is defined.
    pub fn definition(&self, of: Defined) -> Span {
        match of {
            Defined::Label(index) => self.label(index).span,
            Defined::Constant(index) => self.constant(index).span,
        }
    }

    /// Returns the name as its definition writes it.
    pub fn name(&self, of: Defined) -> &str {
        match of {
            Defined::Label(index) => &self.label(index).name,
            Defined::Constant(index) => &self.constant(index).name,
        }
    }

    /// Returns where a name is used, in the order of the text.
    pub fn references(&self, of: Defined) -> impl Iterator<Item = Span> {
        self.assembly.uses.iter().filter(move |used| used.of == of).map(|used| used.span)
    }

    /// Returns the address of the command on the line of a byte.
    pub fn command_at(&self, source: usize, offset: usize) -> Option<usize> {
        let commands = &self.assembly.commands;
        commands
            .iter()
            .position(|text| text.line.source == source && (text.line.start..=text.line.end).contains(&offset))
    }

    /// Returns a command of the program with its row in the catalogue; `None` for one with an error.
    pub fn command(&self, address: usize) -> Option<(&Instruction, &'static Command)> {
        let is_valid = self.assembly.commands.get(address).is_none_or(|text| text.is_valid);
        let instruction = self.assembly.program.get(address).filter(|_| is_valid)?;
        Some((instruction, Command::of(instruction.opcode)?))
    }

    /// Returns the operand that a name stands in, with its command.
    pub fn operand_around(&self, name: Span) -> Option<(&Instruction, &'static Operand)> {
        let address = self.command_at(name.source, name.start)?;
        let operands = &self.assembly.commands.get(address)?.operands;
        let index = operands.iter().position(|operand| operand.start <= name.start && name.end <= operand.end)?;
        let (instruction, row) = self.command(address)?;
        Some((instruction, row.operands.get(index)?))
    }

    /// Returns every CSUB, CALL and VECT of the program.
    pub fn calls(&self) -> impl Iterator<Item = Call> {
        let program = self.assembly.program.iter().enumerate();
        let calls = program.filter(|(_, it)| matches!(it.opcode, Opcode::CSUB | Opcode::CALL | Opcode::VECT));
        calls.filter_map(|(from, it)| Some(Call { from, to: usize::try_from(it.value).ok()? }))
    }

    /// Returns the routine or handler that a command stands in: the last label before it that is called. Main has none.
    pub fn routine_at(&self, address: usize) -> Option<usize> {
        let labels = self.assembly.labels.iter().enumerate();
        let called = labels.filter(|(_, label)| label.address <= address && self.is_called(label.address));
        called.max_by_key(|(_, label)| label.address).map(|(index, _)| index)
    }

    /// True if a CSUB, CALL or VECT leads to an address.
    pub fn is_called(&self, address: usize) -> bool {
        self.calls().any(|call| call.to == address)
    }

    /// True if a VECT leads to an address.
    pub fn is_handler(&self, address: usize) -> bool {
        self.calls().any(|call| call.to == address && self.assembly.program[call.from].opcode == Opcode::VECT)
    }
}
