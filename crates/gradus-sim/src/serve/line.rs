//! A line to one host: bytes in, replies out, never waiting.

use std::io;
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use gradus_firmware::{Link, LinkKind};
use rustix::event::PollFlags;
use rustix::io::Errno;

use super::pty::Pty;
use crate::Bench;

/// A pause inside a datagram after which a new one begins (BEHAVIOUR 1: TCP and pseudo-terminals). It is a matter of the
/// host's clock, however fast virtual time runs.
const DATAGRAM_GAP: Duration = Duration::from_millis(50);

/// Bytes read at once.
const READ_LEN: usize = 4096;

/// With so many bytes unsent no more requests are taken.
const OUTBOX_BUSY: usize = 4096;

/// With so many bytes unsent, events included, nobody is listening.
const OUTBOX_FULL: usize = 65_536;

/// What carries the bytes.
#[derive(Debug)]
enum Carrier {
    Pty(Pty),
    Tcp(TcpStream),
}

/// A host's connection to the module.
#[derive(Debug)]
pub(crate) struct Line {
    carrier: Carrier,
    link_id: u32,
    link: Link,
    /// Bytes that the carrier has not taken yet.
    outbox: Vec<u8>,
    /// When the host was heard last, `None` if it may have said more that has not been read.
    heard: Option<Instant>,
    closed: bool,
}

impl Line {
    pub(crate) fn pty(pty: Pty, bench: &mut Bench) -> Self {
        Self::new(Carrier::Pty(pty), bench)
    }

    pub(crate) fn tcp(stream: TcpStream, bench: &mut Bench) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        Ok(Self::new(Carrier::Tcp(stream), bench))
    }

    fn new(carrier: Carrier, bench: &mut Bench) -> Self {
        let link_id = bench.new_link_id();
        let outbox = Vec::with_capacity(OUTBOX_BUSY);
        Self { carrier, link_id, link: new_link(link_id), outbox, heard: None, closed: false }
    }

    /// What becomes readable when a client of a pseudo-terminal comes or goes.
    pub(crate) fn visitors(&self) -> Option<BorrowedFd<'_>> {
        match &self.carrier {
            Carrier::Pty(pty) => pty.visitors(),
            Carrier::Tcp(_) => None,
        }
    }

    /// What the line waits for.
    pub(crate) fn interest(&self) -> PollFlags {
        let mut interest = PollFlags::empty();
        interest.set(PollFlags::IN, self.listens());
        interest.set(PollFlags::OUT, !self.outbox.is_empty());
        interest
    }

    fn listens(&self) -> bool {
        self.outbox.len() < OUTBOX_BUSY
    }

    /// True when the host has gone for good. A pseudo-terminal waits for the next one.
    pub(crate) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Starts afresh when a pseudo-terminal changes hands.
    pub(crate) fn check_visitors(&mut self, bench: &mut Bench) {
        if let Carrier::Pty(pty) = &mut self.carrier
            && pty.changes_hands()
        {
            self.outbox.clear();
            self.link_id = bench.new_link_id();
            self.link = new_link(self.link_id);
        }
    }

    /// Hands the module what has come at `wall`; [`flush`](Self::flush) sends the replies.
    pub(crate) fn receive(&mut self, bench: &mut Bench, wall: Instant) {
        let mut buffer = [0; READ_LEN];
        match rustix::io::read(self.as_fd(), &mut buffer) {
            Ok(0) => self.fail(),
            Ok(len) => {
                // Who writes has come before: seen only now, the arrival would throw away the reply.
                self.check_visitors(bench);
                self.resynchronise(wall);
                self.heard = (len < READ_LEN).then_some(wall);
                self.offer(&buffer[..len], bench);
            }
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => self.fail(),
        }
    }

    /// Sends what waits, as far as the carrier takes it.
    pub(crate) fn flush(&mut self, bench: &mut Bench) {
        self.collect(bench);
        if self.outbox.is_empty() {
            return;
        }
        match rustix::io::write(self.as_fd(), &self.outbox) {
            Ok(written) => drop(self.outbox.drain(..written)),
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => self.fail(),
        }
        if self.outbox.len() > OUTBOX_FULL {
            self.fail();
        }
        if !self.listens() {
            self.heard = None;
        }
    }

    /// Forgets the beginning of a datagram after a pause.
    fn resynchronise(&mut self, wall: Instant) {
        if self.heard.is_some_and(|heard| wall.saturating_duration_since(heard) > DATAGRAM_GAP) {
            self.link = new_link(self.link_id);
        }
    }

    /// A USB-like link holds no reply back, so the module takes everything if its replies are collected meanwhile.
    fn offer(&mut self, mut bytes: &[u8], bench: &mut Bench) {
        while !bytes.is_empty() {
            let taken = bench.send(&mut self.link, bytes);
            bytes = &bytes[taken..];
            self.collect(bench);
        }
    }

    fn collect(&mut self, bench: &mut Bench) {
        while let Some(reply) = bench.take(&mut self.link) {
            self.outbox.extend_from_slice(&reply);
        }
    }

    /// The host is gone, or does not listen.
    fn fail(&mut self) {
        self.outbox.clear();
        self.closed = matches!(self.carrier, Carrier::Tcp(_));
    }
}

impl AsFd for Line {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match &self.carrier {
            Carrier::Pty(pty) => pty.as_fd(),
            Carrier::Tcp(stream) => stream.as_fd(),
        }
    }
}

/// A link without a gap in virtual time; the line watches the wall clock instead.
fn new_link(id: u32) -> Link {
    Link::new(id, LinkKind::Usb, 0)
}
