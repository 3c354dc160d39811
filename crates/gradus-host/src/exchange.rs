//! One request and its answer; sent again after a failure on the way, if that is allowed.

use gradus_tmcl::catalogue::Impact;
use gradus_tmcl::{Bulk, Instruction, Opcode, Reply, Status};

use crate::line::downloads::is_control;
use crate::line::wire::{Exchange, Wire};
use crate::verdict::{Form, Verdict, form, judge};
use crate::{Error, Heard, Session};

/// Why a session asks for no bulk download.
const NO_BULK: &str =
    "raw bytes behind the reply would put the line out of step; ask for one sample after the other (type 9)";

impl Session {
    /// A request and its answer, sent again after a failure on the way if that is allowed.
    pub(crate) fn converse(&mut self, request: Instruction, repeat: bool) -> Result<[u8; 9], Error> {
        let is_stored = self.storing && !is_control(request.opcode);
        let mut left = if repeat && !is_stored { self.retries } else { 0 };
        self.statistics.requests += 1;
        let job = self.line.job();
        loop {
            match self.attempt(request) {
                Err(error) if left > 0 && error.is_passing() && !self.mute => {
                    self.line.go_on_with(job, request).inspect_err(|_| self.fail(request))?;
                    left -= 1;
                    self.statistics.retries += 1;
                }
                result => return result.inspect_err(|_| self.fail(request)),
            }
        }
    }

    fn fail(&self, request: Instruction) {
        self.line.lock().downloads.failed(self.number_of_module(), self.number, request.opcode);
    }

    /// One request and its answer.
    fn attempt(&mut self, request: Instruction) -> Result<[u8; 9], Error> {
        let line = self.line.clone();
        let mut wire = line.lock();
        let wire = &mut *wire;
        if let Some(last) = wire.last.filter(|last| wire.doubling && is_alike(last.request, request)) {
            self.in_step = None;
            wire.owe(last.to, last.request);
        }
        self.get_in_step(wire)?;
        self.settle_debts(wire, form(request))?;
        self.clear_way(wire, request)?;
        self.ask(wire, request)
    }

    /// A stop stops: motors cannot be stopped while the module stores what it is sent, so another session's download is ended
    /// before. Whatever else would go into that program is refused, and so is what no session can receive.
    fn clear_way(&mut self, wire: &mut Wire, request: Instruction) -> Result<(), Error> {
        let module = self.number_of_module();
        let bulk = Bulk::is_asked_by(&request).then_some(NO_BULK);
        if let Some(reason) = bulk.or_else(|| wire.downloads.refusal(module, self.number, request.opcode)) {
            let (request, reason) = (self.text(request), reason.into());
            return Err(Error::Refused { request, status: Status::NOT_AVAILABLE, reason });
        }
        if request.opcode == Opcode::MST && wire.downloads.is_others(module, self.number) {
            self.ask(wire, Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0))?;
        }
        Ok(())
    }

    /// The module as the line's downloads know it: the address in its answers, whatever it is asked under; on a CAN bus that is
    /// the low byte of its identifier.
    pub(crate) fn number_of_module(&self) -> u8 {
        self.peer.module
    }

    /// Sends a request, and hears its answer.
    fn ask(&mut self, wire: &mut Wire, request: Instruction) -> Result<[u8; 9], Error> {
        let module = self.number_of_module();
        let is_stored = wire.downloads.is_own(module, self.number) && !is_control(request.opcode);
        let start = wire.link.now();
        wire.send(self.address, request, is_stored || request.impact() == Impact::Acts, self.line.port())?;
        wire.downloads.sent(module, self.number, request.opcode);
        let answer = self.hear_answer(wire, request);
        if let Some(reply) = answer.as_ref().ok().and_then(|bytes| Reply::parse(bytes).ok()) {
            wire.downloads.answered(module, self.number, request.opcode, reply.status);
        }
        if self.mute && request.opcode == Opcode::EXIT_DOWNLOAD {
            // The module acknowledges nothing; waiting for it would lock everybody out.
            wire.downloads.answered(module, self.number, request.opcode, Status::OK);
        }
        match answer {
            Ok(bytes) => {
                self.statistics.answers += 1;
                self.statistics.round_trips.add(wire.link.now().saturating_sub(start));
                wire.last = Some(Exchange { to: self.address, request, answer: bytes });
            }
            Err(_) => {
                wire.owe(self.address, request);
                wire.doubt();
            }
        }
        answer
    }

    fn hear_answer(&mut self, wire: &mut Wire, request: Instruction) -> Result<[u8; 9], Error> {
        let deadline = wire.link.now() + self.timeout;
        let mut foreign = 0;
        loop {
            let bytes = match wire.hear(deadline, self.line.port())? {
                Heard::Datagram(bytes) => bytes,
                Heard::Fragment(bytes) => {
                    self.statistics.damaged += 1;
                    return Err(self.garbled(request, bytes));
                }
                Heard::Nothing => {
                    self.statistics.silent += 1;
                    return Err(self.silent(request, foreign));
                }
            };
            match judge(request, self.peer, self.nonce, &bytes) {
                Verdict::Answer => return Ok(bytes),
                Verdict::Foreign => {
                    // Something else came: more may be under way.
                    wire.unasked(&bytes);
                    self.statistics.drained += 1;
                    foreign += 1;
                }
                Verdict::Damaged => {
                    self.statistics.damaged += 1;
                    return Err(self.garbled(request, bytes.to_vec()));
                }
                Verdict::DamagedRequest => {
                    self.statistics.damaged_requests += 1;
                    let port = self.line.port().into();
                    return Err(Error::GarbledRequest { port, request: self.text(request) });
                }
            }
        }
    }

    pub(crate) fn garbled(&self, request: Instruction, bytes: Vec<u8>) -> Error {
        Error::Garbled { port: self.line.port().into(), request: self.text(request), bytes }
    }

    fn silent(&self, request: Instruction, foreign: usize) -> Error {
        let port = self.line.port().into();
        Error::Silent { port, request: self.text(request), waited: self.timeout, foreign }
    }
}

/// True if the answer to an earlier request could pass for that to a later one: both are the same command, or one of the answers
/// does not tell what it answers.
fn is_alike(earlier: Instruction, request: Instruction) -> bool {
    earlier.opcode == request.opcode || [earlier, request].map(form) != [Form::Reply; 2]
}
