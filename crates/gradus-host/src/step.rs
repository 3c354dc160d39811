//! Getting in step: making sure that no old answer is under way before the next request goes out.
//!
//! The session sends a probe: a question that changes nothing on any module and works in download mode too (command 157 with a type
//! that does not exist), with a number as its value that was never used before. A module answers in the order in which it was asked, and an
//! error answer repeats the value. So whoever repeats the number is the module at the other end, and everything that was under
//! way before has arrived or is lost.

use std::time::Duration;

use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use crate::session::{Peer, PositionReached, REPLY_TIMEOUT};
use crate::{Error, Session};

/// A type of command 157 that no module has.
const PROBE_TYPE: u8 = 255;
/// How often a module is probed before it counts as absent.
const PROBES: usize = 3;
/// A pause inside a datagram that ends it; longer than the 50 ms of modules on USB and TCP, so that they too have
/// thrown away an unfinished datagram.
const SILENCE: Duration = Duration::from_millis(60);
/// How long a line may babble before the session probes all the same.
const LONGEST_NOISE: Duration = Duration::from_secs(1);

/// What came over the line.
pub(crate) enum Heard {
    /// Nothing in time.
    Nothing,
    /// Nine bytes that are no event.
    Datagram([u8; 9]),
    /// Fewer, and then a pause.
    Fragment(Vec<u8>),
}

impl Session {
    /// Makes sure that nothing is under way.
    pub(crate) fn get_in_step(&mut self) -> Result<(), Error> {
        self.drain()?;
        if self.in_step {
            return Ok(());
        }
        for _ in 0..PROBES {
            if self.probe()? {
                self.in_step = true;
                return Ok(());
            }
            self.wait_for_silence()?;
        }
        if self.probe_mute()? {
            self.in_step = true;
            return Ok(());
        }
        let (port, check) = (self.port.clone(), self.link.what_to_check());
        Err(Error::NoModule { port, address: self.address, check })
    }

    /// Reads what has come unasked.
    pub(crate) fn drain(&mut self) -> Result<(), Error> {
        while self.listen(self.now())? {}
        Ok(())
    }

    /// Takes the next thing that comes unasked: an event, or an answer that is late. False when nothing comes in time.
    pub(crate) fn listen(&mut self, deadline: Duration) -> Result<bool, Error> {
        match self.receive_datagram(deadline)? {
            Heard::Nothing => return Ok(false),
            Heard::Datagram(bytes) if self.keep_event(&bytes) => {}
            Heard::Datagram(_) | Heard::Fragment(_) => self.in_step = false,
        }
        Ok(true)
    }

    /// The next datagram that is no event; events are kept.
    pub(crate) fn hear(&mut self, deadline: Duration) -> Result<Heard, Error> {
        loop {
            match self.receive_datagram(deadline)? {
                Heard::Datagram(bytes) if self.keep_event(&bytes) => {}
                other => return Ok(other),
            }
        }
    }

    /// Sends a request.
    pub(crate) fn send(&mut self, instruction: Instruction) -> Result<(), Error> {
        let bytes = Request { address: self.address, instruction }.emit();
        self.link.send(&bytes).map_err(|error| Error::Broken { port: self.port.clone(), error })
    }

    /// Sends a probe; true when the module repeats its number, which also tells the addresses of its replies.
    fn probe(&mut self) -> Result<bool, Error> {
        self.nonce = self.nonce.wrapping_add(1);
        self.send(Instruction::new(Opcode::GET_INFO, PROBE_TYPE, 0, self.nonce))?;
        let deadline = self.now() + REPLY_TIMEOUT;
        while let Heard::Datagram(bytes) = self.hear(deadline)? {
            let Ok(reply) = Reply::parse(&bytes) else { return Ok(false) };
            if reply.command == Opcode::GET_INFO && reply.value == self.nonce {
                self.peer = Peer { host: reply.host, module: reply.module };
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Asks for the version text, which a module answers even if its replies are suppressed (global parameter 255), so
    /// that reading works and the suppression can be ended. The text carries no address: the last one known holds.
    fn probe_mute(&mut self) -> Result<bool, Error> {
        self.send(Instruction::new(Opcode::FIRMWARE_VERSION, 0, 0, 0))?;
        match self.hear(self.now() + REPLY_TIMEOUT)? {
            Heard::Datagram([host, text @ ..]) if text.iter().all(u8::is_ascii_graphic) => {
                self.peer.host = host;
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    fn keep_event(&mut self, bytes: &[u8; 9]) -> bool {
        let event = Reply::parse(bytes).ok().filter(|reply| {
            reply.status == Status::POSITION_REACHED
                && reply.command == Opcode::POSITION_EVENT
                && reply.module == self.peer.module
        });
        self.events.extend(event.map(|reply| PositionReached { motors: reply.value }));
        event.is_some()
    }

    /// The next nine bytes. The deadline holds for the first of them, [`SILENCE`] for each further one.
    fn receive_datagram(&mut self, mut deadline: Duration) -> Result<Heard, Error> {
        let mut bytes = [0; 9];
        let mut len = 0;
        while len < bytes.len() {
            match self.receive(&mut bytes[len..], deadline)? {
                0 if self.now() < deadline => {}
                0 if len == 0 => return Ok(Heard::Nothing),
                0 => return Ok(Heard::Fragment(bytes[..len].to_vec())),
                count => {
                    len += count;
                    deadline = self.now() + SILENCE;
                }
            }
        }
        Ok(Heard::Datagram(bytes))
    }

    fn wait_for_silence(&mut self) -> Result<(), Error> {
        let give_up = self.now() + LONGEST_NOISE;
        let mut quiet_at = self.now() + SILENCE;
        while self.now() < quiet_at.min(give_up) {
            if self.receive(&mut [0; 64], quiet_at)? > 0 {
                quiet_at = self.now() + SILENCE;
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> Result<usize, Error> {
        self.link.receive(buffer, deadline).map_err(|error| Error::Broken { port: self.port.clone(), error })
    }
}
