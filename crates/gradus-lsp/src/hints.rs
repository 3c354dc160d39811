//! What an editor writes into and above the lines: quantities, addresses, numbers of references, colours.

use gradus_asm::{Defined, Span};
use gradus_tmcl::catalogue::{Ap, OperandKind, Unit};
use gradus_tmcl::{Instruction, Opcode};

use crate::analysis::Analysis;
use crate::describe;
use crate::symbols::{self, SymbolKind};

/// A few words between the letters of a line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InlayHint {
    /// The file.
    pub source: usize,
    /// Byte behind which it stands.
    pub at: usize,
    /// The words.
    pub label: String,
    /// True for a name of what stands before, false for a quantity.
    pub is_name: bool,
}

/// What the editor shows between the letters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HintSettings {
    /// The address before each command.
    pub addresses: bool,
}

/// Returns the hints of the commands that lie in a span.
pub fn inlay_hints(analysis: &Analysis, within: Span, settings: HintSettings) -> Vec<InlayHint> {
    let commands = analysis.assembly.commands.iter().enumerate();
    let here = commands.filter(|(_, text)| text.line.source == within.source);
    let here = here.filter(|(_, text)| text.line.start <= within.end && text.line.end >= within.start);
    let mut hints = Vec::new();
    for (address, text) in here {
        let source = text.line.source;
        if settings.addresses {
            hints.push(InlayHint { source, at: text.mnemonic.start, label: format!("{address}:"), is_name: true });
        }
        for (index, span) in text.operands.iter().enumerate() {
            let hint = operand_hint(analysis, address, index, *span);
            hints.extend(hint.map(|(label, is_name)| InlayHint { source, at: span.end, label, is_name }));
        }
    }
    hints
}

fn operand_hint(analysis: &Analysis, address: usize, index: usize, span: Span) -> Option<(String, bool)> {
    let (instruction, row) = analysis.command(address)?;
    let operand = row.operands.get(index)?;
    let value = operand.get(instruction);
    let is_number = analysis.slice(span).starts_with(|letter: char| letter.is_ascii_digit() || letter == '-');
    match operand.kind {
        OperandKind::Ticks if value > 0 => Some((format!("= {}", describe::ticks(value)), false)),
        OperandKind::AxisParameter if is_number => {
            let row = analysis.module().axis_parameter(u8::try_from(value).ok()?)?;
            Some((row.name.to_owned(), true))
        }
        OperandKind::GlobalParameter if is_number && instruction.motor != 2 => {
            let row = analysis.module().global_parameter(instruction.motor, u8::try_from(value).ok()?)?;
            Some((row.name.to_owned(), true))
        }
        OperandKind::Number => turns(analysis, instruction).map(|text| (format!("= {text}"), false)),
        _ => None,
    }
}

/// A speed in turns per second, where the program sets the microsteps of the axis.
fn turns(analysis: &Analysis, instruction: &Instruction) -> Option<String> {
    const FULL_STEPS: f64 = 200.0;
    let is_speed = match instruction.opcode {
        Opcode::ROR | Opcode::ROL => instruction.value != 0,
        Opcode::SAP => analysis.module().axis_parameter(instruction.kind).is_some_and(|row| row.unit == Unit::Pps),
        _ => false,
    };
    let pps_module =
        analysis.module().axis_parameters.iter().any(|row| row.id == Ap::MaxSpeed && row.unit == Unit::Pps);
    if !is_speed || !pps_module {
        return None;
    }
    let microsteps = f64::from(1_u32 << microstep_resolution(analysis, instruction.motor)?);
    let rps = f64::from(instruction.value) / (FULL_STEPS * microsteps);
    Some(format!("{} rps", (rps * 1000.0).round() / 1000.0))
}

/// The microstep resolution that the program sets for an axis, if it sets one only.
fn microstep_resolution(analysis: &Analysis, axis: u8) -> Option<u32> {
    let row = analysis.module().axis_parameters.iter().find(|row| row.id == Ap::MicrostepResolution)?;
    let sets = |it: &&Instruction| it.opcode == Opcode::SAP && it.motor == axis && it.kind == row.number;
    let mut found = analysis.assembly.program.iter().filter(sets).map(|it| it.value);
    let first = found.next()?;
    if found.any(|other| other != first) { None } else { u32::try_from(first).ok().filter(|value| *value <= 8) }
}

/// A line above a definition.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Lens {
    /// The name that it is about.
    pub span: Span,
    /// `3 references`.
    pub title: String,
}

/// Returns the lenses of a file: how often each label is used.
pub fn lenses(analysis: &Analysis, source: usize) -> Vec<Lens> {
    let labels = analysis.assembly.labels.iter().enumerate().filter(|(_, label)| label.span.source == source);
    let lens = |(index, label): (usize, &gradus_asm::Label)| {
        let count = analysis.references(Defined::Label(index)).count();
        let title = if count == 1 { "1 reference".to_owned() } else { format!("{count} references") };
        Lens { span: label.span, title }
    };
    labels.map(lens).collect()
}

/// What a piece of text is, for its colour.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum TokenKind {
    /// A mnemonic.
    Mnemonic,
    /// `ABS`, `TICKS`, ...
    Keyword,
    /// A label that is called.
    Routine,
    /// Any other label.
    Label,
    /// A constant.
    Constant,
    /// A constant that is used for a parameter number.
    Parameter,
    /// A constant that is used for a user variable.
    Variable,
    /// A number.
    Number,
    /// A comment.
    Comment,
}

/// A coloured piece of text.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Token {
    /// Where.
    pub span: Span,
    /// What it is.
    pub kind: TokenKind,
    /// It is where the name is defined.
    pub is_definition: bool,
    /// Nothing uses the name.
    pub is_unused: bool,
}

/// Returns the colours of a file, in the order of the text and without overlaps.
pub fn tokens(analysis: &Analysis, source: usize) -> Vec<Token> {
    let plain = |span: Span, kind| Token { span, kind, is_definition: false, is_unused: false };
    let mut tokens: Vec<_> = analysis.assembly.comments.iter().map(|span| plain(*span, TokenKind::Comment)).collect();
    for (address, text) in analysis.assembly.commands.iter().enumerate() {
        tokens.push(plain(text.mnemonic, TokenKind::Mnemonic));
        for (index, span) in text.operands.iter().enumerate() {
            tokens.extend(operand_token(analysis, address, index, *span).map(|kind| plain(*span, kind)));
        }
    }
    tokens.extend(analysis.assembly.uses.iter().map(|used| plain(used.span, name_kind(analysis, used.of))));
    tokens.extend(analysis.definitions().map(|(span, of)| Token {
        span,
        kind: name_kind(analysis, of),
        is_definition: true,
        is_unused: analysis.references(of).next().is_none(),
    }));
    tokens.retain(|token| token.span.source == source && token.span.start < token.span.end);
    tokens.sort_by_key(|token| (token.span.start, token.span.end));
    let mut until = 0;
    tokens.retain(|token| {
        let is_free = token.span.start >= until;
        until = if is_free { token.span.end } else { until };
        is_free
    });
    tokens
}

fn operand_token(analysis: &Analysis, address: usize, index: usize, span: Span) -> Option<TokenKind> {
    let text = analysis.slice(span);
    let is_number = text.starts_with(|letter: char| letter.is_ascii_digit() || matches!(letter, '$' | '%' | '-' | '+'));
    let is_plain =
        text.chars().all(|letter| letter.is_ascii_alphanumeric() || matches!(letter, '$' | '%' | '-' | '+' | '.'));
    if is_number && is_plain {
        return Some(TokenKind::Number);
    }
    let (_, row) = analysis.command(address)?;
    let operand = row.operands.get(index)?;
    operand.keyword(text, analysis.module()).map(|_| TokenKind::Keyword)
}

fn name_kind(analysis: &Analysis, of: Defined) -> TokenKind {
    match of {
        Defined::Label(index) => match symbols::label_kind(analysis, analysis.label(index).address) {
            SymbolKind::Routine | SymbolKind::Handler => TokenKind::Routine,
            _ => TokenKind::Label,
        },
        Defined::Constant(_) => constant_kind(analysis, of),
    }
}

/// What a constant is used for first.
fn constant_kind(analysis: &Analysis, of: Defined) -> TokenKind {
    let Some(span) = analysis.references(of).next() else { return TokenKind::Constant };
    match analysis.operand_around(span).map(|(instruction, operand)| (operand.kind, instruction.motor)) {
        Some((OperandKind::AxisParameter, _)) => TokenKind::Parameter,
        Some((OperandKind::Variable, _)) | Some((OperandKind::GlobalParameter, 2)) => TokenKind::Variable,
        Some((OperandKind::GlobalParameter, _)) => TokenKind::Parameter,
        _ => TokenKind::Constant,
    }
}
