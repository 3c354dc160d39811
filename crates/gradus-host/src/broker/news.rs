//! What a broker tells of its clients and its line.

use std::fmt;
use std::io;
use std::net::SocketAddr;

/// What a broker tells.
pub enum News {
    /// A client has come.
    Came(SocketAddr),
    /// A client has gone, or was let go.
    Gone(SocketAddr, Visit),
    /// A client was not let in: there are as many as there may be.
    Full(SocketAddr, usize),
    /// The system lets nobody in at present, having no descriptors left for example.
    Deaf(io::Error),
    /// The line broke, in the words of the error.
    LineBroke(String),
    /// The line is back.
    LineIsBack,
}

/// A client's account.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Visit {
    /// Requests that came.
    pub requests: u64,
    /// Answers that went back, but those that refuse.
    pub answers: u64,
    /// Requests that the broker refused.
    pub refused: u64,
    /// Requests that came damaged.
    pub damaged: u64,
    /// Requests that were sent again on the line.
    pub retries: u64,
    /// Datagrams on the line that answered nothing.
    pub drained: u64,
    /// True if it did not read its answers.
    pub unread: bool,
}

impl fmt::Display for News {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Came(client) => write!(f, "{client} came"),
            Self::Gone(client, visit) => write!(f, "{client} went: {visit}"),
            Self::Full(client, most) => {
                write!(f, "{client} was not let in: there are {most} clients already (--clients)")
            }
            Self::Deaf(error) => write!(f, "nobody is let in at present: {error}"),
            Self::LineBroke(error) => write!(f, "{error}; all clients are let go, and the port is tried again"),
            Self::LineIsBack => write!(f, "the line is back"),
        }
    }
}

impl fmt::Display for Visit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { requests, answers, retries, drained, .. } = self;
        write!(f, "{requests} requests, {answers} answers, {retries} sent again, {drained} drained")?;
        let others = [("refused", self.refused), ("damaged", self.damaged)];
        others.iter().filter(|(_, count)| *count > 0).try_for_each(|(what, count)| write!(f, ", {count} {what}"))?;
        if self.unread { write!(f, ", did not read its answers") } else { Ok(()) }
    }
}
