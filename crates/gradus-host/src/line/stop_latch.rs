//! The stop latch of a line: from a stop until its release nothing that acts goes out, whoever asks.
//!
//! Who sends holds the latch's lock while the bytes go out, so a stop returns when the latest of them is out, and nothing follows.
//! It does not wait for answers.
//!
//! The latch of a line that several programs share through a broker is the broker's. It is worked by three datagrams, which the
//! broker answers itself: command 157 with a type and a value that no module knows. A module, or a broker that does not know them,
//! gives the answer of a wrong type and is so told apart.

use std::sync::{Mutex, MutexGuard, PoisonError};

use gradus_tmcl::{Instruction, Opcode, Reply, Status};

/// Says whether anything that acts may go out.
#[derive(Default)]
pub(crate) struct StopLatch {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    stopped: bool,
    /// How many stops there were: a job begun before the latest one ends, though the line may be released again.
    stops: u64,
}

/// What holds of a latch while nobody can change it.
pub(crate) struct Held<'a>(MutexGuard<'a, State>);

impl StopLatch {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Nothing that acts goes out from now on.
    pub fn stop(&self) {
        let mut state = self.lock();
        state.stopped = true;
        state.stops += 1;
    }

    /// What acts may go out again.
    pub fn release(&self) {
        self.lock().stopped = false;
    }

    /// True from a stop until its release.
    pub fn is_stopped(&self) -> bool {
        self.lock().stopped
    }

    /// How many stops there were.
    pub fn stops(&self) -> u64 {
        self.lock().stops
    }

    /// Keeps the latch as it is while something is sent.
    pub fn hold(&self) -> Held<'_> {
        Held(self.lock())
    }
}

impl Held<'_> {
    /// True from a stop until its release.
    pub fn is_stopped(&self) -> bool {
        self.0.stopped
    }
}

/// What a client asks of a broker's latch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LatchRequest {
    /// Tell whether the line is stopped.
    State,
    /// Let pass again what acts.
    Release,
    /// Let nothing pass that acts.
    Stop,
}

/// The value of the three datagrams: `STOP`.
const KEY: i32 = i32::from_be_bytes(*b"STOP");
/// The value of the broker's answer while the line is released; one more while it is stopped.
const RELEASED: i32 = i32::from_be_bytes(*b"LTC0");
const STOPPED: i32 = RELEASED + 1;

impl LatchRequest {
    const ALL: [Self; 3] = [Self::State, Self::Release, Self::Stop];

    /// Type of command 157, from the end of what no module has.
    const fn kind(self) -> u8 {
        match self {
            Self::State => 252,
            Self::Release => 253,
            Self::Stop => 254,
        }
    }

    /// The datagram to the broker.
    pub const fn instruction(self) -> Instruction {
        Instruction::new(Opcode::GET_INFO, self.kind(), 0, KEY)
    }

    /// What a datagram asks of the latch, if it is one of the three.
    pub(crate) fn of(instruction: Instruction) -> Option<Self> {
        Self::ALL.into_iter().find(|request| request.instruction() == instruction)
    }

    /// Does it, and gives back the value of the answer.
    pub(crate) fn apply(self, latch: &StopLatch) -> i32 {
        match self {
            Self::State => {}
            Self::Release => latch.release(),
            Self::Stop => latch.stop(),
        }
        if latch.is_stopped() { STOPPED } else { RELEASED }
    }

    /// What an answer to command 157 says: whether the line is stopped; `None` if no broker gave it.
    pub(crate) fn state(reply: &Reply) -> Option<bool> {
        let by_broker = reply.status == Status::OK && matches!(reply.value, RELEASED | STOPPED);
        by_broker.then_some(reply.value == STOPPED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_holds_until_its_release_and_is_counted() {
        let latch = StopLatch::default();
        assert!(!latch.is_stopped());
        latch.stop();
        latch.stop();
        assert!(latch.is_stopped() && latch.hold().is_stopped());
        latch.release();
        assert!(!latch.is_stopped());
        assert_eq!(latch.stops(), 2);
    }

    #[test]
    fn the_three_datagrams_are_told_from_all_others() {
        for request in LatchRequest::ALL {
            assert_eq!(LatchRequest::of(request.instruction()), Some(request));
        }
        for kind in 0..=255 {
            assert_eq!(LatchRequest::of(Instruction::new(Opcode::GET_INFO, kind, 0, 0)), None);
        }
        assert_eq!(LatchRequest::of(Instruction::new(Opcode::GET_INFO, 251, 0, KEY)), None);
    }

    #[test]
    fn an_answer_of_a_module_is_no_answer_of_a_broker() {
        let reply = |status, value| Reply { host: 2, module: 1, status, command: Opcode::GET_INFO, value };
        assert_eq!(LatchRequest::state(&reply(Status::WRONG_TYPE, KEY)), None);
        assert_eq!(LatchRequest::state(&reply(Status::OK, KEY)), None);
        assert_eq!(LatchRequest::state(&reply(Status::OK, RELEASED)), Some(false));
        assert_eq!(LatchRequest::state(&reply(Status::OK, STOPPED)), Some(true));
    }
}
