//! A broker: several programs share one line, each over a TCP connection of its own.
//!
//! A client talks as to a module on an USB-like port: whatever address it writes, the one module answers. With
//! [`whole_bus`](Rights::whole_bus) the address counts, and all modules of the line can be reached. Requests of all clients go through
//! sessions, one at a time, and an answer goes to nobody but the client that asked; an event (status 128) goes to the client that
//! asked last for events of its module. A client whose request fails on the line gets no answer.

use std::collections::HashMap;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use gradus_tmcl::catalogue::Effect;
use gradus_tmcl::{Framer, Instruction, Opcode, Reply, Request, Status};

use crate::{Address, Error, Line, Session, Statistics};

/// A pause inside a datagram that ends it, as on a module's own TCP port.
const GAP: Duration = Duration::from_millis(50);
/// How often a client's thread looks for events and for the end.
const GLANCE: Duration = Duration::from_millis(10);
/// The host's address in answers that are the broker's own.
const HOST: u8 = 2;

/// Shares a line.
pub struct Broker {
    line: Line,
    /// The module that clients see.
    address: Address,
    /// How long an answer of the line may take.
    timeout: Duration,
    rights: Rights,
    /// The client that gets the events of a module.
    listeners: Mutex<HashMap<u8, SocketAddr>>,
}

/// What clients may do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Rights {
    /// True: the address in a request counts, and all modules of the line can be reached.
    pub whole_bus: bool,
    /// True: clients may read and nothing else; the rest is refused with status 6.
    pub read_only: bool,
}

/// What a broker tells of its clients.
pub enum News {
    /// A client has come.
    Came(SocketAddr),
    /// A client has gone.
    Gone(SocketAddr, Box<Visit>),
}

/// A client's account.
#[derive(Default)]
pub struct Visit {
    /// Requests that came.
    pub requests: u64,
    /// Answers that went back.
    pub answers: u64,
    /// Requests that were refused because clients may only read.
    pub refused: u64,
    /// Requests that came damaged.
    pub damaged: u64,
    /// What its sessions saw of the line.
    pub line: Vec<Statistics>,
}

impl fmt::Display for News {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Came(client) => write!(f, "{client} came"),
            Self::Gone(client, visit) => {
                let sum = |count: fn(&Statistics) -> u64| visit.line.iter().map(count).sum::<u64>();
                let (requests, answers) = (visit.requests, visit.answers);
                write!(
                    f,
                    "{client} went: {requests} requests, {answers} answers, {} sent again",
                    sum(|seen| seen.retries)
                )?;
                write!(f, ", {} drained", sum(|seen| seen.drained))?;
                let others = [("refused", visit.refused), ("damaged", visit.damaged)];
                others
                    .iter()
                    .filter(|(_, count)| *count > 0)
                    .try_for_each(|(what, count)| write!(f, ", {count} {what}"))
            }
        }
    }
}

impl Broker {
    /// A broker for the module at `address`.
    pub fn new(line: Line, address: Address, timeout: Duration, rights: Rights) -> Self {
        Self { line, address, timeout, rights, listeners: Mutex::default() }
    }

    /// Serves clients until `stop` is set. `news` is told who comes and goes.
    ///
    /// # Errors
    /// When the socket fails.
    pub fn serve(&self, listener: &TcpListener, stop: &AtomicBool, news: impl Fn(News) + Sync) -> io::Result<()> {
        listener.set_nonblocking(true)?;
        std::thread::scope(|scope| {
            while !stop.load(Ordering::Relaxed) {
                match listener.accept() {
                    Ok((stream, client)) => {
                        let news = &news;
                        scope.spawn(move || {
                            news(News::Came(client));
                            news(News::Gone(client, Box::new(self.visit(stream, client, stop))));
                        });
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => std::thread::sleep(GLANCE),
                    // The client has gone before it was let in.
                    Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
                    Err(error) => return Err(error),
                }
            }
            Ok(())
        })
    }

    /// One client, until it goes, the line breaks or the broker stops.
    fn visit(&self, stream: TcpStream, address: SocketAddr, stop: &AtomicBool) -> Visit {
        let mut client = Client { broker: self, address, stream, sessions: HashMap::new(), visit: Visit::default() };
        let _ = client.talk(stop); // a client that goes is no error
        let mut listeners = self.listeners.lock().unwrap_or_else(PoisonError::into_inner);
        listeners.retain(|_, listener| *listener != address);
        client.visit.line = client.sessions.values().map(|session| session.statistics().clone()).collect();
        client.visit
    }
}

struct Client<'a> {
    broker: &'a Broker,
    address: SocketAddr,
    stream: TcpStream,
    /// One a module, by the address in the request.
    sessions: HashMap<u8, Session>,
    visit: Visit,
}

impl Client<'_> {
    fn talk(&mut self, stop: &AtomicBool) -> io::Result<()> {
        self.stream.set_nonblocking(false)?;
        self.stream.set_nodelay(true)?;
        self.stream.set_read_timeout(Some(GLANCE))?;
        let start = Instant::now();
        let mut framer = Framer::new(GAP.as_micros() as u32);
        let mut buffer = [0; 256];
        while !stop.load(Ordering::Relaxed) {
            let count = match self.stream.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => count,
                Err(error) if is_pause(&error) => 0,
                Err(error) => return Err(error),
            };
            let now_us = u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX);
            for byte in &buffer[..count] {
                if let Some(datagram) = framer.push(*byte, now_us) {
                    self.answer(&datagram)?;
                }
            }
            self.pass_events()?;
        }
        Ok(())
    }

    /// Answers one datagram, if there is an answer.
    fn answer(&mut self, datagram: &[u8; 9]) -> io::Result<()> {
        self.visit.requests += 1;
        let Ok(Request { address, instruction }) = Request::parse(datagram) else {
            self.visit.damaged += 1;
            return self.reply(datagram[0], Status::WRONG_CHECKSUM, Instruction::default());
        };
        if self.broker.rights.read_only && instruction.effect() != Effect::Read {
            self.visit.refused += 1;
            return self.reply(address, Status::NOT_AVAILABLE, instruction);
        }
        match self.session(address).relay(instruction) {
            Ok(bytes) => {
                self.listen_for(address, instruction);
                self.visit.answers += 1;
                self.stream.write_all(&bytes)
            }
            Err(Error::Broken { error, .. }) => Err(error),
            Err(_) => Ok(()),
        }
    }

    /// An answer of the broker's own.
    fn reply(&mut self, address: u8, status: Status, request: Instruction) -> io::Result<()> {
        let module = if self.broker.rights.whole_bus { address } else { self.broker.address.module as u8 };
        let reply = Reply { host: HOST, module, status, command: request.opcode, value: request.value };
        self.stream.write_all(&reply.emit())
    }

    fn session(&mut self, address: u8) -> &mut Session {
        let broker = self.broker;
        let key = if broker.rights.whole_bus { address } else { 0 };
        self.sessions.entry(key).or_insert_with(|| {
            let module = if broker.rights.whole_bus { u16::from(address) } else { broker.address.module };
            let mut session = broker.line.session(Address { module, ..broker.address });
            session.set_timeout(broker.timeout);
            session
        })
    }

    /// From now on the events of a module are this client's, if it has asked for them.
    fn listen_for(&mut self, address: u8, instruction: Instruction) {
        if instruction.opcode == Opcode::POSITION_EVENT {
            let module = self.session(address).answering_address() as u8;
            let mut listeners = self.broker.listeners.lock().unwrap_or_else(PoisonError::into_inner);
            listeners.insert(module, self.address);
        }
    }

    fn pass_events(&mut self) -> io::Result<()> {
        for session in self.sessions.values_mut() {
            let module = session.answering_address() as u8;
            let listeners = self.broker.listeners.lock().unwrap_or_else(PoisonError::into_inner);
            let mine = listeners.get(&module) == Some(&self.address);
            drop(listeners);
            while let Some(event) = mine.then(|| session.take_event().ok().flatten()).flatten() {
                let (status, command) = (Status::POSITION_REACHED, Opcode::POSITION_EVENT);
                let reply = Reply { host: HOST, module, status, command, value: event.motors };
                self.stream.write_all(&reply.emit())?;
            }
        }
        Ok(())
    }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}
