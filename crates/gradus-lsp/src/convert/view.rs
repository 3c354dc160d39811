//! What the server answers.

use std::collections::HashMap;
use std::path::Path;

use gen_lsp_types as lsp;
use gradus_asm::{Code, Edit, Problem, Severity, Span};
use serde_json::{Value, json};

use crate::actions::{Action, ActionKind};
use crate::analysis::Analysis;
use crate::complete::{ProposalKind, Proposals};
use crate::hints::{InlayHint, Lens, Token, TokenKind};
use crate::hover::Hover;
use crate::signature::Signature;
use crate::symbols::{Calls, Fold, Symbol, SymbolKind};
use crate::text::{Encoding, Place};
use crate::uri;

/// Where the page of a code is, in front of the code.
const PAGES: &str = "https://github.com/gradus-motion/gradus/blob/main/crates/gradus-asm/src/lint/explain/";

/// Findings about text that could be deleted.
const UNNECESSARY: &[Code] = &[
    Code::Unreachable,
    Code::UnusedLabel,
    Code::UnusedConstant,
    Code::LoadUnused,
    Code::JumpToNext,
    Code::UnneededAllow,
];

fn value(result: impl serde::Serialize) -> Value {
    serde_json::to_value(result).unwrap_or(Value::Null)
}

pub(crate) fn publication(uri: String, version: Option<i32>, diagnostics: Vec<Value>) -> Value {
    let mut params = json!({ "uri": uri, "diagnostics": diagnostics });
    if let Some(version) = version {
        params["version"] = version.into();
    }
    params
}

pub(crate) fn signature(signature: &Signature) -> Value {
    let parameters = signature.operands.iter().map(|(start, end)| json!({ "label": [start, end] }));
    json!({
        "signatures": [{
            "label": signature.label,
            "documentation": markdown(&signature.text),
            "parameters": parameters.collect::<Vec<_>>(),
        }],
        "activeSignature": 0,
        "activeParameter": signature.active,
    })
}

fn markdown(text: &str) -> lsp::MarkupContent {
    lsp::MarkupContent { kind: lsp::MarkupKind::Markdown, value: text.to_owned() }
}

/// A program, with the way in which the client counts.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub analysis: &'a Analysis,
    pub encoding: Encoding,
}

// Places.
impl View<'_> {
    /// Returns the byte of a place in a file.
    pub fn offset(self, source: usize, place: Place) -> usize {
        self.analysis.lines[source].offset(&self.analysis.assembly.sources[source].text, place, self.encoding)
    }

    fn position(self, source: usize, offset: usize) -> lsp::Position {
        let place =
            self.analysis.lines[source].place(&self.analysis.assembly.sources[source].text, offset, self.encoding);
        lsp::Position { line: place.line, character: place.character }
    }

    fn range(self, span: Span) -> lsp::Range {
        lsp::Range { start: self.position(span.source, span.start), end: self.position(span.source, span.end) }
    }

    pub fn range_value(self, span: Span) -> Value {
        value(self.range(span))
    }

    fn uri(self, source: usize) -> lsp::Uri {
        lsp::Uri(uri::from_path(&self.analysis.assembly.sources[source].path))
    }

    pub fn location(self, span: Span) -> Value {
        value(self.place(span))
    }

    fn place(self, span: Span) -> lsp::Location {
        lsp::Location { uri: self.uri(span.source), range: self.range(span) }
    }
}

// Answers.
impl View<'_> {
    pub fn diagnostic(self, problem: &Problem) -> Value {
        let code = problem.code.text();
        let message = match &problem.help {
            Some(help) => format!("{}\nhelp: {help}", problem.message),
            None => problem.message.clone(),
        };
        let related = problem.note.iter().filter(|note| crate::symbols::is_file(self.analysis.source(note.span)));
        let related: Vec<_> =
            related.map(|note| json!({ "location": self.place(note.span), "message": note.text })).collect();
        let mut diagnostic = json!({
            "range": self.range(problem.span),
            "severity": severity(problem.severity),
            "code": code,
            "codeDescription": { "href": format!("{PAGES}{code}.md") },
            "source": "gradus",
            "message": message,
        });
        if UNNECESSARY.contains(&problem.code) {
            diagnostic["tags"] = json!([lsp::DiagnosticTag::Unnecessary]);
        }
        if !related.is_empty() {
            diagnostic["relatedInformation"] = related.into();
        }
        diagnostic
    }

    pub fn hover(self, hover: &Hover) -> Value {
        json!({ "contents": markdown(&hover.text), "range": self.range(hover.span) })
    }

    /// Completion items. Snippets are left out for a client that cannot fill them in.
    pub fn completion(self, proposals: &Proposals, replaced: Span, snippets: bool) -> Value {
        let range = self.range(replaced);
        let offered = proposals.items.iter().filter(|item| snippets || item.kind != ProposalKind::Snippet);
        let item = |(order, item): (usize, &crate::complete::Proposal)| {
            let mut value = json!({
                "label": item.label,
                "kind": proposal_kind(item.kind),
                "sortText": format!("{order:04}"),
                "filterText": item.filter,
                "textEdit": { "range": range, "newText": item.insert },
            });
            if !item.detail.is_empty() {
                value["detail"] = item.detail.as_str().into();
            }
            if !item.text.is_empty() {
                value["documentation"] = json!(markdown(&item.text));
            }
            if item.kind == ProposalKind::Snippet {
                value["insertTextFormat"] = json!(lsp::InsertTextFormat::Snippet);
            }
            value
        };
        offered.enumerate().map(item).collect()
    }

    pub fn highlight(self, span: Span, is_definition: bool) -> Value {
        let kind = if is_definition { lsp::DocumentHighlightKind::Write } else { lsp::DocumentHighlightKind::Read };
        json!({ "range": self.range(span), "kind": kind })
    }

    /// The outline: constants, and labels within the routine they stand in where the client can show that.
    pub fn outline(self, symbols: &[Symbol], nested: bool) -> Value {
        if !nested {
            return symbols.iter().map(|symbol| self.workspace_symbol(symbol)).collect();
        }
        let is_part = |symbol: &Symbol| matches!(symbol.kind, SymbolKind::Routine | SymbolKind::Handler);
        let mut top: Vec<Value> = Vec::new();
        let mut open: Option<(Span, usize)> = None;
        for symbol in symbols {
            let value = self.document_symbol(symbol);
            match open.filter(|(span, _)| !is_part(symbol) && symbol.name_span.start < span.end) {
                Some((_, index)) => {
                    if let Some(children) = top[index]["children"].as_array_mut() {
                        children.push(value);
                    }
                }
                None => top.push(value),
            }
            if is_part(symbol) {
                open = Some((symbol.span, top.len() - 1));
            }
        }
        top.into()
    }

    fn document_symbol(self, symbol: &Symbol) -> Value {
        json!({
            "name": symbol.name,
            "detail": symbol.detail,
            "kind": symbol_kind(symbol.kind),
            "range": self.range(symbol.span),
            "selectionRange": self.range(symbol.name_span),
            "children": [],
        })
    }

    pub fn workspace_symbol(self, symbol: &Symbol) -> Value {
        json!({ "name": symbol.name, "kind": symbol_kind(symbol.kind), "location": self.place(symbol.name_span) })
    }

    pub fn fold(self, fold: &Fold) -> Value {
        let range = self.range(fold.span);
        let kind = if fold.is_comment { lsp::FoldingRangeKind::Comment } else { lsp::FoldingRangeKind::Region };
        json!({ "startLine": range.start.line, "endLine": range.end.line, "kind": kind })
    }

    pub fn text_edit(self, edit: &Edit) -> Value {
        json!({ "range": self.range(edit.span), "newText": edit.text })
    }

    pub fn workspace_edit(self, edits: &[Edit]) -> Value {
        let mut changes: HashMap<String, Vec<Value>> = HashMap::new();
        for edit in edits {
            changes.entry(self.uri(edit.span.source).0).or_default().push(self.text_edit(edit));
        }
        json!({ "changes": changes })
    }

    pub fn action(self, action: &Action) -> Value {
        let kind = match action.kind {
            ActionKind::QuickFix => "quickfix",
            ActionKind::FixAll => "source.fixAll.gradus",
            ActionKind::Extract => "refactor.extract",
        };
        let mut value = json!({ "title": action.title, "kind": kind, "edit": self.workspace_edit(&action.edits) });
        if let Some(problem) = action.problem.and_then(|number| self.analysis.problems.get(number)) {
            value["diagnostics"] = json!([self.diagnostic(problem)]);
        }
        if action.is_preferred {
            value["isPreferred"] = true.into();
        }
        value
    }

    pub fn inlay_hint(self, hint: &InlayHint) -> Value {
        let kind = if hint.is_name { lsp::InlayHintKind::Parameter } else { lsp::InlayHintKind::Type };
        let is_before = hint.label.ends_with(':');
        json!({
            "position": self.position(hint.source, hint.at),
            "label": hint.label,
            "kind": kind,
            "paddingLeft": !is_before,
            "paddingRight": is_before,
        })
    }

    pub fn lens(self, lens: &Lens) -> Value {
        json!({ "range": self.range(lens.span), "command": { "title": lens.title, "command": "" } })
    }

    /// Colours, each relative to the one before.
    pub fn tokens(self, source: usize, tokens: &[Token]) -> Value {
        let (mut line, mut character) = (0, 0);
        let mut data = Vec::with_capacity(5 * tokens.len());
        for token in tokens {
            let start = self.position(source, token.span.start);
            let length = self.position(source, token.span.end).character.saturating_sub(start.character);
            let from = if start.line == line { character } else { 0 };
            data.extend([start.line - line, start.character - from, length, token_kind(token.kind), modifiers(token)]);
            (line, character) = (start.line, start.character);
        }
        json!({ "data": data })
    }

    /// An item of the call hierarchy: a label, or the main program.
    pub fn call_item(self, label: Option<usize>) -> Value {
        let start = Span { source: 0, start: 0, end: 0 };
        let (name, span) = match label {
            Some(label) => (self.analysis.label(label).name.clone(), self.analysis.label(label).span),
            None => ("main".to_owned(), start),
        };
        let range = self.range(span);
        json!({
            "name": name,
            "kind": lsp::SymbolKind::Function,
            "uri": self.uri(span.source),
            "range": range,
            "selectionRange": range,
        })
    }

    pub fn calls(self, calls: &Calls, side: &str) -> Value {
        let ranges: Vec<_> = calls.spans.iter().map(|span| self.range(*span)).collect();
        json!({ side: self.call_item(calls.label), "fromRanges": ranges })
    }

    pub fn link(self, span: Span, path: &Path) -> Value {
        json!({ "range": self.range(span), "target": uri::from_path(path) })
    }
}

fn severity(severity: Severity) -> lsp::DiagnosticSeverity {
    match severity {
        Severity::Error => lsp::DiagnosticSeverity::Error,
        Severity::Warning => lsp::DiagnosticSeverity::Warning,
        Severity::Hint => lsp::DiagnosticSeverity::Hint,
    }
}

fn proposal_kind(kind: ProposalKind) -> lsp::CompletionItemKind {
    match kind {
        ProposalKind::Mnemonic | ProposalKind::Pragma => lsp::CompletionItemKind::Keyword,
        ProposalKind::Keyword => lsp::CompletionItemKind::EnumMember,
        ProposalKind::Parameter => lsp::CompletionItemKind::Property,
        ProposalKind::Port => lsp::CompletionItemKind::Field,
        ProposalKind::Interrupt => lsp::CompletionItemKind::Event,
        ProposalKind::Label => lsp::CompletionItemKind::Reference,
        ProposalKind::Constant => lsp::CompletionItemKind::Constant,
        ProposalKind::Function => lsp::CompletionItemKind::Function,
        ProposalKind::File => lsp::CompletionItemKind::File,
        ProposalKind::Snippet => lsp::CompletionItemKind::Snippet,
        ProposalKind::Number => lsp::CompletionItemKind::Value,
    }
}

fn symbol_kind(kind: SymbolKind) -> lsp::SymbolKind {
    match kind {
        SymbolKind::Routine => lsp::SymbolKind::Function,
        SymbolKind::Handler => lsp::SymbolKind::Event,
        SymbolKind::Label => lsp::SymbolKind::Key,
        SymbolKind::Constant => lsp::SymbolKind::Constant,
    }
}

/// Number of a colour in the legend.
fn token_kind(kind: TokenKind) -> u32 {
    match kind {
        TokenKind::Mnemonic => 0,
        TokenKind::Keyword => 1,
        TokenKind::Routine => 2,
        TokenKind::Label => 3,
        TokenKind::Constant => 4,
        TokenKind::Parameter => 5,
        TokenKind::Variable => 6,
        TokenKind::Number => 7,
        TokenKind::Comment => 8,
    }
}

/// Bits of what a colour can have besides.
fn modifiers(token: &Token) -> u32 {
    let is_constant = matches!(token.kind, TokenKind::Constant | TokenKind::Parameter);
    u32::from(token.is_definition) | u32::from(is_constant) << 1 | u32::from(token.is_unused) << 2
}
