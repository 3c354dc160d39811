//! Endpoints: where hosts find a module.

use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

/// A place where hosts connect. It prints as `pty PATH` or `tcp ADDR:PORT`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Endpoint {
    /// A pseudo-terminal; with a path a symbolic link there leads to it.
    Pty(Option<PathBuf>),
    /// A TCP address; port 0 picks a free one.
    Tcp(SocketAddr),
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Pty(Some(path)) => write!(f, "pty {}", path.display()),
            Self::Pty(None) => f.write_str("pty"),
            Self::Tcp(address) => write!(f, "tcp {address}"),
        }
    }
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
    #[error("a server has {most} endpoints at most")]
    TooMany { most: usize },
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
        ];
        for (endpoint, text) in cases {
            assert_eq!(endpoint.to_string(), text);
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
