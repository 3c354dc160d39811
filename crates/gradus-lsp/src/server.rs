//! The server: a function from messages to messages.
//!
//! [`Server::receive`] takes one message and returns the answers to it. [`Server::settle`] is called when no message waits any
//! more: it analyses what has changed since, once however many changes there were, and returns the diagnostics. Between the two
//! a request makes the analysis that it needs. Nothing in here waits, sleeps or owns a thread.

use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use serde_json::Value;

use crate::convert::{capabilities, read};
use crate::programs::Programs;
use crate::refusal::Refusal;
use crate::requests;
use crate::workspace::Files;

/// How far the conversation has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Life {
    Starting,
    Running,
    ShuttingDown,
    /// With its exit status.
    Ended(i32),
}

/// A language server for one client.
pub struct Server {
    life: Life,
    programs: Programs,
}

// Messages.
impl Server {
    /// Creates a server that reads these files.
    pub fn new(files: Box<dyn Files>) -> Self {
        Self { life: Life::Starting, programs: Programs::new(files) }
    }

    /// Takes a message and returns the answers.
    pub fn receive(&mut self, message: Message) -> Vec<Message> {
        match message {
            Message::Request(request) => vec![self.answer(request).into()],
            Message::Notification(notification) => {
                self.notice(&notification);
                Vec::new()
            }
            Message::Response(_) => Vec::new(), // this server asks nothing
        }
    }

    /// Returns the exit status of the process once the client has ended the conversation: 0 after a shutdown, else 1.
    pub fn exit_status(&self) -> Option<i32> {
        match self.life {
            Life::Ended(status) => Some(status),
            _ => None,
        }
    }

    /// Returns how many analyses there were.
    pub fn runs(&self) -> u64 {
        self.programs.runs
    }

    fn answer(&mut self, request: Request) -> Response {
        let Request { id, method, params } = request;
        match self.result(&method, params) {
            Ok(result) => Response { id, response_result: Ok(result) },
            Err(Refusal { code, message }) => refuse(id, code, message),
        }
    }

    fn result(&mut self, method: &str, params: Value) -> Result<Value, Refusal> {
        match (self.life, method) {
            (Life::Starting, "initialize") => self.initialize(params),
            (Life::Starting, _) => Err(Refusal::new(ErrorCode::ServerNotInitialized, "`initialize` comes first")),
            (Life::Running, "shutdown") => {
                self.life = Life::ShuttingDown;
                Ok(Value::Null)
            }
            (Life::Running, _) => match requests::served(method) {
                Some(serve) => serve(&mut self.programs, params),
                None => Err(Refusal::new(ErrorCode::MethodNotFound, format!("`{method}` is not served"))),
            },
            (Life::ShuttingDown | Life::Ended(_), _) => {
                Err(Refusal::new(ErrorCode::InvalidRequest, "the server is shutting down"))
            }
        }
    }

    fn initialize(&mut self, params: Value) -> Result<Value, Refusal> {
        self.programs.client = read::client(params)?;
        self.life = Life::Running;
        capabilities::initialized(&self.programs.client, requests::methods())
    }

    fn notice(&mut self, notification: &Notification) {
        let params = &notification.params;
        match notification.method.as_str() {
            "exit" => self.life = Life::Ended(i32::from(self.life != Life::ShuttingDown)),
            _ if self.life != Life::Running => {}
            "textDocument/didOpen" => {
                if let Ok((uri, version, text)) = read::opened(params) {
                    self.programs.open(uri, version, &text);
                }
            }
            "textDocument/didChange" => {
                if let Ok((uri, version, changes)) = read::changed(params) {
                    self.programs.edit(&uri, version, &changes);
                }
            }
            "textDocument/didClose" => {
                if let Ok(uri) = read::document(params) {
                    self.programs.close(&uri);
                }
            }
            "workspace/didChangeWatchedFiles" => {
                self.programs.disk_changed(&read::watched(params).unwrap_or_default());
            }
            _ => {}
        }
    }

    /// Analyses what has changed since the last call and returns the diagnostics.
    pub fn settle(&mut self) -> Vec<Message> {
        if self.life == Life::Running { self.programs.settle() } else { Vec::new() }
    }
}

fn refuse(id: RequestId, code: ErrorCode, message: String) -> Response {
    Response::new_err(id, code as i32, message)
}
