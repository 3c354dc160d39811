//! What stands in for a link between its end and the next one.

use std::io;
use std::time::Duration;

use gradus_tmcl::Instruction;

use crate::{Address, Heard, Link, Nature};

/// A link to nowhere, with the nature and the time of the one before.
pub struct Unplugged {
    pub nature: Nature,
    pub now: Duration,
}

fn gone() -> io::Error {
    io::Error::new(io::ErrorKind::NotConnected, "the port is not open")
}

impl Link for Unplugged {
    fn send(&mut self, _: Address, _: Instruction) -> io::Result<()> {
        Err(gone())
    }

    fn receive(&mut self, _: Duration) -> io::Result<Heard> {
        Err(gone())
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn nature(&self) -> Nature {
        self.nature
    }
}
