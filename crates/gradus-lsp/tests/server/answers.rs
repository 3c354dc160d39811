//! Hover, completion and the other requests about a text.

use serde_json::{Value, json};

use crate::support::{Client, URI, place, position};

const STAGE: &str = "\
Motor  = 0      // axis
Travel = 51200
Count  = 3
    SAP 140, Motor, 8
    SAP 4, Motor, 102400
    CSUB Home
Loop:
    MVP ABS, Motor, Travel
    WAIT POS, Motor, 500
    GGP Count, 2
    JC EQ, Loop
    STOP

Home:
    RFS START, Motor
    WAIT RFS, Motor, 0
    RSUB
";

fn stage() -> Client {
    let mut client = Client::new(&[]);
    client.open(URI, STAGE);
    client
}

fn hover(line: u32, character: u32) -> String {
    let answer = stage().at("textDocument/hover", line, character);
    answer["contents"]["value"].as_str().unwrap_or("").to_owned()
}

#[test]
fn hover_tells_what_the_catalogue_knows() {
    let mnemonic = hover(7, 5);
    assert!(mnemonic.starts_with("```tmcl\nMVP <kind>, <axis>, <position>\n```\nMove to position."), "{mnemonic}");
    assert!(mnemonic.contains("Modules: TMCM-3351, TMCM-1617, TMCM-351."), "{mnemonic}");
    let parameter = hover(4, 8);
    assert!(parameter.starts_with("**maximum positioning speed** (axis parameter 4"), "{parameter}");
    assert!(parameter.contains("pps"), "{parameter}");
    assert!(hover(8, 21).contains("500 ticks = 5 s"));
    assert!(hover(4, 20).starts_with("102400 = 0x19000\n\nfor **maximum positioning speed**"));
    assert_eq!(hover(12, 0), "");
}

#[test]
fn hover_tells_what_a_name_stands_for() {
    assert_eq!(hover(1, 2), "**Travel** = 51200 = 0xC800");
    assert!(hover(0, 2).contains("Used as axis 0"));
    assert!(hover(2, 2).contains("Used as user variable 3"));
    let routine = hover(5, 10);
    assert!(routine.starts_with("**Home**: routine at address 8\n\nCalled from main; calls nest 1 deep"), "{routine}");
}

fn labels(answer: &Value) -> Vec<&str> {
    answer.as_array().unwrap().iter().map(|item| item["label"].as_str().unwrap()).collect()
}

#[test]
fn completion_offers_what_may_stand_there() {
    let mut client = stage();
    client.edit(URI, (11, 8), (11, 8), "\n    MV\n    MVP \n    SAP 193, Motor, \n    JC \n    JA \n");
    let starts = client.at("textDocument/completion", 12, 6);
    assert!(labels(&starts).contains(&"MVP") && labels(&starts).contains(&"homing"));
    assert!(!labels(&starts).contains(&"STAP"), "the TMCM-3351 has none");
    let kinds = client.at("textDocument/completion", 13, 8);
    assert_eq!(labels(&kinds), ["ABS", "REL", "COORD"]);
    let modes = client.at("textDocument/completion", 14, 20);
    assert!(labels(&modes).contains(&"1: search left stop switch only"), "{modes}");
    assert!(labels(&modes).contains(&"Travel"));
    assert!(labels(&client.at("textDocument/completion", 15, 7)).contains(&"ETO"));
    let targets = client.at("textDocument/completion", 16, 7);
    assert!(labels(&targets).contains(&"Loop") && labels(&targets).contains(&"Home"));
}

#[test]
fn completion_replaces_the_word_and_finds_parameters_by_name() {
    let mut client = stage();
    client.edit(URI, (11, 8), (11, 8), "\n    SAP max, 0, 1\n");
    let answer = client.at("textDocument/completion", 12, 11);
    let speed = answer.as_array().unwrap().iter().find(|item| item["label"] == "4: maximum positioning speed").unwrap();
    assert_eq!(speed["textEdit"]["newText"], "4");
    assert_eq!(speed["textEdit"]["range"], json!({ "start": place((12, 8)), "end": place((12, 11)) }));
    assert!(speed["filterText"].as_str().unwrap().contains("APMaxPositioningSpeed"));
    assert!(speed["documentation"]["value"].as_str().unwrap().contains("Range 0 to"));
}

#[test]
fn snippets_go_to_clients_that_take_them_only() {
    let (mut client, _) = Client::with_capabilities(&[], json!({}));
    client.open(URI, "\n");
    let answer = client.at("textDocument/completion", 0, 0);
    assert!(!labels(&answer).contains(&"homing"));
}

#[test]
fn pragmas_and_codes_are_completed() {
    let mut client = Client::new(&[]);
    client.open(URI, "STOP // gradus: \nSTOP // gradus: allow(\n");
    assert!(labels(&client.at("textDocument/completion", 0, 16)).contains(&"module tmcm-351"));
    assert!(labels(&client.at("textDocument/completion", 1, 22)).contains(&"unreachable"));
}

#[test]
fn signature_names_the_operand() {
    let answer = stage().at("textDocument/signatureHelp", 4, 11);
    assert_eq!(answer["signatures"][0]["label"], "SAP <parameter>, <axis>, <value>");
    assert_eq!(answer["signatures"][0]["parameters"][1]["label"], json!([17, 23]));
    assert_eq!(answer["activeParameter"], 1);
}

#[test]
fn names_are_found_whatever_their_case() {
    let mut client = stage();
    client.edit(URI, (5, 9), (5, 13), "HOME");
    let definition = client.at("textDocument/definition", 5, 10);
    assert_eq!(definition["range"]["start"], place((13, 0)));
    let references = client.at("textDocument/references", 13, 1);
    assert_eq!(references.as_array().unwrap().len(), 2);
    let highlights = client.at("textDocument/documentHighlight", 13, 1);
    assert_eq!(highlights[0]["kind"], 3);
}

#[test]
fn outline_nests_what_belongs_to_a_routine() {
    let outline = stage().about("textDocument/documentSymbol");
    let names: Vec<_> = outline.as_array().unwrap().iter().map(|it| it["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Motor", "Travel", "Count", "Loop", "Home"]);
    assert_eq!(outline[4]["range"]["end"]["line"], 16);
    let found = stage().ask("workspace/symbol", json!({ "query": "hm" })).unwrap();
    assert_eq!(found[0]["name"], "Home");
}

#[test]
fn calls_are_followed_both_ways() {
    let mut client = stage();
    let item = client.at("textDocument/prepareCallHierarchy", 13, 1)[0].clone();
    let incoming = client.ask("callHierarchy/incomingCalls", json!({ "item": item })).unwrap();
    assert_eq!(
        (&incoming[0]["from"]["name"], incoming[0]["fromRanges"][0]["start"]["line"].clone()),
        (&json!("main"), json!(5))
    );
    assert_eq!(client.ask("callHierarchy/outgoingCalls", json!({ "item": item })).unwrap(), json!([]));
}

#[test]
fn hints_turn_numbers_into_quantities() {
    let hints = stage().about("textDocument/inlayHint");
    let labels: Vec<_> = hints.as_array().unwrap().iter().map(|it| it["label"].as_str().unwrap()).collect();
    assert_eq!(labels, ["microstep resolution", "maximum positioning speed", "= 2 rps", "= 5 s"]);
}

#[test]
fn colours_cover_mnemonics_numbers_comments_and_names() {
    let answer = stage().about("textDocument/semanticTokens/full");
    let data: Vec<u64> = answer["data"].as_array().unwrap().iter().map(|it| it.as_u64().unwrap()).collect();
    // The first lines: `Motor` defined, its comment; `Travel`.
    assert_eq!(data[..15], [0, 0, 5, 4, 3, 0, 16, 7, 8, 0, 1, 0, 6, 4, 3]);
    assert_eq!(data.len() % 5, 0);
}

#[test]
fn comments_routines_and_regions_fold() {
    let mut client = Client::new(&[]);
    client.open(URI, "// one\n// two\n// region Setup\nCSUB A\nSTOP\n// endregion\nA:\nMST 0\nRSUB\n");
    let folds = client.about("textDocument/foldingRange");
    let lines: Vec<_> = folds
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["startLine"].as_u64().unwrap(), it["endLine"].as_u64().unwrap()))
        .collect();
    assert_eq!(lines, [(6, 8), (0, 1), (2, 5)]);
}

#[test]
fn lenses_count_references_where_they_are_switched_on() {
    let lenses = stage().about("textDocument/codeLens");
    assert_eq!(lenses[1]["command"]["title"], "1 reference");
}

#[test]
fn included_files_are_links() {
    let mut client = Client::new(&[("lib/speeds.inc", "Fast = 2\n")]);
    client.open(URI, "#include \"lib/speeds.inc\"\nROR 0, Fast\nSTOP\n");
    let links = client.about("textDocument/documentLink");
    assert_eq!(links[0]["target"], "file:///stage/lib/speeds.inc");
    assert_eq!(links[0]["range"], json!({ "start": place((0, 10)), "end": place((0, 24)) }));
    let definition = client.ask("textDocument/definition", position(URI, 1, 8)).unwrap();
    assert_eq!(definition["uri"], "file:///stage/lib/speeds.inc");
}
