//! A CAN bus behind a socketcand server: lines of text in angle brackets over TCP.
//!
//! The server says `< hi >`, is asked for a bus with `< open can0 >` and for every frame with `< rawmode >`, and answers `< ok >`
//! to each. Then `< send 1 7 06 01 00 00 00 00 00 >` sends a frame (identifier, number of bytes, bytes, all hexadecimal), and
//! `< frame 2 1700000000.5 0164... >` is one that came, with its time.

use std::io::{self, ErrorKind};
use std::time::Duration;

use gradus_tmcl::can::Frame;

use super::FramePort;
use crate::Stream;
use crate::link::GRACE;
use crate::tcp::TcpStream;

/// How long the server may take to open its bus.
const PATIENCE: Duration = Duration::from_secs(3);
/// The longest text that a server sends in one pair of brackets; more is no socketcand.
const LONGEST: usize = 1024;

/// An open bus.
pub struct Socketcand<S> {
    stream: S,
    /// What has come and is not read yet.
    text: Vec<u8>,
}

/// Connects and opens the bus; `Err` holds the reason in words.
pub fn open(host: &str, port: u16, bus: &str) -> Result<Box<dyn FramePort>, String> {
    Ok(Box::new(Socketcand::new(TcpStream::open(host, port)?, bus)?))
}

impl<S: Stream> Socketcand<S> {
    /// Opens the bus of a server; `Err` holds the reason in words.
    pub fn new(stream: S, bus: &str) -> Result<Self, String> {
        let mut server = Self { stream, text: Vec::new() };
        server.expect("hi")?;
        for command in [format!("< open {bus} >"), "< rawmode >".into()] {
            server.stream.send(command.as_bytes()).map_err(|error| error.to_string())?;
            server.expect("ok")?;
        }
        Ok(server)
    }

    fn expect(&mut self, wanted: &str) -> Result<(), String> {
        match self.next(PATIENCE) {
            Ok(Some(text)) if text == wanted => Ok(()),
            Ok(Some(text)) => Err(format!("the server says `{text}`; is there such a bus?")),
            Ok(None) => Err("the server says nothing; is it a socketcand?".into()),
            Err(error) => Err(error.to_string()),
        }
    }

    /// The text of the next pair of brackets.
    fn next(&mut self, wait: Duration) -> io::Result<Option<String>> {
        let deadline = self.stream.now() + wait;
        loop {
            if let Some(end) = self.text.iter().position(|byte| *byte == b'>') {
                let message: Vec<u8> = self.text.drain(..=end).collect();
                let text = String::from_utf8_lossy(&message);
                return Ok(Some(text.trim().trim_matches(['<', '>']).trim().into()));
            }
            if self.text.len() > LONGEST {
                return Err(io::Error::new(ErrorKind::InvalidData, "the server does not speak socketcand"));
            }
            let mut buffer = [0; 256];
            match self.stream.receive(&mut buffer, deadline)? {
                0 if self.stream.now() >= deadline => return Ok(None),
                count => self.text.extend(&buffer[..count]),
            }
        }
    }
}

impl<S: Stream> FramePort for Socketcand<S> {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        self.stream.send(message(frame).as_bytes())
    }

    fn receive(&mut self, wait: Duration) -> io::Result<Option<Frame>> {
        let deadline = self.stream.now() + wait;
        while self.stream.now() <= deadline + GRACE {
            match self.next(deadline.saturating_sub(self.stream.now()))? {
                None => return Ok(None),
                Some(text) => {
                    if let Some(frame) = frame(&text) {
                        return Ok(Some(frame));
                    }
                }
            }
        }
        Ok(None)
    }
}

/// The text that sends a frame. The identifier's length tells its kind.
pub fn message(frame: &Frame) -> String {
    let id = if frame.extended { format!("{:08X}", frame.id) } else { format!("{:X}", frame.id) };
    let bytes: Vec<String> = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    format!("< send {id} {} {} >", frame.data().len(), bytes.join(" "))
}

/// The frame that a text tells of; `None` where it is about something else.
pub fn frame(text: &str) -> Option<Frame> {
    let mut words = text.split_ascii_whitespace();
    let (kind, id, _time) = (words.next()?, words.next()?, words.next()?);
    let digits: String = words.collect();
    let bytes = digits.as_bytes().chunks(2).map(|pair| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok());
    let bytes: Vec<u8> = bytes.collect::<Option<_>>()?;
    let frame = Frame::new(u32::from_str_radix(id, 16).ok()?, id.len() > 3, &bytes)?;
    (kind == "frame").then_some(frame)
}
