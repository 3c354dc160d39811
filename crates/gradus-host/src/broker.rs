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
mod news;
mod own_answer;
mod queue;
mod reception;
mod rights;
mod worker;

use std::io;
use std::net::TcpListener;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::{Address, Line, Url};

pub use desk::Desk;
pub use news::{News, Visit};
use reception::Reception;
pub use rights::Rights;

/// How many clients there may be at a time, unless told otherwise.
pub const MOST_CLIENTS: usize = 64;

/// Shares a line.
pub struct Broker {
    desk: Desk,
    most_clients: usize,
}

impl Broker {
    /// A broker for the module at `address`.
    pub fn new(line: Line, address: Address, timeout: Duration, rights: Rights) -> Self {
        Self { desk: Desk::new(line, address, timeout, rights), most_clients: MOST_CLIENTS }
    }

    /// Lets so many clients in at a time; [`MOST_CLIENTS`] at first.
    pub fn set_most_clients(&mut self, count: usize) {
        self.most_clients = count;
    }

    /// Opens the line at that port again when it breaks. Without this, it stays broken.
    pub fn reopen_at(&mut self, url: Url) {
        self.desk.reopen_at(url);
    }

    /// Serves clients until `stop` is set. `news` is told who comes and goes.
    ///
    /// # Errors
    /// When the socket fails.
    pub fn serve(self, listener: &TcpListener, stop: &AtomicBool, news: impl FnMut(News)) -> io::Result<()> {
        Reception::open(self.desk, self.most_clients, listener, news)?.run(stop)
    }
}
