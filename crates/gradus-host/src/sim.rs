//! A link to a virtual module in the same process, in virtual time.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use gradus_sim::{Bench, Link as BenchLink, LinkKind, is_virtual, virtual_names};
use gradus_tmcl::catalogue::Module;

use crate::Stream;

/// A virtual module of its own. Requests and answers take no time.
pub struct SimStream {
    bench: Bench,
    line: BenchLink,
    /// Bytes that the module has sent and nobody has received yet.
    pending: VecDeque<u8>,
}

impl SimStream {
    /// Builds the module on the default machine and switches it on.
    pub fn open(module: &'static Module) -> Result<Self, String> {
        if !is_virtual(module) {
            return Err(format!("there is no virtual {}, only {}", module.name, virtual_names()));
        }
        Ok(Self::to(Bench::with_defaults(module)))
    }

    /// A link to the module of a bench.
    pub fn to(mut bench: Bench) -> Self {
        let line = bench.attach(LinkKind::Usb, 0);
        Self { bench, line, pending: VecDeque::new() }
    }

    fn fetch(&mut self) {
        while let Some(bytes) = self.bench.take(&mut self.line) {
            self.pending.extend(bytes);
        }
        while let Some(byte) = self.bench.take_byte(&mut self.line) {
            self.pending.push_back(byte);
        }
    }

    /// When the module does something next, not after `end_us`.
    fn next_us(&self, end_us: u64) -> u64 {
        let next = [self.bench.next_event(), self.bench.ready_at(&self.line)].into_iter().flatten().min();
        next.unwrap_or(end_us).max(self.bench.now() + 1).min(end_us)
    }
}

impl Stream for SimStream {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            self.fetch();
            match self.bench.send(&mut self.line, bytes) {
                // The module takes nothing while a reply is held back by the telegram pause.
                0 => self.bench.run_until(self.next_us(self.bench.now() + 1)),
                count => bytes = &bytes[count..],
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        let end_us = microseconds(deadline);
        self.fetch();
        while self.pending.is_empty() && self.bench.now() < end_us {
            self.bench.run_until(self.next_us(end_us));
            self.fetch();
        }
        io::Read::read(&mut self.pending, buffer)
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.bench.now())
    }

    fn what_to_check(&self) -> &'static str {
        "the address (?address=N)"
    }

    fn bench(&mut self) -> Option<&mut Bench> {
        Some(&mut self.bench)
    }
}

fn microseconds(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}
