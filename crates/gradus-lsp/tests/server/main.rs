//! The server as a client meets it: messages in, messages out.

mod answers;
mod conversation;
mod edits;
mod support;
