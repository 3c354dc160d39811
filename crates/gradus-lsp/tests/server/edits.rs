//! Changes of the text: fixes, renaming; and that many changes end where a fresh start does.

use proptest::prelude::*;
use serde_json::{Value, json};

use crate::support::{Client, URI, place, position};

/// Applies text edits of a workspace edit to a text (positions count bytes).
fn apply(text: &str, edit: &Value) -> String {
    let offset = |it: &Value| {
        let line = it["line"].as_u64().unwrap() as usize;
        let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
        start + it["character"].as_u64().unwrap() as usize
    };
    let mut edits: Vec<_> = edit["changes"][URI].as_array().unwrap().iter().collect();
    edits.sort_by_key(|it| std::cmp::Reverse(offset(&it["range"]["start"])));
    let mut text = text.to_owned();
    for it in edits {
        let range = offset(&it["range"]["start"])..offset(&it["range"]["end"]);
        text.replace_range(range, it["newText"].as_str().unwrap());
    }
    text
}

fn rename(client: &mut Client, line: u32, character: u32, name: &str) -> Result<Value, String> {
    let mut params = position(URI, line, character);
    params["newName"] = name.into();
    client.ask("textDocument/rename", params)
}

#[test]
fn renaming_changes_every_place() {
    let text = "Loop: MST 0\nJA loop\nCSUB LOOP // Loop\nSTOP\n";
    let mut client = Client::new(&[]);
    client.open(URI, text);
    let edit = rename(&mut client, 1, 4, "Again").unwrap();
    assert_eq!(apply(text, &edit), "Again: MST 0\nJA Again\nCSUB Again // Loop\nSTOP\n");
    assert_eq!(
        rename(&mut client, 1, 4, "2nd").unwrap_err(),
        "`2nd` is no name: a letter or _ first, then letters, digits and _"
    );
    let mut other = Client::new(&[]);
    other.open(URI, "A: JA B\nB: JA A\n");
    assert_eq!(rename(&mut other, 0, 0, "b").unwrap_err(), "`b` is defined already");
}

#[test]
fn built_in_names_are_not_renamed() {
    let mut client = Client::new(&[]);
    client.open(URI, "#include TMCLParam.tmc\nGAP APActualPosition, 0\nSTOP\n");
    assert_eq!(client.at("textDocument/prepareRename", 1, 6), Value::Null);
    assert_eq!(client.at("textDocument/definition", 1, 6), Value::Null);
    assert!(client.at("textDocument/hover", 1, 6)["contents"]["value"].as_str().unwrap().contains("actual position"));
}

fn actions(client: &mut Client, line: u32, start: u32, end: u32, only: Option<&str>) -> Vec<Value> {
    let range = json!({ "start": place((line, start)), "end": place((line, end)) });
    let mut context = json!({ "diagnostics": [] });
    if let Some(only) = only {
        context["only"] = json!([only]);
    }
    let params = json!({ "textDocument": { "uri": URI }, "range": range, "context": context });
    client.ask("textDocument/codeAction", params).unwrap().as_array().unwrap().clone()
}

#[test]
fn fixes_and_permissions_are_offered() {
    let text = "Unused = 1\nMST 0\nSTOP\n";
    let mut client = Client::new(&[]);
    client.open(URI, text);
    let found = actions(&mut client, 0, 0, 0, Some("quickfix"));
    let fix = found.iter().find(|it| it["isPreferred"] == true).unwrap();
    assert_eq!(apply(text, &fix["edit"]), "MST 0\nSTOP\n");
    let allow = found.iter().find(|it| it["title"] == "allow unused-constant here").unwrap();
    assert_eq!(apply(text, &allow["edit"]), "Unused = 1 // gradus: allow(unused-constant)\nMST 0\nSTOP\n");
    let all = actions(&mut client, 2, 0, 0, Some("source.fixAll"));
    assert_eq!(all[0]["kind"], "source.fixAll.gradus");
    assert_eq!(apply(text, &all[0]["edit"]), "MST 0\nSTOP\n");
}

#[test]
fn number_gets_a_name() {
    let text = "// stage\nROR 0, 51200\nSTOP\n";
    let mut client = Client::new(&[]);
    client.open(URI, text);
    let found = actions(&mut client, 1, 7, 12, Some("refactor"));
    assert_eq!(found[0]["title"], "give 51200 a name");
    assert_eq!(apply(text, &found[0]["edit"]), "// stage\nNewConstant = 51200\n\nROR 0, NewConstant\nSTOP\n");
}

#[test]
fn text_is_formatted_as_a_whole_or_in_part() {
    let text = "mst 0//stop\n\n\n\nLoop:mvp abs,0,100\n  ja Loop\n";
    let mut client = Client::new(&[]);
    client.open(URI, text);
    let edits = client.about("textDocument/formatting");
    let new = apply(text, &json!({ "changes": { URI: edits } }));
    assert_eq!(new, gradus_asm::format(text.as_bytes()).unwrap().text);
    assert!(new.ends_with("// stop\n\nLoop:\n    MVP ABS, 0, 100\n    JA Loop\n"), "{new}");
    let range = json!({ "start": place((0, 0)), "end": place((0, 3)) });
    let params = json!({ "textDocument": { "uri": URI }, "range": range, "options": {} });
    let edits = client.ask("textDocument/rangeFormatting", params).unwrap();
    assert!(apply(text, &json!({ "changes": { URI: edits } })).contains("Loop:mvp abs,0,100"));
}

const LINES: &[&str] = &[
    "Loop: MVP ABS, 0, 100\n",
    "WAIT POS, 0, 0\n",
    "Speed = 10\n",
    "ROR 0, Speed // größer 😀\n",
    "JA Loop\n",
    "CSUB Home\n",
    "Home: RSUB\n",
    "nonsense ,,\n",
    "\n",
];

/// An edit: line and character of both ends, and what comes there.
fn edit() -> impl Strategy<Value = ((u32, u32), (u32, u32), &'static str)> {
    let place = || (0_u32..8, 0_u32..12);
    let text = prop::sample::select(&["", "x", "Loop", "\n", ", 1", "// ", "STOP\n", "😀"][..]);
    (place(), place(), text).prop_map(|(a, b, text)| (a.min(b), a.max(b), text))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Edits and their undoing end with the diagnostics of a fresh start.
    #[test]
    fn edits_end_with_the_diagnostics_of_a_fresh_start(
        lines in prop::collection::vec(prop::sample::select(LINES), 0..8),
        edits in prop::collection::vec((edit(), any::<bool>()), 1..12),
    ) {
        let text = lines.concat();
        let mut client = Client::new(&[]);
        client.open(URI, &text);
        let mut mirror = Client::new(&[]);
        let mut current = text;
        for ((start, end, new), settles) in edits {
            current = replaced(&current, start, end, new);
            client.edit(URI, start, end, new);
            if settles {
                client.settle();
            }
        }
        client.edit(URI, (999, 0), (999, 0), "\nSTOP\n");
        current.push_str("\nSTOP\n");
        prop_assert_eq!(&client.settle()[URI], &mirror.open(URI, &current)[URI]);
    }
}

/// What the protocol says of a replaced range: positions past the end of a line mean its end.
fn replaced(text: &str, start: (u32, u32), end: (u32, u32), new: &str) -> String {
    let offset = |(line, character): (u32, u32)| {
        let Some(from) = text
            .split_inclusive('\n')
            .map(str::len)
            .scan(0, |at, len| {
                let start = *at;
                *at += len;
                Some(start)
            })
            .chain(text.ends_with('\n').then_some(text.len()))
            .chain(text.is_empty().then_some(0))
            .nth(line as usize)
        else {
            return text.len();
        };
        let content = text[from..].split('\n').next().unwrap();
        from + content.floor_char_boundary((character as usize).min(content.len()))
    };
    let (start, end) = (offset(start), offset(end));
    [&text[..start], new, &text[end.max(start)..]].concat()
}
