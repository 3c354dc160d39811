//! What a fuzzer of the server calls.

use std::io;
use std::path::{Path, PathBuf};

use gradus_asm::{LintOptions, Options};
use gradus_tmcl::catalogue::{Module, TMCM_3351};
use lsp_server::{Message, Notification, Request};
use serde_json::{Value, json};

use crate::server::Server;
use crate::workspace::{Files, Project};

/// A disk without files.
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

/// Takes any bytes as what a client sends: lines of `METHOD JSON`, after `initialize` and a text that is the bytes themselves.
/// Panics if the server does, or if a request is not answered once.
pub fn fuzz_messages(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut server = Server::new(Box::new(Nothing));
    server.receive(request("initialize", json!({ "capabilities": {} })));
    let document = json!({ "uri": "file:///a.tmc", "languageId": "tmcl", "version": 1, "text": text });
    server.receive(notification("textDocument/didOpen", json!({ "textDocument": document })));
    server.settle();
    for line in text.lines().take(200) {
        let (method, params) = line.split_once(' ').unwrap_or((line, ""));
        let params = serde_json::from_str(params).unwrap_or(Value::Null);
        server.receive(notification(method, params.clone()));
        assert_eq!(server.receive(request(method, params)).len(), 1, "one answer to {method}");
        server.settle();
    }
}

fn request(method: &str, params: Value) -> Message {
    Request { id: 1.into(), method: method.to_owned(), params }.into()
}

fn notification(method: &str, params: Value) -> Message {
    Notification { method: method.to_owned(), params }.into()
}
