//! The boundary between a session and the line, and what serial lines have in common.
//!
//! A [`Link`] carries datagrams: requests as commands with an address, answers as the nine bytes of a serial reply, whatever the
//! line is made of. A line of bytes is a [`Stream`]; [`Framed`] makes a link of it. A line of CAN frames is one by itself, see
//! [`can`](crate::can).

use std::io;
use std::time::Duration;

use gradus_sim::Bench;
use gradus_tmcl::{Instruction, Request};

/// A pause inside a datagram that ends it; longer than the 50 ms of modules on USB and TCP, so that they too have
/// thrown away an unfinished datagram.
pub(crate) const SILENCE: Duration = Duration::from_millis(60);

/// What is there already is taken though the deadline has passed, but no longer than this: a peer may never stop sending.
pub(crate) const GRACE: Duration = Duration::from_millis(60);

/// Where requests go, and where answers come from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Address {
    /// Address of the module, 0 to 255; on a CAN bus its identifier, 0 to 2047.
    pub module: u16,
    /// Identifier that answers carry on a CAN bus; `None`: any. Without meaning on a serial line.
    pub reply: Option<u16>,
}

impl Address {
    /// An address on a serial line.
    pub const fn serial(module: u8) -> Self {
        Self { module: module as u16, reply: None }
    }
}

/// What came over a line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Heard {
    /// Nothing in time.
    Nothing,
    /// A datagram of nine bytes.
    Datagram([u8; 9]),
    /// Fewer bytes, and then a pause.
    Fragment(Vec<u8>),
}

/// What kind of line a link is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Nature {
    /// True on a CAN bus, where addresses are identifiers, and where a frame may come twice: a node that misses the last bit of
    /// one sends it again.
    pub can: bool,
    /// What to check when no module answers, as the end of a sentence.
    pub check: &'static str,
}

/// A line to modules that carries datagrams, with the clock that belongs to it.
///
/// On a virtual module the clock is virtual: waiting costs no real time.
pub trait Link: Send {
    /// Sends a request.
    ///
    /// # Errors
    /// When the line is broken.
    fn send(&mut self, to: Address, instruction: Instruction) -> io::Result<()>;

    /// Waits for a datagram, at most until `deadline` on the clock of [`now`](Self::now). What is there already is taken
    /// even if the deadline has passed; a peer that never stops sending does not hold it up.
    ///
    /// # Errors
    /// When the line is broken or the other end has closed it.
    fn receive(&mut self, deadline: Duration) -> io::Result<Heard>;

    /// Time since the link was opened.
    fn now(&self) -> Duration;

    /// What kind of line it is.
    fn nature(&self) -> Nature;

    /// The bench at the other end, where that is one in this process. Its time is that of the link.
    fn bench(&mut self) -> Option<&mut Bench> {
        None
    }
}

/// A line of bytes, with its clock.
pub trait Stream: Send {
    /// Sends all bytes.
    ///
    /// # Errors
    /// When the line is broken.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes, at most until `deadline`, and says how many came. Bytes that
    /// are there already are taken even if the deadline has passed; 0: none came.
    ///
    /// # Errors
    /// When the line is broken or the other end has closed it.
    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize>;

    /// Time since the line was opened.
    fn now(&self) -> Duration;

    /// What to check when no module answers, as the end of a sentence.
    fn what_to_check(&self) -> &'static str;

    /// As [`Link::bench`].
    fn bench(&mut self) -> Option<&mut Bench> {
        None
    }
}

impl Stream for Box<dyn Stream> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        (**self).receive(buffer, deadline)
    }

    fn now(&self) -> Duration {
        (**self).now()
    }

    fn what_to_check(&self) -> &'static str {
        (**self).what_to_check()
    }

    fn bench(&mut self) -> Option<&mut Bench> {
        (**self).bench()
    }
}

/// Serial datagrams on a line of bytes.
pub struct Framed<S> {
    pub(crate) stream: S,
    /// True where every byte sent comes back, as on an RS-485 adapter whose receiver stays on.
    echo: bool,
    /// The request whose echo has not come yet.
    own: Option<[u8; 9]>,
}

impl<S: Stream> Framed<S> {
    /// Datagrams over `stream`. With `echo` the first datagram after a request is thrown away if it is that very request.
    pub fn new(stream: S, echo: bool) -> Self {
        Self { stream, echo, own: None }
    }

    /// The next nine bytes. The deadline holds for the first of them, [`SILENCE`] for each further one.
    fn collect(&mut self, mut deadline: Duration) -> io::Result<Heard> {
        let mut bytes = [0; 9];
        let mut len = 0;
        while len < bytes.len() {
            match self.stream.receive(&mut bytes[len..], deadline)? {
                0 if self.stream.now() < deadline => {}
                0 if len == 0 => return Ok(Heard::Nothing),
                0 => return Ok(Heard::Fragment(bytes[..len].to_vec())),
                count => {
                    len += count;
                    deadline = self.stream.now() + SILENCE;
                }
            }
        }
        Ok(Heard::Datagram(bytes))
    }
}

impl<S: Stream> Link for Framed<S> {
    fn send(&mut self, to: Address, instruction: Instruction) -> io::Result<()> {
        let bytes = Request { address: to.module as u8, instruction }.emit();
        self.own = self.echo.then_some(bytes);
        self.stream.send(&bytes)
    }

    fn receive(&mut self, deadline: Duration) -> io::Result<Heard> {
        let heard = self.collect(deadline)?;
        match (&heard, self.own) {
            (Heard::Nothing, _) | (_, None) => return Ok(heard),
            (Heard::Datagram(bytes), Some(own)) if *bytes == own => self.own = None,
            _ => {
                self.own = None;
                return Ok(heard);
            }
        }
        self.collect(deadline)
    }

    fn now(&self) -> Duration {
        self.stream.now()
    }

    fn nature(&self) -> Nature {
        Nature { can: false, check: self.stream.what_to_check() }
    }

    fn bench(&mut self) -> Option<&mut Bench> {
        self.stream.bench()
    }
}

/// What `receive` makes of a read from a file or a socket: no bytes in time is 0, the end of the stream an error.
pub(crate) fn received(read: io::Result<usize>) -> io::Result<usize> {
    use io::ErrorKind::{Interrupted, TimedOut, UnexpectedEof, WouldBlock};
    match read {
        Ok(0) => Err(io::Error::new(UnexpectedEof, "the other end closed the connection")),
        Err(error) if matches!(error.kind(), TimedOut | WouldBlock | Interrupted) => Ok(0),
        other => other,
    }
}
