//! A bench with a host that speaks in lines of TMCL.

use gradus_sim::{Bench, Eeprom, Link, LinkKind, Machine, console};
use gradus_tmcl::catalogue::TMCM_351;
use gradus_tmcl::{Instruction, Opcode, Reply, Request};

pub const SECOND_US: u64 = 1_000_000;

pub struct Host {
    pub bench: Bench,
    pub link: Link,
}

impl Host {
    /// On a machine that loses no step.
    pub fn new() -> Self {
        Self::on(Machine::rigid(&TMCM_351))
    }

    pub fn on(machine: Machine) -> Self {
        Self::with(Bench::new(&TMCM_351, machine, Eeprom::of(&TMCM_351)))
    }

    pub fn with(mut bench: Bench) -> Self {
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    /// Status and value of the reply.
    pub fn send(&mut self, instruction: Instruction) -> (u8, i32) {
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link).expect("no reply")).unwrap();
        (reply.status.0, reply.value)
    }

    /// The same for a line, `DATA` with four numbers for what has no name.
    pub fn exchange(&mut self, line: &str) -> (u8, i32) {
        self.send(Instruction::parse(line, &TMCM_351).unwrap_or_else(|error| panic!("{line}: {error}")))
    }

    pub fn ask(&mut self, line: &str) -> i32 {
        let (status, value) = self.exchange(line);
        assert_eq!(status, 100, "{line}");
        value
    }

    /// Lines between semicolons.
    pub fn all(&mut self, lines: &str) {
        for line in lines.split(';').map(str::trim).filter(|line| !line.is_empty()) {
            self.ask(line);
        }
    }

    pub fn get(&mut self, number: u8, axis: u8) -> i32 {
        let (status, value) = self.send(Instruction::new(Opcode::GAP, number, axis, 0));
        assert_eq!(status, 100, "GAP {number}, {axis}");
        value
    }

    /// A line of the bench's console.
    pub fn console(&mut self, line: &str) {
        console::execute(line, &mut self.bench).unwrap();
    }

    pub fn run_ms(&mut self, ms: u64) {
        self.bench.run_for(1000 * ms);
    }

    /// Runs until the condition holds.
    pub fn until(&mut self, limit_ms: u64, mut holds: impl FnMut(&mut Self) -> bool) {
        let end = self.bench.now() + 1000 * limit_ms;
        while !holds(self) {
            assert!(self.bench.now() < end, "it takes too long");
            self.run_ms(1);
        }
    }

    pub fn arrive(&mut self, axis: u8) {
        self.until(60_000, |host| host.get(8, axis) == 1 && host.get(3, axis) == 0);
    }

    /// Stores a program and starts it.
    pub fn start(&mut self, program: &[&str]) {
        assert_eq!(self.exchange("DATA 132, 0, 0, 0").0, 100);
        for line in program {
            assert_eq!(self.exchange(line).0, 101, "{line}");
        }
        self.all("DATA 133, 0, 0, 0; DATA 129, 1, 0, 0");
    }

    pub fn shaft(&mut self, axis: usize) -> i64 {
        self.bench.machine().axes[axis].plant.position()
    }

    pub fn power_cycle(&mut self) {
        self.bench.power_off();
        self.bench.power_on();
        self.link = self.bench.attach(LinkKind::Usb, 0);
    }
}
