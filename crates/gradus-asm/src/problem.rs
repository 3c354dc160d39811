//! Problems as data: what is wrong, where, and what to do about it.
//!
//! Front ends show them as they like: text with a caret ([`render`](crate::render)), a list in an editor, JSON.

/// A piece of a source text.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Span {
    /// Index into [`Assembly::sources`](crate::Assembly::sources).
    pub source: usize,
    /// First byte.
    pub start: usize,
    /// Byte after the last one.
    pub end: usize,
}

impl Span {
    /// From the start of this span to the end of a later one in the same source.
    pub fn to(self, last: Span) -> Span {
        Span { end: last.end.max(self.start), ..self }
    }
}

/// How bad it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Severity {
    /// The program is not what its author wrote.
    Error,
    /// The program is complete, but the module will hardly do what its author expects.
    Warning,
}

/// What kind of problem it is. The names stay the same from version to version.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Code {
    /// The line or an expression is malformed.
    Syntax,
    /// No module has a command of that name.
    UnknownCommand,
    /// Other modules have this command.
    CommandNotAvailable,
    /// Too few or too many operands.
    OperandCount,
    /// No label or constant of that name.
    UnknownName,
    /// The keyword exists, but not for this command on this module.
    KeywordNotAvailable,
    /// A label or constant is defined twice.
    Duplicate,
    /// A file is no text in UTF-8 or Windows-1252.
    Encoding,
    /// An included file does not exist or cannot be read.
    Include,
    /// A file includes itself, perhaps through others.
    IncludeCycle,
    /// A constant is defined by itself, perhaps through others.
    ConstantCycle,
    /// An expression without a finite value.
    Arithmetic,
    /// A value that its field or its parameter does not take.
    OutOfRange,
    /// The module has no such axis, parameter, bank, port, interrupt or coordinate.
    NotOnModule,
    /// A parameter or port that can only be read is written.
    ReadOnly,
    /// A parameter without a place in the EEPROM is stored or restored.
    NotStored,
    /// A jump to an address without a command.
    JumpTarget,
    /// More commands than the module's memory holds.
    ProgramTooLong,
}

impl Code {
    /// As it is printed and as other tools see it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Syntax => "syntax",
            Self::UnknownCommand => "unknown-command",
            Self::CommandNotAvailable => "command-not-available",
            Self::OperandCount => "operand-count",
            Self::UnknownName => "unknown-name",
            Self::KeywordNotAvailable => "keyword-not-available",
            Self::Duplicate => "duplicate",
            Self::Encoding => "encoding",
            Self::Include => "include",
            Self::IncludeCycle => "include-cycle",
            Self::ConstantCycle => "constant-cycle",
            Self::Arithmetic => "arithmetic",
            Self::OutOfRange => "out-of-range",
            Self::NotOnModule => "not-on-module",
            Self::ReadOnly => "read-only",
            Self::NotStored => "not-stored",
            Self::JumpTarget => "jump-target",
            Self::ProgramTooLong => "program-too-long",
        }
    }
}

/// Something wrong in a source text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Problem {
    /// How bad it is.
    pub severity: Severity,
    /// What kind it is.
    pub code: Code,
    /// What is wrong, one line.
    pub message: String,
    /// Where.
    pub span: Span,
    /// The first definition, when this is a second one.
    pub first: Option<Span>,
    /// What to do about it.
    pub help: Option<String>,
}

impl Problem {
    /// An error.
    pub(crate) fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, code, message: message.into(), span, first: None, help: None }
    }

    /// A warning.
    pub(crate) fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// The same with a hint.
    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// The same with a hint if there is one.
    pub(crate) fn maybe_help(self, help: Option<String>) -> Self {
        Self { help, ..self }
    }

    /// True unless it is a warning.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
