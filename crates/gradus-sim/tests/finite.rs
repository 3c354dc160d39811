//! Nothing in a machine becomes NaN or absurd, whatever is done with it: random commands, lines of the console, and time.
//!
//! In a debug build the plant asserts the same after every step.

use gradus_sim::{Bench, Link, LinkKind, console};
use gradus_tmcl::catalogue::{Module, TMCM_351, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Request};

/// Numbers that are the same each time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % limit
    }

    fn real(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.below(1 << 20) as f64 / f64::from((1 << 20) - 1)
    }

    fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u64) as usize]
    }

    /// Small, large and extreme numbers.
    fn value(&mut self) -> i32 {
        match self.below(4) {
            0 => self.below(3) as i32,
            1 => self.below(256) as i32,
            2 => self.below(4_000_000) as i32 - 2_000_000,
            _ => self.pick(&[i32::MIN, i32::MAX, -1, 16_777_215, 2_000_000]),
        }
    }

    fn line(&mut self) -> String {
        let axis = self.below(3);
        match self.below(12) {
            0 => format!("load {axis} {}", self.real(-1_000.0, 1_000.0)),
            1 => format!("load {axis} {}", self.real(-2.0, 2.0)),
            2 => format!("friction {axis} {}", self.pick(&[0.0, 0.01, 1.0, 1_000.0])),
            3 => format!("push {axis} {}", self.real(-36_000.0, 36_000.0)),
            4 => format!("block {axis}"),
            5 => format!("unblock {axis}"),
            6 => format!("supply {}", self.pick(&[0.0, 5.0, 9.0, 12.0, 24.0, 48.0, 60.0])),
            7 => format!("coil {axis} {} {}", self.pick(&["a", "b"]), self.pick(&["ok", "open", "short"])),
            8 => format!("temperature {axis} {}", self.pick(&["-55", "25", "130", "200", "auto"])),
            9 => format!("temperature board {}", self.real(-55.0, 200.0)),
            10 => format!("enable {}", self.below(2)),
            _ => self.pick(&["power off", "power on", "reset", "hang 0", "power on", "enable 1"]).to_owned(),
        }
    }

    fn instruction(&mut self, module: &Module) -> Instruction {
        let motor = self.below(3) as u8;
        let value = self.value();
        match self.below(8) {
            0 => Instruction::new(Opcode::ROR, 0, motor, value),
            1 => Instruction::new(Opcode::ROL, 0, motor, value),
            2 => Instruction::new(Opcode::MST, 0, motor, 0),
            3 => Instruction::new(Opcode::MVP, self.below(2) as u8, motor, value),
            4 => Instruction::new(Opcode::RFS, self.below(2) as u8, motor, 0),
            _ => {
                let row = &module.axis_parameters[self.below(module.axis_parameters.len() as u64) as usize];
                Instruction::new(Opcode::SAP, row.number, motor, value)
            }
        }
    }
}

/// What instruments show must be a number, and one that a machine can have.
fn check(bench: &Bench, done: &[String]) {
    for axis in 0..3 {
        let readings = bench.readings(axis).unwrap();
        let context = || format!("axis {axis}: {readings:?} after {done:#?}");
        assert!(readings.are_sane(), "{}", context());
        assert!(readings.speed_rps.abs() <= 400.0 + 1e-9, "{}", context());
        // A coil at 60 V carries 72 A; a gust of back-EMF adds to it.
        assert!(readings.current_a < 150.0 && readings.torque_nm.abs() < 100.0, "{}", context());
        assert!((-55.0..=300.0).contains(&readings.winding_c), "{}", context());
        assert!((-55.0..=200.0).contains(&readings.driver_c), "{}", context());
    }
}

fn play(module: &'static Module, seed: u64) {
    let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut bench = Bench::with_defaults(module);
    let mut link: Link = bench.attach(LinkKind::Usb, 0);
    let mut done = Vec::new();
    for _ in 0..60 {
        match dice.below(3) {
            0 => {
                let line = dice.line();
                console::execute(&line, &mut bench).unwrap();
                done.push(line);
            }
            1 => {
                let instruction = dice.instruction(module);
                bench.send(&mut link, &Request { address: 1, instruction }.emit());
                _ = bench.take(&mut link);
                done.push(instruction.display(module).to_string());
            }
            _ => {
                let us = dice.pick(&[100, 1_000, 20_000, 100_000]);
                bench.run_for(us);
                done.push(format!("{us} us"));
            }
        }
        check(&bench, &done);
    }
}

#[test]
fn every_reading_is_a_number_whatever_is_done() {
    for seed in 1..=120 {
        play(&TMCM_3351, seed);
        play(&TMCM_351, seed);
    }
}
