//! The programs of `examples/` for the TMCM-3351, run in virtual time, with what they do checked.
//!
//! That those of the other modules assemble is tested in `gradus-asm`.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use gradus_asm::{Options, assemble};
use gradus_sim::{Bench, BenchFile, Eeprom, Link, LinkKind, console};
use gradus_tmcl::catalogue::TMCM_3351;
use gradus_tmcl::{Instruction, Opcode, Reply, Request};

use Row::{Do, Reads, Turns};

/// What is done or found, so many milliseconds after the start of the program.
#[derive(Clone, Copy, Debug)]
enum Row {
    /// The machine is worked with a line of the bench's console.
    Do(f64, &'static str),
    /// A command is answered with a value.
    Reads(f64, &'static str, i32),
    /// The answer changes from the first value to the second one, within [`tolerance_ms`] of the time.
    Turns(f64, &'static str, i32, i32),
}

/// A tick of 0.1 ms at the ends of a ramp, and the 10 us of each instruction that the closed forms leave out.
fn tolerance_ms(time_ms: f64) -> f64 {
    1.0 + 1e-5 * time_ms
}

/// A module with a program.
struct Rig {
    bench: Bench,
    link: Link,
}

impl Rig {
    /// Downloads a program and starts it.
    fn running(program: &[Instruction]) -> Self {
        Self::on(Bench::rigid(&TMCM_3351), program)
    }

    /// Downloads a program into the module of a bench and starts it.
    fn on(mut bench: Bench, program: &[Instruction]) -> Self {
        let link = bench.attach(LinkKind::Usb, 0);
        let mut rig = Self { bench, link };
        rig.send(Instruction::new(Opcode::ENTER_DOWNLOAD, 0, 0, 0));
        for command in program {
            rig.send(*command);
        }
        rig.send(Instruction::new(Opcode::EXIT_DOWNLOAD, 0, 0, 0));
        rig.send(Instruction::new(Opcode::RUN_APPLICATION, 1, 0, 0));
        rig
    }

    fn send(&mut self, instruction: Instruction) -> i32 {
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link).unwrap()).unwrap();
        assert!(reply.status.is_ok(), "{}: {:?}", instruction.display(&TMCM_3351), reply.status);
        reply.value
    }

    fn ask(&mut self, command: &str) -> i32 {
        self.send(Instruction::parse(command, &TMCM_3351).unwrap())
    }

    fn run_until(&mut self, time_ms: f64) {
        let time_us = (time_ms * 1e3).round() as u64;
        assert!(self.bench.now() <= time_us, "rows are in the order of time");
        self.bench.run_until(time_us);
    }

    fn play(&mut self, example: &str, row: Row) {
        match row {
            Do(time_ms, line) => {
                self.run_until(time_ms);
                console::execute(line, &mut self.bench).unwrap();
            }
            Reads(time_ms, command, value) => {
                self.run_until(time_ms);
                assert_eq!(self.ask(command), value, "{example}: {row:?}");
            }
            Turns(time_ms, command, before, after) => {
                for (sign, value) in [(-1.0, before), (1.0, after)] {
                    self.run_until(time_ms + sign * tolerance_ms(time_ms));
                    assert_eq!(self.ask(command), value, "{example}: {row:?}");
                }
            }
        }
    }
}

/// Speed in pps; acceleration and deceleration in pps^2.
#[derive(Clone, Copy)]
struct Ramp {
    speed: f64,
    up: f64,
    down: f64,
}

/// The factory settings.
const FACTORY: Ramp = Ramp { speed: 51_200.0, up: 51_200.0, down: 51_200.0 };

impl Ramp {
    /// Time of a move of so many microsteps from rest to rest: a trapezoid, or a triangle if the way is short.
    fn ms(self, way: f64) -> f64 {
        let Self { speed, up, down } = self;
        let slope = 1.0 / up + 1.0 / down;
        let top = (2.0 * way / slope).sqrt().min(speed);
        1e3 * (way / top + top * slope / 2.0)
    }
}

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");

fn assembled(example: &str) -> Vec<Instruction> {
    let path = format!("{EXAMPLES}/{example}.tmc");
    let text = fs::read(&path).unwrap();
    let assembly = assemble(path, &text, &TMCM_3351, &Options::default(), &|path: &Path| fs::read(path));
    assert!(assembly.problems.is_empty(), "{example}: {:?}", assembly.problems);
    assembly.program
}

/// The names of the programs in `examples/` itself.
fn examples() -> BTreeSet<String> {
    let paths = fs::read_dir(EXAMPLES).unwrap().map(|entry| entry.unwrap().path());
    let programs = paths.filter(|path| path.extension().is_some_and(|extension| extension == "tmc"));
    programs.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
}

/// 1 while the program runs.
const RUNS: &str = "GGP 128, 0";

/// The address behind the STOP where the program has ended; a number above 65535 while it runs.
const STOPPED_BEHIND: &str = "DATA 135, 1, 0, 0";

/// All outputs, bit 0 is OUT0.
const OUTPUTS: &str = "GIO 255, 2";

/// OUT0 changes every 1000 ms by interrupt, OUT3 every 500 ms in the main program.
const TIMERS: &[Row] = &[
    Reads(1.0, OUTPUTS, 0b1000),
    Turns(500.0, OUTPUTS, 0b1000, 0b0000),
    Turns(1000.0, OUTPUTS, 0b0000, 0b1001),
    Turns(1500.0, OUTPUTS, 0b1001, 0b0001),
    Turns(2000.0, OUTPUTS, 0b0001, 0b1000),
    Turns(2500.0, OUTPUTS, 0b1000, 0b0000),
    Turns(3000.0, OUTPUTS, 0b0000, 0b1001),
];

/// Both branches of a comparison end at the same place.
const ENDS_BEHIND_3: &[Row] = &[Reads(1.0, STOPPED_BEHIND, 4)];

#[test]
fn examples_do_what_they_say() {
    let main_loop_ms = Ramp { speed: 50_000.0, up: 10_000.0, ..FACTORY }.ms(5_000.0);
    let symbolic_ms = Ramp { speed: 50_000.0, up: 10_000.0, ..FACTORY }.ms(500_000.0);
    let one_way_ms = FACTORY.ms(10_000.0) + 500.0;
    let routine_ms = FACTORY.ms(1_000.0);
    let side_ms = Ramp { speed: 100_000.0, up: 500_000.0, down: 500_000.0 }.ms(51_200.0);

    // Name; global parameter 131 at the end (status << 16 | address of the last command that failed); rows. A motor has arrived
    // when the program gives it its next target; 2 ms later it is less than a microstep on its way. Positions are rounded down.
    let cases: &[(&str, i32, &[Row])] = &[
        (
            "analogue-position",
            0,
            &[
                Do(0.0, "analog 0 512"),
                Turns(FACTORY.ms(2_048.0), "GAP 8, 0", 0, 1),
                Reads(450.0, "GAP 1, 0", 2_048),
                Do(500.0, "analog 0 1023"),
                Reads(501.0, "GAP 0, 0", 4_092),
                Turns(500.0 + FACTORY.ms(2_044.0), "GAP 8, 0", 0, 1),
                Do(1000.0, "analog 0 0"),
                Turns(1000.0 + FACTORY.ms(4_092.0), "GAP 8, 0", 0, 1),
                Reads(2000.0, "GAP 1, 0", 0),
            ],
        ),
        // Axes 5, 4 and 3 are refused; MVPXA at address 7 is the last to be. Axis 2 goes at 400 pps, axis 1 at 800 pps.
        (
            "axis-in-x-register",
            4 << 16 | 7,
            &[
                Reads(2_900.0, "GAP 4, 2", 51_200),
                Reads(3_100.0, "GAP 4, 2", 400),
                Reads(4_100.0, "GAP 4, 1", 800),
                Reads(5_100.0, STOPPED_BEHIND, 12),
                Reads(5_100.0, "GGP 1, 2", 1_600),
                Turns(4_000.0 + Ramp { speed: 800.0, ..FACTORY }.ms(51_200.0), "GAP 8, 1", 0, 1),
                Turns(3_000.0 + Ramp { speed: 400.0, ..FACTORY }.ms(51_200.0), "GAP 8, 2", 0, 1),
                Reads(140_000.0, "GAP 1, 1", 51_200),
                Reads(140_000.0, "GAP 1, 2", 51_200),
                Reads(140_000.0, "GAP 4, 0", 51_200),
                Reads(140_000.0, "GAP 1, 0", 0),
            ],
        ),
        (
            "back-and-forth",
            0,
            &[
                Turns(2_000.0, "GAP 0, 0", 51_200, 0),
                Reads(2_002.0, "GAP 1, 0", 51_199),
                Turns(4_000.0, "GAP 0, 0", 0, 51_200),
                Reads(4_002.0, "GAP 1, 0", 0),
                Turns(6_000.0, "GAP 0, 0", 51_200, 0),
            ],
        ),
        (
            "closed-loop",
            0,
            &[
                Reads(100.0, "GAP 6, 0", 85),
                Reads(100.0, "GAP 7, 0", 10),
                Reads(100.0, "GAP 109, 0", 1_600_000),
                Reads(100.0, "GAP 114, 0", 255),
                Reads(100.0, "GAP 117, 0", 2_000),
                Reads(100.0, "GAP 119, 0", 100_000),
                Reads(100.0, "GAP 129, 0", 1),
                Reads(100.0, "GAP 210, 0", 10_000),
                Reads(100.0, "GAP 213, 0", 30_000),
                Reads(100.0, "GAP 133, 0", 0),
                Reads(100.0, RUNS, 1),
                Reads(100.0, "GAP 4, 0", 51_200),
                Reads(2_100.0, "GAP 133, 0", 1),
                Reads(2_100.0, RUNS, 0),
                Reads(2_100.0, "GAP 4, 0", 600_000),
            ],
        ),
        ("compare", 0, ENDS_BEHIND_3),
        ("conditional-jump", 0, &[Reads(1.0, STOPPED_BEHIND, 5), Reads(1.0, "GAP 2, 0", -1_000)]),
        (
            "copy-inputs",
            0,
            &[
                Reads(1.0, OUTPUTS, 0),
                Do(1.0, "in 0 1"),
                Do(1.0, "in 3 1"),
                Do(1.0, "in 7 1"),
                Reads(1.1, OUTPUTS, 0b1000_1001),
                Do(2.0, "in 3 0"),
                Reads(2.1, OUTPUTS, 0b1000_0001),
            ],
        ),
        (
            "interrupt-vector",
            0,
            &[
                Reads(100.0, OUTPUTS, 0),
                Reads(100.0, "SGP 0, 3, 50", 50),
                Reads(100.0, "EI 0", 0),
                Reads(100.0, "EI 255", 0),
                Turns(150.0, OUTPUTS, 0, 1),
                Reads(160.0, RUNS, 1),
            ],
        ),
        // It begins with the stick in the middle. As printed it only turns right: RunLeft and MotorStop leave flags of their own
        // behind, which CALL GT obeys.
        (
            "joystick",
            0,
            &[
                Do(0.0, "analog 0 512"),
                Reads(1.0, "DATA 131, 0, 0, 0", 0),
                Reads(1.0, "MST 0", 0),
                Reads(100.0, "DATA 129, 1, 0, 0", 0),
                Reads(200.0, "GAP 3, 0", 0),
                Do(200.0, "analog 0 800"),
                Reads(300.0, "GAP 3, 0", 288),
                Do(300.0, "analog 0 1023"),
                Reads(400.0, "GAP 3, 0", 511),
                Do(400.0, "analog 0 513"),
                Reads(500.0, "GAP 3, 0", 1),
            ],
        ),
        (
            "main-loop",
            0,
            &[
                Turns(main_loop_ms, "GAP 0, 0", 5_000, 0),
                Turns(2.0 * main_loop_ms, "GAP 0, 0", 0, 5_000),
                Turns(3.0 * main_loop_ms, "GAP 0, 0", 5_000, 0),
            ],
        ),
        // A hundred times 2 s of motion and 5 s of rest.
        (
            "repeat",
            0,
            &[
                Turns(2_000.0, "GAP 8, 0", 0, 1),
                Turns(7_000.0, "GGP 42, 2", 100, 99),
                Turns(350_000.0, "GAP 0, 0", 50 * 51_200, 51 * 51_200),
                Turns(700_000.0, "GGP 42, 2", 1, 0),
                Reads(700_010.0, STOPPED_BEHIND, 6),
                Reads(700_010.0, "GAP 1, 0", 100 * 51_200),
            ],
        ),
        (
            "restart",
            0,
            &[Turns(2_000.0, "GAP 8, 0", 0, 1), Reads(3_000.0, "GAP 1, 0", 51_200), Reads(3_000.0, RUNS, 1)],
        ),
        // The start is that of the first routine. The second one turns 500 pps * 1 s to the left, the third one 1000 pps * 7 s
        // to the right.
        (
            "routines",
            0,
            &[
                Turns(routine_ms, "GAP 0, 0", 1_000, 0),
                Turns(2.0 * routine_ms, "GAP 8, 0", 0, 1),
                Reads(1_000.0, STOPPED_BEHIND, 8),
                Reads(1_000.0, "DATA 129, 1, 0, 1", 1),
                Reads(1_900.0, "GAP 3, 0", -500),
                Reads(3_000.0, STOPPED_BEHIND, 12),
                Reads(3_000.0, "GAP 1, 0", -501),
                Reads(3_000.0, "DATA 129, 1, 0, 2", 2),
                Reads(9_900.0, "GAP 3, 0", 1_000),
                Reads(11_000.0, STOPPED_BEHIND, 16),
                Reads(11_000.0, "GAP 1, 0", 6_499),
                Reads(11_000.0, "DATA 129, 1, 0, 0", 0),
                Reads(11_100.0, "GAP 0, 0", 1_000),
            ],
        ),
        (
            "square",
            0,
            &[
                Turns(side_ms, "GAP 0, 1", 0, 51_200),
                Turns(2.0 * side_ms, "GAP 0, 0", 51_200, 0),
                Turns(4.0 * side_ms, "GAP 0, 0", 0, 51_200),
            ],
        ),
        (
            "subroutine",
            0,
            &[
                Turns(one_way_ms, "GAP 0, 0", 10_000, 0),
                Turns(2.0 * one_way_ms, "GAP 0, 0", 0, 10_000),
                Turns(20.0 * one_way_ms, "GAP 0, 0", 0, 10_000),
            ],
        ),
        (
            "symbolic-constants",
            0,
            &[
                Turns(symbolic_ms, "GAP 0, 0", 500_000, 0),
                Reads(symbolic_ms + 2.0, "GAP 1, 0", 499_999),
                Turns(2.0 * symbolic_ms, "GAP 0, 0", 0, 500_000),
            ],
        ),
        ("timer-interrupt", 0, TIMERS),
        ("timer-interrupt-by-name", 0, TIMERS),
        // At 5 s the motor turns back, with 2 s from one speed to the other; at 10 s it is at -76800 and turns right at full
        // speed. That leaves 563200 microsteps and the 1 s of slowing down, then 1024000 each way.
        (
            "two-positions",
            0,
            &[
                Reads(1_001.0, "GAP 3, 0", -51_200),
                Turns(5_000.0, "GAP 2, 0", -51_200, 51_200),
                Turns(22_000.0, "GAP 0, 0", 512_000, -512_000),
                Reads(22_002.0, "GAP 1, 0", 511_999),
                Turns(43_000.0, "GAP 0, 0", -512_000, 512_000),
                Reads(43_002.0, "GAP 1, 0", -512_000),
                Turns(43_000.0 + FACTORY.ms(1_024_000.0), "GAP 0, 0", 512_000, -512_000),
            ],
        ),
        ("variables", 0, &[Reads(1.0, STOPPED_BEHIND, 5), Reads(1.0, "GGP 42, 2", 2_468)]),
    ];

    assert_eq!(cases.iter().map(|(example, ..)| (*example).to_owned()).collect::<BTreeSet<_>>(), examples());
    for (example, failure, rows) in cases {
        let mut rig = Rig::running(&assembled(example));
        rows.iter().for_each(|row| rig.play(example, *row));
        assert_eq!(rig.ask("GGP 131, 0"), *failure, "{example}: the last failure");
        let positions = ["GAP 1, 0", "GAP 1, 1", "GAP 1, 2"].map(|command| i64::from(rig.ask(command)));
        assert_eq!(
            [0, 1, 2].map(|axis| rig.bench.machine().axes[axis].plant.position()),
            positions,
            "{example}: shafts"
        );
    }
}

/// An example of `benches/` running on its machine.
fn rig_on(machine: &str, example: &str) -> Rig {
    let file = BenchFile::read(Path::new(&format!("{EXAMPLES}/benches/{machine}.toml"))).unwrap();
    Rig::on(file.build(Eeprom::of(&TMCM_3351)), &assembled(&format!("benches/{example}")))
}

/// Place of the carriage on axis 0 in the unit of a bench that moves so far in a turn.
fn place(rig: &mut Rig, travel_per_turn: f64) -> f64 {
    let plant = &rig.bench.machine().axes[0].plant;
    plant.position() as f64 / f64::from(plant.microsteps_per_turn()) * travel_per_turn
}

/// The edges of the switch are found at 2 mm/s, 0.0002 mm a tick, by a rotor that friction keeps up to 0.005 mm behind.
#[test]
fn stage_finds_the_middle_of_its_home_switch() {
    let mut rig = rig_on("linear-stage", "home");
    rig.run_until(8_000.0);
    assert_eq!(rig.ask(STOPPED_BEHIND), 11);
    assert!((place(&mut rig, 5.0) - 50.0).abs() < 0.005, "at {} mm, not 50", place(&mut rig, 5.0));
}

/// Three quarter turns from the home switch; its edges are found at 2 degrees/s, 0.0002 degrees a tick, by a rotor that friction keeps behind.
#[test]
fn table_turns_until_the_lid_opens() {
    let mut rig = rig_on("rotary-table", "index");
    for (time_ms, closed) in [(7_999.0, 1), (8_001.0, 0)] {
        rig.run_until(time_ms);
        assert_eq!((rig.ask("GIO 0, 0"), rig.ask(RUNS)), (closed, 1), "{time_ms} ms");
    }
    rig.run_until(9_500.0);
    assert_eq!(rig.ask(RUNS), 0);
    assert!((place(&mut rig, 4.0) - 270.0).abs() < 0.005, "at {} degrees, not 270", place(&mut rig, 4.0));
}

/// The part on the carriage presses with 0.6 Nm; the run current of step 25 gives 2 Nm, its half just enough.
#[test]
fn belt_has_more_current_while_it_is_loaded() {
    let mut rig = rig_on("belt-axis", "belt");
    let currents = [(1_000.0, 12..=12), (1_500.0, 18..=25), (3_000.0, 18..=25), (4_500.0, 12..=12)];
    for (time_ms, expected) in currents {
        rig.run_until(time_ms);
        let current = rig.ask("GAP 180, 0");
        assert!(expected.contains(&current), "step {current} at {time_ms} ms, not {expected:?}");
    }
    rig.run_until(14_000.0);
    assert_eq!(rig.ask(RUNS), 0);
    assert!((place(&mut rig, 40.0) - 100.0).abs() < 0.2, "at {} mm, not 100", place(&mut rig, 40.0));
}

#[test]
fn gantry_finds_its_zero_points_and_goes_to_the_middle_of_the_square() {
    let mut rig = rig_on("gantry", "gantry");
    rig.run_until(60_000.0);
    assert_eq!((rig.ask(RUNS), rig.ask("GGP 131, 0")), (0, 0));
    let places = [(0, 40.0, 200.0), (1, 40.0, 200.0), (2, 5.0, 20.0)];
    for (axis, travel_per_turn, expected) in places {
        let plant = &rig.bench.machine().axes[axis].plant;
        let place = plant.position() as f64 / f64::from(plant.microsteps_per_turn()) * travel_per_turn;
        assert!(
            (place - expected).abs() < 0.001 * travel_per_turn + 0.005,
            "axis {axis} at {place} mm, not {expected}"
        );
    }
}

/// Up to two full steps pass until the stall is seen, and the rotor snaps back by two at most: 0.1 mm.
#[test]
fn screw_finds_its_end_stop_by_its_load() {
    let mut rig = rig_on("stall-home", "stall-home");
    rig.run_until(30_000.0);
    assert_eq!((rig.ask(RUNS), rig.ask("GGP 131, 0"), rig.ask("GAP 1, 0")), (0, 0, 20_480));
    assert!((place(&mut rig, 5.0) - 2.0).abs() < 0.1, "at {} mm, not 2", place(&mut rig, 5.0));
    let stalled = rig.ask("GAP 207, 0");
    assert_eq!(stalled, 0, "the move off the stop clears the flag");
}
