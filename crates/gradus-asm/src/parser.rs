//! One line of source text: `[label:] [MNEMONIC operands] [// comment]`.
//!
//! Besides commands there are `NAME = expression`, `#include file` and `#data opcode, type, motor, value`. The last is an
//! addition of ours: a command in plain numbers, so that every program memory can be written as source text. `DATA` without
//! the sign, as direct mode has it, is the same.

use crate::code::Code;
use crate::dialects;
use crate::expression::{Expression, unexpected};
use crate::lexer::{self, Kind, Token, tokens};
use crate::problem::{Problem, Span};

/// A name where it is defined or a mnemonic where it is used.
#[derive(Clone, Debug)]
pub(crate) struct Name {
    pub text: String,
    pub span: Span,
}

/// What a line holds.
pub(crate) struct Line {
    pub labels: Vec<Name>,
    pub body: Option<Body>,
}

pub(crate) enum Body {
    Constant(Name, Expression),
    /// The file's name without quotes.
    Include(Name),
    Command(Command),
}

/// A command as written.
pub(crate) struct Command {
    pub mnemonic: Name,
    pub operands: Vec<Expression>,
}

/// The word of the directive for another file, behind its sign.
const INCLUDE: &str = "include";

/// The directive for a command in plain numbers.
pub(crate) const DATA: &str = "#data";

/// Reads a line; `span` is its place. A line that is partly wrong gives what could be read.
pub(crate) fn line(text: &str, span: Span, problems: &mut Vec<Problem>) -> Line {
    if let Some(body) = include(text, span, problems) {
        return Line { labels: Vec::new(), body };
    }
    let words = tokens(before_foreign_comment(text, span, problems), span);
    let (labels, rest) = labels(&words);
    let body = match body(rest, problems) {
        Ok(body) => body,
        Err(problem) => {
            problems.push(problem);
            None
        }
    };
    Line { labels, body }
}

/// The line up to a comment in the manner of another language, which is reported.
fn before_foreign_comment<'a>(text: &'a str, span: Span, problems: &mut Vec<Problem>) -> &'a str {
    let Some((at, sign)) = dialects::comment(lexer::code(text)) else { return text };
    let span = Span { start: span.start + at, end: span.start + at + sign.len(), ..span };
    let problem = Problem::error(Code::Syntax, span, format!("`{sign}` cannot stand here"));
    problems.push(problem.help("comments begin with //"));
    &text[..at]
}

/// Where the comment of a line begins. The name of an included file in quotes may hold `//`.
pub(crate) fn comment(text: &str) -> Option<usize> {
    let quoted = if text.trim_start().starts_with('#') { quoted(text) } else { 0 };
    text.get(quoted..)?.find("//").map(|at| quoted + at)
}

/// Length of a line up to the end of what stands in quotes, 0 where nothing does.
fn quoted(text: &str) -> usize {
    let mut quotes = text.match_indices('"').map(|(at, _)| at + 1);
    let before = lexer::code(text).len();
    match (quotes.next(), quotes.next()) {
        (Some(open), Some(close)) if open <= before => close,
        _ => 0,
    }
}

/// `Some` if the line is an `#include`.
fn include(text: &str, span: Span, problems: &mut Vec<Problem>) -> Option<Option<Body>> {
    let rest = text.trim_start();
    let directive = rest.strip_prefix('#')?.trim_start();
    let (word, operand) = directive.split_at_checked(INCLUDE.len())?;
    if !word.eq_ignore_ascii_case(INCLUDE) {
        return None;
    }
    match file_name(operand) {
        Some(name) => {
            let start = span.start + (name.as_ptr().addr() - text.as_ptr().addr());
            let span = Span { start, end: start + name.len(), ..span };
            Some(Some(Body::Include(Name { text: name.to_owned(), span })))
        }
        None => {
            let start = span.start + text.len() - rest.len();
            let span = Span { start, end: start + rest.len() - operand.len(), ..span };
            let problem = Problem::error(Code::Syntax, span, "the name of a file is missing here");
            problems.push(problem.help("write #include TMCLParam.tmc or #include \"my file.tmc\""));
            Some(None)
        }
    }
}

/// The name with or without quotes, in front of a comment.
fn file_name(operand: &str) -> Option<&str> {
    let name = match operand.trim_start().strip_prefix('"') {
        Some(quoted) => quoted.split_once('"').filter(|(_, rest)| lexer::code(rest).trim().is_empty())?.0,
        None => lexer::code(operand).trim(),
    };
    (!name.is_empty()).then_some(name)
}

/// The labels at the start of a line, and the rest.
fn labels<'a, 't>(mut tokens: &'t [Token<'a>]) -> (Vec<Name>, &'t [Token<'a>]) {
    let mut labels = Vec::new();
    while let [Token { kind: Kind::Name(name), span, .. }, Token { kind: Kind::Sign(':'), .. }, rest @ ..] = tokens {
        labels.push(Name { text: (*name).to_owned(), span: *span });
        tokens = rest;
    }
    (labels, tokens)
}

fn body(tokens: &[Token], problems: &mut Vec<Problem>) -> Result<Option<Body>, Problem> {
    match tokens {
        [] => Ok(None),
        [Token { kind: Kind::Name(name), span, .. }, Token { kind: Kind::Sign('='), span: equals, .. }, value @ ..] => {
            let name = Name { text: (*name).to_owned(), span: *span };
            Ok(Some(Body::Constant(name, expression(value, *equals, problems))))
        }
        [Token { kind: Kind::Name(name), span, .. }, operands @ ..] => {
            let mnemonic = Name { text: (*name).to_owned(), span: *span };
            Ok(Some(command(mnemonic, operands, problems)))
        }
        [
            Token { kind: Kind::Sign('#'), span: hash, .. },
            Token { kind: Kind::Name(name), span, .. },
            operands @ ..,
        ] => {
            let directive = Name { text: format!("#{}", name.to_lowercase()), span: hash.to(*span) };
            directive_body(directive, operands, problems)
        }
        [first, ..] => Err(unexpected(first).help("a line is a command, `NAME = value`, `label:` or `#include file`")),
    }
}

fn directive_body(directive: Name, operands: &[Token], problems: &mut Vec<Problem>) -> Result<Option<Body>, Problem> {
    if directive.text == DATA {
        return Ok(Some(command(directive, operands, problems)));
    }
    let problem = Problem::error(Code::Syntax, directive.span, format!("no directive named `{}`", directive.text));
    Err(problem.maybe_help(crate::nearest::hint(&directive.text, ["#include", DATA])))
}

fn command(mnemonic: Name, tokens: &[Token], problems: &mut Vec<Problem>) -> Body {
    let mut operands = Vec::new();
    let mut before = mnemonic.span;
    if !tokens.is_empty() {
        for operand in tokens.split_inclusive(|token| token.kind == Kind::Sign(',')) {
            let (words, comma) = match operand {
                [words @ .., Token { kind: Kind::Sign(','), span, .. }] => (words, *span),
                words => (words, before),
            };
            operands.push(expression(words, comma, problems));
            before = comma;
        }
        if let Some(Token { kind: Kind::Sign(','), span, .. }) = tokens.last() {
            operands.push(expression(&[], *span, problems));
        }
    }
    Body::Command(Command { mnemonic, operands })
}

fn expression(tokens: &[Token], at: Span, problems: &mut Vec<Problem>) -> Expression {
    Expression::parse(tokens, at).unwrap_or_else(|problem| {
        let span = problem.span;
        problems.push(problem);
        Expression::broken(span)
    })
}
