//! What the bytes of a line mean.

use super::adapter::Adapter;
use super::endpoint::Endpoint;
use super::socketcand::{GREETING, Socketcand};
use crate::{HostId, Rig};

/// Between the bytes of a host and a bus.
#[derive(Debug)]
pub(crate) enum Protocol {
    /// The bytes are those of the serial line.
    Bytes,
    Slcan(Adapter),
    Socketcand(Socketcand),
}

impl Protocol {
    /// That of an endpoint's lines, for a host that has just come.
    pub(crate) fn of(endpoint: &Endpoint) -> Self {
        match endpoint {
            Endpoint::Pty(_) | Endpoint::Tcp(_) | Endpoint::Can(_) => Self::Bytes,
            Endpoint::SlcanPty(_) | Endpoint::SlcanTcp(_) => Self::Slcan(Adapter::default()),
            Endpoint::Socketcand(_) => Self::Socketcand(Socketcand::default()),
        }
    }

    /// What a host is told when it comes.
    pub(crate) fn greeting(&self) -> &'static [u8] {
        if matches!(self, Self::Socketcand(_)) { GREETING } else { &[] }
    }

    /// Starts afresh for the next host.
    pub(crate) fn restart(&mut self) {
        match self {
            Self::Bytes => {}
            Self::Slcan(adapter) => *adapter = Adapter::default(),
            Self::Socketcand(server) => *server = Socketcand::default(),
        }
    }

    /// Hands over what a host has sent; `answers` gets what the line itself has to say.
    pub(crate) fn receive(&mut self, bytes: &[u8], rig: &mut Rig, host: HostId, answers: &mut Vec<u8>) {
        match self {
            Self::Bytes => rig.send(host, bytes),
            Self::Slcan(adapter) => adapter.receive(bytes, rig, host, answers),
            Self::Socketcand(server) => server.receive(bytes, rig, host, answers),
        }
    }

    /// What has arrived for the host.
    pub(crate) fn collect(&self, rig: &mut Rig, host: HostId, into: &mut Vec<u8>) {
        match self {
            Self::Bytes => rig.take(host, into),
            Self::Slcan(adapter) => adapter.collect(rig, host, into),
            Self::Socketcand(server) => server.collect(rig, host, into),
        }
    }
}
