//! The session against a scripted line: what is lost, late, foreign, damaged or unasked.

use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex};

use gradus_tmcl::catalogue::Ap;

use super::*;
use crate::{Framed, Stream};

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
    /// In download mode.
    storing: bool,
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
    /// A second copy of the answer comes so many milliseconds later.
    Doubled(u64),
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
        self.storing |= instruction.opcode == Opcode::ENTER_DOWNLOAD;
        self.storing &= instruction.opcode != Opcode::EXIT_DOWNLOAD;
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
            self.reply(self.status(instruction.opcode), instruction.opcode, value)
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
            Fault::Doubled(ms) => {
                self.arrive(1, bytes.clone());
                return self.arrive(1 + ms, bytes);
            }
            Fault::None | Fault::RequestFlipped => {}
        }
        self.arrive(1, bytes);
    }

    fn status(&self, opcode: Opcode) -> Status {
        match opcode {
            Opcode::GET_INFO => Status::WRONG_TYPE,
            _ if self.storing && opcode.0 < 128 => Status::LOADED,
            _ => Status::OK,
        }
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
struct FakeLine(Arc<Mutex<Fake>>);

impl Stream for FakeLine {
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

    fn what_to_check(&self) -> &'static str {
        "the fake"
    }
}

fn over(line: &FakeLine) -> Session {
    Session::over(Box::new(Framed::new(line.clone(), false)), "fake", Address::serial(1))
}

/// A session in step with a fake module that goes on with `script`, and which sends again what it may.
fn careful_session(script: &[Fault]) -> (Session, FakeLine) {
    let line = FakeLine(Arc::new(Mutex::new(Fake { address: ADDRESS, ..Fake::default() })));
    let mut session = over(&line);
    session.greet().unwrap();
    line.0.lock().unwrap().script = script.iter().copied().collect();
    (session, line)
}

/// The same, but it sends nothing again.
fn session(script: &[Fault]) -> (Session, FakeLine) {
    let (mut session, line) = careful_session(&[]);
    session.set_retries(0);
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
    let line = FakeLine(Arc::new(Mutex::new(Fake { address: ADDRESS, ..Fake::default() })));
    {
        let mut fake = line.0.lock().unwrap();
        let stale = fake.reply(Status::OK, Opcode::GAP, 4711);
        fake.arrive(0, stale.clone());
        fake.arrive(2, stale);
    }
    let mut session = over(&line);
    assert_eq!(session.command(gap(3)).unwrap(), answer(gap(3)));
}

#[test]
fn a_silent_line_is_reported() {
    let line = FakeLine(Arc::new(Mutex::new(Fake { script: [Fault::Lost; 4].into(), ..Fake::default() })));
    let mut session = over(&line);
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
    let line = FakeLine(Arc::new(Mutex::new(Fake { address: 1, mute: true, ..Fake::default() })));
    let mut session = over(&line);
    assert_eq!(session.command(gap(1)).unwrap(), answer(gap(1)));
    let message = session.command(Instruction::new(Opcode::SAP, 4, 0, 1)).unwrap_err().to_string();
    assert!(message.contains("its reply suppressed"), "{message}");
    assert_eq!(line.0.lock().unwrap().executed.iter().filter(|done| done.opcode == Opcode::SAP).count(), 1);
    assert_eq!(session.command(gap(2)).unwrap(), answer(gap(2)));
}

#[test]
fn the_text_tells_the_version_of_the_firmware() {
    for module in gradus_tmcl::catalogue::MODULES {
        let text = String::from_utf8(module.version_text.to_vec()).unwrap();
        assert_eq!(firmware(&text), Some(module.version), "{text}");
    }
    for text in ["", "3351", "3351V", "3351V1", "3351Vx11", "3351V1\u{e9}1", "\u{e9}V\u{e9}11"] {
        assert_eq!(firmware(text), None, "{text}");
    }
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
fn a_word_about_a_damaged_request_is_no_command() {
    let (mut session, _) = careful_session(&[Fault::RequestFlipped]);
    assert_eq!(session.read_memory(17).unwrap(), Instruction::new(Opcode::ROR, 0, 2, 17));
    let (mut session, _) = careful_session(&[Fault::RequestFlipped, Fault::None].repeat(3)); // the module answers the probes
    assert_eq!(session.read_memory(17).unwrap(), Instruction::new(Opcode(ADDRESS), 1, 0, 0), "it comes every time");
}

#[test]
fn parameters_are_read_by_meaning() {
    let (mut session, _) = session(&[]);
    assert_eq!(session.get_axis(Ap::MaxSpeed, 2).unwrap(), 4002);
}

#[test]
fn reads_and_absolute_writes_are_sent_again() {
    use Fault::*;
    let commands = ["GAP 4, 1", "GGP 66, 0", "SAP 4, 1, 1000", "MVP ABS, 1, 1000", "SGP 5, 2, 7"];
    for fault in [Lost, Late(1500), Flipped, Short, RequestFlipped] {
        for text in commands {
            let (mut session, line) = careful_session(&[fault]);
            let instruction = Instruction::parse(text, &TMCM_3351).unwrap();
            assert_eq!(session.command(instruction).unwrap(), answer(instruction), "{fault:?} {text}");
            assert_eq!(session.statistics().retries, 1, "{fault:?} {text}");
            let sent = if matches!(fault, RequestFlipped) { 1 } else { 2 };
            assert_eq!(line.0.lock().unwrap().executed, vec![instruction; sent], "{fault:?} {text}");
        }
    }
}

#[test]
fn relative_moves_and_control_of_programs_are_never_sent_twice() {
    use Fault::*;
    let commands = ["MVP REL, 1, 1000", "RFS START, 1", "CALC ADD, 1", "DATA 129, 0, 0, 0", "DATA 133, 0, 0, 0"];
    for fault in [Lost, Late(1500), Flipped, Short, RequestFlipped] {
        for text in commands {
            let (mut session, line) = careful_session(&[fault]);
            let instruction = Instruction::parse(text, &TMCM_3351).unwrap();
            assert!(session.command(instruction).is_err(), "{fault:?} {text}");
            assert!(line.0.lock().unwrap().executed.len() <= 1, "{fault:?} {text}");
            assert_eq!(session.command(gap(1)).unwrap(), answer(gap(1)));
        }
    }
}

#[test]
fn a_caller_may_insist() {
    let (mut session, line) = careful_session(&[Fault::Lost]);
    let stop = Instruction::parse("DATA 128, 0, 0, 0", &TMCM_3351).unwrap();
    assert_eq!(session.insist(stop).unwrap().status, Status::OK);
    assert_eq!(line.0.lock().unwrap().executed, [stop, stop]);
}

#[test]
fn nothing_is_sent_again_while_the_module_stores() {
    let (mut session, line) = careful_session(&[Fault::None, Fault::Lost]);
    session.command(Instruction::new(Opcode::ENTER_DOWNLOAD, 0, 0, 0)).unwrap();
    let stored = Instruction::parse("SAP 4, 0, 1", &TMCM_3351).unwrap();
    assert!(session.command(stored).is_err());
    assert_eq!(line.0.lock().unwrap().executed.iter().filter(|done| **done == stored).count(), 1);
    session.command(Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0)).unwrap();
    line.0.lock().unwrap().script = [Fault::Lost].into();
    assert_eq!(session.command(gap(1)).unwrap(), answer(gap(1)));
}

#[test]
fn a_download_goes_on_where_a_command_failed_on_the_way() {
    let program: Vec<Instruction> = (0..4).map(|value| Instruction::new(Opcode::JA, 0, 0, value)).collect();
    for fault in [Fault::Lost, Fault::Flipped, Fault::RequestFlipped] {
        // Version text, begin of the download, two commands, then the fault.
        let (mut session, line) = careful_session(&[Fault::None, Fault::None, Fault::None, Fault::None, fault]);
        session.download(&program, |_| {}).unwrap();
        let (mut pointer, mut memory) = (0, [Instruction::default(); 6]);
        for done in &line.0.lock().unwrap().executed {
            match done.opcode {
                Opcode::ENTER_DOWNLOAD => pointer = done.value as usize,
                Opcode::JA => {
                    memory[pointer] = *done;
                    pointer += 1;
                }
                _ => {}
            }
        }
        assert_eq!(memory[..4], program, "{fault:?}");
    }
}

#[test]
fn retries_end() {
    let (mut session, line) = careful_session(&[Fault::Flipped; 20]);
    assert!(session.command(gap(1)).is_err());
    assert!(line.0.lock().unwrap().executed.iter().filter(|done| **done == gap(1)).count() <= 3);
}

/// Every answer comes twice, the copy after the next request has gone out: it must never pass for that one's answer.
#[test]
fn a_line_that_doubles_answers_never_gives_a_wrong_one() {
    for late in [0, 1, 2] {
        let (mut session, line) = careful_session(&[]);
        session.line.lock().doubling = true;
        line.0.lock().unwrap().script = [Fault::Doubled(late); 60].into();
        assert_eq!(ask_ten(&mut session), 0, "{late} ms");
    }
}

#[test]
fn the_first_copy_of_an_answer_is_a_warning() {
    let (mut session, line) = session(&[Fault::Doubled(0)]);
    session.command(gap(1)).unwrap();
    session.command(gap(2)).unwrap();
    let probes = line.0.lock().unwrap().probes;
    assert_eq!(ask_ten(&mut session), 0);
    assert_eq!(line.0.lock().unwrap().probes, probes + 10, "a probe between two requests of a kind");
}

#[test]
fn statistics_tell_what_happened() {
    use Fault::*;
    let (mut session, _) = careful_session(&[None, Lost, None, None, Flipped, None, None, RequestFlipped]);
    assert_eq!(ask_ten(&mut session), 0);
    let seen = session.statistics().clone();
    let counts = (seen.requests, seen.answers, seen.retries, seen.silent, seen.damaged, seen.damaged_requests);
    assert_eq!(counts, (10, 10, 3, 1, 1, 1));
    assert_eq!(seen.round_trips.count(), 10);
    assert_eq!(seen.round_trips.longest(), Duration::from_millis(1));
}

#[test]
fn the_echo_of_a_request_is_no_answer() {
    struct Echoing(VecDeque<u8>);
    impl Stream for Echoing {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            let request = Request::parse(bytes.try_into().unwrap()).unwrap().instruction;
            let reply = Reply { host: 2, module: 1, status: Status::OK, command: request.opcode, value: request.value };
            self.0.extend(bytes.iter().chain(&reply.emit()));
            Ok(())
        }

        fn receive(&mut self, buffer: &mut [u8], _: Duration) -> io::Result<usize> {
            io::Read::read(&mut self.0, buffer)
        }

        fn now(&self) -> Duration {
            Duration::ZERO
        }

        fn what_to_check(&self) -> &'static str {
            "the echo"
        }
    }
    let link = Framed::new(Echoing(VecDeque::new()), true);
    let mut session = Session::over(Box::new(link), "echo", Address::serial(1));
    for value in 0..100 {
        assert_eq!(session.command(Instruction::new(Opcode::SAP, 4, 0, value)).unwrap(), value);
    }
    assert_eq!(session.statistics().drained, 0);
}

/// A bus of modules, each of which answers with its address and the parameter asked for, some of them late.
struct Segment {
    now: Duration,
    line: VecDeque<(Duration, Vec<u8>)>,
    requests: usize,
    /// Whether the answer to a request, by its number, is late.
    is_late: fn(usize) -> bool,
    /// When the latest answer of each module arrives.
    latest: [Duration; 4],
}

/// What a module holds in its program memory: commands that look like answers of another module.
fn stored(module: u8, address: i32) -> Instruction {
    Instruction::new(Opcode(module % 3 + 1), Status::OK.0, Opcode::GAP.0, 100_000 + 1000 * i32::from(module) + address)
}

impl Stream for Segment {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Request { address, instruction } = Request::parse(bytes.try_into().unwrap()).unwrap();
        let value = match instruction.opcode {
            Opcode::GAP => i32::from(address) * 1000 + i32::from(instruction.kind),
            _ => instruction.value,
        };
        let reply = Reply { host: 2, module: address, status: Status::OK, command: instruction.opcode, value }.emit();
        let memory = Request { address: 2, instruction: stored(address, instruction.value) }.emit();
        let reply = if instruction.opcode == Opcode::READ_MEMORY { memory } else { reply };
        self.requests += 1;
        let late = if (self.is_late)(self.requests) { 1300 } else { 1 };
        // Each module answers in its order, and does not wait for the others.
        let at = (self.now + Duration::from_millis(late)).max(self.latest[usize::from(address)]);
        self.latest[usize::from(address)] = at;
        let before = self.line.iter().position(|(later, _)| *later > at).unwrap_or(self.line.len());
        self.line.insert(before, (at, reply.to_vec()));
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Duration) -> io::Result<usize> {
        let now = self.now;
        let Some((at, bytes)) = self.line.pop_front_if(|(at, _)| *at <= deadline.max(now)) else {
            self.now = now.max(deadline);
            return Ok(0);
        };
        self.now = now.max(at);
        buffer[..9].copy_from_slice(&bytes);
        Ok(9)
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn what_to_check(&self) -> &'static str {
        "the segment"
    }
}

fn segment(is_late: fn(usize) -> bool) -> Line {
    let (now, latest) = (Duration::ZERO, [Duration::ZERO; 4]);
    let segment = Segment { now, line: VecDeque::new(), requests: 0, is_late, latest };
    Line::over(Box::new(Framed::new(segment, false)), "segment")
}

#[test]
fn late_answer_of_another_module_is_no_command_of_program_memory() {
    let line = segment(|number| number == 2);
    let (mut late, mut other) = (Session::new(&line, Address::serial(1)), Session::new(&line, Address::serial(3)));
    late.set_retries(0);
    assert!(late.command(gap(7)).is_err());
    for address in 0..1000 {
        assert_eq!(other.read_memory(address).unwrap(), stored(3, address.into()));
    }
    assert_eq!(other.statistics().drained, 1, "the late answer came in between");
    assert_eq!(late.command(gap(7)).unwrap(), 1007);
}

#[test]
fn threads_share_a_line_and_each_gets_its_own_answers() {
    // One in eight, in no rhythm that the sessions could fall into.
    let line = segment(|number| (number as u32).wrapping_mul(0x9e37_79b9) >> 29 == 0);
    std::thread::scope(|scope| {
        for thread in 0..6u8 {
            let mut session = Session::new(&line, Address::serial(1 + thread % 3));
            session.set_retries(20);
            scope.spawn(move || {
                for number in 0..200 {
                    let value = session.command(gap(number)).unwrap();
                    assert_eq!(value, i32::from(1 + thread % 3) * 1000 + i32::from(number));
                    let command = session.read_memory(number.into()).unwrap();
                    assert_eq!(command, stored(1 + thread % 3, number.into()));
                }
            });
        }
    });
}

#[test]
fn of_events_that_nobody_takes_the_oldest_go_first() {
    const KEPT: i32 = 1000;
    let (mut session, line) = session(&[]);
    for motors in 0..=KEPT {
        let mut fake = line.0.lock().unwrap();
        let event = fake.reply(Status::POSITION_REACHED, Opcode::POSITION_EVENT, motors);
        fake.arrive(0, event);
    }
    ask_ten(&mut session);
    let taken: Vec<i32> = std::iter::from_fn(|| session.take_event().unwrap()).map(|event| event.motors).collect();
    assert_eq!(taken, (1..=KEPT).collect::<Vec<i32>>());
}
