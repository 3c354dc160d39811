//! A client that others wrote would send the same messages; this one keeps them short.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

use gradus_asm::{LintOptions, Options};
use gradus_lsp::{Files, Project, Server};
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};
use lsp_server::{Message, Notification, Request};
use serde_json::{Value, json};

/// A folder `/stage` in memory.
#[derive(Default)]
pub struct Memory(pub HashMap<PathBuf, String>);

impl Files for Memory {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.0.get(path).map(|text| text.clone().into_bytes()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn programs(&self, folder: &Path, most: usize) -> Vec<PathBuf> {
        let is_program = |path: &&PathBuf| path.starts_with(folder) && path.extension().is_some_and(|it| it == "tmc");
        let mut programs: Vec<_> = self.0.keys().filter(is_program).cloned().collect();
        programs.sort();
        programs.truncate(most);
        programs
    }

    fn project(&self, _: &Path) -> Project {
        Project { module: &TMCM_3351, options: Options::default(), lint: LintOptions::default() }
    }

    fn module(&self, name: &str) -> Option<&'static Module> {
        MODULES.iter().find(|module| module.name.eq_ignore_ascii_case(name)).copied()
    }
}

/// A client with its server.
pub struct Client {
    pub server: Server,
    next_id: i32,
    version: i32,
}

pub const URI: &str = "file:///stage/a.tmc";

impl Client {
    /// A server that is initialised for the folder `/stage` with these files.
    pub fn new(files: &[(&str, &str)]) -> Self {
        let capabilities = json!({
            "general": { "positionEncodings": ["utf-8", "utf-16"] },
            "textDocument": {
                "completion": { "completionItem": { "snippetSupport": true } },
                "documentSymbol": { "hierarchicalDocumentSymbolSupport": true },
            },
        });
        Self::with_capabilities(files, capabilities).0
    }

    /// The same with the answer to `initialize`.
    pub fn with_capabilities(files: &[(&str, &str)], capabilities: Value) -> (Self, Value) {
        let files = files.iter().map(|(name, text)| (Path::new("/stage").join(name), (*text).to_owned()));
        let mut client = Self { server: Server::new(Box::new(Memory(files.collect()))), next_id: 0, version: 0 };
        let folder = json!([{ "uri": "file:///stage", "name": "stage" }]);
        let options = json!({ "codeLens": true });
        let params = json!({ "processId": null, "rootUri": null, "capabilities": capabilities, "workspaceFolders": folder, "initializationOptions": options });
        let answer = client.ask("initialize", params).unwrap();
        client.tell("initialized", json!({}));
        (client, answer)
    }

    /// Sends a request and returns its result, or the error's message.
    pub fn ask(&mut self, method: &str, params: Value) -> Result<Value, String> {
        self.next_id += 1;
        let request = Request { id: self.next_id.into(), method: method.to_owned(), params };
        let answers = self.server.receive(request.into());
        let [Message::Response(response)] = answers.as_slice() else { panic!("one response to {method}: {answers:?}") };
        assert_eq!(response.id, self.next_id.into());
        response.response_result.clone().map_err(|error| error.message)
    }

    pub fn tell(&mut self, method: &str, params: Value) {
        let notification = Notification { method: method.to_owned(), params };
        assert!(self.server.receive(notification.into()).is_empty());
    }

    /// Opens a text; returns the diagnostics.
    pub fn open(&mut self, uri: &str, text: &str) -> HashMap<String, Vec<Value>> {
        self.version += 1;
        let document = json!({ "uri": uri, "languageId": "tmcl", "version": self.version, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        self.settle()
    }

    /// Replaces a piece of a text, without looking at the diagnostics.
    pub fn edit(&mut self, uri: &str, start: (u32, u32), end: (u32, u32), text: &str) {
        self.version += 1;
        let range = json!({ "start": place(start), "end": place(end) });
        let document = json!({ "uri": uri, "version": self.version });
        let changes = json!([{ "range": range, "text": text }]);
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
    }

    /// Lets the server analyse; returns the diagnostics by URI.
    pub fn settle(&mut self) -> HashMap<String, Vec<Value>> {
        let publications = self.server.settle().into_iter().map(|message| match message {
            Message::Notification(it) if it.method == "textDocument/publishDiagnostics" => {
                let uri = it.params["uri"].as_str().unwrap().to_owned();
                (uri, it.params["diagnostics"].as_array().unwrap().clone())
            }
            other => panic!("{other:?}"),
        });
        publications.collect()
    }

    /// Asks about a place of the first text.
    pub fn at(&mut self, method: &str, line: u32, character: u32) -> Value {
        self.ask(method, position(URI, line, character)).unwrap()
    }

    /// Asks about the first text.
    pub fn about(&mut self, method: &str) -> Value {
        let range = json!({ "start": place((0, 0)), "end": place((999, 0)) });
        let context = json!({ "diagnostics": [] });
        self.ask(method, json!({ "textDocument": { "uri": URI }, "range": range, "context": context })).unwrap()
    }
}

pub fn place((line, character): (u32, u32)) -> Value {
    json!({ "line": line, "character": character })
}

pub fn position(uri: &str, line: u32, character: u32) -> Value {
    json!({ "textDocument": { "uri": uri }, "position": place((line, character)), "context": { "includeDeclaration": true } })
}

/// `severity code line:character` of diagnostics, one a line.
pub fn short(diagnostics: &[Value]) -> String {
    let line = |it: &Value| {
        let start = &it["range"]["start"];
        format!("{} {} {}:{}", it["severity"], it["code"].as_str().unwrap(), start["line"], start["character"])
    };
    diagnostics.iter().map(line).collect::<Vec<_>>().join("\n")
}
