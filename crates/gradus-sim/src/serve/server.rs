//! The server: a bench in step with the wall clock, open to hosts.
//!
//! One thread waits for hosts, the console and a stop, and for the time of the next event. Then it moves virtual time on,
//! hands over what has come, and sends what is due. No host can hold it up.

use std::fs;
use std::io::{self, Write};
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use signal_hook::SigId;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::endpoint::{Endpoint, EndpointError, listen};
use super::line::Line;
use super::pace::{Pace, Speed};
use super::pty::Pty;
use super::terminal::Console;
use crate::{Bench, EepromError};

/// While anything moves, virtual time goes on in steps of this much wall time.
const STEP: Duration = Duration::from_millis(1);

/// Wall time after which hosts are looked at again, however much there is to simulate.
const PATIENCE: Duration = Duration::from_millis(2);

/// Virtual time between two looks at the wall clock, in microseconds.
const SLICE_US: u64 = 10_000;

/// How far virtual time may lag behind on a slow computer, in wall time; what is more is given up.
const MAX_LAG: Duration = Duration::from_millis(100);

/// Lines at once; more hosts wait until one goes.
const MAX_LINES: usize = 500;

/// Endpoints of a server.
const MAX_ENDPOINTS: usize = 100;

/// The stop, the console, an endpoint's listener or visitors each, the lines.
const MAX_SOURCES: usize = 2 + MAX_ENDPOINTS + MAX_LINES;

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

/// A bench with endpoints for hosts.
#[derive(Debug)]
pub struct Server {
    bench: Bench,
    speed: Speed,
    pace: Pace,
    /// Virtual time lags behind.
    late: bool,
    endpoints: Vec<Endpoint>,
    listeners: Vec<TcpListener>,
    lines: Vec<Line>,
    stop: UnixStream,
    stopper: UnixStream,
    signals: Vec<SigId>,
}

/// Ends a server from elsewhere.
#[derive(Debug)]
pub struct Stopper(UnixStream);

/// What the server waits for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Source {
    Stop,
    Console,
    Listener(usize),
    Visitors(usize),
    Line(usize),
}

// Building.
impl Server {
    /// Opens the endpoints.
    ///
    /// # Errors
    /// When one of them cannot be opened, or there are more than 100; none stays open then.
    pub fn open(bench: Bench, endpoints: &[Endpoint], options: Options) -> Result<Self, ServeError> {
        if endpoints.len() > MAX_ENDPOINTS {
            return Err(EndpointError::TooMany { most: MAX_ENDPOINTS }.into());
        }
        let (stop, stopper) = UnixStream::pair().map_err(ServeError::Wait)?;
        let mut server = Self {
            pace: Pace::new(options.speed, Instant::now(), bench.now()),
            bench,
            speed: options.speed,
            late: false,
            endpoints: Vec::new(),
            listeners: Vec::new(),
            lines: Vec::new(),
            stop,
            stopper,
            signals: Vec::new(),
        };
        for endpoint in endpoints {
            let opened = server.open_endpoint(endpoint, options.allow_remote)?;
            server.endpoints.push(opened);
        }
        Ok(server)
    }

    fn open_endpoint(&mut self, endpoint: &Endpoint, allow_remote: bool) -> Result<Endpoint, EndpointError> {
        match endpoint {
            Endpoint::Pty(link) => {
                let pty = Pty::open(link.as_deref())?;
                let path = pty.path().to_owned();
                self.lines.push(Line::pty(pty, &mut self.bench));
                Ok(Endpoint::Pty(Some(path)))
            }
            Endpoint::Tcp(address) => {
                let listener = listen(*address, allow_remote)?;
                let bound = listener.local_addr().unwrap_or(*address);
                self.listeners.push(listener);
                Ok(Endpoint::Tcp(bound))
            }
        }
    }

    /// The endpoints as they came to be: with the path of the terminal and the real port.
    pub fn endpoints(&self) -> &[Endpoint] {
        &self.endpoints
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

/// Whether this process ignores a signal, where the system tells it in `/proc`.
fn is_ignored(signal: i32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok()).unwrap_or(0);
    mask & 1 << (signal - 1) != 0
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
    /// Serves until it is stopped, then makes sure that the EEPROM file is on the disk.
    ///
    /// # Errors
    /// When the EEPROM file cannot be written: no reply goes out then that would promise a stored value.
    pub fn run(&mut self, mut console: Option<Console>) -> Result<(), ServeError> {
        self.pace.restart(Instant::now(), self.bench.now());
        let mut ready = Vec::with_capacity(MAX_SOURCES);
        loop {
            self.wait(console.as_ref(), &mut ready).map_err(ServeError::Wait)?;
            let wall = self.advance();
            if ready.contains(&Source::Stop) {
                break;
            }
            for source in &ready {
                self.serve(*source, &mut console, wall);
            }
            self.bench.eeprom().check()?;
            self.flush();
        }
        Ok(self.bench.eeprom().sync()?)
    }

    /// The bench, to look at it when the server has ended.
    pub fn bench(&mut self) -> &mut Bench {
        &mut self.bench
    }

    /// Waits until something comes or is due. Allocates nothing, as nothing in the loop does that a command or a tick needs.
    fn wait(&self, console: Option<&Console>, ready: &mut Vec<Source>) -> io::Result<()> {
        ready.clear();
        let descriptors = self.sources(console).map(|(_, descriptor)| descriptor);
        let mut descriptors: heapless::Vec<_, MAX_SOURCES> = descriptors.collect();
        let timeout = self.timeout().and_then(|timeout| Timespec::try_from(timeout).ok());
        match poll(&mut descriptors, timeout.as_ref()) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
        let polled = self.sources(console).zip(&descriptors);
        let has_come = polled.filter(|(_, descriptor)| !descriptor.revents().is_empty());
        ready.extend(has_come.map(|((source, _), _)| source));
        Ok(())
    }

    /// The arrival of a visitor comes before its bytes.
    fn sources<'a>(&'a self, console: Option<&'a Console>) -> impl Iterator<Item = (Source, PollFd<'a>)> {
        let readable = |source, fd| (source, PollFd::from_borrowed_fd(fd, PollFlags::IN));
        let console = console.map(|console| readable(Source::Console, console.as_fd()));
        let open = if self.lines.len() < MAX_LINES { self.listeners.as_slice() } else { &[] };
        let listeners =
            open.iter().enumerate().map(move |(i, listener)| readable(Source::Listener(i), listener.as_fd()));
        let lines = self.lines.iter().enumerate().flat_map(move |(i, line)| {
            let visitors = line.visitors().map(|fd| readable(Source::Visitors(i), fd));
            visitors.into_iter().chain([(Source::Line(i), PollFd::new(line, line.interest()))])
        });
        [readable(Source::Stop, self.stop.as_fd())].into_iter().chain(console).chain(listeners).chain(lines)
    }

    fn serve(&mut self, source: Source, console: &mut Option<Console>, wall: Instant) {
        match source {
            Source::Stop => {}
            Source::Console => {
                *console = console.take().and_then(|mut open| open.receive(&mut self.bench).then_some(open));
            }
            Source::Listener(index) => self.accept(index),
            Source::Visitors(index) => self.lines[index].check_visitors(&mut self.bench),
            Source::Line(index) => self.lines[index].receive(&mut self.bench, wall),
        }
    }

    /// A host that is gone already is nobody's loss.
    fn accept(&mut self, index: usize) {
        if let Ok((stream, _)) = self.listeners[index].accept()
            && let Ok(line) = Line::tcp(stream, &mut self.bench)
        {
            self.lines.push(line);
        }
    }

    fn flush(&mut self) {
        for line in &mut self.lines {
            line.flush(&mut self.bench);
        }
        self.lines.retain(|line| !line.is_closed());
    }
}

// Time.
impl Server {
    /// How long nothing is due; `None`: for ever.
    fn timeout(&self) -> Option<Duration> {
        let event_us = self.bench.next_event()?;
        if self.late || self.speed == Speed::Max {
            return Some(Duration::ZERO);
        }
        Some(self.pace.wait(Instant::now(), event_us).max(STEP))
    }

    /// Moves virtual time to where it belongs, and gives back the wall time for which that is.
    fn advance(&mut self) -> Instant {
        let wall = Instant::now();
        if self.speed == Speed::Max && self.bench.next_event().is_some() {
            self.race(wall);
        } else {
            self.follow(wall);
        }
        wall
    }

    fn follow(&mut self, wall: Instant) {
        let goal = self.pace.virtual_at(wall);
        while self.bench.now() < goal {
            let slice = self.slice_end().unwrap_or(goal);
            self.bench.run_until(slice.min(goal));
            if wall.elapsed() > PATIENCE {
                break;
            }
        }
        self.late = self.bench.now() < goal;
        if self.late {
            self.give_up_lag(wall);
        }
    }

    /// As far ahead as patience allows; the wall clock's pace holds again from there.
    fn race(&mut self, wall: Instant) {
        while let Some(slice) = self.slice_end() {
            self.bench.run_until(slice);
            if wall.elapsed() > PATIENCE {
                break;
            }
        }
        self.pace.restart(Instant::now(), self.bench.now());
    }

    /// Far enough to be worth a look at the clock; `None` if nothing is due.
    fn slice_end(&self) -> Option<u64> {
        self.bench.next_event().map(|at| at.max(self.bench.now().saturating_add(SLICE_US)))
    }

    fn give_up_lag(&mut self, wall: Instant) {
        let Some(latest) = wall.checked_sub(MAX_LAG) else { return };
        if self.bench.now() < self.pace.virtual_at(latest) {
            self.pace.restart(latest, self.bench.now());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::TcpStream;

    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;
    use crate::Machine;
    use crate::eeprom::tests::broken;

    #[test]
    fn too_many_endpoints_are_refused_before_any_is_opened() {
        let endpoints = vec![Endpoint::Tcp("127.0.0.1:0".parse().unwrap()); MAX_ENDPOINTS + 1];
        let error = Server::open(Bench::with_defaults(&TMCM_3351), &endpoints, Options::default()).unwrap_err();
        assert_eq!(error.to_string(), "a server has 100 endpoints at most");
    }

    #[test]
    fn value_that_cannot_be_stored_is_never_acknowledged() {
        let bench = Bench::new(&TMCM_3351, Machine::new(3), broken(200_000));
        let any_port = Endpoint::Tcp("127.0.0.1:0".parse().unwrap());
        let mut server = Server::open(bench, &[any_port], Options::default()).unwrap();
        let Endpoint::Tcp(address) = server.endpoints()[0] else { panic!("not TCP") };
        let mut host = TcpStream::connect(address).unwrap();
        host.write_all(&[1, 9, 77, 0, 0, 0, 0, 1, 88]).unwrap(); // SGP 77, 0, 1
        let error = server.run(None).unwrap_err();
        assert!(matches!(error, ServeError::Eeprom(_)), "{error}");
        drop(server);
        let mut reply = Vec::new();
        host.read_to_end(&mut reply).unwrap();
        assert_eq!(reply, []);
    }
}
