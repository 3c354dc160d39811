//! A line that several sessions share.
//!
//! Only one request is under way on a line at a time, also where the modules would allow more (CAN): on RS-485 two answers at
//! once destroy each other, and an order that holds for the whole line is what makes late answers recognisable.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use gradus_sim::Bench;
use gradus_tmcl::can::Frame;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status, checksum};

use crate::can::CanLink;
use crate::link::{Framed, GRACE};
use crate::serial::SerialStream;
use crate::sim::SimStream;
use crate::tcp::TcpStream;
use crate::trace::{Direction, Packet, Record, Sink, time_of_day};
use crate::verdict::{Form, form};
use crate::{Address, Error, Heard, Link, Nature, Place, Session, Stream, Url};

/// How many events wait for somebody to take them; the oldest go.
const EVENTS_KEPT: usize = 1000;

/// A second reply of command 138: motors have reached their targets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PositionReached {
    /// The motors, one bit each.
    pub motors: i32,
}

/// An open line. Clones are the same line.
#[derive(Clone)]
pub struct Line {
    port: Arc<str>,
    shared: Arc<Shared>,
}

struct Shared {
    /// Whoever wants the wire queues here, so that nobody takes it twice while another one waits.
    turnstile: Mutex<()>,
    wire: Mutex<Wire>,
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
    /// Takes what passes.
    trace: Option<Sink>,
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

impl Line {
    /// Opens a port. Nothing is sent yet.
    ///
    /// # Errors
    /// When the port does not open.
    pub fn open(url: &Url) -> Result<Self, Error> {
        let link = link(url).map_err(|reason| Error::Open { port: url.to_string(), reason })?;
        let line = Self::over(link, &url.to_string());
        line.lock().doubling |= url.guard;
        Ok(line)
    }

    /// A line over a link that is open already; `port` names it in messages.
    pub fn over(link: Box<dyn Link>, port: &str) -> Self {
        let doubling = link.nature().can;
        let began = time_of_day().saturating_sub(link.now());
        let wire = Wire {
            link,
            doubts: 1,
            last: None,
            owing: Vec::new(),
            doubling,
            trace: None,
            began,
            events: VecDeque::new(),
        };
        Self { port: port.into(), shared: Arc::new(Shared { turnstile: Mutex::default(), wire: Mutex::new(wire) }) }
    }

    /// A line to the module of a bench, in virtual time.
    pub fn on_bench(bench: Bench) -> Self {
        let port = Url::sim(bench.catalogue()).to_string();
        Self::over(Box::new(Framed::new(SimStream::to(bench), false)), &port)
    }

    /// Lets `sink` have everything that passes from now on.
    pub fn trace(&self, sink: Sink) {
        self.lock().trace = Some(sink);
    }

    /// A session with the module of that address. It sends nothing before its first request.
    pub fn session(&self, address: Address) -> Session {
        Session::new(self.clone(), address)
    }

    /// Name of the port, for messages.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// What kind of line it is.
    pub fn nature(&self) -> Nature {
        self.lock().link.nature()
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Wire> {
        let _turn = self.shared.turnstile.lock().unwrap_or_else(PoisonError::into_inner);
        self.shared.wire.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The bench of a virtual module, if this is the only session with it.
    pub(crate) fn bench(&mut self) -> Option<&mut Bench> {
        let shared = Arc::get_mut(&mut self.shared)?;
        shared.wire.get_mut().unwrap_or_else(PoisonError::into_inner).link.bench()
    }
}

fn link(url: &Url) -> Result<Box<dyn Link>, String> {
    Ok(match &url.place {
        Place::Can { bus, bit_rate } => Box::new(CanLink::open(bus, *bit_rate)?),
        _ => Box::new(Framed::new(stream(url)?, url.echo)),
    })
}

/// The bytes of a serial line.
pub(crate) fn stream(url: &Url) -> Result<Box<dyn Stream>, String> {
    Ok(match &url.place {
        Place::Sim(module) => Box::new(SimStream::open(module)?),
        Place::Tcp { host, port } => Box::new(TcpStream::open(host, *port)?),
        Place::Serial { path, baud, rs485 } => Box::new(SerialStream::open(path, *baud, *rs485)?),
        Place::Can { .. } => return Err("a CAN bus carries no text; use a serial port of the module".into()),
    })
}

impl Wire {
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

    pub fn send(&mut self, to: Address, instruction: Instruction, port: &str) -> Result<(), Error> {
        self.link.send(to, instruction).map_err(|error| Error::Broken { port: port.into(), error })?;
        if self.trace.is_some() {
            let address = to.module as u8;
            let packet = match self.link.nature().can {
                true => Packet::Can(Frame::request(to.module.into(), &instruction)),
                false => Packet::Serial(Request { address, instruction }.emit().to_vec()),
            };
            self.record(Direction::Request, packet);
        }
        Ok(())
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
