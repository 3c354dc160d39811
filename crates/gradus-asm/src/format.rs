//! The formatter: one way to write a program.
//!
//! - Labels stand at column 0, alone on their line. A label stays before its command where two and more such lines follow each
//!   other (a jump table), and where a pragma speaks of the line.
//! - Commands are indented by four spaces; mnemonics, keywords and functions are in capitals; `, ` between operands, one space
//!   around `=` and binary operators. Names and numbers stay as they are written. Consecutive constants align their `=`.
//! - Comments keep their text; one space comes behind `//` where a letter follows at once. Those behind the commands of a block
//!   align at one column; those alone on a line have the indentation of the next line.
//! - At most one blank line, none at the ends; LF; UTF-8; a newline at the end.
//!
//! A line with a mistake is left as it is. The program's bytes, its comments and its problems stay the same, and formatting
//! twice is the same as once.

use std::borrow::Cow;

use crate::encoder;
use crate::expression;
use crate::lexer::{Kind, Token, tokens};
use crate::parser::{self, Body};
use crate::problem::Span;
use crate::source::Source;

/// Largest file that is formatted, in bytes.
const MOST: usize = 4 << 20;

/// Where comments behind commands begin, at least and at most.
const COMMENTS: (usize, usize) = (28, 48);

/// Indentation of commands.
const INDENT: &str = "    ";

/// A text in its form.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Formatted {
    /// The new text.
    pub text: String,
    /// The file was Windows-1252.
    pub is_converted: bool,
    /// Lines, from 1, that have a mistake and are left as they are.
    pub left: Vec<usize>,
}

/// Why a file is not formatted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum FormatError {
    /// It is UTF-16 or no text at all.
    #[error("it is no text in UTF-8 or Windows-1252; save it as UTF-8")]
    Encoding,
    /// It is too large.
    #[error("it has more than 4 MB")]
    TooLarge,
}

/// Formats the text of a file.
///
/// # Errors
/// When it is no text, or too large.
pub fn format(bytes: &[u8]) -> Result<Formatted, FormatError> {
    if bytes.len() > MOST {
        return Err(FormatError::TooLarge);
    }
    let source = Source::new("", bytes);
    if source.is_binary() {
        return Err(FormatError::Encoding);
    }
    let mut rows: Vec<Row> = source.text.split('\n').map(row).collect();
    let left = rows.iter().enumerate().filter(|(_, row)| matches!(row.code, Code::Wrong(_))).map(|(at, _)| at + 1);
    let left = left.collect();
    squeeze(&mut rows);
    let rows = split_labels(rows);
    let text = written(&rows);
    Ok(Formatted { text, is_converted: str::from_utf8(bytes).is_err(), left })
}

/// A line in its parts.
struct Row<'a> {
    labels: Vec<String>,
    code: Code<'a>,
    comment: Option<Cow<'a, str>>,
}

/// What a line has besides labels and comment.
enum Code<'a> {
    Nothing,
    Constant(String, String),
    Include(String),
    Command(String),
    /// A line with a mistake.
    Wrong(&'a str),
}

impl Row<'_> {
    fn is_blank(&self) -> bool {
        self.labels.is_empty() && matches!(self.code, Code::Nothing) && self.comment.is_none()
    }

    /// A comment and nothing else.
    fn is_comment(&self) -> bool {
        self.labels.is_empty() && matches!(self.code, Code::Nothing) && self.comment.is_some()
    }

    /// A label in front of something.
    fn is_labelled(&self) -> bool {
        self.labels.len() == 1 && matches!(self.code, Code::Command(_))
    }

    fn is_pragma(&self) -> bool {
        self.comment.as_ref().is_some_and(|comment| comment.contains("gradus:"))
    }
}

fn row(line: &str) -> Row<'_> {
    let line = line.strip_suffix('\r').unwrap_or(line);
    let span = Span { source: 0, start: 0, end: line.len() };
    let mut problems = Vec::new();
    let parsed = parser::line(line, span, &mut problems);
    let comment = parser::comment(line);
    if !problems.is_empty() {
        return Row { labels: Vec::new(), code: Code::Wrong(line), comment: None };
    }
    let labels = parsed.labels.iter().map(|label| label.text.clone()).collect();
    let words = tokens(&line[..comment.unwrap_or(line.len())], span);
    let words = &words[2 * parsed.labels.len().min(words.len() / 2)..];
    let code = match &parsed.body {
        None => Code::Nothing,
        Some(Body::Constant(name, _)) => Code::Constant(name.text.clone(), expression(&words[2.min(words.len())..])),
        Some(Body::Include(name)) => Code::Include(include(&name.text)),
        Some(Body::Command(command)) => Code::Command(self::command(&command.mnemonic.text, words)),
    };
    Row { labels, code, comment: comment.map(|at| spaced(line[at..].trim_end())) }
}

/// A comment with a space behind its sign where a letter follows at once.
fn spaced(comment: &str) -> Cow<'_, str> {
    match comment.strip_prefix("//") {
        Some(text) if text.starts_with(char::is_alphabetic) => format!("// {text}").into(),
        _ => comment.into(),
    }
}

fn include(name: &str) -> String {
    let quoted = name.contains(char::is_whitespace) || name.contains("//");
    if quoted { format!("#include \"{name}\"") } else { format!("#include {name}") }
}

/// A command from its words, the mnemonic first.
fn command(mnemonic: &str, words: &[Token]) -> String {
    let row = encoder::find(mnemonic);
    let is_directive = mnemonic.starts_with('#');
    let operands = words.get(if is_directive { 2 } else { 1 }..).unwrap_or(&[]);
    let mut text = if is_directive { mnemonic.to_lowercase() } else { mnemonic.to_uppercase() };
    for (index, operand) in operands.split(|word| word.kind == Kind::Sign(',')).enumerate() {
        let expected = row.and_then(|row| row.operands.get(index));
        let keyword = match (operand, expected) {
            ([Token { kind: Kind::Name(name), .. }], Some(expected)) => encoder::keyword(name, expected),
            _ => None,
        };
        text.push_str(if index == 0 { " " } else { ", " });
        text.push_str(&keyword.map_or_else(|| expression(operand), |keyword| keyword.text.into()));
    }
    text.trim_end().to_owned()
}

/// An expression with one space around its operators and none behind its signs.
fn expression(words: &[Token]) -> String {
    let mut text = String::new();
    let mut after_value = false;
    for (index, word) in words.iter().enumerate() {
        let called = matches!(words.get(index + 1), Some(Token { kind: Kind::Sign('('), .. }));
        match word.kind {
            Kind::Sign('(') => {
                text.push('(');
                after_value = false;
            }
            Kind::Sign(')') => {
                text.push(')');
                after_value = true;
            }
            Kind::Sign(sign) if after_value => {
                text.extend([' ', sign, ' ']);
                after_value = false;
            }
            Kind::Sign(sign) => text.push(sign),
            Kind::Name(name) if called && expression::is_function(name) => text.push_str(&name.to_uppercase()),
            _ => {
                text.push_str(word.text);
                after_value = true;
            }
        }
    }
    text
}

/// Leaves one blank line of several, and none at the ends.
fn squeeze(rows: &mut Vec<Row>) {
    let mut before_blank = true;
    rows.retain(|row| {
        let keep = !(row.is_blank() && before_blank);
        before_blank = row.is_blank();
        keep
    });
    while rows.last().is_some_and(Row::is_blank) {
        rows.pop();
    }
}

/// Gives labels lines of their own, but those of jump tables and those that a pragma speaks of.
fn split_labels(rows: Vec<Row<'_>>) -> Vec<Row<'_>> {
    let labelled: Vec<_> = rows.iter().map(Row::is_labelled).collect();
    let mut split = Vec::with_capacity(rows.len());
    let mut pragma_above = false;
    for (at, mut row) in rows.into_iter().enumerate() {
        let spoken_of = pragma_above || row.is_pragma();
        let in_table = labelled[at] && (at > 0 && labelled[at - 1] || labelled.get(at + 1) == Some(&true));
        pragma_above = spoken_of && (row.is_comment() || row.is_blank());
        let alone = matches!(row.code, Code::Nothing) && row.labels.len() <= 1;
        if !in_table && !alone && !spoken_of {
            let labels = std::mem::take(&mut row.labels).into_iter();
            split.extend(labels.map(|label| Row { labels: vec![label], code: Code::Nothing, comment: None }));
            if row.is_blank() {
                continue;
            }
        }
        split.push(row);
    }
    split
}

/// The lines as text.
fn written(rows: &[Row]) -> String {
    let codes = codes(rows);
    let (columns, indents) = (columns(rows, &codes), indents(rows));
    let mut text = String::new();
    for (at, row) in rows.iter().enumerate() {
        let code = &codes[at];
        text.push_str(code);
        if let Some(comment) = &row.comment {
            let width = code.chars().count();
            let gap = if row.is_comment() { indents[at] } else { columns[at].saturating_sub(width).max(1) };
            text.extend(std::iter::repeat_n(' ', gap));
            text.push_str(comment);
        }
        text.push('\n');
    }
    text
}

/// The lines without their comments.
fn codes(rows: &[Row]) -> Vec<String> {
    let equals = runs(
        rows,
        |row| matches!(row.code, Code::Constant(..)),
        |row| match &row.code {
            Code::Constant(name, _) => name.chars().count(),
            _ => 0,
        },
    );
    let labels = runs(rows, |row| row.is_labelled(), |row| row.labels[0].chars().count());
    let mut codes = Vec::with_capacity(rows.len());
    for (at, row) in rows.iter().enumerate() {
        let head: String = row.labels.iter().map(|label| format!("{label}: ")).collect();
        codes.push(match &row.code {
            Code::Nothing => head.trim_end().to_owned(),
            Code::Constant(name, value) => format!("{head}{name:width$} = {value}", width = equals[at]),
            Code::Include(line) => format!("{head}{line}"),
            Code::Command(line) if row.labels.is_empty() => format!("{INDENT}{line}"),
            Code::Command(line) => format!("{head:width$}{line}", width = labels[at] + 2),
            Code::Wrong(line) => (*line).to_owned(),
        });
    }
    codes
}

/// For each row the greatest width in its run of rows of one kind.
fn runs(rows: &[Row], is_one: impl Fn(&Row) -> bool, width: impl Fn(&Row) -> usize) -> Vec<usize> {
    let mut widths = vec![0; rows.len()];
    let mut start = 0;
    while start < rows.len() {
        let length = rows[start..].iter().take_while(|row| is_one(row)).count();
        let widest = rows[start..start + length].iter().map(&width).max().unwrap_or(0);
        widths[start..start + length].fill(widest);
        start += length.max(1);
    }
    widths
}

/// For each row the column of its comment: one for a block, which ends at a blank line and at a comment of its own.
fn columns(rows: &[Row], codes: &[String]) -> Vec<usize> {
    let (least, most) = COMMENTS;
    let mut columns = vec![least; rows.len()];
    let mut start = 0;
    while start < rows.len() {
        let inside = |row: &&Row| !row.is_blank() && !row.is_comment() && !matches!(row.code, Code::Wrong(_));
        let length = rows[start..].iter().take_while(inside).count();
        let block = start..start + length;
        let widths = block.clone().filter(|at| rows[*at].comment.is_some()).map(|at| codes[at].chars().count() + 1);
        let widest = widths.filter(|width| *width <= most).max().unwrap_or(0);
        columns[block].fill(widest.max(least).next_multiple_of(4).min(most));
        start += length.max(1);
    }
    columns
}

/// For each row the indentation of the next one that is neither blank nor a comment: comments have it too.
fn indents(rows: &[Row]) -> Vec<usize> {
    let mut next = 0;
    let mut indents: Vec<_> = rows
        .iter()
        .rev()
        .map(|row| {
            if !row.is_comment() && !row.is_blank() {
                let is_command = matches!(row.code, Code::Command(_)) && row.labels.is_empty();
                next = if is_command { INDENT.len() } else { 0 };
            }
            next
        })
        .collect();
    indents.reverse();
    indents
}
