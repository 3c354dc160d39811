//! One conversation with one module.
//!
//! TMCL numbers neither requests nor replies, so a reply alone does not tell which request it answers. The session is right by
//! construction all the same:
//!
//! - One request at a time on a [`Line`]; its answer carries its command number and comes from its module.
//! - While every request got its answer and nothing unasked came, nothing can be under way: the session is *in step*.
//! - A time-out, a damaged datagram or a datagram nobody asked for ends that, for all sessions of the line. The next request waits
//!   until its session is in step again, see [`step`](crate::step).
//! - Two answers do not tell whose they are: a version text and a command of program memory. Before they are asked for, every
//!   module that still owes an answer is probed, and so has given it; a module that owes one of them is before any request.
//! - Where a line may deliver an answer twice, a copy could pass for the answer to a next request of the same kind: the session
//!   gets in step between two such requests. CAN may double; of another line it is assumed from the first copy seen on,
//!   or from the beginning with `?guard=1`.
//!
//! A request that failed on the way is sent again, [`RETRIES`] times at most, if executing it twice does no harm
//! ([`Effect`]), and only after the session has got in step, so that the module has done with the first one.
//!
//! What no host can see, because the datagrams carry nothing to see it by: an answer delayed past a later one (a line that changes
//! the order), or past three unanswered probes; a request that the line doubles, so that a relative move is made twice; damage that leaves the checksum
//! right, as two errors may that make up for each other; a download begun by another host, during which commands are stored
//! instead of executed until an answer says so.
//!
//! A module on an USB-like port answers whatever address it is asked under, with its own address in the reply. Which address
//! that is, the session learns while it gets in step, and from then on no other counts.

use std::time::Duration;

use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Command, Effect, Gp, Impact, MODULES, Module, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use crate::line::downloads::Owner;
use crate::line::stop_latch::LatchRequest;
use crate::refusal::reason;
use crate::url::REPLY_TIMEOUT;
use crate::verdict::{Form, Peer, complaint, form};
use crate::{Address, Error, Line, Link, PositionReached, Statistics, Url};

/// How often a request is sent again, unless told otherwise.
pub const RETRIES: u32 = 2;
/// How long a session that waits for an event keeps the others of the line waiting.
const SHARE: Duration = Duration::from_millis(10);

/// A conversation with one module over one line.
pub struct Session {
    pub(crate) line: Line,
    /// Its number on the line.
    pub(crate) number: Owner,
    /// Address that requests carry.
    pub(crate) address: Address,
    /// Addresses that replies carry.
    pub(crate) peer: Peer,
    /// The line's count of doubts when this session got in step.
    pub(crate) in_step: Option<u64>,
    /// Value of the latest probe.
    pub(crate) nonce: i32,
    pub(crate) timeout: Duration,
    pub(crate) statistics: Statistics,
    /// True while the module suppresses its replies: no answer tells nothing, and sending again helps nothing.
    pub(crate) mute: bool,
    pub(crate) retries: u32,
    /// True while the module stores commands, so that none may be sent twice.
    pub(crate) storing: bool,
    module: Option<&'static Module>,
}

impl Session {
    /// Opens a port and makes sure that a module answers.
    ///
    /// # Errors
    /// When the port does not open or nothing answers.
    pub fn open(url: &Url) -> Result<Self, Error> {
        Self::on_line(&Line::open(url)?, url)
    }

    /// A session over a line that is open already, with address and time-out of `url`.
    ///
    /// # Errors
    /// When nothing answers.
    pub fn on_line(line: &Line, url: &Url) -> Result<Self, Error> {
        let mut session = Session::new(line, url.address);
        session.timeout = url.timeout;
        session.greet()?;
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
        let url = Url::sim(bench.catalogue());
        Self::on_line(&Line::on_bench(bench), &url)
    }

    /// A session over a link that is open already. `port` names it in messages; requests go to `address`.
    pub fn over(link: Box<dyn Link>, port: &str, address: Address) -> Self {
        Self::new(&Line::over(link, port), address)
    }

    /// A session with the module of that address on an open line. It sends nothing before its first request.
    pub fn new(line: &Line, address: Address) -> Self {
        let peer = Peer { host: 0, module: address.module as u8 };
        let number = line.number();
        Self {
            number,
            nonce: line.first_nonce(number),
            line: line.clone(),
            address,
            peer,
            in_step: None,
            timeout: REPLY_TIMEOUT,
            statistics: Statistics::default(),
            mute: false,
            retries: RETRIES,
            storing: false,
            module: None,
        }
    }

    /// Makes sure that the module answers.
    ///
    /// # Errors
    /// When it does not, or the line is broken.
    pub fn greet(&mut self) -> Result<(), Error> {
        let line = self.line.clone();
        self.get_in_step(&mut line.lock())
    }

    /// Asks once whether a module answers.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn knock(&mut self) -> Result<bool, Error> {
        let line = self.line.clone();
        let mut wire = line.lock();
        self.drain(&mut wire)?;
        let answers = self.probe(&mut wire)?;
        self.in_step = answers.then_some(wire.doubts);
        Ok(answers)
    }

    /// The address in the module's answers: its own, whatever it was asked under.
    pub fn answering_address(&self) -> u16 {
        u16::from(self.peer.module)
    }

    /// The line, for sessions with other modules on it.
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// The address that requests go to.
    pub fn address(&self) -> Address {
        self.address
    }

    /// How long an answer may take; 1 s at first.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// How often a request that failed on the way is sent again, if that does no harm; [`RETRIES`] at first.
    pub fn set_retries(&mut self, retries: u32) {
        self.retries = retries;
    }

    /// What the session has seen so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Counts from zero again.
    pub fn reset_statistics(&mut self) {
        self.statistics = Statistics::default();
    }

    /// Sends a command and gives back the answer, whatever its status is. Not for commands with a special reply (134, and
    /// 136 type 0), see [`read_memory`](Self::read_memory) and [`version_text`](Self::version_text).
    ///
    /// # Errors
    /// When the line is broken, no answer comes in time, or a datagram is damaged.
    pub fn execute(&mut self, instruction: Instruction) -> Result<Reply, Error> {
        let repeat = instruction.effect() != Effect::Act;
        self.execute_as(instruction, repeat)
    }

    /// As [`execute`](Self::execute), but a command that failed on the way is sent again whatever it does: the caller
    /// knows that executing it twice does no harm.
    ///
    /// # Errors
    /// As [`execute`](Self::execute).
    pub fn insist(&mut self, instruction: Instruction) -> Result<Reply, Error> {
        self.execute_as(instruction, true)
    }

    fn execute_as(&mut self, instruction: Instruction, repeat: bool) -> Result<Reply, Error> {
        let bytes = self.converse(instruction, repeat)?;
        let reply = Reply::parse(&bytes).map_err(|_| self.garbled(instruction, bytes.to_vec()))?;
        if reply.status.is_ok() {
            self.follow(instruction, reply.status);
        }
        Ok(reply)
    }

    /// Sends a command and gives back the nine bytes of its answer, whatever form they have.
    ///
    /// # Errors
    /// As [`execute`](Self::execute).
    pub fn relay(&mut self, instruction: Instruction) -> Result<[u8; 9], Error> {
        match (form(instruction), u16::try_from(instruction.value)) {
            (Form::Reply, _) => self.execute(instruction).map(|reply| reply.emit()),
            (Form::Command, Ok(address)) => {
                let command = self.read_memory(address)?;
                Ok(Request { address: self.peer.host, instruction: command }.emit())
            }
            (Form::Text | Form::Command, _) => self.converse(instruction, true),
        }
    }

    /// New addresses of the module or the host hold as soon as they are set; the next probe learns what replies carry now.
    /// While the module stores commands nothing may be sent twice.
    fn follow(&mut self, executed: Instruction, status: Status) {
        self.storing |= executed.opcode == Opcode::ENTER_DOWNLOAD || status == Status::LOADED;
        self.storing &= executed.opcode != Opcode::EXIT_DOWNLOAD;
        if executed.opcode != Opcode::SGP || status != Status::OK {
            return;
        }
        let module = self.module.unwrap_or(&TMCM_3351);
        let can = self.line.nature().can;
        match module.global_parameter(executed.motor, executed.kind).map(|row| row.id) {
            Some(Gp::SerialAddress) if !can => self.address.module = executed.value as u16,
            Some(Gp::CanId) if can => self.address.module = executed.value as u16,
            Some(Gp::CanReplyId) if can && self.address.reply.is_some() => {
                self.address.reply = Some(executed.value as u16);
            }
            Some(Gp::HostAddress) => {}
            _ => return,
        }
        self.in_step = None;
    }

    /// Sends a command and gives back the value of the answer.
    ///
    /// # Errors
    /// As [`execute`](Self::execute), and when the module refuses the command.
    pub fn command(&mut self, instruction: Instruction) -> Result<i32, Error> {
        let reply = self.execute(instruction)?;
        if reply.status.is_ok() { Ok(reply.value) } else { Err(self.refused(instruction, reply.status)) }
    }

    /// The error for a refusal, with what the catalogue knows about it. Where a broker refuses because its line is stopped, that is
    /// the error.
    pub fn refused(&mut self, request: Instruction, status: Status) -> Error {
        let may_be_stopped = status == Status::NOT_AVAILABLE && request.impact() == Impact::Acts;
        if may_be_stopped && matches!(self.ask_latch(LatchRequest::State), Ok(Some(true))) {
            return Error::Stopped { port: self.port().into() };
        }
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
        let bytes = self.converse(Instruction::new(Opcode::FIRMWARE_VERSION, 0, 0, 0), true)?;
        Ok(bytes.iter().skip(1).copied().map(char::from).collect())
    }

    /// The version of the module's firmware, `(1, 11)` for 1.11; `None` if the module's text tells none.
    ///
    /// # Errors
    /// When the line is broken or no answer comes in time.
    pub fn firmware(&mut self) -> Result<Option<(u8, u8)>, Error> {
        Ok(firmware(&self.version_text()?))
    }

    /// The command at an address of the program memory. Past its end, and behind read protection, all fields are zero.
    ///
    /// What comes carries neither a module's address nor the command's number. So all late answers of other modules on the line
    /// are waited for before. And one command, `SAP 1, 0, 0` on a module with address 5 for example, looks like the module's
    /// word about a damaged request: it counts when it comes every time.
    ///
    /// # Errors
    /// When the line is broken, no answer comes in time, or it comes damaged.
    pub fn read_memory(&mut self, address: u16) -> Result<Instruction, Error> {
        let request = Instruction::new(Opcode::READ_MEMORY, 0, 0, i32::from(address));
        let before = self.statistics.damaged_requests;
        match self.converse(request, true) {
            Ok([_, command @ .., _]) => Ok(Instruction::from_bytes(command)),
            Err(Error::GarbledRequest { .. }) if self.statistics.damaged_requests - before > u64::from(RETRIES) => {
                Ok(complaint(self.peer))
            }
            Err(error) => Err(error),
        }
    }

    /// The oldest event that has come and was not taken yet.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn take_event(&mut self) -> Result<Option<PositionReached>, Error> {
        let line = self.line.clone();
        let mut wire = line.lock();
        self.drain(&mut wire)?;
        Ok(wire.take_event(self.peer.module))
    }

    /// Reads what has come unasked; an event waits until it is taken.
    pub(crate) fn listen_in(&mut self) -> Result<(), Error> {
        let line = self.line.clone();
        self.drain(&mut line.lock())
    }

    /// The oldest event of a module that has come and was not taken yet.
    pub(crate) fn take_event_of(&self, module: u8) -> Option<PositionReached> {
        self.line.lock().take_event(module)
    }

    /// True while the module stores what this session sends.
    pub(crate) fn downloads(&self) -> bool {
        let module = self.number_of_module();
        self.line.lock().downloads.is_own(module, self.number)
    }

    /// Waits for the next event, at most for `time`.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn wait_event(&mut self, time: Duration) -> Result<Option<PositionReached>, Error> {
        let line = self.line.clone();
        let deadline = self.now() + time;
        loop {
            let mut wire = line.lock();
            let now = wire.link.now();
            self.listen(&mut wire, deadline.min(now + SHARE))?;
            match wire.take_event(self.peer.module) {
                None if now < deadline => {}
                event => return Ok(event),
            }
        }
    }

    /// Time on the link's clock; virtual on a virtual module.
    pub fn now(&self) -> Duration {
        self.line.lock().link.now()
    }

    /// Lets `time` pass on the link's clock.
    pub fn sleep(&mut self, time: Duration) {
        if let Some(bench) = self.line.lock().link.bench() {
            return bench.run_for(u64::try_from(time.as_micros()).unwrap_or(u64::MAX));
        }
        std::thread::sleep(time);
    }

    /// The bench of a virtual module in this process, to look at its machine; `None` for every other module, and while
    /// other sessions share the line. Whoever moves its time moves that of the session.
    pub fn bench(&mut self) -> Option<&mut Bench> {
        self.line.bench()
    }

    /// Name of the port, for messages.
    pub fn port(&self) -> &str {
        self.line.port()
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

/// The version in a text as `3351V111` or `351V.445`: one digit, and two behind the point.
fn firmware(text: &str) -> Option<(u8, u8)> {
    let digits = text.split_once('V')?.1.trim_start_matches('.');
    let (major, minor) = digits.split_at_checked(1)?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

#[cfg(test)]
mod tests;
