//! Problems as data: what is wrong, where, what to do about it, and the change that does it.
//!
//! Front ends show them as they like: text with a caret ([`render`](crate::render)), a list in an editor, JSON.

use crate::code::Code;

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

/// How bad it is; the worst is the greatest.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Severity {
    /// Worth a look: often right, or a matter of style.
    Hint,
    /// The program is complete, but the module will hardly do what its author expects.
    Warning,
    /// The program is not what its author wrote.
    Error,
}

impl Severity {
    /// As it is printed and as other tools see it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Hint => "hint",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Another place that belongs to a problem: the first definition, the call, the comparison.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Note {
    /// Where.
    pub span: Span,
    /// What is there: `the first one`.
    pub text: String,
}

/// A piece of text that takes the place of another.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Edit {
    /// What is replaced; an empty span is a place to insert at.
    pub span: Span,
    /// What comes there.
    pub text: String,
}

/// A change of the text that removes a problem.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fix {
    /// What it does, as a menu shows it: `delete the label`.
    pub title: String,
    /// True if the program's bytes stay the same.
    pub safe: bool,
    /// What is changed, in the order of the text.
    pub edits: Vec<Edit>,
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
    /// Another place that belongs to it.
    pub note: Option<Box<Note>>,
    /// What to do about it.
    pub help: Option<String>,
    /// A change that removes it.
    pub fix: Option<Box<Fix>>,
}

impl Problem {
    /// An error.
    pub(crate) fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, code, message: message.into(), span, note: None, help: None, fix: None }
    }

    /// A warning.
    pub(crate) fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// A hint.
    pub(crate) fn hint(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Hint, ..Self::error(code, span, message) }
    }

    /// The same with another place.
    pub(crate) fn note(self, span: Span, text: impl Into<String>) -> Self {
        Self { note: Some(Box::new(Note { span, text: text.into() })), ..self }
    }

    /// The same with a change that keeps the program's bytes.
    pub(crate) fn safe_fix(self, title: impl Into<String>, edits: Vec<Edit>) -> Self {
        Self { fix: Some(Box::new(Fix { title: title.into(), safe: true, edits })), ..self }
    }

    /// The same with a change of the program.
    pub(crate) fn unsafe_fix(self, title: impl Into<String>, edits: Vec<Edit>) -> Self {
        Self { fix: Some(Box::new(Fix { title: title.into(), safe: false, edits })), ..self }
    }

    /// The same with an advice.
    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// The same with an advice if there is one.
    pub(crate) fn maybe_help(self, help: Option<String>) -> Self {
        Self { help, ..self }
    }

    /// True if the program should not be used.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
