//! The language's tools on the longest program that a TMCM-3351 holds: assembler, linter, formatter, and the language server.

use std::hint::black_box;
use std::io;
use std::path::{Path, PathBuf};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use gradus_asm::{Assembly, LintOptions, Options, assemble, format, lint};
use gradus_lsp::{Files, Project, Server};
use gradus_tmcl::catalogue::{Module, TMCM_3351};
use lsp_server::{Message, Notification, Request};
use serde_json::{Value, json};

/// Commands of the program: all that the module holds.
const LINES: usize = 6144;
/// Changes that come before the server has time to look.
const BURST: i32 = 400;
const URI: &str = "file:///stage/long.tmc";

/// Routines of nine commands each and a main loop that calls them.
fn program() -> String {
    let routines = (LINES - 2) / 10;
    let calls: String = (0..routines).map(|number| format!("    CSUB Move{number}\n")).collect();
    let routine = |number: usize| {
        format!(
            "Move{number}:\n    GAP 1, 0\n    COMP {number}\n    JC GE, Back{number}\n    \
             MVP ABS, 0, {number} * 512  // there\n    WAIT POS, 0, 500\n    WAIT TICKS, 0, 10  // 100 ms\n\
             Back{number}:\n    MVP ABS, 0, 0\n    WAIT POS, 0, 0\n    RSUB\n"
        )
    };
    let routines: String = (0..routines).map(routine).collect();
    format!("Loop:\n{calls}    JA Loop\n    STOP\n{routines}")
}

fn assembled(text: &str) -> Assembly {
    let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
    assemble("long.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &nothing)
}

fn tools(criterion: &mut Criterion) {
    let text = program();
    let assembly = assembled(&text);
    assert!(!assembly.has_errors() && assembly.program.len() > LINES - 20, "{} commands", assembly.program.len());
    let mut group = criterion.benchmark_group("language");
    group.bench_function("assembler", |bencher| bencher.iter(|| assembled(black_box(&text))));
    group.bench_function("linter", |bencher| bencher.iter(|| lint(black_box(&assembly), &LintOptions::default())));
    group.bench_function("formatter", |bencher| bencher.iter(|| format(black_box(text.as_bytes()))));
    group.finish();
}

/// No files beside the open text.
struct Nothing;

impl Files for Nothing {
    fn read(&self, _: &Path) -> io::Result<Vec<u8>> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn programs(&self, _: &Path, _: usize) -> Vec<PathBuf> {
        Vec::new()
    }

    fn project(&self, _: &Path) -> Project {
        Project { module: &TMCM_3351, options: Options::default(), lint: LintOptions::default() }
    }

    fn module(&self, _: &str) -> Option<&'static Module> {
        None
    }
}

fn ask(server: &mut Server, method: &str, params: Value) -> Value {
    let answers = server.receive(Request { id: 1.into(), method: method.into(), params }.into());
    let [Message::Response(response)] = answers.as_slice() else { panic!("one response to {method}") };
    response.response_result.clone().expect(method)
}

fn tell(server: &mut Server, method: &str, params: Value) {
    server.receive(Notification { method: method.into(), params }.into());
}

fn started() -> Server {
    let mut server = Server::new(Box::new(Nothing));
    ask(&mut server, "initialize", json!({ "processId": null, "rootUri": null, "capabilities": {} }));
    tell(&mut server, "initialized", json!({}));
    server
}

fn open(server: &mut Server, text: &str) -> Vec<Message> {
    let document = json!({ "uri": URI, "languageId": "tmcl", "version": 0, "text": text });
    tell(server, "textDocument/didOpen", json!({ "textDocument": document }));
    server.settle()
}

/// A letter is typed in the middle, again and again.
fn burst(server: &mut Server) -> Vec<Message> {
    let middle = json!({ "line": LINES / 2, "character": 0 });
    for version in 1..=BURST {
        let change = json!({ "range": { "start": middle, "end": middle }, "text": " " });
        let document = json!({ "uri": URI, "version": version });
        tell(server, "textDocument/didChange", json!({ "textDocument": document, "contentChanges": [change] }));
    }
    let runs = server.runs();
    let diagnostics = server.settle();
    assert_eq!(server.runs(), runs + 1, "one analysis after the last change");
    diagnostics
}

fn opened(text: &str) -> Server {
    let mut server = started();
    assert!(!open(&mut server, text).is_empty(), "diagnostics come");
    server
}

fn server(criterion: &mut Criterion) {
    let text = program();
    let mut group = criterion.benchmark_group("language server");
    group.sample_size(20);
    group.bench_function("open to diagnostics", |bencher| {
        bencher.iter_batched(started, |mut server| (open(&mut server, &text), server), BatchSize::PerIteration);
    });
    group.bench_function("burst of changes", |bencher| {
        bencher.iter_batched(|| opened(&text), |mut server| (burst(&mut server), server), BatchSize::PerIteration);
    });
    let mut server = opened(&text);
    let line = text.lines().position(|line| line == "    GAP 1, 0");
    let place = json!({ "textDocument": { "uri": URI }, "position": { "line": line, "character": 8 } });
    for (name, method) in [("hover", "textDocument/hover"), ("completion", "textDocument/completion")] {
        assert!(!ask(&mut server, method, place.clone()).is_null(), "{name} answers");
        group.bench_function(name, |bencher| bencher.iter(|| ask(&mut server, method, place.clone())));
    }
    group.finish();
}

criterion_group!(benches, tools, server);
criterion_main!(benches);
