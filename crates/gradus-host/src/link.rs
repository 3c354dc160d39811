//! The boundary between a session and the line.

use std::io;
use std::time::Duration;

use gradus_sim::Bench;

/// A stream of bytes to a module, with the clock that belongs to it.
///
/// On a virtual module the clock is virtual: waiting costs no real time.
pub trait Link: Send {
    /// Sends all bytes.
    ///
    /// # Errors
    /// When the line is broken.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes, at most until `deadline` on the clock of [`now`](Self::now), and says how many came. Bytes that
    /// are there already are taken even if the deadline has passed; 0: none came.
    ///
    /// # Errors
    /// When the line is broken or the other end has closed it.
    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize>;

    /// Time since the link was opened.
    fn now(&self) -> Duration;

    /// Lets `time` pass.
    fn sleep(&mut self, time: Duration);

    /// What to check when no module answers, as the end of a sentence.
    fn what_to_check(&self) -> &'static str;

    /// The bench at the other end, where that is one in this process: what only a simulated machine knows can be looked at.
    fn bench(&mut self) -> Option<&mut Bench> {
        None
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
