//! The server: a rig in step with the wall clock, open to hosts.
//!
//! One thread waits for hosts, the console and a stop, and for the time of the next event. Then it moves virtual time on,
//! hands over what has come, and sends what is due. No host can hold it up.

use std::fmt;
use std::io::{self, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::io::Errno;
use signal_hook::SigId;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

#[cfg(all(target_os = "linux", feature = "socketcan"))]
use super::can_socket::CanInterface;
use super::endpoint::{Endpoint, EndpointError, listen};
use super::line::{Carrier, Line};
use super::pace::{Pace, Speed};
use super::process::is_ignored;
use super::protocol::Protocol;
use super::pty::Pty;
use super::source::Source;
use super::terminal::Console;
use super::waiter::{Interest, Waiter};
use crate::slots::put;
use crate::{Content, EepromError, Notice, Passed, Rig};

/// While anything moves, virtual time goes on in steps of this much wall time.
const STEP: Duration = Duration::from_millis(1);

/// Wall time after which hosts are looked at again, however much there is to simulate.
const PATIENCE: Duration = Duration::from_millis(2);

/// Virtual time between two looks at the wall clock, in microseconds.
const SLICE_US: u64 = 10_000;

/// How far virtual time may lag behind on a slow computer, in wall time; what is more is given up.
const MAX_LAG: Duration = Duration::from_millis(100);

/// Lines at once; more hosts are turned away.
const MAX_LINES: usize = 20_000;

/// How a server runs.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Options {
    /// How fast virtual time runs.
    pub speed: Speed,
    /// Lets hosts on other computers connect.
    pub allow_remote: bool,
}

/// Why a server could not start or had to end.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum ServeError {
    #[error(transparent)]
    Endpoint(#[from] EndpointError),
    #[error(transparent)]
    Eeprom(#[from] EepromError),
    #[error("the operating system refused to wait for hosts")]
    Wait(#[source] io::Error),
}

/// A rig with endpoints for hosts.
#[derive(Debug)]
pub struct Server {
    rig: Rig,
    speed: Speed,
    pace: Pace,
    /// Virtual time lags behind.
    late: bool,
    allow_remote: bool,
    endpoints: Vec<Endpoint>,
    listeners: Vec<Listener>,
    /// A line keeps its place as long as it lives.
    lines: Vec<Option<Line>>,
    /// The places of the lines of each bus.
    lines_on: Vec<Vec<usize>>,
    waiter: Waiter,
    /// Is given up for a moment when there are no descriptors left, to turn a host away: one that is left waiting would wake the
    /// server again and again.
    spare: Option<UnixStream>,
    /// Hosts are turned away, and the operator knows.
    full: bool,
    /// What the waiter watches for a stop.
    _stop: UnixStream,
    stopper: UnixStream,
    signals: Vec<SigId>,
    tap: Tap,
}

/// Takes what passes on the buses.
#[derive(Default)]
struct Tap(Option<Box<TakePassed>>);

type TakePassed = dyn FnMut(&Passed) + Send;

impl fmt::Debug for Tap {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Tap" } else { "no tap" })
    }
}

#[derive(Debug)]
struct Listener {
    socket: TcpListener,
    bus: usize,
    endpoint: Endpoint,
}

/// Ends a server from elsewhere.
#[derive(Debug)]
pub struct Stopper(UnixStream);

// Building.
impl Server {
    /// Opens endpoints for the first bus of a rig, or for a bench alone; [`open_endpoint`](Self::open_endpoint) opens more.
    ///
    /// # Errors
    /// When one of them cannot be opened; none stays open then.
    pub fn open(rig: impl Into<Rig>, endpoints: &[Endpoint], options: Options) -> Result<Self, ServeError> {
        let rig = rig.into();
        let (stop, stopper) = UnixStream::pair().map_err(ServeError::Wait)?;
        let mut waiter = Waiter::new().map_err(ServeError::Wait)?;
        waiter.add(stop.as_fd(), Source::Stop.token(), Interest::READ).map_err(ServeError::Wait)?;
        let mut server = Self {
            pace: Pace::new(options.speed, Instant::now(), rig.now()),
            rig,
            speed: options.speed,
            late: false,
            allow_remote: options.allow_remote,
            endpoints: Vec::new(),
            listeners: Vec::new(),
            lines: Vec::new(),
            lines_on: Vec::new(),
            waiter,
            spare: stopper.try_clone().ok(),
            full: false,
            _stop: stop,
            stopper,
            signals: Vec::new(),
            tap: Tap::default(),
        };
        for endpoint in endpoints {
            server.open_endpoint(0, endpoint)?;
        }
        Ok(server)
    }

    /// Opens an endpoint for a bus.
    ///
    /// # Errors
    /// When it cannot be opened, or is not for this kind of bus.
    pub fn open_endpoint(&mut self, bus: usize, endpoint: &Endpoint) -> Result<(), ServeError> {
        if self.rig.can_bit_rate(bus).is_some() != endpoint.is_can() {
            let bus = self.rig.bus_name(bus).to_owned();
            return Err(EndpointError::Kind { endpoint: endpoint.clone(), bus }.into());
        }
        let opened = match endpoint {
            Endpoint::Pty(link) => Endpoint::Pty(Some(self.open_pty(bus, endpoint, link.as_deref())?)),
            Endpoint::SlcanPty(link) => Endpoint::SlcanPty(Some(self.open_pty(bus, endpoint, link.as_deref())?)),
            Endpoint::Tcp(address) => Endpoint::Tcp(self.listen(bus, endpoint, *address)?),
            Endpoint::SlcanTcp(address) => Endpoint::SlcanTcp(self.listen(bus, endpoint, *address)?),
            Endpoint::Socketcand(address) => Endpoint::Socketcand(self.listen(bus, endpoint, *address)?),
            Endpoint::Can(interface) => {
                self.open_can(bus, endpoint, interface)?;
                endpoint.clone()
            }
        };
        self.endpoints.push(opened);
        Ok(())
    }

    fn open_pty(&mut self, bus: usize, endpoint: &Endpoint, link: Option<&Path>) -> Result<PathBuf, ServeError> {
        let pty = Pty::open(link)?;
        let path = pty.path().to_owned();
        self.add_line(Carrier::Pty(pty), Protocol::of(endpoint), bus)?;
        Ok(path)
    }

    fn listen(&mut self, bus: usize, endpoint: &Endpoint, address: SocketAddr) -> Result<SocketAddr, ServeError> {
        let socket = listen(address, self.allow_remote)?;
        let bound = socket.local_addr().unwrap_or(address);
        let token = Source::Listener(self.listeners.len()).token();
        self.waiter.add(socket.as_fd(), token, Interest::READ).map_err(ServeError::Wait)?;
        self.listeners.push(Listener { socket, bus, endpoint: endpoint.clone() });
        Ok(bound)
    }

    #[cfg(all(target_os = "linux", feature = "socketcan"))]
    fn open_can(&mut self, bus: usize, endpoint: &Endpoint, interface: &str) -> Result<(), ServeError> {
        let fail = |source| EndpointError::Can { interface: interface.to_owned(), source };
        let carrier = Carrier::Can(CanInterface::open(interface).map_err(fail)?);
        self.add_line(carrier, Protocol::of(endpoint), bus)
    }

    #[cfg(not(all(target_os = "linux", feature = "socketcan")))]
    fn open_can(&mut self, _: usize, _: &Endpoint, _: &str) -> Result<(), ServeError> {
        Err(EndpointError::NoSocketCan.into())
    }

    /// The endpoints as they came to be: with the path of the terminal and the real port.
    pub fn endpoints(&self) -> &[Endpoint] {
        &self.endpoints
    }

    /// Lets `tap` have what passes on the buses from now on.
    pub fn tap(&mut self, tap: impl FnMut(&Passed) + Send + 'static) {
        self.rig.record();
        self.tap = Tap(Some(Box::new(tap)));
    }

    /// Lets another thread end the server.
    ///
    /// # Errors
    /// When there are no descriptors left.
    pub fn stopper(&self) -> io::Result<Stopper> {
        self.stopper.try_clone().map(Stopper)
    }

    /// Lets SIGINT, SIGTERM and SIGHUP (the terminal is closed) end the server. One that was ignored at the start of the
    /// process, as `nohup` has it, stays ignored.
    ///
    /// # Errors
    /// When the signals cannot be caught.
    pub fn stop_on_signals(&mut self) -> io::Result<()> {
        for signal in [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal)) {
            let stopper = self.stopper.try_clone()?;
            self.signals.push(signal_hook::low_level::pipe::register(signal, stopper)?);
        }
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        for signal in self.signals.drain(..) {
            signal_hook::low_level::unregister(signal);
        }
    }
}

impl Stopper {
    /// Ends the server, which may be anywhere in its loop.
    pub fn stop(&self) {
        // Fails only when the server is gone already.
        let _ = (&self.0).write(&[0]);
    }
}

// Serving.
impl Server {
    /// Serves until it is stopped, then makes sure that the EEPROM files are on the disk.
    ///
    /// # Errors
    /// When an EEPROM file cannot be written: no reply goes out then that would promise a stored value.
    pub fn run(&mut self, console: Option<Console>) -> Result<(), ServeError> {
        let mut console = console.and_then(|console| self.admit(console));
        self.pace.restart(Instant::now(), self.rig.now());
        let mut ready = Vec::with_capacity(1024);
        loop {
            self.waiter.wait(self.timeout(), &mut ready).map_err(ServeError::Wait)?;
            let wall = self.advance();
            if ready.contains(&Source::Stop.token()) {
                break;
            }
            for token in &ready {
                self.serve(Source::of(*token), &mut console, wall)?;
            }
            self.deliver()?;
            self.tell();
            self.give_notice(&mut console);
        }
        self.tell();
        for bench in self.rig.benches() {
            bench.eeprom().sync()?;
        }
        Ok(())
    }

    /// Tells the tap what has passed.
    fn tell(&mut self) {
        if let Some(tap) = &mut self.tap.0 {
            self.rig.take_passed().iter().for_each(tap);
        }
    }

    /// Says what has happened by itself.
    fn give_notice(&mut self, console: &mut Option<Console>) {
        let notices: Vec<(usize, Notice)> = self
            .rig
            .benches()
            .iter_mut()
            .enumerate()
            .flat_map(|(module, bench)| bench.take_notices().into_iter().map(move |notice| (module, notice)))
            .collect();
        for (module, Notice { at_us, text }) in notices {
            let names = self.rig.module_names();
            let name = if names.len() > 1 { format!("{}: ", names[module]) } else { String::new() };
            let text = name + &text;
            let line = format!("{:.3} s: {text}\n", at_us as f64 * 1e-6);
            if let Some(tap) = &mut self.tap.0 {
                tap(&Passed { at_us, bus: 0, host: 0, from_module: true, what: Content::Notice(text) });
            }
            match console {
                Some(console) => console.say(&line),
                None => drop(io::stderr().write_all(line.as_bytes())),
            }
        }
    }

    /// The rig, to look at it when the server has ended.
    pub fn rig(&mut self) -> &mut Rig {
        &mut self.rig
    }

    /// Waits for the console from now on; one that cannot be waited for, a file of the disk, is read to its end.
    fn admit(&mut self, mut console: Console) -> Option<Console> {
        if self.waiter.add(console.as_fd(), Source::Console.token(), Interest::READ).is_err() {
            while console.receive(&mut self.rig) {}
            return None;
        }
        Some(console)
    }

    fn serve(&mut self, source: Source, console: &mut Option<Console>, wall: Instant) -> Result<(), ServeError> {
        match source {
            Source::Stop => {}
            Source::Console => {
                if console.as_mut().is_some_and(|console| !console.receive(&mut self.rig))
                    && let Some(console) = console.take()
                {
                    self.waiter.remove(console.as_fd());
                }
            }
            Source::Listener(index) => self.accept(index, console)?,
            Source::Visitors(index) => {
                if let Some(line) = &mut self.lines[index] {
                    line.check_visitors(&mut self.rig);
                }
            }
            Source::Line(index) => {
                if let Some(line) = &mut self.lines[index] {
                    line.receive(&mut self.rig, wall);
                }
                self.flush(index)?;
            }
        }
        Ok(())
    }

    /// Admits a host, if there is room for it. One that is gone already is nobody's loss.
    fn accept(&mut self, index: usize, console: &mut Option<Console>) -> Result<(), ServeError> {
        let admitted = match self.listeners[index].socket.accept() {
            Ok((stream, _)) => self.admit_host(index, stream)?,
            Err(error) if is_out_of_descriptors(&error) => self.turn_away(index),
            Err(_) => return Ok(()),
        };
        if !admitted
            && !self.full
            && let Some(console) = console
        {
            console.complain("there is no room for more hosts; they are turned away until one leaves");
        }
        self.full = !admitted;
        Ok(())
    }

    fn admit_host(&mut self, listener: usize, stream: TcpStream) -> Result<bool, ServeError> {
        let Listener { bus, endpoint, .. } = &self.listeners[listener];
        let (bus, protocol) = (*bus, Protocol::of(endpoint));
        let Ok(carrier) = Carrier::tcp(stream) else { return Ok(true) };
        if self.lines.iter().flatten().count() >= MAX_LINES {
            return Ok(false);
        }
        match self.add_line(carrier, protocol, bus) {
            Err(ServeError::Wait(_)) => Ok(false),
            added => added.map(|()| true),
        }
    }

    /// Accepts a host with the spare descriptor and lets it go. Never succeeds in admitting one.
    fn turn_away(&mut self, index: usize) -> bool {
        if self.spare.take().is_none() {
            std::thread::sleep(STEP); // somebody else in this process has taken the last one
        }
        drop(self.listeners[index].socket.accept());
        self.spare = self.stopper.try_clone().ok();
        false
    }

    /// The lines whose hosts have got something send it.
    fn deliver(&mut self) -> Result<(), ServeError> {
        while let Some(bus) = self.rig.next_mail() {
            // From the last one on, because a line that fails is taken out.
            for place in (0..self.lines_on.get(bus).map_or(0, Vec::len)).rev() {
                self.flush(self.lines_on[bus][place])?;
            }
        }
        Ok(())
    }
}

/// True when the process or the computer has no more descriptors, or no memory for them.
fn is_out_of_descriptors(error: &io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::MFILE | Errno::NFILE | Errno::NOBUFS | Errno::NOMEM))
}

// Lines.
impl Server {
    fn add_line(&mut self, carrier: Carrier, protocol: Protocol, bus: usize) -> Result<(), ServeError> {
        let place = put(&mut self.lines, Line::new(carrier, protocol, bus, &mut self.rig));
        if let Err(error) = self.watch(place) {
            self.remove_line(place);
            return Err(ServeError::Wait(error));
        }
        if self.lines_on.len() <= bus {
            self.lines_on.resize_with(bus + 1, Vec::new);
        }
        self.lines_on[bus].push(place);
        self.flush(place)
    }

    /// Waits for a line from now on.
    fn watch(&mut self, place: usize) -> io::Result<()> {
        let Some(line) = &self.lines[place] else { return Ok(()) };
        let visitors = line.visitors().map(|visitors| (visitors, Source::Visitors(place)));
        for (descriptor, source) in [(line.as_fd(), Source::Line(place))].into_iter().chain(visitors) {
            self.waiter.add(descriptor, source.token(), Interest::READ)?;
        }
        Ok(())
    }

    /// Sends what a line has, but no reply that promises a value which could not be stored.
    fn flush(&mut self, place: usize) -> Result<(), ServeError> {
        let Some(line) = &mut self.lines[place] else { return Ok(()) };
        self.rig.check_memories(line.bus())?;
        line.flush(&mut self.rig);
        if line.is_closed() {
            self.remove_line(place);
            return Ok(());
        }
        let interest = line.interest(&self.rig);
        if interest != line.awaited {
            line.awaited = interest;
            let token = Source::Line(place).token();
            self.waiter.change(line.as_fd(), token, interest).map_err(ServeError::Wait)?;
        }
        Ok(())
    }

    fn remove_line(&mut self, place: usize) {
        if let Some(line) = self.lines[place].take() {
            self.waiter.remove(line.as_fd());
            if let Some(places) = self.lines_on.get_mut(line.bus()) {
                places.retain(|other| *other != place);
            }
            line.detach(&mut self.rig);
        }
    }
}

// Time.
impl Server {
    /// How long nothing is due; `None`: for ever.
    fn timeout(&self) -> Option<Duration> {
        let event_us = self.rig.next_event()?;
        if self.late || self.speed == Speed::Max {
            return Some(Duration::ZERO);
        }
        Some(self.pace.wait(Instant::now(), event_us).max(STEP))
    }

    /// Moves virtual time to where it belongs, and gives back the wall time for which that is.
    fn advance(&mut self) -> Instant {
        let wall = Instant::now();
        if self.speed == Speed::Max && self.rig.next_event().is_some() {
            self.race(wall);
        } else {
            self.follow(wall);
        }
        wall
    }

    fn follow(&mut self, wall: Instant) {
        let goal = self.pace.virtual_at(wall);
        while self.rig.now() < goal {
            let slice = self.slice_end().unwrap_or(goal);
            self.rig.run_until(slice.min(goal));
            if wall.elapsed() > PATIENCE {
                break;
            }
        }
        self.late = self.rig.now() < goal;
        if self.late {
            self.give_up_lag(wall);
        }
    }

    /// As far ahead as patience allows; the wall clock's pace holds again from there.
    fn race(&mut self, wall: Instant) {
        while let Some(slice) = self.slice_end() {
            self.rig.run_until(slice);
            if wall.elapsed() > PATIENCE {
                break;
            }
        }
        self.pace.restart(Instant::now(), self.rig.now());
    }

    /// Far enough to be worth a look at the clock; `None` if nothing is due.
    fn slice_end(&self) -> Option<u64> {
        self.rig.next_event().map(|at| at.max(self.rig.now().saturating_add(SLICE_US)))
    }

    fn give_up_lag(&mut self, wall: Instant) {
        let Some(latest) = wall.checked_sub(MAX_LAG) else { return };
        if self.rig.now() < self.pace.virtual_at(latest) {
            self.pace.restart(latest, self.rig.now());
        }
    }
}

#[cfg(test)]
mod tests;
