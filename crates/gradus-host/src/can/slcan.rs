//! Serial CAN adapters that speak slcan, on a serial port or over TCP.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use gradus_tmcl::can::Frame;
use gradus_tmcl::slcan::{Command, LineReader, Text};

use super::FramePort;
use crate::Stream;
use crate::link::GRACE;
use crate::serial::SerialStream;
use crate::tcp::TcpStream;
use crate::url::SlcanPlace;

/// How long an adapter may take to do what it is told. Some answer nothing at all.
const PATIENCE: Duration = Duration::from_millis(100);
/// How long old frames may come out of it.
const LONGEST_NOISE: Duration = Duration::from_secs(1);

/// An adapter that takes part in its bus.
pub struct Slcan<S> {
    stream: S,
    reader: LineReader,
    /// What has come in a piece with an earlier line.
    pending: VecDeque<u8>,
}

/// Opens an adapter and lets it take part in the bus; `Err` holds the reason in words.
pub fn open(place: &SlcanPlace, bit_rate: u32) -> Result<Box<dyn FramePort>, String> {
    Ok(match place {
        SlcanPlace::Serial { path, baud } => Box::new(Slcan::new(SerialStream::open(path, *baud, false)?, bit_rate)?),
        SlcanPlace::Tcp { host, port } => Box::new(Slcan::new(TcpStream::open(host, *port)?, bit_rate)?),
    })
}

impl<S: Stream> Slcan<S> {
    /// Closes the adapter, in case another program has left it open, sets the bit rate, and opens it.
    pub fn new(stream: S, bit_rate: u32) -> Result<Self, String> {
        let rate = Text::bit_rate(bit_rate).ok_or_else(|| format!("no slcan adapter knows the bit rate {bit_rate}"))?;
        let mut adapter = Self { stream, reader: LineReader::new(), pending: VecDeque::new() };
        adapter.close().map_err(|error| error.to_string())?;
        adapter.tell(rate.bytes()).map_err(|problem| format!("{problem} the bit rate {bit_rate}"))?;
        adapter.tell(b"O\r").map_err(|problem| format!("{problem} to take part in the bus"))?;
        Ok(adapter)
    }

    /// Ends a line that a program before may have left unfinished, and leaves the bus. Whatever comes until the adapter is quiet
    /// answers that, or is an old frame; a closed adapter may refuse to be closed.
    fn close(&mut self) -> io::Result<()> {
        self.stream.send(b"\rC\r")?;
        let give_up = self.stream.now() + LONGEST_NOISE;
        while self.stream.now() < give_up && self.next(self.stream.now() + PATIENCE)?.is_some() {}
        Ok(())
    }

    fn tell(&mut self, line: &[u8]) -> Result<(), &'static str> {
        self.stream.send(line).map_err(|_| "the adapter does not take")?;
        let deadline = self.stream.now() + PATIENCE;
        match self.next(deadline) {
            Ok(Some(Err(()))) => Err("the adapter refuses"),
            Ok(_) => Ok(()),
            Err(_) => Err("the adapter has gone when asked for"),
        }
    }

    /// The next line that comes before the deadline; `Err(())` is the adapter's "no". A peer that never ends its line, or sends
    /// line after line, is listened to for [`GRACE`] past the deadline.
    fn next(&mut self, deadline: Duration) -> io::Result<Option<Result<Command, ()>>> {
        while self.stream.now() <= deadline + GRACE {
            while let Some(byte) = self.pending.pop_front() {
                if let Some(line) = self.reader.push(byte) {
                    return Ok(Some(line.map_err(|_| ())));
                }
            }
            let mut buffer = [0; 256];
            match self.stream.receive(&mut buffer, deadline)? {
                0 if self.stream.now() >= deadline => return Ok(None),
                count => self.pending.extend(&buffer[..count]),
            }
        }
        Ok(None)
    }
}

impl<S: Stream> FramePort for Slcan<S> {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        self.stream.send(Text::frame(frame, None).bytes())
    }

    fn receive(&mut self, wait: Duration) -> io::Result<Option<Frame>> {
        let deadline = self.stream.now() + wait;
        loop {
            match self.next(deadline)? {
                None => return Ok(None),
                Some(Ok(Command::Frame(frame))) => return Ok(Some(frame)),
                Some(_) => {}
            }
        }
    }
}
