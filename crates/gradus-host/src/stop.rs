//! Stopping whatever a module does, and asking the broker of a shared line to hold the stop.

use std::time::Duration;

use gradus_tmcl::{Instruction, Opcode, Reply};

use crate::line::stop_latch::LatchRequest;
use crate::line::wire::Wire;
use crate::{Error, Heard, Session};

/// What ends whatever a module does, in this order.
fn commands(axes: u8) -> impl Iterator<Item = Instruction> {
    let ends = [Opcode::EXIT_DOWNLOAD, Opcode::STOP_APPLICATION].map(|opcode| Instruction::new(opcode, 0, 0, 0));
    ends.into_iter().chain((0..axes).map(|axis| Instruction::new(Opcode::MST, 0, axis, 0)))
}

/// Axes that a module of unknown kind is taken to have.
const MOST_AXES: u8 = 6;

/// Time for an answer that nobody relies on.
const BLINDLY: Duration = Duration::from_millis(20);

impl Session {
    /// Stops everything: ends download mode, in which the module would store what follows; stops the program, which could start
    /// motors again; stops every motor. Each of them is tried though an earlier one failed, and all of them are sent blindly to a
    /// module whose answers do not come through. Passes on a stopped line too.
    ///
    /// # Errors
    /// The first failure. What it names may go on.
    pub fn halt(&mut self) -> Result<(), Error> {
        if let Err(error) = self.greet() {
            self.halt_blindly();
            return Err(error);
        }
        let axes = self.module().map_or(MOST_AXES, |module| module.axes);
        let known = self.module().is_ok();
        let done: Vec<_> = commands(axes).map(|command| self.end(command, known)).collect();
        done.into_iter().collect()
    }

    /// Motors that an unknown module lacks are refused, which is no failure.
    fn end(&mut self, command: Instruction, known: bool) -> Result<(), Error> {
        let status = self.insist(command)?.status;
        if status.is_ok() || !known { Ok(()) } else { Err(self.refused(command, status)) }
    }

    fn halt_blindly(&mut self) {
        let line = self.line.clone();
        let mut wire = line.lock();
        for command in commands(MOST_AXES) {
            let _ = wire.send(self.address, command, false, line.port());
            let deadline = wire.link.now() + BLINDLY;
            let _ = wire.hear(deadline, line.port());
        }
        wire.doubt();
    }

    /// Asks the broker at the other end to hold a stop, to end it, or whether it holds one. True: nothing that acts passes, from
    /// any of its clients. `None`: there is no broker, or one that knows no stops, or nothing answers at all.
    ///
    /// # Errors
    /// When the line is broken.
    pub fn ask_latch(&mut self, request: LatchRequest) -> Result<Option<bool>, Error> {
        let line = self.line.clone();
        let mut wire = line.lock();
        self.drain(&mut wire)?;
        wire.send(self.address, request.instruction(), false, line.port())?;
        let deadline = wire.link.now() + self.timeout;
        self.hear_latch(&mut wire, deadline)
    }

    /// The next answer to command 157; all others are late.
    fn hear_latch(&mut self, wire: &mut Wire, deadline: Duration) -> Result<Option<bool>, Error> {
        while let Heard::Datagram(bytes) = wire.hear(deadline, self.line.port())? {
            match Reply::parse(&bytes) {
                Ok(reply) if reply.command == Opcode::GET_INFO => return Ok(LatchRequest::state(&reply)),
                _ => wire.unasked(&bytes),
            }
        }
        wire.doubt();
        Ok(None)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.line.lock().downloads.forget(self.number);
    }
}
