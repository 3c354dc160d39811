//! The session against a scripted line: what is lost, late, foreign, damaged or unasked.

use std::io;
use std::sync::{Arc, Mutex};

use gradus_tmcl::catalogue::Ap;

use super::*;

/// A module on a line with faults, in virtual time. Each request takes the next fault of the script.
#[derive(Default)]
struct Fake {
    now: Duration,
    script: VecDeque<Fault>,
    /// Bytes under way to the host, with the time of their arrival.
    line: VecDeque<(Duration, Vec<u8>)>,
    /// Requests that the module executed, probes left out.
    executed: Vec<Instruction>,
    /// What the module answers as its address; USB-like, it does not look at the address asked.
    address: u8,
    /// Answers nothing but reads and what has a special reply.
    mute: bool,
    probes: usize,
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    /// Nothing comes back.
    Lost,
    /// The answer comes after so many milliseconds.
    Late(u64),
    /// One bit of the answer is wrong.
    Flipped,
    /// The last byte of the answer is lost.
    Short,
    /// The request reached the module damaged.
    RequestFlipped,
    /// Another module answers first.
    Foreign,
    /// An event comes before the answer.
    Event,
}

const ADDRESS: u8 = 7;
const HOST: u8 = 2;

/// What the fake module answers: the value tells which request is answered.
fn answer(instruction: Instruction) -> i32 {
    i32::from(instruction.kind) * 1000 + i32::from(instruction.motor)
}

impl Fake {
    fn reply(&self, status: Status, command: Opcode, value: i32) -> Vec<u8> {
        Reply { host: HOST, module: self.address, status, command, value }.emit().to_vec()
    }

    fn arrive(&mut self, after_ms: u64, bytes: Vec<u8>) {
        let at = self.now + Duration::from_millis(after_ms);
        // A module answers in the order in which it is asked.
        let at = self.line.back().map_or(at, |(last, _)| at.max(*last));
        self.line.push_back((at, bytes));
    }

    fn ask(&mut self, instruction: Instruction) {
        let probe = instruction.opcode == Opcode::GET_INFO;
        let fault = self.script.pop_front().unwrap_or(Fault::None);
        if matches!(fault, Fault::RequestFlipped) {
            return self.arrive(1, self.reply(Status::WRONG_CHECKSUM, Opcode::NOP, 0));
        }
        if probe {
            self.probes += 1;
        } else {
            self.executed.push(instruction);
        }
        if self.mute && !matches!(instruction.opcode, Opcode::GAP | Opcode::FIRMWARE_VERSION) {
            return;
        }
        let mut bytes = self.special(instruction).unwrap_or_else(|| {
            let value = if probe { instruction.value } else { answer(instruction) };
            self.reply(if probe { Status::WRONG_TYPE } else { Status::OK }, instruction.opcode, value)
        });
        match fault {
            Fault::Lost => return,
            Fault::Late(ms) => return self.arrive(ms, bytes),
            Fault::Flipped => bytes[5] ^= 0x10,
            Fault::Short => bytes.truncate(8),
            Fault::Foreign => {
                let other =
                    Reply { host: HOST, module: 9, status: Status::OK, command: instruction.opcode, value: 4711 };
                self.arrive(1, other.emit().to_vec());
            }
            Fault::Event => self.arrive(1, self.reply(Status::POSITION_REACHED, Opcode::POSITION_EVENT, 5)),
            Fault::None | Fault::RequestFlipped => {}
        }
        self.arrive(1, bytes);
    }

    fn special(&self, instruction: Instruction) -> Option<Vec<u8>> {
        match (instruction.opcode, instruction.kind) {
            (Opcode::FIRMWARE_VERSION, 0) => Some([&[HOST], b"3351V111".as_slice()].concat()),
            (Opcode::FIRMWARE_VERSION, _) => Some(self.reply(Status::OK, instruction.opcode, 0x0D17_010B)),
            (Opcode::READ_MEMORY, _) => {
                let instruction = Instruction::new(Opcode::ROR, 0, 2, instruction.value);
                Some(Request { address: HOST, instruction }.emit().to_vec())
            }
            _ => None,
        }
    }
}

#[derive(Clone)]
struct Line(Arc<Mutex<Fake>>);

impl Link for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let request = Request::parse(bytes.try_into().unwrap()).unwrap();
        self.0.lock().unwrap().ask(request.instruction);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        let mut fake = self.0.lock().unwrap();
        let now = fake.now;
        let Some((at, mut bytes)) = fake.line.pop_front_if(|(at, _)| *at <= deadline.max(now)) else {
            fake.now = now.max(deadline);
            return Ok(0);
        };
        fake.now = fake.now.max(at);
        let count = bytes.len().min(buffer.len());
        buffer[..count].copy_from_slice(&bytes[..count]);
        if count < bytes.len() {
            fake.line.push_front((at, bytes.split_off(count)));
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.0.lock().unwrap().now
    }

    fn sleep(&mut self, time: Duration) {
        self.0.lock().unwrap().now += time;
    }

    fn what_to_check(&self) -> &'static str {
        "the fake"
    }
}

/// A session in step with a fake module that goes on with `script`.
fn session(script: &[Fault]) -> (Session, Line) {
    let line = Line(Arc::new(Mutex::new(Fake { address: ADDRESS, ..Fake::default() })));
    let mut session = Session::over(Box::new(line.clone()), "fake".into(), 1);
    session.get_in_step().unwrap();
    line.0.lock().unwrap().script = script.iter().copied().collect();
    (session, line)
}

fn gap(number: u8) -> Instruction {
    Instruction::new(Opcode::GAP, number, 1, 0)
}

/// Asks for parameters 10 to 19; every value handed out must be the right one. Gives back how many requests failed.
fn ask_ten(session: &mut Session) -> usize {
    let results = (10..20).map(|number| (number, session.command(gap(number))));
    results
        .filter(|(number, result)| {
            result.as_ref().map_or(true, |value| {
                assert_eq!(*value, answer(gap(*number)));
                false
            })
        })
        .count()
}

#[test]
fn a_clean_line_needs_one_probe() {
    let (mut session, line) = session(&[]);
    assert_eq!(ask_ten(&mut session), 0);
    assert_eq!(line.0.lock().unwrap().probes, 1);
}

#[test]
fn no_fault_makes_a_wrong_answer() {
    use Fault::*;
    let cases: [(&str, &[Fault], usize); 10] = [
        ("lost", &[None, Lost], 1),
        ("late, but in time", &[None, Late(900)], 0),
        ("late", &[None, Late(1500)], 1),
        ("late, and the probe is lost", &[None, Late(1500), Lost], 1),
        ("very late, after two probes", &[None, Late(3500)], 1),
        ("flipped", &[None, Flipped], 1),
        ("short", &[None, Short], 1),
        ("request flipped", &[None, RequestFlipped], 1),
        ("foreign", &[None, Foreign], 0),
        ("event", &[None, Event], 0),
    ];
    for (name, script, failures) in cases {
        let (mut session, _) = session(script);
        assert_eq!(ask_ten(&mut session), failures, "{name}");
    }
}

#[test]
fn every_pair_of_faults_leaves_the_session_right() {
    use Fault::*;
    let faults = [None, Lost, Late(900), Late(1100), Late(2500), Flipped, Short, RequestFlipped, Foreign, Event];
    for first in faults {
        for second in faults {
            let (mut session, _) = session(&[first, second]);
            assert!(ask_ten(&mut session) <= 2, "{first:?}, {second:?}");
        }
    }
}

#[test]
fn nothing_is_sent_twice() {
    let (mut session, line) = session(&[Fault::Lost, Fault::None, Fault::Flipped]);
    ask_ten(&mut session);
    let numbers: Vec<u8> = line.0.lock().unwrap().executed.iter().map(|instruction| instruction.kind).collect();
    assert_eq!(numbers, (10..20).collect::<Vec<u8>>());
}

#[test]
fn errors_say_what_happened() {
    let cases = [
        (Fault::Lost, "no answer to"),
        (Fault::Flipped, "came damaged"),
        (Fault::Short, "came damaged"),
        (Fault::RequestFlipped, "was not executed"),
    ];
    for (fault, expected) in cases {
        let (mut session, _) = session(&[fault]);
        let message = session.command(gap(1)).unwrap_err().to_string();
        assert!(message.starts_with("fake: ") && message.contains(expected), "{message}");
    }
}

#[test]
fn what_an_earlier_program_left_behind_is_no_answer() {
    let line = Line(Arc::new(Mutex::new(Fake { address: ADDRESS, ..Fake::default() })));
    {
        let mut fake = line.0.lock().unwrap();
        let stale = fake.reply(Status::OK, Opcode::GAP, 4711);
        fake.arrive(0, stale.clone());
        fake.arrive(2, stale);
    }
    let mut session = Session::over(Box::new(line), "fake".into(), 1);
    assert_eq!(session.command(gap(3)).unwrap(), answer(gap(3)));
}

#[test]
fn a_silent_line_is_reported() {
    let line = Line(Arc::new(Mutex::new(Fake { script: [Fault::Lost; 4].into(), ..Fake::default() })));
    let mut session = Session::over(Box::new(line), "fake".into(), 1);
    let message = session.command(gap(3)).unwrap_err().to_string();
    assert!(message.contains("no module answers at address 1; check the fake"), "{message}");
}

#[test]
fn events_come_apart_from_answers() {
    let (mut session, line) = session(&[Fault::None, Fault::Event]);
    assert_eq!(ask_ten(&mut session), 0);
    assert_eq!(session.take_event().unwrap(), Some(PositionReached { motors: 5 }));
    assert_eq!(session.take_event().unwrap(), None);
    {
        let mut fake = line.0.lock().unwrap();
        let event = fake.reply(Status::POSITION_REACHED, Opcode::POSITION_EVENT, 2);
        fake.arrive(300, event);
    }
    assert_eq!(session.wait_event(Duration::from_millis(200)).unwrap(), None);
    assert_eq!(session.wait_event(Duration::from_millis(200)).unwrap(), Some(PositionReached { motors: 2 }));
    assert_eq!(line.0.lock().unwrap().probes, 1, "an event does not bring the session out of step");
}

#[test]
fn a_changed_address_is_learnt_anew() {
    let (mut session, line) = session(&[]);
    line.0.lock().unwrap().address = 8;
    assert!(session.command(gap(1)).is_err());
    assert_eq!(session.command(gap(2)).unwrap(), answer(gap(2)));
}

#[test]
fn a_module_with_suppressed_replies_can_be_read() {
    let line = Line(Arc::new(Mutex::new(Fake { address: 1, mute: true, ..Fake::default() })));
    let mut session = Session::over(Box::new(line.clone()), "fake".into(), 1);
    assert_eq!(session.command(gap(1)).unwrap(), answer(gap(1)));
    let message = session.command(Instruction::new(Opcode::SAP, 4, 0, 1)).unwrap_err().to_string();
    assert!(message.contains("its reply suppressed"), "{message}");
    assert_eq!(line.0.lock().unwrap().executed.iter().filter(|done| done.opcode == Opcode::SAP).count(), 1);
    assert_eq!(session.command(gap(2)).unwrap(), answer(gap(2)));
}

#[test]
fn special_replies_are_read() {
    let (mut session, _) = session(&[Fault::Event, Fault::Event, Fault::Flipped]);
    assert_eq!(session.version_text().unwrap(), "3351V111");
    assert_eq!(session.read_memory(17).unwrap(), Instruction::new(Opcode::ROR, 0, 2, 17));
    assert!(session.read_memory(17).is_err());
    assert_eq!(session.module().unwrap().name, "TMCM-3351");
    assert_eq!(session.take_event().unwrap(), Some(PositionReached { motors: 5 }));
}

#[test]
fn parameters_are_read_by_meaning() {
    let (mut session, _) = session(&[]);
    assert_eq!(session.get_axis(Ap::MaxSpeed, 2).unwrap(), 4002);
}
