//! What holds for the whole line, used by one session at a time: the link, what may still come over it, who stores programs.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use gradus_tmcl::can::Frame;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status, checksum};

use super::downloads::Downloads;
use super::stop_latch::StopLatch;
use super::unplugged::Unplugged;
use crate::link::GRACE;
use crate::trace::{Direction, Packet, Record, Sink, time_of_day};
use crate::verdict::{Form, form};
use crate::{Address, Error, Heard, Link};

/// How many events wait for somebody to take them; the oldest go.
const EVENTS_KEPT: usize = 1000;

/// A second reply of command 138: motors have reached their targets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PositionReached {
    /// The motors, one bit each.
    pub motors: i32,
}

/// What holds for the whole line.
pub(crate) struct Wire {
    pub link: Box<dyn Link>,
    /// Counts the doubts whether an answer is under way. Who got in step before the latest one has to do it again.
    pub doubts: u64,
    /// The latest answer.
    pub last: Option<Exchange>,
    /// Answers that may still come.
    pub owing: Vec<Debt>,
    /// True where a second copy of an answer may come.
    pub doubling: bool,
    /// Who stores programs.
    pub downloads: Downloads,
    latch: Arc<StopLatch>,
    /// Takes what passes.
    pub trace: Option<Sink>,
    /// The time of day at which the link's clock stood at zero.
    began: Duration,
    /// Events that nobody has taken yet, with the address of their module.
    events: VecDeque<(u8, PositionReached)>,
}

/// An answer that may still come.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Debt {
    /// Where the request went.
    pub to: Address,
    pub form: Form,
}

/// A request and its answer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Exchange {
    pub to: Address,
    pub request: Instruction,
    pub answer: [u8; 9],
}

impl Wire {
    pub fn new(link: Box<dyn Link>, latch: Arc<StopLatch>) -> Self {
        let doubling = link.nature().can;
        let began = time_of_day().saturating_sub(link.now());
        Self {
            link,
            doubts: 1,
            last: None,
            owing: Vec::new(),
            doubling,
            downloads: Downloads::default(),
            latch,
            trace: None,
            began,
            events: VecDeque::new(),
        }
    }

    /// Closes the link.
    pub fn unplug(&mut self) {
        let (nature, now) = (self.link.nature(), self.link.now());
        self.link = Box::new(Unplugged { nature, now });
    }

    /// Goes on over another link, after the old one broke.
    pub fn replace(&mut self, link: Box<dyn Link>) {
        self.began = time_of_day().saturating_sub(link.now());
        self.link = link;
        self.last = None;
        self.owing.clear();
        self.downloads.end_all();
        self.doubt();
    }

    /// The answer to a request may still come.
    pub fn owe(&mut self, to: Address, request: Instruction) {
        let debt = Debt { to, form: form(request) };
        if !self.owing.contains(&debt) {
            self.owing.push(debt);
        }
    }

    /// From now on nobody knows what is under way.
    pub fn doubt(&mut self) {
        self.doubts += 1;
    }

    /// Sends a request. While the line is stopped one that acts goes nowhere.
    ///
    /// # Errors
    /// [`Error::Stopped`], and when the line is broken.
    pub fn send(&mut self, to: Address, instruction: Instruction, acts: bool, port: &str) -> Result<(), Error> {
        let latch = Arc::clone(&self.latch);
        let held = latch.hold();
        if acts && held.is_stopped() {
            return Err(Error::Stopped { port: port.into() });
        }
        self.link.send(to, instruction).map_err(|error| Error::Broken { port: port.into(), error })?;
        self.record_sent(to, instruction);
        Ok(())
    }

    fn record_sent(&mut self, to: Address, instruction: Instruction) {
        if self.trace.is_none() {
            return;
        }
        let address = to.module as u8;
        let packet = match self.link.nature().can {
            true => Packet::Can(Frame::request(to.module.into(), &instruction)),
            false => Packet::Serial(Request { address, instruction }.emit().to_vec()),
        };
        self.record(Direction::Request, packet);
    }

    fn record(&mut self, direction: Direction, packet: Packet) {
        let at = self.began + self.link.now();
        if let Some(sink) = &mut self.trace {
            sink(&Record { at, direction, packet });
        }
    }

    fn record_heard(&mut self, heard: &Heard) {
        let bytes = match heard {
            Heard::Nothing => return,
            Heard::Datagram(bytes) => bytes.as_slice(),
            Heard::Fragment(bytes) => bytes,
        };
        let packet = match bytes {
            // The ninth byte of a datagram from CAN is the link's own, except in a version text.
            [id, body @ .., last] if self.link.nature().can => {
                let own = checksum(&bytes[..bytes.len() - 1]) == *last;
                Frame::new(u32::from(*id), false, if own { body } else { &bytes[1..] }).map(Packet::Can)
            }
            _ => Some(Packet::Serial(bytes.to_vec())),
        };
        if let Some(packet) = packet {
            self.record(Direction::Reply, packet);
        }
    }

    /// What comes next; `None`: an event, which is kept. Whoever asks again and again with the same deadline hears nothing more
    /// from [`GRACE`] after it on, so that every wait ends.
    pub fn receive(&mut self, deadline: Duration, port: &str) -> Result<Option<Heard>, Error> {
        if self.link.now() > deadline + GRACE {
            return Ok(Some(Heard::Nothing));
        }
        let heard = self.link.receive(deadline).map_err(|error| Error::Broken { port: port.into(), error })?;
        if self.trace.is_some() {
            self.record_heard(&heard);
        }
        Ok(match heard {
            Heard::Datagram(bytes) if self.keep_event(&bytes) => None,
            other => Some(other),
        })
    }

    /// What comes next and is no event.
    pub fn hear(&mut self, deadline: Duration, port: &str) -> Result<Heard, Error> {
        loop {
            if let Some(heard) = self.receive(deadline, port)? {
                return Ok(heard);
            }
        }
    }

    fn keep_event(&mut self, bytes: &[u8; 9]) -> bool {
        let event = Reply::parse(bytes)
            .ok()
            .filter(|reply| reply.status == Status::POSITION_REACHED && reply.command == Opcode::POSITION_EVENT);
        if let Some(reply) = event {
            if self.events.len() == EVENTS_KEPT {
                self.events.pop_front();
            }
            self.events.push_back((reply.module, PositionReached { motors: reply.value }));
        }
        event.is_some()
    }

    /// The oldest event of a module.
    pub fn take_event(&mut self, module: u8) -> Option<PositionReached> {
        let index = self.events.iter().position(|(from, _)| *from == module)?;
        self.events.remove(index).map(|(_, event)| event)
    }

    /// Says what a datagram means that nobody asked for: a second copy of the latest answer shows that the line doubles.
    pub fn unasked(&mut self, bytes: &[u8; 9]) {
        self.doubling |= self.last.is_some_and(|last| last.answer == *bytes);
        self.doubt();
    }
}
