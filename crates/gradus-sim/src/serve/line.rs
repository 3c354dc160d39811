//! A line to one host: bytes in, replies out, never waiting.

use std::io;
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use rustix::io::Errno;

#[cfg(all(target_os = "linux", feature = "socketcan"))]
use super::can_socket::CanInterface;
use super::protocol::Protocol;
use super::pty::Pty;
use super::waiter::Interest;
use crate::{HostId, Rig};

/// A pause inside a datagram after which a new one begins (BEHAVIOUR 1: TCP and pseudo-terminals), unless the bus has a rule of its
/// own. It is a matter of the host's clock, however fast virtual time runs.
const DATAGRAM_GAP: Duration = Duration::from_millis(50);

/// Bytes read at once.
const READ_LEN: usize = 4096;

/// With so many bytes unsent no more requests are taken.
const OUTBOX_BUSY: usize = 4096;

/// With so many bytes unsent, events included, nobody is listening.
const OUTBOX_FULL: usize = 65_536;

/// What carries the bytes.
#[derive(Debug)]
pub(crate) enum Carrier {
    Pty(Pty),
    Tcp(TcpStream),
    #[cfg(all(target_os = "linux", feature = "socketcan"))]
    Can(CanInterface),
}

impl Carrier {
    /// A stream that never waits.
    pub(crate) fn tcp(stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        Ok(Self::Tcp(stream))
    }
}

/// A host's connection to a bus.
#[derive(Debug)]
pub(crate) struct Line {
    carrier: Carrier,
    bus: usize,
    host: HostId,
    protocol: Protocol,
    /// Bytes that the carrier has not taken yet.
    outbox: Vec<u8>,
    /// When the host was heard last, `None` if it may have said more that has not been read.
    heard: Option<Instant>,
    closed: bool,
    /// What the waiter was told last.
    pub(crate) awaited: Interest,
}

impl Line {
    pub(crate) fn new(carrier: Carrier, protocol: Protocol, bus: usize, rig: &mut Rig) -> Self {
        let mut outbox = Vec::with_capacity(OUTBOX_BUSY);
        outbox.extend_from_slice(protocol.greeting());
        let host = rig.attach(bus);
        if matches!(carrier, Carrier::Tcp(_)) {
            // PyTrinamic takes raw bytes behind a reply from serial ports only, and fails on a socket that offers them.
            rig.refuse_bulk(host);
        }
        Self { carrier, bus, host, protocol, outbox, heard: None, closed: false, awaited: Interest::READ }
    }

    /// The bus that it leads to.
    pub(crate) fn bus(&self) -> usize {
        self.bus
    }

    /// Takes the host off its bus.
    pub(crate) fn detach(&self, rig: &mut Rig) {
        rig.detach(self.host);
    }

    /// What becomes readable when a client of a pseudo-terminal comes or goes.
    pub(crate) fn visitors(&self) -> Option<BorrowedFd<'_>> {
        match &self.carrier {
            Carrier::Pty(pty) => pty.visitors(),
            _ => None,
        }
    }

    /// What the line waits for.
    pub(crate) fn interest(&self, rig: &Rig) -> Interest {
        Interest { read: self.listens() && !rig.is_busy(self.host), write: !self.outbox.is_empty() }
    }

    fn listens(&self) -> bool {
        self.outbox.len() < OUTBOX_BUSY
    }

    /// True when the host has gone for good. A pseudo-terminal waits for the next one.
    pub(crate) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Starts afresh when a pseudo-terminal changes hands.
    pub(crate) fn check_visitors(&mut self, rig: &mut Rig) {
        if let Carrier::Pty(pty) = &mut self.carrier
            && pty.changes_hands()
        {
            self.outbox.clear();
            self.protocol.restart();
            rig.detach(self.host);
            self.host = rig.attach(self.bus);
        }
    }

    /// Hands the bus what has come at `wall`; [`flush`](Self::flush) sends the replies.
    pub(crate) fn receive(&mut self, rig: &mut Rig, wall: Instant) {
        #[cfg(all(target_os = "linux", feature = "socketcan"))]
        if let Carrier::Can(socket) = &self.carrier {
            while let Ok(frame) = socket.read() {
                rig.send_frame(self.host, frame);
            }
            return;
        }
        let mut buffer = [0; READ_LEN];
        match rustix::io::read(self.as_fd(), &mut buffer) {
            Ok(0) => self.fail(),
            Ok(len) => {
                // Who writes has come before: seen only now, the arrival would throw away the reply.
                self.check_visitors(rig);
                self.heed_rate(rig);
                self.resynchronise(rig, wall);
                self.heard = (len < READ_LEN).then_some(wall);
                self.protocol.receive(&buffer[..len], rig, self.host, &mut self.outbox);
            }
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => self.fail(),
        }
    }

    /// Sends and listens at the rate that the client of a pseudo-terminal has set, where that counts.
    fn heed_rate(&mut self, rig: &mut Rig) {
        if let Carrier::Pty(pty) = &self.carrier
            && rig.is_strict(self.bus)
            && let Some(baud) = pty.baud()
        {
            rig.set_host_rate(self.host, baud);
        }
    }

    /// Sends what has arrived for the host, as far as the carrier takes it.
    pub(crate) fn flush(&mut self, rig: &mut Rig) {
        #[cfg(all(target_os = "linux", feature = "socketcan"))]
        if let Carrier::Can(socket) = &self.carrier {
            while let Some(frame) = rig.take_frame(self.host) {
                // A frame that a bus has no room for is lost.
                let _ = socket.write(&frame);
            }
            return;
        }
        self.protocol.collect(rig, self.host, &mut self.outbox);
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
    fn resynchronise(&mut self, rig: &mut Rig, wall: Instant) {
        if self.heard.is_some_and(|heard| wall.saturating_duration_since(heard) > DATAGRAM_GAP) {
            rig.resynchronise(self.host);
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
            #[cfg(all(target_os = "linux", feature = "socketcan"))]
            Carrier::Can(socket) => socket.as_fd(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;
    use crate::Bench;

    /// A line whose host never reads, with a carrier that takes no more.
    fn stuffed(carrier: Carrier, rig: &mut Rig) -> Line {
        let mut line = Line::new(carrier, Protocol::Bytes, 0, rig);
        let mut left = 0;
        while left < OUTBOX_FULL {
            line.outbox.resize(OUTBOX_FULL, 0);
            line.flush(rig);
            left = line.outbox.len();
        }
        line
    }

    #[test]
    fn host_that_reads_nothing_is_let_go_when_its_outbox_is_full() {
        let mut rig = Rig::from(Bench::with_defaults(&TMCM_3351));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let _host = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let carrier = Carrier::tcp(listener.accept().unwrap().0).unwrap();
        let mut line = stuffed(carrier, &mut rig);
        assert!(!line.is_closed(), "{OUTBOX_FULL} bytes are not too many");
        assert!(!line.interest(&rig).read, "but no more requests are taken");
        line.outbox.push(0);
        line.flush(&mut rig);
        assert!(line.is_closed() && line.outbox.is_empty());
    }

    #[test]
    fn pseudo_terminal_that_nobody_reads_loses_what_waits_and_lives_on() {
        let mut rig = Rig::from(Bench::with_defaults(&TMCM_3351));
        let mut line = stuffed(Carrier::Pty(Pty::open(None).unwrap()), &mut rig);
        line.outbox.push(0);
        line.flush(&mut rig);
        assert!(!line.is_closed() && line.outbox.is_empty() && line.interest(&rig).read);
    }
}
