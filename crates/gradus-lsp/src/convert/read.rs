//! What the client says.

use std::path::PathBuf;

use gen_lsp_types as lsp;
use lsp_server::ErrorCode;
use serde_json::Value;

use crate::documents::Change;
use crate::refusal::Refusal;
use crate::text::{Encoding, Place};
use crate::uri;

/// What the client can do and wants.
#[derive(Clone, Debug, Default)]
pub(crate) struct Client {
    /// How positions count.
    pub encoding: Encoding,
    /// The folders of the workspace.
    pub folders: Vec<PathBuf>,
    /// Completions may have places to fill in.
    pub snippets: bool,
    /// The outline may be nested.
    pub nested_symbols: bool,
    /// Addresses are shown before commands (`initializationOptions.addresses`).
    pub addresses: bool,
    /// References are counted above labels (`initializationOptions.codeLens`).
    pub lenses: bool,
}

/// A place in a text.
pub(crate) struct Position {
    pub uri: String,
    pub place: Place,
}

pub(super) fn parse<T: serde::de::DeserializeOwned>(params: Value) -> Result<T, Refusal> {
    serde_json::from_value(params).map_err(|error| Refusal::new(ErrorCode::InvalidParams, error.to_string()))
}

/// Reads the parameters of `initialize`. What a client leaves out it cannot do.
pub(crate) fn client(params: Value) -> Result<Client, Refusal> {
    let flag = |pointer: &str| params.pointer(pointer).and_then(Value::as_bool).unwrap_or(false);
    let encodings = params.pointer("/capabilities/general/positionEncodings").and_then(Value::as_array);
    let has_utf8 = encodings.is_some_and(|list| list.iter().any(|name| name == "utf-8"));
    Ok(Client {
        encoding: if has_utf8 { Encoding::Utf8 } else { Encoding::Utf16 },
        folders: folders(&params),
        snippets: flag("/capabilities/textDocument/completion/completionItem/snippetSupport"),
        nested_symbols: flag("/capabilities/textDocument/documentSymbol/hierarchicalDocumentSymbolSupport"),
        addresses: flag("/initializationOptions/addresses"),
        lenses: flag("/initializationOptions/codeLens"),
    })
}

fn folders(params: &Value) -> Vec<PathBuf> {
    let listed = params.get("workspaceFolders").and_then(Value::as_array);
    let uris: Vec<_> = listed.into_iter().flatten().filter_map(|folder| folder.get("uri")?.as_str()).collect();
    let root = params.get("rootUri").and_then(Value::as_str).filter(|_| uris.is_empty());
    uris.into_iter().chain(root).map(uri::to_path).collect()
}

pub(crate) fn opened(params: &Value) -> Result<(String, i32, String), Refusal> {
    let lsp::DidOpenTextDocumentParams { text_document } = parse(params.clone())?;
    Ok((text_document.uri.0, text_document.version, text_document.text))
}

pub(crate) fn changed(params: &Value) -> Result<(String, i32, Vec<Change>), Refusal> {
    let params: lsp::DidChangeTextDocumentParams = parse(params.clone())?;
    let changes = params.content_changes.into_iter().map(|change| match change {
        lsp::TextDocumentContentChangeEvent::TextDocumentContentChangePartial(part) => {
            Change { range: Some((place(part.range.start), place(part.range.end))), text: part.text }
        }
        lsp::TextDocumentContentChangeEvent::TextDocumentContentChangeWholeDocument(whole) => {
            Change { range: None, text: whole.text }
        }
    });
    let document = params.text_document;
    Ok((document.text_document_identifier.uri.0, document.version, changes.collect()))
}

/// The URI of `textDocument`.
pub(crate) fn document(params: &Value) -> Result<String, Refusal> {
    let uri = params.pointer("/textDocument/uri").and_then(Value::as_str);
    uri.map(str::to_owned).ok_or_else(|| Refusal::new(ErrorCode::InvalidParams, "`textDocument.uri` is missing"))
}

pub(crate) fn watched(params: &Value) -> Result<Vec<String>, Refusal> {
    let params: lsp::DidChangeWatchedFilesParams = parse(params.clone())?;
    Ok(params.changes.into_iter().map(|change| change.uri.0).collect())
}

pub(crate) fn position(params: Value) -> Result<Position, Refusal> {
    let params: lsp::TextDocumentPositionParams = parse(params)?;
    Ok(Position { uri: params.text_document.uri.0, place: place(params.position) })
}

pub(crate) fn range(params: Value) -> Result<(String, Place, Place), Refusal> {
    let uri = document(&params)?;
    let range: lsp::Range = parse(params.get("range").cloned().unwrap_or(Value::Null))?;
    Ok((uri, place(range.start), place(range.end)))
}

pub(crate) fn new_name(params: &Value) -> Result<String, Refusal> {
    let name = params.get("newName").and_then(Value::as_str);
    name.map(str::to_owned).ok_or_else(|| Refusal::new(ErrorCode::InvalidParams, "`newName` is missing"))
}

pub(crate) fn includes_declaration(params: &Value) -> bool {
    params.pointer("/context/includeDeclaration").and_then(Value::as_bool).unwrap_or(false)
}

pub(crate) fn query(params: Value) -> Result<String, Refusal> {
    Ok(params.get("query").and_then(Value::as_str).unwrap_or("").to_owned())
}

/// The kinds of actions that the client asks for; empty for all.
pub(crate) fn only(params: &Value) -> Vec<String> {
    let list = params.pointer("/context/only").and_then(Value::as_array);
    list.into_iter().flatten().filter_map(|kind| Some(kind.as_str()?.to_owned())).collect()
}

/// True if an action is of a kind that the client asks for. `source.fixAll` must be asked for.
pub(crate) fn is_wanted(action: &Value, only: &[String]) -> bool {
    let kind = action.get("kind").and_then(Value::as_str).unwrap_or("");
    let within = |wanted: &String| kind == wanted || kind.starts_with(&format!("{wanted}."));
    if only.is_empty() { !kind.starts_with("source") } else { only.iter().any(within) }
}

/// URI and name of an item of the call hierarchy.
pub(crate) fn call_item(params: &Value) -> Result<(String, String), Refusal> {
    let text = |pointer| params.pointer(pointer).and_then(Value::as_str).map(str::to_owned);
    let item = text("/item/uri").zip(text("/item/name"));
    item.ok_or_else(|| Refusal::new(ErrorCode::InvalidParams, "`item` is missing"))
}

fn place(position: lsp::Position) -> Place {
    Place { line: position.line, character: position.character }
}
