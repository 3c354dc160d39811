//! Endpoints: where hosts find a module.

use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;

/// A place where hosts connect. It prints as `pty PATH`, `tcp ADDR:PORT`, and is read as `pty:PATH`, `tcp:ADDR:PORT`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Endpoint {
    /// A pseudo-terminal; with a path a symbolic link there leads to it.
    Pty(Option<PathBuf>),
    /// A TCP address; port 0 picks a free one.
    Tcp(SocketAddr),
    /// A serial CAN adapter on a pseudo-terminal.
    SlcanPty(Option<PathBuf>),
    /// A serial CAN adapter on a TCP address.
    SlcanTcp(SocketAddr),
    /// A socketcand server on a TCP address. It takes any name for its bus.
    Socketcand(SocketAddr),
    /// A CAN interface of this computer: `can0`.
    Can(String),
}

impl Endpoint {
    /// True for those that carry frames of a CAN bus.
    pub fn is_can(&self) -> bool {
        !matches!(self, Self::Pty(_) | Self::Tcp(_))
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Pty(Some(path)) => write!(f, "pty {}", path.display()),
            Self::Pty(None) => f.write_str("pty"),
            Self::Tcp(address) => write!(f, "tcp {address}"),
            Self::SlcanPty(Some(path)) => write!(f, "slcan {}", path.display()),
            Self::SlcanPty(None) => f.write_str("slcan"),
            Self::SlcanTcp(address) => write!(f, "slcan {address}"),
            Self::Socketcand(address) => write!(f, "socketcand {address}"),
            Self::Can(interface) => write!(f, "can {interface}"),
        }
    }
}

/// A text that names no endpoint.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "`{0}` is no endpoint; expected pty, pty:PATH, tcp:ADDR:PORT, slcan:PATH, slcan:ADDR:PORT, socketcand:ADDR:PORT or can:INTERFACE"
)]
pub struct EndpointParseError(String);

impl FromStr for Endpoint {
    type Err = EndpointParseError;

    fn from_str(text: &str) -> Result<Self, EndpointParseError> {
        let unknown = || EndpointParseError(text.to_owned());
        let (kind, place) = text.split_once(':').unwrap_or((text, ""));
        let path = (!place.is_empty()).then(|| PathBuf::from(place));
        let listens = || address(place).ok_or_else(unknown);
        match kind {
            "pty" => Ok(Self::Pty(path)),
            "tcp" => listens().map(Self::Tcp),
            "slcan" => Ok(address(place).map_or(Self::SlcanPty(path), Self::SlcanTcp)),
            "socketcand" => listens().map(Self::Socketcand),
            "can" if !place.is_empty() => Ok(Self::Can(place.to_owned())),
            _ => Err(unknown()),
        }
    }
}

/// The address of a host by name or number; where a name has several, one that IPv4 clients reach.
pub fn address(text: &str) -> Option<SocketAddr> {
    text.to_socket_addrs().ok().and_then(|all| all.min_by_key(SocketAddr::is_ipv6))
}

/// Why an endpoint could not be opened.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum EndpointError {
    #[error("cannot listen on {address}; choose another port (0 picks a free one)")]
    Listen { address: SocketAddr, source: io::Error },
    #[error(
        "{address} can be reached from other computers, which could move the motors; use 127.0.0.1 or allow remote hosts"
    )]
    Remote { address: SocketAddr },
    #[error("{endpoint} does not fit the bus {bus}; {}", if endpoint.is_can() {
        "a serial line has the endpoints pty and tcp"
    } else {
        "a CAN bus has the endpoints slcan, socketcand and can"
    })]
    Kind { endpoint: Endpoint, bus: String },
    #[error("cannot open the CAN interface {interface}; it must be up: `ip link set {interface} up`")]
    Can { interface: String, source: io::Error },
    #[error("this program was built without CAN interfaces (feature `socketcan`, on Linux)")]
    NoSocketCan,
    #[error("cannot open a pseudo-terminal")]
    Pty { source: io::Error },
    #[error("cannot make the link {path}")]
    Link { path: PathBuf, source: io::Error },
    #[error("{path} exists and is not a dead link of an earlier run; remove it or choose another path")]
    Occupied { path: PathBuf },
}

/// Listens on an address, for this computer only unless `allow_remote`.
pub(crate) fn listen(address: SocketAddr, allow_remote: bool) -> Result<TcpListener, EndpointError> {
    if !allow_remote && !address.ip().is_loopback() {
        return Err(EndpointError::Remote { address });
    }
    let open = || {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(listener)
    };
    open().map_err(|source| EndpointError::Listen { address, source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    #[test]
    fn endpoints_print_as_lines_for_scripts() {
        let cases = [
            (Endpoint::Pty(Some("/dev/pts/3".into())), "pty /dev/pts/3"),
            (Endpoint::Tcp(address("127.0.0.1:4322")), "tcp 127.0.0.1:4322"),
            (Endpoint::Tcp(address("[::1]:4322")), "tcp [::1]:4322"),
            (Endpoint::SlcanPty(Some("/tmp/adapter".into())), "slcan /tmp/adapter"),
            (Endpoint::SlcanTcp(address("127.0.0.1:4323")), "slcan 127.0.0.1:4323"),
            (Endpoint::Socketcand(address("127.0.0.1:28600")), "socketcand 127.0.0.1:28600"),
            (Endpoint::Can("can0".into()), "can can0"),
        ];
        for (endpoint, text) in cases {
            assert_eq!(endpoint.to_string(), text);
        }
    }

    #[test]
    fn endpoints_are_read_as_they_print() {
        let cases = [
            "pty",
            "pty /a/b",
            "tcp 127.0.0.1:0",
            "slcan",
            "slcan a",
            "slcan [::1]:5",
            "socketcand 127.0.0.1:6",
            "can can0",
        ];
        for text in cases {
            let endpoint: Endpoint = text.replacen(' ', ":", 1).parse().unwrap();
            assert_eq!(endpoint.to_string(), text);
        }
        for text in ["", "tcp", "tcp:4322", "serial:/dev/x", "socketcand", "can", "can:"] {
            assert!(text.parse::<Endpoint>().is_err(), "{text}");
        }
    }

    #[test]
    fn addresses_of_other_computers_need_permission() {
        for text in ["0.0.0.0:0", "[::]:0", "192.0.2.1:4322"] {
            assert!(matches!(listen(address(text), false), Err(EndpointError::Remote { .. })), "{text}");
        }
        assert!(listen(address("0.0.0.0:0"), true).is_ok());
        assert!(listen(address("127.0.0.2:0"), false).is_ok());
    }

    #[test]
    fn port_in_use_is_named() {
        let first = listen(address("127.0.0.1:0"), false).unwrap();
        let taken = first.local_addr().unwrap();
        let error = listen(taken, false).unwrap_err();
        assert_eq!(error.to_string(), format!("cannot listen on {taken}; choose another port (0 picks a free one)"));
    }
}
