//! A broker: several programs share one line, each over a TCP connection of its own.
//!
//! A client talks as to a module on an USB-like port: whatever address it writes, the one module answers. With
//! [`whole_bus`](Rights::whole_bus) the address counts, and all modules of the line can be reached. Requests of all clients go through
//! sessions, one at a time, and an answer goes to nobody but the client that asked; an event (status 128) goes to the client that
//! asked last for events of its module. A client whose request fails on the line gets no answer.
//!
//! Two threads do it, for any number of clients: one accepts and reads, the other asks the line and answers. Clients take
//! turns; MST, 128 and 133 go before everything else. A client that does not read its answers is let go.
//!
//! *Stop.* A [`LatchRequest`](crate::LatchRequest) is answered at once, whatever the line does. While the line is stopped clients
//! get status 6 for what acts. Readers may ask for the state only. No MST of a client stops the line.
//!
//! *Download.* Download mode belongs to the client that entered it: what others send to that module meanwhile is refused with status 6, but
//! for control commands. Any client may end it (133, or MST, before which the broker ends it); then the owner gets
//! status 6 until it sends 132 or 133. The download of a client that goes is ended.
//!
//! *A line that breaks.* All clients are let go, so that they learn of it, and so is who asks before the line is back. The port
//! is opened again as soon as that works. A stop lasts.

mod desk;
mod own_answer;
mod queue;
mod reception;
mod worker;

use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::{Address, Line, Url};

pub use desk::Desk;
use reception::Reception;

/// How many clients there may be at a time, unless told otherwise.
pub const MOST_CLIENTS: usize = 64;

/// Shares a line.
pub struct Broker {
    pub(crate) line: Line,
    /// The module that clients see.
    pub(crate) address: Address,
    /// How long an answer of the line may take.
    pub(crate) timeout: Duration,
    pub(crate) rights: Rights,
    pub(crate) most_clients: usize,
    /// The port, to open it again.
    pub(crate) url: Option<Url>,
}

/// What clients may do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Rights {
    /// True: the address in a request counts, and all modules of the line can be reached.
    pub whole_bus: bool,
    /// True: clients may read and nothing else; the rest is refused with status 6.
    pub read_only: bool,
}

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

impl Broker {
    /// A broker for the module at `address`.
    pub fn new(line: Line, address: Address, timeout: Duration, rights: Rights) -> Self {
        Self { line, address, timeout, rights, most_clients: MOST_CLIENTS, url: None }
    }

    /// Lets so many clients in at a time; [`MOST_CLIENTS`] at first.
    pub fn set_most_clients(&mut self, count: usize) {
        self.most_clients = count;
    }

    /// Opens the line at that port again when it breaks. Without this, it stays broken.
    pub fn reopen_at(&mut self, url: Url) {
        self.url = Some(url);
    }

    /// Serves clients until `stop` is set. `news` is told who comes and goes.
    ///
    /// # Errors
    /// When the socket fails.
    pub fn serve(self, listener: &TcpListener, stop: &AtomicBool, news: impl FnMut(News)) -> io::Result<()> {
        Reception::open(self, listener, news)?.run(stop)
    }
}
