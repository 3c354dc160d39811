//! Listening to a line without saying anything.

use std::io;
use std::time::Duration;

use super::{Direction, Packet, Record, time_of_day};
use crate::can::FramePort;
use crate::link::Framed;
use crate::serial::SerialStream;
use crate::tcp::TcpStream;
use crate::{Error, Heard, Link, Place, Url, can};

/// An ear on a line: an RS-485 segment, a CAN bus, or a port that copies what passes.
pub enum Sniffer {
    /// A serial line.
    Serial(Box<dyn Link>),
    /// A CAN bus.
    Can(Box<dyn FramePort>),
}

impl Sniffer {
    /// Opens a line to listen.
    ///
    /// # Errors
    /// When it does not open, or is one that nobody else can talk on.
    pub fn open(url: &Url) -> Result<Self, Error> {
        let opened = match &url.place {
            Place::Sim(_) => {
                Err("nobody else talks to a virtual module of this process; `gradus sim --trace` records".into())
            }
            Place::Tcp { host, port } => {
                TcpStream::open(host, *port).map(|line| Self::Serial(Box::new(Framed::new(line, false))))
            }
            Place::Serial { path, baud, .. } => {
                SerialStream::open(path, *baud, false).map(|line| Self::Serial(Box::new(Framed::new(line, false))))
            }
            Place::Can { bus, bit_rate } => can::open(bus, *bit_rate).map(|(port, _)| Self::Can(port)),
        };
        opened.map_err(|reason| Error::Open { port: url.to_string(), reason })
    }

    /// What passes next, if anything does within `wait`.
    ///
    /// # Errors
    /// When the line breaks.
    pub fn listen(&mut self, wait: Duration) -> io::Result<Option<Record>> {
        let packet = match self {
            Self::Can(port) => port.receive(wait)?.map(Packet::Can),
            Self::Serial(link) => match link.receive(link.now() + wait)? {
                Heard::Nothing => None,
                Heard::Datagram(bytes) => Some(Packet::Serial(bytes.to_vec())),
                Heard::Fragment(bytes) => Some(Packet::Serial(bytes)),
            },
        };
        Ok(packet.map(|packet| Record { at: time_of_day(), direction: Direction::Unknown, packet }))
    }
}
