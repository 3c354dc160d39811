//! What the server says of itself.

use gen_lsp_types as lsp;
use serde_json::{Value, json};

use crate::convert::read::{Client, parse};
use crate::refusal::Refusal;
use crate::text::Encoding;

/// The kinds of colours, by their number.
pub(super) const TOKENS: [&str; 9] =
    ["keyword", "enumMember", "function", "label", "variable", "parameter", "property", "number", "comment"];
/// What colours can have besides, by their bit.
const MODIFIERS: [&str; 3] = ["declaration", "readonly", "unused"];

/// The answer to `initialize`: what is served, and nothing else.
pub(crate) fn initialized(client: &Client, methods: impl Iterator<Item = &'static str>) -> Result<Value, Refusal> {
    let encoding = match client.encoding {
        Encoding::Utf8 => "utf-8",
        Encoding::Utf16 => "utf-16",
    };
    let mut capabilities = json!({
        "positionEncoding": encoding,
        "textDocumentSync": { "openClose": true, "change": 2 },
    });
    for method in methods {
        if let Some((name, options)) = capability(method) {
            capabilities[name] = options;
        }
    }
    let result = json!({
        "capabilities": capabilities,
        "serverInfo": { "name": "gradus", "version": env!("CARGO_PKG_VERSION") },
    });
    let checked: lsp::InitializeResult = parse(result)?; // what the protocol has no word for ends here
    Ok(serde_json::to_value(checked).unwrap_or(Value::Null))
}

/// The capability that a served request stands for; `None` where another one's options say it.
fn capability(method: &str) -> Option<(&'static str, Value)> {
    Some(match method {
        "textDocument/hover" => ("hoverProvider", json!(true)),
        "textDocument/completion" => ("completionProvider", json!({ "triggerCharacters": [" ", ",", "#", "("] })),
        "textDocument/signatureHelp" => ("signatureHelpProvider", json!({ "triggerCharacters": [" ", ","] })),
        "textDocument/definition" => ("definitionProvider", json!(true)),
        "textDocument/references" => ("referencesProvider", json!(true)),
        "textDocument/documentHighlight" => ("documentHighlightProvider", json!(true)),
        "textDocument/rename" => ("renameProvider", json!({ "prepareProvider": true })),
        "textDocument/documentSymbol" => ("documentSymbolProvider", json!(true)),
        "workspace/symbol" => ("workspaceSymbolProvider", json!(true)),
        "textDocument/foldingRange" => ("foldingRangeProvider", json!(true)),
        "textDocument/formatting" => ("documentFormattingProvider", json!(true)),
        "textDocument/rangeFormatting" => ("documentRangeFormattingProvider", json!(true)),
        "textDocument/codeAction" => (
            "codeActionProvider",
            json!({ "codeActionKinds": ["quickfix", "refactor.extract", "source.fixAll.gradus"] }),
        ),
        "textDocument/inlayHint" => ("inlayHintProvider", json!(true)),
        "textDocument/codeLens" => ("codeLensProvider", json!({})),
        "textDocument/semanticTokens/full" => {
            let legend = json!({ "tokenTypes": TOKENS, "tokenModifiers": MODIFIERS });
            ("semanticTokensProvider", json!({ "legend": legend, "full": true }))
        }
        "textDocument/prepareCallHierarchy" => ("callHierarchyProvider", json!(true)),
        "textDocument/documentLink" => ("documentLinkProvider", json!({})),
        _ => return None,
    })
}
