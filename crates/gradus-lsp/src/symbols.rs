//! Names and where they are: outline, search, folding, highlights, renaming, calls.

use gradus_asm::{Defined, Span};
use gradus_tmcl::Opcode;

use crate::analysis::{Analysis, NameAt};

/// What a name is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SymbolKind {
    /// A label that CSUB or CALL leads to.
    Routine,
    /// A label that VECT leads to.
    Handler,
    /// Any other label.
    Label,
    /// A constant.
    Constant,
}

/// A name of the outline.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Symbol {
    /// As its definition writes it.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// Address, or value.
    pub detail: String,
    /// The name itself.
    pub name_span: Span,
    /// All that belongs to it: for a routine up to the next one.
    pub span: Span,
}

/// Lines that can be folded, first and last byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fold {
    /// What is folded.
    pub span: Span,
    /// True for lines of comment.
    pub is_comment: bool,
}

/// Returns the names that a file defines, in the order of the text.
pub fn outline(analysis: &Analysis, source: usize) -> Vec<Symbol> {
    let here = analysis.definitions().filter(|(span, _)| span.source == source);
    let mut symbols: Vec<_> = here.map(|(_, of)| symbol(analysis, of)).collect();
    symbols.sort_by_key(|symbol| symbol.name_span.start);
    extend_labels(&mut symbols, analysis.assembly.sources[source].text.trim_end().len());
    symbols
}

fn symbol(analysis: &Analysis, of: Defined) -> Symbol {
    let (name, name_span) = (analysis.name(of).to_owned(), analysis.definition(of));
    let line = line_of(analysis, name_span);
    let (kind, detail) = match of {
        Defined::Label(index) => {
            let address = analysis.label(index).address;
            (label_kind(analysis, address), format!("address {address}"))
        }
        Defined::Constant(index) => (SymbolKind::Constant, value_text(analysis.constant(index).value)),
    };
    Symbol { name, kind, detail, name_span, span: line }
}

/// Returns what a label at an address is.
pub fn label_kind(analysis: &Analysis, address: usize) -> SymbolKind {
    match (analysis.is_handler(address), analysis.is_called(address)) {
        (true, _) => SymbolKind::Handler,
        (false, true) => SymbolKind::Routine,
        (false, false) => SymbolKind::Label,
    }
}

/// A constant's value as it is shown.
pub fn value_text(value: f64) -> String {
    format!("= {value}")
}

/// A routine or handler reaches up to the next one.
fn extend_labels(symbols: &mut [Symbol], end: usize) {
    let is_part = |symbol: &Symbol| matches!(symbol.kind, SymbolKind::Routine | SymbolKind::Handler);
    let mut until = end;
    for symbol in symbols.iter_mut().rev().filter(|symbol| is_part(symbol)) {
        symbol.span.end = until.max(symbol.span.end);
        until = symbol.span.start.saturating_sub(1);
    }
}

fn line_of(analysis: &Analysis, span: Span) -> Span {
    let text = &analysis.source(span).text;
    let lines = &analysis.lines[span.source];
    let (start, end) = lines.range(text, lines.line(span.start));
    Span { start, end, ..span }
}

/// Returns the names of a program in which the letters of `query` stand one after the other, in any case.
pub fn search(analysis: &Analysis, query: &str) -> Vec<Symbol> {
    let found = analysis.definitions().filter(|(span, of)| {
        let source = analysis.source(*span);
        !source.built_in && is_file(source) && matches(analysis.name(*of), query)
    });
    found.map(|(_, of)| symbol(analysis, of)).collect()
}

/// False for constants from outside, which stand in no file.
pub fn is_file(source: &gradus_asm::Source) -> bool {
    source.path.is_absolute() || source.path.to_string_lossy().contains(':')
}

fn matches(name: &str, query: &str) -> bool {
    let mut letters = name.chars().map(|letter| letter.to_ascii_lowercase());
    query.chars().all(|wanted| letters.any(|letter| letter == wanted.to_ascii_lowercase()))
}

/// Returns every place of a name, its definition first.
pub fn places(analysis: &Analysis, name: NameAt, with_definition: bool) -> Vec<Span> {
    let definition = Some(analysis.definition(name.of)).filter(|_| with_definition);
    definition.into_iter().chain(analysis.references(name.of)).collect()
}

/// True if a name can get another one: it stands in a file that somebody has written.
pub fn can_be_renamed(analysis: &Analysis, name: NameAt) -> bool {
    let source = analysis.source(analysis.definition(name.of));
    !source.built_in && is_file(source)
}

/// Why a name cannot be given.
pub fn refuse_name(analysis: &Analysis, name: NameAt, new: &str) -> Option<String> {
    let mut letters = new.chars();
    let starts = letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_');
    if !starts || !letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
        return Some(format!("`{new}` is no name: a letter or _ first, then letters, digits and _"));
    }
    let taken = |of: &Defined| *of != name.of && analysis.name(*of).eq_ignore_ascii_case(new);
    analysis.definitions().map(|(_, of)| of).find(taken).map(|_| format!("`{new}` is defined already"))
}

/// Returns what can be folded in a file: routines and handlers, runs of comment, and regions.
pub fn folds(analysis: &Analysis, source: usize) -> Vec<Fold> {
    let parts = outline(analysis, source).into_iter().map(|symbol| Fold { span: symbol.span, is_comment: false });
    let text = &analysis.assembly.sources[source].text;
    let mut folds: Vec<_> = parts.chain(comment_runs(text, source)).chain(regions(text, source)).collect();
    let lines = &analysis.lines[source];
    folds.retain(|fold| lines.line(fold.span.start) < lines.line(fold.span.end));
    folds
}

/// The lines of a text with the byte that each begins with.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.split_inclusive('\n').scan(0, |at, line| {
        let start = *at;
        *at += line.len();
        Some((start, line.trim_end()))
    })
}

fn comment_runs(text: &str, source: usize) -> Vec<Fold> {
    let mut runs: Vec<Fold> = Vec::new();
    let mut inside = false;
    for (start, line) in lines(text) {
        let is_comment = line.trim_start().starts_with("//") && region(line).is_none();
        let end = start + line.len();
        match runs.last_mut().filter(|_| inside && is_comment) {
            Some(run) => run.span.end = end,
            None if is_comment => runs.push(Fold { span: Span { source, start, end }, is_comment: true }),
            None => {}
        }
        inside = is_comment;
    }
    runs
}

/// `// region NAME` ... `// endregion`.
fn regions(text: &str, source: usize) -> Vec<Fold> {
    let (mut open, mut found) = (Vec::new(), Vec::new());
    for (start, line) in lines(text) {
        match region(line) {
            Some(true) => open.push(start),
            Some(false) => {
                let begun = open.pop();
                found.extend(begun.map(|begin| Fold {
                    span: Span { source, start: begin, end: start + line.len() },
                    is_comment: false,
                }));
            }
            None => {}
        }
    }
    found
}

/// Whether a line begins or ends a region.
fn region(line: &str) -> Option<bool> {
    let words = line.trim().strip_prefix("//")?.trim_start().trim_start_matches('#');
    match words.split_whitespace().next()? {
        "region" => Some(true),
        "endregion" => Some(false),
        _ => None,
    }
}

/// Calls of a routine or handler from one other part of the program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Calls {
    /// The label of the other part; `None` for the main program.
    pub label: Option<usize>,
    /// The commands that call.
    pub spans: Vec<Span>,
}

/// Returns who calls the routine at an address.
pub fn incoming(analysis: &Analysis, address: usize) -> Vec<Calls> {
    let calls = analysis.calls().filter(|call| call.to == address);
    grouped(analysis, calls.map(|call| (analysis.routine_at(call.from), call.from)))
}

/// Returns whom the routine of a label calls.
pub fn outgoing(analysis: &Analysis, label: usize) -> Vec<Calls> {
    let inside = |from: usize| analysis.routine_at(from) == Some(label);
    let calls = analysis.calls().filter(|call| inside(call.from));
    grouped(analysis, calls.map(|call| (label_at(analysis, call.to), call.from)))
}

/// Returns the label at an address, the last one of several.
pub fn label_at(analysis: &Analysis, address: usize) -> Option<usize> {
    analysis.assembly.labels.iter().rposition(|label| label.address == address)
}

fn grouped(analysis: &Analysis, calls: impl Iterator<Item = (Option<usize>, usize)>) -> Vec<Calls> {
    let mut groups: Vec<Calls> = Vec::new();
    for (label, from) in calls {
        let Some(text) = analysis.assembly.commands.get(from) else { continue };
        match groups.iter_mut().find(|group| group.label == label) {
            Some(group) => group.spans.push(text.span()),
            None => groups.push(Calls { label, spans: vec![text.span()] }),
        }
    }
    groups
}

/// Returns the files that a file includes: the name in the text, and the path.
pub fn includes(analysis: &Analysis, source: usize) -> Vec<(Span, std::path::PathBuf)> {
    let text = &analysis.assembly.sources[source].text;
    let named = lines(text).filter_map(|(start, line)| include(line).map(|(at, name)| (start + at, name)));
    let found = named.filter_map(|(start, name)| {
        let path = included(analysis, name)?;
        Some((Span { source, start, end: start + name.len() }, path))
    });
    found.collect()
}

/// The name in an `#include` with its place in the line.
pub fn include(line: &str) -> Option<(usize, &str)> {
    let word = line.trim_start();
    let keyword = word.get(..8).filter(|word| word.eq_ignore_ascii_case("#include"))?;
    let rest = word[keyword.len()..].split("//").next()?;
    let name = rest.trim().trim_matches(|quote| matches!(quote, '"' | '\'' | '<' | '>'));
    (!name.is_empty()).then(|| (name.as_ptr().addr() - line.as_ptr().addr(), name))
}

/// The file of the program that an include names.
fn included(analysis: &Analysis, name: &str) -> Option<std::path::PathBuf> {
    let name = std::path::PathBuf::from(name.replace('\\', "/"));
    let tail = name.components().filter(|part| matches!(part, std::path::Component::Normal(_)));
    let tail: std::path::PathBuf = tail.collect();
    let sources = analysis.assembly.sources.iter().filter(|source| !source.built_in);
    sources.map(|source| &source.path).find(|path| path.ends_with(&tail)).cloned()
}

/// Returns how deep calls nest at most below a label, 1 for a routine that calls nothing; `None` where it calls itself.
pub fn depth(analysis: &Analysis, label: usize) -> Option<usize> {
    depth_below(analysis, label, &mut Vec::new())
}

fn depth_below(analysis: &Analysis, label: usize, above: &mut Vec<usize>) -> Option<usize> {
    const STACK: usize = 8;
    if above.contains(&label) || above.len() > STACK {
        return None;
    }
    above.push(label);
    let is_call =
        |span: &Span| analysis.command_at(span.source, span.start).is_some_and(|at| is_subroutine(analysis, at));
    let callees = outgoing(analysis, label).into_iter().filter(|calls| calls.spans.iter().any(is_call));
    let mut deepest = 0;
    for callee in callees.filter_map(|calls| calls.label) {
        deepest = deepest.max(depth_below(analysis, callee, above)?);
    }
    above.pop();
    Some(deepest + 1)
}

fn is_subroutine(analysis: &Analysis, address: usize) -> bool {
    matches!(analysis.assembly.program[address].opcode, Opcode::CSUB | Opcode::CALL)
}
