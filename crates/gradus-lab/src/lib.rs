//! What the front ends of Gradus share: nothing here parses a command line, and nothing prints.
//!
//! [`Project`] is the file `gradus.toml`, in which a folder says once which port, module and rules its programs have.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod project;

pub use project::{ANY, FILE, KEYS, Key, Lint, Project, ProjectError, with_key};
