//! The requests that are served: one table, from which the capabilities are read.

use gradus_asm::{Edit, Span, format, normal};
use lsp_server::ErrorCode;
use serde_json::{Value, json};

use crate::analysis::Analysis;
use crate::convert::read::{self, Position};
use crate::convert::view::{self, View};
use crate::hints::HintSettings;
use crate::programs::Programs;
use crate::refusal::Refusal;
use crate::{actions, complete, hints, hover, lines, signature, symbols, uri};

/// Serves a request.
pub(crate) type Serve = fn(&mut Programs, Value) -> Result<Value, Refusal>;

/// Every request that is served besides `initialize` and `shutdown`.
const SERVED: &[(&str, Serve)] = &[
    ("textDocument/hover", hover),
    ("textDocument/completion", completion),
    ("textDocument/signatureHelp", signature_help),
    ("textDocument/definition", definition),
    ("textDocument/references", references),
    ("textDocument/documentHighlight", highlights),
    ("textDocument/prepareRename", prepare_rename),
    ("textDocument/rename", rename),
    ("textDocument/documentSymbol", document_symbols),
    ("workspace/symbol", workspace_symbols),
    ("textDocument/foldingRange", folding_ranges),
    ("textDocument/formatting", formatting),
    ("textDocument/rangeFormatting", range_formatting),
    ("textDocument/codeAction", code_actions),
    ("textDocument/inlayHint", inlay_hints),
    ("textDocument/codeLens", code_lenses),
    ("textDocument/semanticTokens/full", semantic_tokens),
    ("textDocument/prepareCallHierarchy", prepare_calls),
    ("callHierarchy/incomingCalls", incoming_calls),
    ("callHierarchy/outgoingCalls", outgoing_calls),
    ("textDocument/documentLink", document_links),
];

/// Returns the names of the requests that are served.
pub(crate) fn methods() -> impl Iterator<Item = &'static str> {
    SERVED.iter().map(|(name, _)| *name)
}

/// Returns the function that serves a request.
pub(crate) fn served(method: &str) -> Option<Serve> {
    SERVED.iter().find(|(name, _)| *name == method).map(|(_, serve)| *serve)
}

/// Runs `work` on the program around a text; the answer about an unknown file is null.
fn about(programs: &mut Programs, uri: &str, work: impl FnOnce(View<'_>, usize) -> Option<Value>) -> Value {
    let encoding = programs.client.encoding;
    let found = programs.analysis_of(&normal(&uri::to_path(uri)));
    found.and_then(|(analysis, source)| work(View { analysis, encoding }, source)).unwrap_or(Value::Null)
}

/// The same for a request about a place: `work` gets file and byte.
fn at(
    programs: &mut Programs,
    params: Value,
    work: impl FnOnce(View<'_>, usize, usize) -> Option<Value>,
) -> Result<Value, Refusal> {
    let Position { uri, place } = read::position(params)?;
    Ok(about(programs, &uri, |view, source| {
        let offset = view.offset(source, place);
        work(view, source, offset)
    }))
}

/// The line of a byte up to the byte.
fn line_before(analysis: &Analysis, source: usize, offset: usize) -> &str {
    let text = &analysis.assembly.sources[source].text;
    let lines = &analysis.lines[source];
    let (start, _) = lines.range(text, lines.line(offset));
    text.get(start..offset).unwrap_or("")
}

fn hover(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| {
        let hover = hover::hover(view.analysis, source, offset)?;
        Some(view.hover(&hover))
    })
}

fn completion(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let snippets = programs.client.snippets;
    at(programs, params, |view, source, offset| {
        let proposals = complete::complete(view.analysis, line_before(view.analysis, source, offset));
        let replaced = Span { source, start: offset - proposals.replaces, end: offset };
        Some(view.completion(&proposals, replaced, snippets))
    })
}

fn signature_help(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| {
        let signature = signature::signature(view.analysis, line_before(view.analysis, source, offset))?;
        Some(view::signature(&signature))
    })
}

fn definition(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| {
        let name = view.analysis.name_at(source, offset)?;
        let span = view.analysis.definition(name.of);
        symbols::can_be_renamed(view.analysis, name).then(|| view.location(span))
    })
}

fn references(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let with_definition = read::includes_declaration(&params);
    at(programs, params, |view, source, offset| {
        let name = view.analysis.name_at(source, offset)?;
        let in_files = symbols::places(view.analysis, name, with_definition).into_iter();
        let in_files = in_files.filter(|span| symbols::is_file(view.analysis.source(*span)));
        Some(in_files.map(|span| view.location(span)).collect())
    })
}

fn highlights(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| {
        let name = view.analysis.name_at(source, offset)?;
        let definition = view.analysis.definition(name.of);
        let here = symbols::places(view.analysis, name, true).into_iter().filter(|span| span.source == source);
        Some(here.map(|span| view.highlight(span, span == definition)).collect())
    })
}

fn prepare_rename(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| {
        let name = view.analysis.name_at(source, offset)?;
        symbols::can_be_renamed(view.analysis, name).then(|| view.range_value(name.span))
    })
}

fn rename(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let new = read::new_name(&params)?;
    let mut refusal = None;
    let edit = at(programs, params, |view, source, offset| {
        let name =
            view.analysis.name_at(source, offset).filter(|name| symbols::can_be_renamed(view.analysis, *name))?;
        refusal = symbols::refuse_name(view.analysis, name, &new);
        let edit = |span| Edit { span, text: new.clone() };
        let edits: Vec<_> = symbols::places(view.analysis, name, true).into_iter().map(edit).collect();
        Some(view.workspace_edit(&edits))
    })?;
    match refusal {
        Some(message) => Err(Refusal::new(ErrorCode::InvalidParams, message)),
        None => Ok(edit),
    }
}

fn document_symbols(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let nested = programs.client.nested_symbols;
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| Some(view.outline(&symbols::outline(view.analysis, source), nested))))
}

fn workspace_symbols(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let query = read::query(params)?;
    let encoding = programs.client.encoding;
    let mut found: Vec<Value> = Vec::new();
    for analysis in programs.all() {
        let view = View { analysis, encoding };
        for symbol in symbols::search(analysis, &query) {
            let value = view.workspace_symbol(&symbol);
            if !found.contains(&value) {
                found.push(value);
            }
        }
    }
    Ok(found.into())
}

fn folding_ranges(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| {
        let folds = symbols::folds(view.analysis, source);
        Some(folds.iter().map(|fold| view.fold(fold)).collect())
    }))
}

fn formatting(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| Some(formatted(view, source, None))))
}

fn range_formatting(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let (uri, start, end) = read::range(params)?;
    Ok(about(programs, &uri, |view, source| {
        let span = Span { source, start: view.offset(source, start), end: view.offset(source, end) };
        Some(formatted(view, source, Some(span)))
    }))
}

/// The edits that format a file, or the lines of a span: one for each run of lines that differ. A text that cannot be formatted
/// stays as it is.
fn formatted(view: View<'_>, source: usize, within: Option<Span>) -> Value {
    let text = &view.analysis.assembly.sources[source].text;
    let Ok(new) = format(text.as_bytes()) else { return json!([]) };
    let edits = lines::edits(text, &new.text).into_iter();
    let edits = edits.filter(|edit| within.is_none_or(|span| edit.start <= span.end && edit.end >= span.start));
    let edits = edits.map(|edit| Edit { span: Span { source, start: edit.start, end: edit.end }, text: edit.text });
    edits.map(|edit| view.text_edit(&edit)).collect()
}

fn code_actions(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let only = read::only(&params);
    let (uri, start, end) = read::range(params)?;
    Ok(about(programs, &uri, |view, source| {
        let span = Span { source, start: view.offset(source, start), end: view.offset(source, end) };
        let actions = actions::actions(view.analysis, span);
        Some(actions.iter().map(|action| view.action(action)).filter(|action| read::is_wanted(action, &only)).collect())
    }))
}

fn inlay_hints(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let settings = HintSettings { addresses: programs.client.addresses };
    let (uri, start, end) = read::range(params)?;
    Ok(about(programs, &uri, |view, source| {
        let span = Span { source, start: view.offset(source, start), end: view.offset(source, end) };
        let found = hints::inlay_hints(view.analysis, span, settings);
        Some(found.iter().map(|hint| view.inlay_hint(hint)).collect())
    }))
}

fn code_lenses(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let enabled = programs.client.lenses;
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| {
        let lenses = if enabled { hints::lenses(view.analysis, source) } else { Vec::new() };
        Some(lenses.iter().map(|lens| view.lens(lens)).collect())
    }))
}

fn semantic_tokens(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| Some(view.tokens(source, &hints::tokens(view.analysis, source)))))
}

fn prepare_calls(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    at(programs, params, |view, source, offset| match view.analysis.name_at(source, offset)?.of {
        gradus_asm::Defined::Label(label) => Some(json!([view.call_item(Some(label))])),
        gradus_asm::Defined::Constant(_) => None,
    })
}

/// Runs `work` on the label that an item of the call hierarchy stands for.
fn of_item(
    programs: &mut Programs,
    params: &Value,
    work: impl FnOnce(View<'_>, usize) -> Value,
) -> Result<Value, Refusal> {
    let (uri, name) = read::call_item(params)?;
    Ok(about(programs, &uri, |view, _| {
        let labels = &view.analysis.assembly.labels;
        let label = labels.iter().position(|label| label.name.eq_ignore_ascii_case(&name))?;
        Some(work(view, label))
    }))
}

fn incoming_calls(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    of_item(programs, &params, |view, label| {
        let calls = symbols::incoming(view.analysis, view.analysis.label(label).address);
        calls.iter().map(|calls| view.calls(calls, "from")).collect()
    })
}

fn outgoing_calls(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    of_item(programs, &params, |view, label| {
        let calls = symbols::outgoing(view.analysis, label);
        calls.iter().filter(|calls| calls.label.is_some()).map(|calls| view.calls(calls, "to")).collect()
    })
}

fn document_links(programs: &mut Programs, params: Value) -> Result<Value, Refusal> {
    let uri = read::document(&params)?;
    Ok(about(programs, &uri, |view, source| {
        let links = symbols::includes(view.analysis, source);
        Some(links.iter().map(|(span, path)| view.link(*span, path)).collect())
    }))
}
