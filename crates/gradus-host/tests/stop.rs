//! Stops: what passes on a stopped line, whose a download is, and what nobody may get past them.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::rc::Rc;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use gradus_host::scan::scan_on;
use gradus_host::trace::{Direction, Packet, Record};
use gradus_host::{Address, Config, Desk, Error, Heard, LatchRequest, Line, Link, Nature, Rights, Session, Visit};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, Impact, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Reply, Request, Status};
use proptest::prelude::*;

fn instruction(text: &str) -> Instruction {
    Instruction::parse(text, &TMCM_3351).unwrap()
}

fn command(opcode: Opcode, value: i32) -> Instruction {
    Instruction::new(opcode, 0, 0, value)
}

fn bench_line() -> Line {
    Line::on_bench(Bench::with_defaults(&TMCM_3351))
}

fn session(line: &Line) -> Session {
    let mut session = Session::new(line, Address::serial(1));
    session.greet().unwrap();
    session
}

fn desk(line: &Line, read_only: bool) -> Desk {
    let rights = Rights { whole_bus: false, read_only };
    Desk::new(line.clone(), Address::serial(1), Duration::from_millis(200), rights)
}

/// What a client of the desk gets for a request.
fn ask(desk: &mut Desk, client: u64, instruction: Instruction) -> (Status, i32) {
    let datagram = Request { address: 1, instruction }.emit();
    let answer = desk.answer(client, &datagram, &mut Visit::default()).unwrap().unwrap();
    let reply = Reply::parse(&answer).unwrap();
    (reply.status, reply.value)
}

const REFUSED: Status = Status::NOT_AVAILABLE;

#[test]
fn on_a_stopped_line_pass_stops_and_what_reads() {
    let line = bench_line();
    let mut session = session(&line);
    line.stop();
    for text in ["MVP ABS, 0, 1000", "ROR 0, 1", "SAP 4, 0, 1", "SIO 0, 2, 1", "RFS START, 0"] {
        assert!(matches!(session.command(instruction(text)), Err(Error::Stopped { .. })), "{text}");
    }
    for opcode in [Opcode::RUN_APPLICATION, Opcode::ENTER_DOWNLOAD, Opcode::SOFTWARE_RESET, Opcode(200)] {
        assert!(matches!(session.execute(command(opcode, 0)), Err(Error::Stopped { .. })), "{opcode:?}");
    }
    let download = session.command(instruction("GAP 1, 0")).unwrap_err().to_string();
    assert!(download.contains("this download was refused"), "{download}");
    for text in ["DATA 133, 0, 0, 0", "GAP 1, 0", "GGP 66, 0", "GIO 0, 1", "MST 2", "DATA 128, 0, 0, 0"] {
        session.command(instruction(text)).unwrap();
    }
    session.read_memory(0).unwrap();
    line.release();
    session.command(instruction("MVP ABS, 0, 1000")).unwrap();
}

#[test]
fn a_halt_stops_program_and_motors_on_a_stopped_line_too() {
    let line = bench_line();
    let mut session = session(&line);
    let text = ["ROR 0, 20000", "ROR 2, 20000", "JA 2"];
    session.download(&text.map(instruction), |_| {}).unwrap();
    session.run().unwrap();
    session.sleep(Duration::from_secs(2));
    assert_eq!(session.get_axis(Ap::ActualSpeed, 2).unwrap(), 20_000);
    line.stop();
    session.halt().unwrap();
    session.sleep(Duration::from_secs(2));
    assert_eq!([0, 2].map(|axis| session.get_axis(Ap::ActualSpeed, axis).unwrap()), [0, 0]);
    assert_eq!(session.application_status().unwrap().state, gradus_host::State::Stopped);
}

#[test]
fn a_stop_ends_downloads_captures_and_dumps() {
    let line = bench_line();
    let mut session = session(&line);
    let is_stopped = |error: &Error| matches!(error, Error::Stopped { .. });
    let program = vec![instruction("GAP 1, 0"); 20];
    let stop = line.clone();
    let at_five = |count: usize| {
        if count == 5 {
            stop.stop();
        }
    };

    assert!(is_stopped(&session.download(&program, at_five).unwrap_err()));
    assert_eq!(session.execute(instruction("GAP 1, 0")).unwrap().status, Status::OK, "download mode has ended");
    line.release();
    session.download(&program, |_| {}).unwrap();
    assert!(is_stopped(&session.verify(&program, at_five).unwrap_err()));
    line.release();
    assert!(is_stopped(&Config::read(&mut session, at_five).unwrap_err()));
    line.release();
    let url = "sim:tmcm-3351".parse().unwrap();
    let scanned = scan_on(&line, &url, 1..=9, |_| {
        stop.stop();
        true
    });
    assert!(is_stopped(&scanned.unwrap_err()));
    line.release();
    let captured = session.capture(0, &[Ap::ActualPosition], Duration::from_millis(100), |session| {
        session.line().stop();
        Ok(())
    });
    assert!(is_stopped(&captured.unwrap_err()));
}

#[test]
fn a_job_begun_before_a_stop_ends_though_the_stop_is_released_at_once() {
    let line = bench_line();
    let mut session = session(&line);
    let other = line.clone();
    let stop_and_release = |_| {
        other.stop();
        other.release();
    };
    let program = vec![instruction("ROR 0, 1"); 20];
    assert!(matches!(session.download(&program, stop_and_release), Err(Error::Stopped { .. })));
}

#[test]
fn nothing_of_a_download_is_executed_when_another_client_ends_it() {
    let line = bench_line();
    let mut desk = desk(&line, false);
    let (one, other) = (1, 2);
    assert_eq!(ask(&mut desk, one, command(Opcode::ENTER_DOWNLOAD, 0)).0, Status::OK);
    assert_eq!(ask(&mut desk, one, instruction("ROR 0, 50000")).0, Status::LOADED);
    for text in ["DATA 133, 0, 0, 0", "DATA 128, 0, 0, 0", "MST 0"] {
        assert_eq!(ask(&mut desk, other, instruction(text)).0, Status::OK, "{text}");
    }
    for text in ["ROL 1, 50000", "SAP 4, 0, 1", "GAP 4, 0"] {
        assert_eq!(ask(&mut desk, one, instruction(text)).0, REFUSED, "{text}");
    }
    assert_eq!(ask(&mut desk, other, instruction("GAP 2, 1")), (Status::OK, 0), "no speed was set");
    assert_eq!(ask(&mut desk, one, command(Opcode::EXIT_DOWNLOAD, 0)).0, Status::OK);
    assert_eq!(ask(&mut desk, one, instruction("GAP 2, 1")), (Status::OK, 0), "its own end of download lets it go on");
}

#[test]
fn a_stop_of_motors_ends_the_download_of_another_client() {
    let line = bench_line();
    let mut desk = desk(&line, false);
    assert_eq!(ask(&mut desk, 2, instruction("ROR 0, 20000")).0, Status::OK);
    assert_eq!(ask(&mut desk, 1, command(Opcode::ENTER_DOWNLOAD, 0)).0, Status::OK);
    assert_eq!(ask(&mut desk, 1, instruction("MST 0")).0, Status::LOADED, "its own is part of the program");
    assert_eq!(ask(&mut desk, 2, instruction("ROR 0, 100")).0, REFUSED, "it would become part of the program");
    assert_eq!(ask(&mut desk, 3, command(Opcode::ENTER_DOWNLOAD, 0)).0, REFUSED);
    assert_eq!(ask(&mut desk, 2, instruction("MST 0")).0, Status::OK);
    assert_eq!(ask(&mut desk, 1, instruction("ROR 0, 100")).0, REFUSED);
    assert_eq!(ask(&mut desk, 2, instruction("GAP 2, 0")), (Status::OK, 0));
    assert!(!line.is_stopped(), "a client's own MST never latches");
}

#[test]
fn the_download_of_a_client_that_goes_is_ended() {
    let line = bench_line();
    let mut desk = desk(&line, false);
    ask(&mut desk, 1, command(Opcode::ENTER_DOWNLOAD, 0));
    desk.leave(1).unwrap();
    assert_eq!(ask(&mut desk, 2, instruction("GAP 4, 0")), (Status::OK, 51_200));
}

#[test]
fn the_latch_of_a_served_line_is_worked_by_datagrams() {
    let line = bench_line();
    let mut desk = desk(&line, false);
    let mut session = session(&line);
    let latch = |desk: &mut Desk, request| {
        let instruction = LatchRequest::instruction(request);
        ask(desk, 1, instruction).0
    };
    assert_eq!(latch(&mut desk, LatchRequest::Stop), Status::OK);
    assert!(line.is_stopped());
    assert_eq!(ask(&mut desk, 2, instruction("ROR 0, 100")).0, REFUSED);
    assert_eq!(ask(&mut desk, 2, instruction("GAP 4, 0")), (Status::OK, 51_200));
    assert!(matches!(session.command(instruction("ROR 0, 100")), Err(Error::Stopped { .. })));
    assert_eq!(latch(&mut desk, LatchRequest::State), Status::OK);
    assert!(line.is_stopped());
    assert_eq!(latch(&mut desk, LatchRequest::Release), Status::OK);
    assert_eq!(ask(&mut desk, 2, instruction("ROR 0, 100")).0, Status::OK);
}

#[test]
fn readers_may_ask_for_the_latch_and_not_work_it() {
    let line = bench_line();
    let mut desk = desk(&line, true);
    assert_eq!(ask(&mut desk, 1, LatchRequest::Stop.instruction()).0, REFUSED);
    assert_eq!(ask(&mut desk, 1, LatchRequest::State.instruction()).0, Status::OK);
    line.stop();
    assert_eq!(ask(&mut desk, 1, LatchRequest::Release.instruction()).0, REFUSED);
    assert!(line.is_stopped());
}

#[test]
fn a_module_is_no_broker() {
    let line = bench_line();
    let mut session = Session::new(&line, Address::serial(1));
    for request in [LatchRequest::Stop, LatchRequest::State, LatchRequest::Release] {
        assert_eq!(session.ask_latch(request).unwrap(), None);
    }
    session.command(instruction("GAP 4, 0")).unwrap();
}

/// Random choices, which sessions, clients, jobs and the line take from one after the other; zeros at the end.
#[derive(Clone)]
struct Choices(Arc<Mutex<VecDeque<u8>>>);

impl Choices {
    fn next(&self, count: u8) -> u8 {
        self.0.lock().unwrap().pop_front().unwrap_or(0) % count
    }

    fn is_empty(&self) -> bool {
        self.0.lock().unwrap().is_empty()
    }
}

/// What happened, in order.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Event {
    Stop,
    Release,
    Sent(Instruction),
}

type Log = Arc<Mutex<Vec<Event>>>;

/// A module that remembers what it did. Now and then an answer is lost, or the line is stopped or released while it is awaited.
struct Module {
    storing: bool,
    executed: Arc<Mutex<Vec<Instruction>>>,
    stored: Arc<Mutex<Vec<Instruction>>>,
    answers: VecDeque<[u8; 9]>,
    now: Duration,
    choices: Choices,
    hand: Arc<OnceLock<Hand>>,
}

/// Whoever stops the line, and writes it down.
#[derive(Clone)]
struct Hand {
    line: Line,
    log: Log,
}

impl Hand {
    fn work(&self, choice: u8) {
        match choice {
            0 => {
                self.line.stop();
                self.log.lock().unwrap().push(Event::Stop);
            }
            1 => {
                self.log.lock().unwrap().push(Event::Release);
                self.line.release();
            }
            _ => {}
        }
    }
}

impl Module {
    fn answer(&mut self, instruction: Instruction) -> [u8; 9] {
        let status = match instruction.opcode {
            Opcode::FIRMWARE_VERSION => return *b"\x023351V111",
            Opcode::GET_INFO => Status::WRONG_TYPE,
            Opcode(0..128) if self.storing => {
                self.stored.lock().unwrap().push(instruction);
                Status::LOADED
            }
            opcode => {
                self.storing |= opcode == Opcode::ENTER_DOWNLOAD;
                self.storing &= opcode != Opcode::EXIT_DOWNLOAD;
                self.executed.lock().unwrap().push(instruction);
                Status::OK
            }
        };
        Reply { host: 2, module: 1, status, command: instruction.opcode, value: instruction.value }.emit()
    }
}

impl Link for Module {
    fn send(&mut self, _: Address, instruction: Instruction) -> io::Result<()> {
        let answer = self.answer(instruction);
        if self.choices.next(16) != 1 {
            self.answers.push_back(answer);
        }
        Ok(())
    }

    fn receive(&mut self, deadline: Duration) -> io::Result<Heard> {
        if let (1, Some(hand)) = (self.choices.next(8), self.hand.get()) {
            hand.work(self.choices.next(2));
        }
        let answer = self.answers.pop_front();
        self.now = if answer.is_some() { self.now } else { self.now.max(deadline) };
        Ok(answer.map_or(Heard::Nothing, Heard::Datagram))
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn nature(&self) -> Nature {
        Nature { can: false, check: "the fake" }
    }
}

/// Marks what belongs to a download: none of it may be executed, and nothing else stored.
const PROGRAM: i32 = 4711;

fn any_command(choices: &Choices, value: i32) -> Instruction {
    let opcodes = [1, 2, 3, 4, 5, 6, 9, 14, 15, 128, 129, 130, 131, 133, 134, 135, 138, 142, 200];
    command(Opcode(opcodes[usize::from(choices.next(opcodes.len() as u8))]), value)
}

/// The next datagram of a client that downloads, or does not, and does not care what is refused.
fn of_client(choices: &Choices, downloads: &mut bool) -> Instruction {
    match choices.next(6) {
        0 => {
            *downloads = true;
            command(Opcode::ENTER_DOWNLOAD, 0)
        }
        1 => {
            *downloads = false;
            command(Opcode::EXIT_DOWNLOAD, 0)
        }
        2 => [LatchRequest::Stop, LatchRequest::Release][usize::from(choices.next(2))].instruction(),
        _ if *downloads => command(Opcode(1 + choices.next(15)), PROGRAM),
        _ => any_command(choices, 0),
    }
}

/// Sessions, clients of a broker, and jobs on one line.
struct Scene {
    choices: Choices,
    hand: Hand,
    sessions: Vec<Session>,
    desk: Desk,
    /// Which clients are downloading.
    downloads: [bool; 3],
}

impl Scene {
    fn act(this: &Rc<RefCell<Self>>, depth: u8) {
        let choices = this.borrow().choices.clone();
        match choices.next(8) {
            0 => this.borrow().hand.work(choices.next(2)),
            1 | 2 => Self::ask_session(this, depth),
            3 if depth == 0 => Self::download(this),
            _ => this.borrow_mut().ask_client(),
        }
    }

    fn ask_session(this: &Rc<RefCell<Self>>, depth: u8) {
        let mut scene = this.borrow_mut();
        let choices = scene.choices.clone();
        if let Some(session) = scene.sessions.last_mut().filter(|_| depth == 0 || choices.next(2) == 0) {
            match choices.next(6) {
                0 => drop(session.halt()),
                _ => drop(session.execute(any_command(&choices, 0))),
            }
        }
    }

    /// A session downloads, while the others go on.
    fn download(this: &Rc<RefCell<Self>>) {
        let mut session = this.borrow_mut().sessions.remove(0);
        let program = vec![command(Opcode::MVP, PROGRAM); 4];
        let _ = session.download(&program, |_| Self::act(this, 1));
        this.borrow_mut().sessions.insert(0, session);
    }

    fn ask_client(&mut self) {
        let client = self.choices.next(3);
        let instruction = of_client(&self.choices, &mut self.downloads[usize::from(client)]);
        let before = self.hand.line.is_stopped();
        if LatchRequest::Release.instruction() == instruction {
            self.hand.log.lock().unwrap().push(Event::Release);
        }
        let datagram = Request { address: 1, instruction }.emit();
        self.desk.answer(client.into(), &datagram, &mut Visit::default()).unwrap();
        if !before && LatchRequest::Stop.instruction() == instruction {
            self.hand.log.lock().unwrap().push(Event::Stop);
        }
    }
}

/// Plays a scene; what happened, what the module executed, what it stored.
fn play(choices: Vec<u8>) -> (Vec<Event>, Vec<Instruction>, Vec<Instruction>) {
    let choices = Choices(Arc::new(Mutex::new(choices.into())));
    let (log, hand) = (Log::default(), Arc::<OnceLock<Hand>>::default());
    let (executed, stored) = (Arc::<Mutex<Vec<_>>>::default(), Arc::<Mutex<Vec<_>>>::default());
    let module = Module {
        storing: false,
        executed: Arc::clone(&executed),
        stored: Arc::clone(&stored),
        answers: VecDeque::new(),
        now: Duration::ZERO,
        choices: choices.clone(),
        hand: Arc::clone(&hand),
    };
    let line = Line::over(Box::new(module), "fake");
    let witness = Arc::clone(&log);
    line.trace(Box::new(move |record: &Record| {
        if let (Direction::Request, Packet::Serial(bytes)) = (record.direction, &record.packet) {
            let request = Request::parse(bytes.as_slice().try_into().unwrap()).unwrap();
            witness.lock().unwrap().push(Event::Sent(request.instruction));
        }
    }));
    let the_hand = Hand { line: line.clone(), log: Arc::clone(&log) };
    assert!(hand.set(the_hand.clone()).is_ok());
    let sessions = (0..2).map(|_| Session::new(&line, Address::serial(1))).collect();
    let desk = desk(&line, false);
    let scene = Scene { choices: choices.clone(), hand: the_hand, sessions, desk, downloads: [false; 3] };
    let scene = Rc::new(RefCell::new(scene));
    while !choices.is_empty() {
        Scene::act(&scene, 0);
    }
    let log = log.lock().unwrap().clone();
    (log, executed.lock().unwrap().clone(), stored.lock().unwrap().clone())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn nothing_that_acts_goes_out_between_stop_and_release(choices in prop::collection::vec(any::<u8>(), 40..160)) {
        let (log, executed, stored) = play(choices);
        let (mut stopped, mut storing) = (false, false);
        for event in &log {
            match event {
                Event::Stop => stopped = true,
                Event::Release => stopped = false,
                Event::Sent(sent) => {
                    let acts = sent.impact() == Impact::Acts || storing && sent.opcode.0 < 128;
                    prop_assert!(!stopped || !acts, "{sent:?} in {log:?}");
                    storing |= sent.opcode == Opcode::ENTER_DOWNLOAD;
                    storing &= sent.opcode != Opcode::EXIT_DOWNLOAD;
                }
            }
        }
        prop_assert!(executed.iter().all(|done| done.opcode.0 >= 128 || done.value != PROGRAM), "{log:?}");
        let end_mark = Instruction::default();
        prop_assert!(stored.iter().all(|kept| kept.value == PROGRAM || *kept == end_mark), "{log:?}");
    }
}
