//! Bytes over TCP.

use std::io::{self, Read, Write};
use std::net::{self, ToSocketAddrs};
use std::time::{Duration, Instant};

use crate::Stream;
use crate::link::received;

/// How long opening a connection may take.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
/// How long the other end may leave unread what it is sent.
const SEND_TIMEOUT: Duration = Duration::from_secs(1);
/// The shortest time-out that a socket takes; zero would mean none at all.
const SHORTEST_WAIT: Duration = Duration::from_micros(1);

/// A connection to a TCP port that carries serial datagrams.
pub struct TcpStream {
    stream: net::TcpStream,
    opened: Instant,
}

impl TcpStream {
    /// Connects; `Err` holds the reason in words.
    pub fn open(host: &str, port: u16) -> Result<Self, String> {
        let stream = connect(host, port).map_err(|error| reason(&error))?;
        Ok(Self { stream, opened: Instant::now() })
    }
}

/// Tries the addresses of the host one after another.
fn connect(host: &str, port: u16) -> io::Result<net::TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, format!("the host `{host}` has no address"));
    for address in (host, port).to_socket_addrs()? {
        match net::TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(SEND_TIMEOUT))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::ConnectionRefused => "nothing listens there; is the module or `gradus sim` running?".into(),
        io::ErrorKind::TimedOut => format!("no answer within {} s; is the address right?", CONNECT_TIMEOUT.as_secs()),
        _ => error.to_string(),
    }
}

impl Stream for TcpStream {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        let wait = deadline.saturating_sub(self.now());
        if wait.is_zero() {
            self.stream.set_nonblocking(true)?;
            let read = self.stream.read(buffer);
            self.stream.set_nonblocking(false)?;
            return received(read);
        }
        self.stream.set_read_timeout(Some(wait.max(SHORTEST_WAIT)))?;
        received(self.stream.read(buffer))
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn what_to_check(&self) -> &'static str {
        "that a module is behind this port, and its address (?address=N)"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_to_check_is_the_address_and_not_the_cable() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let link = TcpStream::open("127.0.0.1", listener.local_addr().unwrap().port()).unwrap();
        let check = link.what_to_check();
        assert!(check.contains("?address=N") && !check.contains("cable") && !check.contains("baud"), "{check}");
    }
}
