//! One conversation with one module.
//!
//! TMCL numbers neither requests nor replies, so a reply alone does not tell which request it answers. The session is right by
//! construction all the same:
//!
//! - One request at a time; its answer carries its command number and comes from its module.
//! - While every request got its answer and nothing unasked came, nothing can be under way: the session is *in step*.
//! - A time-out, a damaged datagram or a datagram nobody asked for ends that. The next request waits until the session is in
//!   step again, see [`step`](crate::step).
//!
//! What this cannot see: a line that doubles an answer and delivers the copy after the next request has gone out, which asks
//! for the same kind of thing.
//!
//! A module on an USB-like port answers whatever address it is asked under, with its own address in the reply. Which address
//! that is, the session learns while it gets in step, and from then on no other counts.

use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Command, Gp, MODULES, Module, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use crate::refusal::reason;
use crate::serial::SerialLink;
use crate::sim::SimLink;
use crate::step::Heard;
use crate::tcp::TcpLink;
use crate::url::DEFAULT_ADDRESS;
use crate::{Error, Link, Place, Url};

/// How long an answer may take.
pub(crate) const REPLY_TIMEOUT: Duration = Duration::from_secs(1);

/// A second reply of command 138: motors have reached their targets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PositionReached {
    /// The motors, one bit each.
    pub motors: i32,
}

/// The two addresses at the head of a reply.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Peer {
    pub host: u8,
    pub module: u8,
}

/// What nine bytes are to a request.
enum Verdict<T> {
    Answer(T),
    Foreign,
    Damaged,
    DamagedRequest,
}

/// A conversation with one module over one link.
pub struct Session {
    pub(crate) link: Box<dyn Link>,
    pub(crate) port: String,
    /// Address that requests carry.
    pub(crate) address: u8,
    /// Addresses that replies carry.
    pub(crate) peer: Peer,
    /// True while no answer can be under way.
    pub(crate) in_step: bool,
    /// Value of the latest probe.
    pub(crate) nonce: i32,
    pub(crate) events: VecDeque<PositionReached>,
    module: Option<&'static Module>,
}

impl Session {
    /// Opens a port and makes sure that a module answers.
    ///
    /// # Errors
    /// When the port does not open or nothing answers.
    pub fn open(url: &Url) -> Result<Self, Error> {
        let link: Result<Box<dyn Link>, String> = match &url.place {
            Place::Sim(module) => SimLink::open(module).map(|link| Box::new(link) as _),
            Place::Tcp { host, port } => TcpLink::open(host, *port).map(|link| Box::new(link) as _),
            Place::Serial { path, baud } => SerialLink::open(path, *baud).map(|link| Box::new(link) as _),
        };
        let link = link.map_err(|reason| Error::Open { port: url.to_string(), reason })?;
        let mut session = Self::over(link, url.to_string(), url.address);
        session.get_in_step()?;
        Ok(session)
    }

    /// A session with the module of a bench, in virtual time.
    ///
    /// ```
    /// use gradus_host::Session;
    /// use gradus_sim::{BenchFile, Eeprom};
    /// use gradus_tmcl::catalogue::Ap;
    ///
    /// let file = BenchFile::parse("module = 'tmcm-3351'\naxis.0 = { start = -1, travel.left.at = 0 }")?;
    /// let memory = Eeprom::of(file.module);
    /// let mut session = Session::on_bench(file.build(memory))?;
    /// assert_eq!(session.get_axis(Ap::LeftSwitch, 0)?, 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the module does not answer, having no power for example.
    pub fn on_bench(bench: Bench) -> Result<Self, Error> {
        let port = Url { place: Place::Sim(bench.catalogue()), address: DEFAULT_ADDRESS }.to_string();
        let mut session = Self::over(Box::new(SimLink::to(bench)), port, DEFAULT_ADDRESS);
        session.get_in_step()?;
        Ok(session)
    }

    /// A session over a link that is open already. `port` names it in messages; requests carry `address`.
    pub fn over(link: Box<dyn Link>, port: String, address: u8) -> Self {
        let peer = Peer { host: 0, module: address };
        Self { link, port, address, peer, in_step: false, nonce: random(), events: VecDeque::new(), module: None }
    }

    /// Sends a command and gives back the answer, whatever its status is. Not for commands with a special reply (134, and
    /// 136 type 0), see [`read_memory`](Self::read_memory) and [`version_text`](Self::version_text).
    ///
    /// # Errors
    /// When the line is broken, no answer comes in time, or a datagram is damaged.
    pub fn execute(&mut self, instruction: Instruction) -> Result<Reply, Error> {
        let reply = self.converse(instruction, |peer, bytes| match Reply::parse(bytes) {
            Err(_) => Verdict::Damaged,
            Ok(reply) if reply.module != peer.module => Verdict::Foreign,
            Ok(reply) if reply.status == Status::WRONG_CHECKSUM && reply.command == Opcode::NOP => {
                Verdict::DamagedRequest
            }
            Ok(reply) if reply.command != instruction.opcode => Verdict::Foreign,
            Ok(reply) => Verdict::Answer(reply),
        })?;
        if reply.status == Status::OK {
            self.follow(instruction);
        }
        Ok(reply)
    }

    /// A new address of the module or the host holds as soon as it is set; the next probe learns what replies carry now.
    fn follow(&mut self, executed: Instruction) {
        let module = self.module.unwrap_or(&TMCM_3351);
        let row = module.global_parameter(executed.motor, executed.kind).filter(|_| executed.opcode == Opcode::SGP);
        match row.map(|row| row.id) {
            Some(Gp::SerialAddress) => self.address = executed.value as u8,
            Some(Gp::HostAddress) => {}
            _ => return,
        }
        self.in_step = false;
    }

    /// Sends a command and gives back the value of the answer.
    ///
    /// # Errors
    /// As [`execute`](Self::execute), and when the module refuses the command.
    pub fn command(&mut self, instruction: Instruction) -> Result<i32, Error> {
        let reply = self.execute(instruction)?;
        if reply.status.is_ok() { Ok(reply.value) } else { Err(self.refused(instruction, reply.status)) }
    }

    /// The error for a refusal, with what the catalogue knows about it.
    pub fn refused(&mut self, request: Instruction, status: Status) -> Error {
        let reason = self.module().map_or_else(|_| String::new(), |module| reason(module, request, status));
        Error::Refused { request: self.text(request), status, reason }
    }

    /// The kind of module at the other end.
    ///
    /// # Errors
    /// When it is none of the catalogue's.
    pub fn module(&mut self) -> Result<&'static Module, Error> {
        if let Some(module) = self.module {
            return Ok(module);
        }
        // The text rather than the number: it comes even while replies are suppressed.
        let text = self.version_text()?;
        let number = text.split(|c: char| !c.is_ascii_digit()).next().and_then(|digits| digits.parse().ok());
        self.module = MODULES.iter().find(|module| Some(module.number) == number).copied();
        self.module.ok_or(Error::UnknownModule { text })
    }

    /// The eight characters that a module calls itself, `3351V111` for example.
    ///
    /// # Errors
    /// When the line is broken or no answer comes in time.
    pub fn version_text(&mut self) -> Result<String, Error> {
        self.converse(Instruction::new(Opcode::FIRMWARE_VERSION, 0, 0, 0), |peer, bytes| match bytes {
            [host, text @ ..] if *host == peer.host && text.iter().all(|byte| byte.is_ascii_graphic()) => {
                Verdict::Answer(text.iter().copied().map(char::from).collect())
            }
            // This reply has no checksum; one that fits shows an answer to something else.
            _ if Reply::parse(bytes).is_ok() => Verdict::Foreign,
            _ => Verdict::Damaged,
        })
    }

    /// The command at an address of the program memory. Past its end, and behind read protection, all fields are zero.
    ///
    /// # Errors
    /// When the line is broken, no answer comes in time, or it comes damaged.
    pub fn read_memory(&mut self, address: u16) -> Result<Instruction, Error> {
        let request = Instruction::new(Opcode::READ_MEMORY, 0, 0, i32::from(address));
        // The reply is built as a request is: an address, seven bytes of a command, a checksum.
        self.converse(request, |peer, bytes| match Request::parse(bytes) {
            Err(_) => Verdict::Damaged,
            Ok(reply) if reply.address != peer.host => Verdict::Foreign,
            Ok(reply) => Verdict::Answer(reply.instruction),
        })
    }

    /// The oldest event that has come and was not taken yet.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn take_event(&mut self) -> Result<Option<PositionReached>, Error> {
        self.drain()?;
        Ok(self.events.pop_front())
    }

    /// Waits for the next event, at most for `time`.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn wait_event(&mut self, time: Duration) -> Result<Option<PositionReached>, Error> {
        let deadline = self.now() + time;
        while self.events.is_empty() && self.listen(deadline)? {}
        Ok(self.events.pop_front())
    }

    /// Time on the link's clock; virtual on a virtual module.
    pub fn now(&self) -> Duration {
        self.link.now()
    }

    /// Lets `time` pass on the link's clock.
    pub fn sleep(&mut self, time: Duration) {
        self.link.sleep(time);
    }

    /// The bench of a virtual module in this process, to look at its machine; `None` for every other module. Whoever moves
    /// its time moves that of the session.
    pub fn bench(&mut self) -> Option<&mut Bench> {
        self.link.bench()
    }

    /// Name of the port, for messages.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// One request and its answer. `judge` says what a datagram is to the request; events are put aside before.
    fn converse<T>(&mut self, request: Instruction, judge: impl Fn(Peer, &[u8; 9]) -> Verdict<T>) -> Result<T, Error> {
        self.get_in_step()?;
        self.send(request)?;
        self.in_step = false; // until the answer is here
        let deadline = self.now() + REPLY_TIMEOUT;
        let mut foreign = 0;
        loop {
            let bytes = match self.hear(deadline)? {
                Heard::Datagram(bytes) => bytes,
                Heard::Fragment(bytes) => return Err(self.garbled(request, bytes)),
                Heard::Nothing => return Err(self.silent(request, foreign)),
            };
            match judge(self.peer, &bytes) {
                Verdict::Answer(answer) => {
                    // Something else came as well: more may be under way.
                    self.in_step = foreign == 0;
                    return Ok(answer);
                }
                Verdict::Foreign => foreign += 1,
                Verdict::Damaged => return Err(self.garbled(request, bytes.to_vec())),
                Verdict::DamagedRequest => {
                    return Err(Error::GarbledRequest { port: self.port.clone(), request: self.text(request) });
                }
            }
        }
    }

    fn garbled(&self, request: Instruction, bytes: Vec<u8>) -> Error {
        Error::Garbled { port: self.port.clone(), request: self.text(request), bytes }
    }

    fn silent(&self, request: Instruction, foreign: usize) -> Error {
        Error::Silent { port: self.port.clone(), request: self.text(request), waited: REPLY_TIMEOUT, foreign }
    }

    /// A command as text, in the words of the module if it is known already.
    pub(crate) fn text(&self, instruction: Instruction) -> String {
        let module = self.module.unwrap_or(&TMCM_3351);
        match Command::of(instruction.opcode) {
            Some(command) if command.mnemonic.is_empty() => format!("{} ({})", instruction.opcode.0, command.name),
            _ => instruction.display(module).to_string(),
        }
    }
}

/// A number that an earlier session has hardly used.
fn random() -> i32 {
    RandomState::new().hash_one(()) as i32
}

#[cfg(test)]
mod tests;
