//! Life of a conversation, diagnostics, includes.

use serde_json::{Value, json};

use crate::support::{Client, URI, position, short};

#[test]
fn what_comes_before_initialize_is_refused() {
    let mut client = Client::new(&[]);
    client.server = gradus_lsp::Server::new(Box::new(crate::support::Memory::default()));
    assert_eq!(client.ask("textDocument/hover", position(URI, 0, 0)).unwrap_err(), "`initialize` comes first");
}

#[test]
fn conversation_ends_with_shutdown_and_exit() {
    let mut client = Client::new(&[]);
    assert_eq!(client.ask("shutdown", Value::Null), Ok(Value::Null));
    assert!(client.ask("textDocument/hover", position(URI, 0, 0)).is_err());
    assert_eq!(client.server.exit_status(), None);
    client.tell("exit", Value::Null);
    assert_eq!(client.server.exit_status(), Some(0));
}

#[test]
fn exit_without_shutdown_is_a_failure() {
    let mut client = Client::new(&[]);
    client.tell("exit", Value::Null);
    assert_eq!(client.server.exit_status(), Some(1));
}

#[test]
fn capabilities_are_what_is_served() {
    let (mut client, answer) = Client::with_capabilities(&[], json!({}));
    let methods = [
        ("hoverProvider", "textDocument/hover"),
        ("completionProvider", "textDocument/completion"),
        ("signatureHelpProvider", "textDocument/signatureHelp"),
        ("declarationProvider", "textDocument/declaration"),
        ("definitionProvider", "textDocument/definition"),
        ("typeDefinitionProvider", "textDocument/typeDefinition"),
        ("implementationProvider", "textDocument/implementation"),
        ("referencesProvider", "textDocument/references"),
        ("documentHighlightProvider", "textDocument/documentHighlight"),
        ("documentSymbolProvider", "textDocument/documentSymbol"),
        ("codeActionProvider", "textDocument/codeAction"),
        ("codeLensProvider", "textDocument/codeLens"),
        ("documentLinkProvider", "textDocument/documentLink"),
        ("colorProvider", "textDocument/documentColor"),
        ("workspaceSymbolProvider", "workspace/symbol"),
        ("documentFormattingProvider", "textDocument/formatting"),
        ("documentRangeFormattingProvider", "textDocument/rangeFormatting"),
        ("documentOnTypeFormattingProvider", "textDocument/onTypeFormatting"),
        ("renameProvider", "textDocument/rename"),
        ("foldingRangeProvider", "textDocument/foldingRange"),
        ("selectionRangeProvider", "textDocument/selectionRange"),
        ("executeCommandProvider", "workspace/executeCommand"),
        ("callHierarchyProvider", "textDocument/prepareCallHierarchy"),
        ("linkedEditingRangeProvider", "textDocument/linkedEditingRange"),
        ("semanticTokensProvider", "textDocument/semanticTokens/full"),
        ("monikerProvider", "textDocument/moniker"),
        ("typeHierarchyProvider", "textDocument/prepareTypeHierarchy"),
        ("inlineValueProvider", "textDocument/inlineValue"),
        ("inlayHintProvider", "textDocument/inlayHint"),
        ("diagnosticProvider", "textDocument/diagnostic"),
    ];
    for (capability, method) in methods {
        let is_advertised = answer["capabilities"].get(capability).is_some();
        let answer = client.ask(method, json!({}));
        let is_served = answer != Err(format!("`{method}` is not served"));
        assert_eq!(is_advertised, is_served, "{method}");
    }
    let known = methods.iter().filter(|(name, _)| answer["capabilities"].get(name).is_some()).count();
    assert_eq!(answer["capabilities"].as_object().unwrap().len(), known + 2, "besides encoding and synchronisation");
}

#[test]
fn unknown_requests_and_notifications_do_no_harm() {
    let mut client = Client::new(&[]);
    assert_eq!(client.ask("dance", Value::Null).unwrap_err(), "`dance` is not served");
    client.tell("$/setTrace", json!({ "value": "off" }));
    client.tell("textDocument/didChange", json!({ "nonsense": 1 }));
    assert!(client.ask("textDocument/hover", json!({ "nonsense": 1 })).is_err());
    assert_eq!(client.ask("textDocument/hover", position("file:///elsewhere.tmc", 0, 0)), Ok(Value::Null));
}

#[test]
fn problems_are_published_with_code_help_and_second_place() {
    let mut client = Client::new(&[]);
    let found = client.open(URI, "Speed = 1\nSpeed = 2\nROR 0, Sped\nSTOP\n");
    assert_eq!(short(&found[URI]), "4 unused-constant 0:0\n1 duplicate 1:0\n1 unknown-name 2:7");
    let duplicate = &found[URI][1];
    assert_eq!(duplicate["relatedInformation"][0]["location"]["range"]["start"], json!({ "line": 0, "character": 0 }));
    assert!(found[URI][2]["message"].as_str().unwrap().contains("Speed"), "{}", found[URI][2]["message"]);
    assert!(found[URI][2]["codeDescription"]["href"].as_str().unwrap().ends_with("/unknown-name.md"));
    assert_eq!(found[URI][0]["tags"], json!([1]));
}

#[test]
fn mended_text_clears_its_diagnostics() {
    let mut client = Client::new(&[]);
    client.open(URI, "ROR 0, Speed\nSTOP\n");
    client.edit(URI, (0, 7), (0, 12), "100");
    assert_eq!(short(&client.settle()[URI]), "");
    assert!(client.settle().is_empty(), "nothing has changed since");
}

#[test]
fn burst_of_changes_is_analysed_once() {
    let mut client = Client::new(&[]);
    client.open(URI, "STOP\n");
    let runs = client.server.runs();
    for index in 0..400 {
        client.edit(URI, (0, 4 + index), (0, 4 + index), "x");
    }
    assert_eq!(short(&client.settle()[URI]), "1 unknown-command 0:0");
    assert_eq!(client.server.runs(), runs + 1);
}

#[test]
fn positions_count_as_the_client_asks() {
    let text = "Größe = 1\nMST 0 // 😀\nROR 0, x // 😀\n";
    let (mut client, answer) = Client::with_capabilities(&[], json!({}));
    assert_eq!(answer["capabilities"]["positionEncoding"], "utf-16");
    let utf16 = client.open(URI, "MST 0 // 😀 ROR\nROR 0, y // 😀\n");
    assert!(short(&utf16[URI]).contains("1 unknown-name 1:7"));
    let mut client = Client::new(&[]);
    assert!(short(&client.open(URI, text)[URI]).contains("1 unknown-name 2:7"));
}

const MAIN: &str = "#include speeds.inc\nROR 0, Fast\nSTOP\n";

#[test]
fn included_file_is_seen_with_the_program_around_it() {
    let files = [
        ("main.tmc", MAIN),
        ("speeds.inc", "Fast = Base * 2\n"),
        ("other.tmc", "Base = 3\n#include speeds.inc\nROR 0, Fast\nSTOP\n"),
    ];
    let mut client = Client::new(&files);
    let found = client.open("file:///stage/speeds.inc", "Fast = Base * 2\n");
    // `Base` is known in other.tmc, but not in main.tmc.
    assert_eq!(short(&found["file:///stage/speeds.inc"]), "1 unknown-name 0:7");
}

#[test]
fn uses_are_found_in_the_program_around_a_file() {
    let mut client = Client::new(&[("main.tmc", MAIN)]);
    client.open("file:///stage/speeds.inc", "Fast = 2\n");
    let uses = client.ask("textDocument/references", position("file:///stage/speeds.inc", 0, 1)).unwrap();
    assert_eq!(uses[1]["uri"], "file:///stage/main.tmc");
}

#[test]
fn included_file_without_a_program_has_unknown_names() {
    let mut client = Client::new(&[]);
    let found = client.open("file:///stage/speeds.inc", "Fast = Base * 2\n");
    assert!(!short(&found["file:///stage/speeds.inc"]).contains("unknown-name"));
}

#[test]
fn open_text_overrides_the_file_in_every_program() {
    let mut client = Client::new(&[("main.tmc", MAIN), ("speeds.inc", "Fast = 2\n")]);
    assert_eq!(short(&client.open("file:///stage/main.tmc", MAIN)["file:///stage/main.tmc"]), "");
    let found = client.open("file:///stage/speeds.inc", "Slow = 2\n");
    assert!(short(&found["file:///stage/main.tmc"]).contains("1 unknown-name 1:7"));
    client.tell("textDocument/didClose", json!({ "textDocument": { "uri": "file:///stage/speeds.inc" } }));
    assert_eq!(short(&client.settle()["file:///stage/main.tmc"]), "");
}

#[test]
fn text_that_was_never_saved_is_analysed() {
    let mut client = Client::new(&[]);
    let found = client.open("untitled:Untitled-1", "ROR 0, x\n");
    assert!(short(&found["untitled:Untitled-1"]).contains("1 unknown-name 0:7"));
}

#[test]
fn program_names_its_module() {
    let mut client = Client::new(&[]);
    let found = client.open(URI, "// gradus: module tmcm-1617\nRFS START, 0\nSTOP\n");
    assert_eq!(short(&found[URI]), "1 command-not-available 1:0");
}

#[test]
fn garbage_ends_soon() {
    let mut client = Client::new(&[]);
    let garbage: String = (0..80_000_u32).map(|n| format!("{:x} \u{1}Ä:=,\n", n.wrapping_mul(2_654_435_761))).collect();
    assert!(garbage.len() > 1_000_000);
    let start = std::time::Instant::now();
    client.open(URI, &garbage);
    let took = start.elapsed();
    println!("1 MB of garbage: {took:?}");
    assert!(took.as_secs() < 5 * 10, "{took:?}"); // unoptimised; the bar is 1 s
}

#[test]
fn any_bytes_are_answered() {
    let requests = include_bytes!("../../../../fuzz/corpus/lsp_messages/requests");
    for end in 0..requests.len() {
        gradus_lsp::fuzz_messages(&requests[..end.min(400) + end / 4]);
    }
}
