//! The language server of TMCL: the protocol round the analysis of `gradus-asm`.
//!
//! [`Server`] is a function from message to messages. It owns no thread, no socket and no clock, and reads files through
//! [`Files`] alone, so that a process, a TCP connection and a page in a browser can all be a shell around it.
//!
//! Positions count UTF-8 where the client offers it, else UTF-16. A change makes the whole program anew; however many changes
//! wait, there is one analysis after the last. A file that others include is analysed inside each program that includes it.
//!
//! Not here: pull diagnostics, incremental parsing, formatting while typing, edits of the workspace that nobody asked for.

#![forbid(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod actions;
mod analysis;
mod complete;
mod context;
mod convert;
mod describe;
mod documents;
mod fuzz;
mod hints;
mod hover;
mod lines;
mod programs;
mod refusal;
mod requests;
mod server;
mod signature;
mod symbols;
mod text;
mod uri;
mod workspace;

pub use fuzz::fuzz_messages;
pub use server::Server;
pub use workspace::{Files, Project};
