//! Many requests of mixed kinds over bad lines: every value that is handed out is the right one, nothing that may not be is executed
//! twice, nothing hangs.
//!
//! Each request asks for something whose answer identifies it. `SOAK=1000000 cargo test -p gradus-host --test soak -- --nocapture`
//! sends a million over each kind of line and prints what became of them; without SOAK it is 20 000.
#![cfg(unix)]

mod support;

use std::time::{Duration, Instant};

use gradus_host::{Error, Session, Statistics, Url};
use gradus_sim::{BusKind, Can};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Operation};

use support::Served;

/// Requests over each kind of line unless SOAK says otherwise; half of them with each of two profiles.
const REQUESTS: u64 = 20_000;
/// Parameters of whose values none is equal to another.
const PARAMETERS: [Ap; 4] = [Ap::MaxSpeed, Ap::MaxAcceleration, Ap::MaxDeceleration, Ap::StartVelocity];
const VARIABLES: usize = 20;
/// Program memory that holds its own addresses.
const MEMORY: u16 = 50;
/// No request may take longer, with all its repeating, on a computer that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(30);
const ACCUMULATOR: u8 = 2;

fn requests() -> u64 {
    std::env::var("SOAK").ok().and_then(|count| count.parse().ok()).unwrap_or(REQUESTS)
}

/// A number that the module holds; `None` while a failed write leaves it unknown.
type Known = Option<i32>;

/// A session that knows what its module must answer.
struct Soak {
    session: Session,
    variables: [Known; VARIABLES],
    accumulator: Known,
    target: Known,
    failed: u64,
    dice: u64,
    counter: i32,
}

fn value_of(parameter: usize, axis: u8) -> i32 {
    1000 * (parameter as i32 + 1) + i32::from(axis)
}

fn calculate(operation: Operation, value: i32) -> Instruction {
    Instruction::new(Opcode::CALC, operation.0, 0, value)
}

impl Soak {
    fn new(url: &Url) -> Self {
        let mut session = until_it_works(|| Session::open(url));
        for axis in 0..3 {
            for (index, parameter) in PARAMETERS.into_iter().enumerate() {
                until_it_works(|| session.set_axis(parameter, axis, value_of(index, axis)));
            }
        }
        let program: Vec<Instruction> =
            (0..MEMORY).map(|address| Instruction::new(Opcode::JA, 0, 0, i32::from(address))).collect();
        until_it_works(|| session.download(&program, |_| {}));
        until_it_works(|| session.command(calculate(Operation::LOAD, 0)));
        until_it_works(|| session.command(Instruction::parse("MVP ABS, 0, 0", &TMCM_3351).unwrap()));
        session.reset_statistics();
        let variables = [None; VARIABLES];
        Self { session, variables, accumulator: Some(0), target: Some(0), failed: 0, dice: 1, counter: 0 }
    }

    fn roll(&mut self, sides: usize) -> usize {
        self.dice = self.dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.dice >> 33) as usize % sides
    }

    fn run(&mut self, count: u64) {
        for _ in 0..count {
            let start = Instant::now();
            match self.roll(16) {
                0..4 => self.read_parameter(),
                4..7 => self.write_variable(),
                7..11 => self.read_variable(),
                11 => self.add(),
                12 => self.read_accumulator(),
                13 => self.read_memory(),
                14 => self.move_by(),
                _ => self.read_target(),
            }
            assert!(start.elapsed() < PATIENCE, "a request hung");
        }
    }

    /// The answer, or `None` for a failure on the way, which is counted. A refusal is never right.
    fn ask(&mut self, instruction: Instruction) -> Known {
        match self.session.command(instruction) {
            Ok(value) => Some(value),
            Err(error @ (Error::Refused { .. } | Error::Broken { .. })) => panic!("{error}"),
            Err(_) => {
                self.failed += 1;
                None
            }
        }
    }

    fn read_parameter(&mut self) {
        let (index, axis) = (self.roll(PARAMETERS.len()), self.roll(3) as u8);
        let row = TMCM_3351.axis_parameters.iter().find(|row| row.id == PARAMETERS[index]).unwrap();
        if let Some(value) = self.ask(Instruction::new(Opcode::GAP, row.number, axis, 0)) {
            assert_eq!(value, value_of(index, axis));
        }
    }

    fn write_variable(&mut self) {
        let index = self.roll(VARIABLES);
        self.counter += 1;
        let value = self.counter * VARIABLES as i32 + index as i32;
        let written = self.ask(Instruction::new(Opcode::SGP, index as u8, 2, value));
        self.variables[index] = written.map(|_| value);
    }

    /// A value tells of which variable it is and which write it was.
    fn read_variable(&mut self) {
        let index = self.roll(VARIABLES);
        let Some(value) = self.ask(Instruction::new(Opcode::GGP, index as u8, 2, 0)) else { return };
        match self.variables[index] {
            Some(known) => assert_eq!(value, known),
            None => assert!(value == 0 || value as usize % VARIABLES == index, "{value} is not of variable {index}"),
        }
        self.variables[index] = Some(value);
    }

    fn add(&mut self) {
        let Some(before) = self.accumulator else { return self.read_accumulator() };
        self.accumulator = self.ask(calculate(Operation::ADD, 1)).map(|_| before + 1);
        if self.accumulator.is_none() {
            self.read_accumulator();
            let after = self.accumulator.unwrap_or(before);
            assert!((before..=before + 1).contains(&after), "added {} times", after - before);
        }
    }

    fn read_accumulator(&mut self) {
        let Some(value) = self.ask(Instruction::new(Opcode::APPLICATION_STATUS, ACCUMULATOR, 0, 0)) else { return };
        assert!(self.accumulator.is_none_or(|known| known == value), "{value} instead of {:?}", self.accumulator);
        self.accumulator = Some(value);
    }

    fn read_memory(&mut self) {
        let address = self.roll(MEMORY.into()) as u16;
        match self.session.read_memory(address) {
            Ok(command) => assert_eq!(command, Instruction::new(Opcode::JA, 0, 0, address.into())),
            Err(_) => self.failed += 1,
        }
    }

    fn move_by(&mut self) {
        const STEP: i32 = 3;
        let Some(before) = self.target else { return self.read_target() };
        let moved = self.ask(Instruction::parse("MVP REL, 0, 3", &TMCM_3351).unwrap());
        self.target = moved.map(|_| before + STEP);
        assert!(moved.is_none_or(|target| target == before + STEP), "{moved:?} instead of {}", before + STEP);
        if moved.is_none() {
            self.read_target();
            let after = self.target.unwrap_or(before);
            assert!([before, before + STEP].contains(&after), "moved from {before} to {after}");
        }
    }

    fn read_target(&mut self) {
        let Some(value) = self.ask(Instruction::parse("GAP 0, 0", &TMCM_3351).unwrap()) else { return };
        assert!(self.target.is_none_or(|known| known == value), "{value} instead of {:?}", self.target);
        self.target = Some(value);
    }
}

/// Preparations are made until they succeed.
fn until_it_works<T>(mut work: impl FnMut() -> Result<T, Error>) -> T {
    let mut results = (0..100).map(|_| work());
    results.find(|result| !matches!(result, Err(error) if error.is_passing())).unwrap().unwrap()
}

fn soak(name: &str, served: impl Fn(&str) -> Served) {
    for profile in ["noisy-line", "late-replies"] {
        let served = served(profile);
        let mut soak = Soak::new(&served.url("?timeout=150"));
        let (start, count) = (Instant::now(), requests() / 2);
        soak.run(count);
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{name}, {profile}: {count} in {seconds:.0} s, {} failed and said so\n{}",
            soak.failed,
            soak.session.statistics()
        );
        let Statistics { retries, damaged, damaged_requests, drained, .. } = soak.session.statistics();
        assert!(retries + damaged + damaged_requests + drained > 0, "the line was no bad one");
        assert!(soak.failed <= count / 500, "{} of {count} failed", soak.failed);
    }
}

#[test]
fn soak_of_a_terminal() {
    soak("pty", |profile| Served::terminal(profile, 1));
}

#[test]
fn soak_of_a_tcp_port() {
    soak("tcp", |profile| Served::segment(&[1], profile));
}

#[test]
fn soak_of_a_can_adapter() {
    soak("slcan", |profile| Served::new(BusKind::Can(Can { bit_rate: 1_000_000, timing: false }), &[1], profile));
}
