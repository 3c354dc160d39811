//! A line that several sessions share.
//!
//! Only one request is under way on a line at a time, also where the modules would allow more (CAN): on RS-485 two answers at
//! once destroy each other, and an order that holds for the whole line is what makes late answers recognisable.

pub(crate) mod downloads;
pub(crate) mod stop_latch;
mod unplugged;
pub(crate) mod wire;

use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use gradus_sim::Bench;
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::Impact;

use self::downloads::Owner;
use self::stop_latch::StopLatch;
use self::wire::Wire;
use crate::can::CanLink;
use crate::link::Framed;
use crate::serial::SerialStream;
use crate::sim::SimStream;
use crate::tcp::TcpStream;
use crate::trace::Sink;
use crate::{Error, Link, Nature, Place, Stream, Url};

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
    latch: Arc<StopLatch>,
    /// How many sessions there were.
    sessions: AtomicU64,
    /// What the numbers of probes come from.
    seed: u64,
}

/// A task of many requests, which a stop of its line ends.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Job {
    /// The stops before it began.
    stops: u64,
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
        Self::simulated(link, port, RandomState::new().hash_one(()))
    }

    /// The same for a simulation: the numbers by which sessions know their probes again come from the seed, so that equal runs are
    /// equal to the bit. On a real line they must differ from those of the program before.
    pub fn simulated(link: Box<dyn Link>, port: &str, seed: u64) -> Self {
        let latch = Arc::<StopLatch>::default();
        let wire = Mutex::new(Wire::new(link, Arc::clone(&latch)));
        let shared = Shared { turnstile: Mutex::default(), wire, latch, sessions: AtomicU64::new(0), seed };
        Self { port: port.into(), shared: Arc::new(shared) }
    }

    /// Opens the port again after the line broke: closes it first, since it may be for one opener alone. Downloads that were under way
    /// have ended, a stop lasts.
    ///
    /// # Errors
    /// When the port does not open.
    pub fn reopen(&self, url: &Url) -> Result<(), Error> {
        let mut wire = self.lock();
        wire.unplug();
        let link = link(url).map_err(|reason| Error::Open { port: url.to_string(), reason })?;
        wire.replace(link);
        Ok(())
    }

    /// Stops the line: until its [`release`](Self::release) nothing that acts goes out on it, from any session. Stops
    /// (MST, 128, 133) and what only reads pass; downloads, captures, dumps and scans under way end with [`Error::Stopped`]. Waits
    /// for no answer. Motors and programs go on: [`Session::halt`](crate::Session::halt) stops those.
    pub fn stop(&self) {
        self.shared.latch.stop();
    }

    /// Lets pass again what acts.
    pub fn release(&self) {
        self.shared.latch.release();
    }

    /// True from a stop until its release.
    pub fn is_stopped(&self) -> bool {
        self.shared.latch.is_stopped()
    }

    pub(crate) fn latch(&self) -> &StopLatch {
        &self.shared.latch
    }

    /// Begins a task of many requests.
    pub(crate) fn job(&self) -> Job {
        Job { stops: self.shared.latch.stops() }
    }

    /// Lets a task go on, unless the line was stopped since it began.
    pub(crate) fn go_on(&self, job: Job) -> Result<(), Error> {
        let stopped = self.shared.latch.stops() != job.stops;
        if stopped { Err(Error::Stopped { port: self.port().into() }) } else { Ok(()) }
    }

    /// Lets a request out that was made with a task, unless it acts and the line was stopped meanwhile: what is older than a stop
    /// does not go out after its release.
    pub(crate) fn go_on_with(&self, job: Job, request: Instruction) -> Result<(), Error> {
        if request.impact() == Impact::Acts { self.go_on(job) } else { Ok(()) }
    }

    /// A number for a new session.
    pub(crate) fn number(&self) -> Owner {
        self.shared.sessions.fetch_add(1, Ordering::Relaxed)
    }

    /// The number before the first probe of a session.
    pub(crate) fn first_nonce(&self, number: Owner) -> i32 {
        (self.shared.seed.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 32) as i32
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
