//! Getting in step: making sure that no old answer is under way before the next request goes out.
//!
//! The session sends a probe: a question that changes nothing on any module and works in download mode too (command 157 with a type
//! that does not exist), with a number as its value that was never used before. A module answers in the order in which it was asked, and an
//! error answer repeats the value. So whoever repeats the number is the module at the other end, and everything that was under
//! way before has arrived or is lost.

use std::time::Duration;

use gradus_tmcl::{Instruction, Opcode, Reply};

use crate::line::wire::{Debt, Wire};
use crate::link::SILENCE;
use crate::verdict::{Form, Peer};
use crate::{Address, Error, Heard, Session};

/// A type of command 157 that no module has.
const PROBE_TYPE: u8 = 255;
/// How often a module is probed before it counts as absent.
const PROBES: usize = 3;
/// How long a line may babble before the session probes all the same; no longer than an answer may take.
const LONGEST_NOISE: Duration = Duration::from_secs(1);

impl Session {
    /// Makes sure that nothing is under way.
    pub(crate) fn get_in_step(&mut self, wire: &mut Wire) -> Result<(), Error> {
        self.drain(wire)?;
        if self.in_step == Some(wire.doubts) {
            return Ok(());
        }
        for _ in 0..PROBES {
            if self.probe(wire)? {
                self.in_step = Some(wire.doubts);
                return Ok(());
            }
            self.wait_for_silence(wire)?;
            self.drain(wire)?;
        }
        if self.probe_mute(wire)? {
            self.in_step = Some(wire.doubts);
            return Ok(());
        }
        let nature = wire.link.nature();
        let name = if nature.can { "CAN ID" } else { "address" };
        let address = format!("{name} {}", self.address.module);
        Err(Error::NoModule { port: self.line.port().into(), address, check: nature.check })
    }

    /// Reads what has come unasked. A line that never has a pause is an error after the time of an answer.
    pub(crate) fn drain(&mut self, wire: &mut Wire) -> Result<(), Error> {
        let give_up = wire.link.now() + self.timeout;
        while self.listen(wire, wire.link.now())? {
            if wire.link.now() > give_up {
                return Err(Error::Babble { port: self.line.port().into(), waited: self.timeout });
            }
        }
        Ok(())
    }

    /// Takes the next thing that comes unasked: an event, or an answer that is late. False when nothing comes in time.
    pub(crate) fn listen(&mut self, wire: &mut Wire, deadline: Duration) -> Result<bool, Error> {
        match wire.receive(deadline, self.line.port())? {
            None => return Ok(true),
            Some(Heard::Nothing) => return Ok(false),
            Some(Heard::Datagram(bytes)) => wire.unasked(&bytes),
            Some(Heard::Fragment(_)) => wire.doubt(),
        }
        self.statistics.drained += 1;
        Ok(true)
    }

    /// Sends a probe; true when the module repeats its number, which also tells the addresses of its replies.
    pub(crate) fn probe(&mut self, wire: &mut Wire) -> Result<bool, Error> {
        let Some(peer) = self.probe_at(self.address, wire)? else { return Ok(false) };
        self.peer = peer;
        self.mute = false;
        Ok(true)
    }

    /// Sends a probe to any module of the line; the addresses of its replies when it repeats the number.
    fn probe_at(&mut self, to: Address, wire: &mut Wire) -> Result<Option<Peer>, Error> {
        self.nonce = self.nonce.wrapping_add(1);
        self.statistics.probes += 1;
        wire.send(to, Instruction::new(Opcode::GET_INFO, PROBE_TYPE, 0, self.nonce), false, self.line.port())?;
        wire.last = None;
        let deadline = wire.link.now() + self.timeout;
        while let Heard::Datagram(bytes) = wire.hear(deadline, self.line.port())? {
            let Ok(reply) = Reply::parse(&bytes) else { return Ok(None) };
            if reply.command == Opcode::GET_INFO && reply.value == self.nonce {
                wire.owing.retain(|debt| debt.to != to);
                return Ok(Some(Peer { host: reply.host, module: reply.module }));
            }
            self.statistics.drained += 1;
        }
        Ok(None)
    }

    /// Waits for late answers of other modules that could pass for an answer of that form: where one of the two does not
    /// tell whose it is. The answer of a module that answers no probe either counts as lost.
    pub(crate) fn settle_debts(&mut self, wire: &mut Wire, form: Form) -> Result<(), Error> {
        let could_pass = |debt: &mut Debt| [debt.form, form] != [Form::Reply; 2];
        let due: Vec<Debt> = wire.owing.extract_if(.., could_pass).collect();
        for debt in due {
            let mut left = PROBES;
            while left > 0 && self.probe_at(debt.to, wire)?.is_none() {
                left -= 1;
            }
        }
        Ok(())
    }

    /// Asks for the version text, which a module answers even if its replies are suppressed (global parameter 255), so
    /// that reading works and the suppression can be ended. The text carries no address: the last one known holds.
    fn probe_mute(&mut self, wire: &mut Wire) -> Result<bool, Error> {
        wire.send(self.address, Instruction::new(Opcode::FIRMWARE_VERSION, 0, 0, 0), false, self.line.port())?;
        match wire.hear(wire.link.now() + self.timeout, self.line.port())? {
            Heard::Datagram([host, text @ ..]) if text.iter().all(u8::is_ascii_graphic) => {
                self.peer.host = host;
                self.mute = true;
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    fn wait_for_silence(&mut self, wire: &mut Wire) -> Result<(), Error> {
        let give_up = wire.link.now() + LONGEST_NOISE.min(self.timeout);
        while wire.link.now() < give_up && wire.hear(wire.link.now() + SILENCE, self.line.port())? != Heard::Nothing {}
        Ok(())
    }
}
