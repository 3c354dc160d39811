//! What a fuzzer of the host calls: a peer that answers as its script says, in virtual time.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};

use crate::can::fuzz_port;
use crate::link::{Address, Framed, Stream};
use crate::session::Session;

/// Lets a session, or an slcan or socketcand port, work against a hostile peer. The first byte chooses which; the rest is the script of
/// the peer. Whatever it sends, nothing may panic, and every call must come to its end.
pub fn fuzz_session(data: &[u8]) {
    let Some((kind, script)) = data.split_first() else { return };
    let peer = Peer::new(script);
    match kind % 4 {
        port @ (0 | 1) => fuzz_port(port == 0, peer),
        echo => converse(Session::over(Box::new(Framed::new(peer, echo == 3)), "fuzz", Address::serial(1))),
    }
}

/// The calls of a session that look at what comes. What they return is up to the peer.
fn converse(mut session: Session) {
    session.set_timeout(Duration::from_millis(20));
    let _ = session.greet();
    let _ = session.module();
    let _ = session.version_text();
    for opcode in [Opcode::GAP, Opcode::MVP, Opcode::SGP, Opcode::CALC, Opcode::GIO, Opcode::STOP_APPLICATION] {
        let _ = session.execute(Instruction::new(opcode, 0, 0, 5));
    }
    let _ = session.application_status();
    let _ = session.read_memory(3);
    let _ = session.download(&[Instruction::new(Opcode::STOP, 0, 0, 0)], |_| ());
    let _ = session.wait_event(Duration::from_millis(50));
    let _ = session.relay(Instruction::new(Opcode::GAP, 1, 0, 0));
}

/// A peer without manners: bytes of its script, answers with a false part, silence, a broken line.
pub(crate) struct Peer {
    script: VecDeque<u8>,
    now: Duration,
    asked: Request,
}

impl Peer {
    fn new(script: &[u8]) -> Self {
        let asked = Request { address: 1, instruction: Instruction::default() };
        Self { script: script.iter().copied().collect(), now: Duration::ZERO, asked }
    }

    fn byte(&mut self) -> u8 {
        self.script.pop_front().unwrap_or(0)
    }

    /// What a module would answer, but for what the script changes.
    fn answer(&mut self, action: u8) -> [u8; 9] {
        let status = if action & 0x40 == 0 { Status::OK } else { Status(self.byte()) };
        let value = i32::from(self.byte());
        let command = self.asked.instruction.opcode;
        let mut bytes = Reply { host: 2, module: self.asked.address, status, command, value }.emit();
        if action & 0x80 != 0 {
            let place = usize::from(self.byte());
            bytes[place % 9] ^= self.byte();
        }
        bytes
    }
}

impl Stream for Peer {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Some(asked) = bytes.try_into().ok().and_then(|bytes| Request::parse(&bytes).ok()) {
            self.asked = asked;
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        self.now += Duration::from_micros(100);
        let Some(action) = self.script.pop_front() else {
            self.now = self.now.max(deadline);
            return Ok(0);
        };
        let bytes: Vec<u8> = match action % 8 {
            0 | 1 => self.answer(action).to_vec(),
            2..=5 => (0..=action / 8).map(|_| self.byte()).collect(),
            6 => {
                self.now = self.now.max(deadline);
                Vec::new()
            }
            _ if action > 250 => return Err(io::ErrorKind::BrokenPipe.into()),
            _ => Vec::new(),
        };
        let count = bytes.len().min(buffer.len());
        buffer[..count].copy_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn what_to_check(&self) -> &'static str {
        "nothing"
    }
}
