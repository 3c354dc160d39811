//! A TMCM-1617 with its firmware on its machine: a host's commands, and what the shaft makes of them.

use gradus_plant::{Encoder, HallSensors, Mechanics, ServoMachine, ServoMotor, ServoSetup, Supply};
use gradus_sim::{Bench, BenchFile, Eeprom, Link, LinkKind, Machine, ServoDrive, console};
use gradus_tmcl::catalogue::{Ap, TMCM_1617};
use gradus_tmcl::{Instruction, Reply, Request};
use proptest::prelude::*;

/// Settings that the maker's example has for a QBL4208-61, but a stiffer position regulator.
const TUNED: &str = "SAP 70, 0, 600; SAP 71, 0, 600; SAP 72, 0, 800; SAP 73, 0, 500; SAP 74, 0, 2000";

struct Host {
    bench: Bench,
    link: Link,
}

impl Host {
    fn new(setup: ServoSetup) -> Self {
        let machine = Machine { servos: vec![ServoDrive::new(setup)], ..Machine::of(&TMCM_1617) };
        let mut bench = Bench::new(&TMCM_1617, machine, Eeprom::of(&TMCM_1617));
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    /// On the default machine, with these commands executed.
    fn set_up(commands: &str) -> Self {
        let mut host = Self::new(ServoSetup::default());
        host.all(commands);
        host
    }

    fn exchange(&mut self, command: &str) -> (u8, i32) {
        let instruction = Instruction::parse(command, &TMCM_1617).unwrap_or_else(|error| panic!("{command}: {error}"));
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link).unwrap()).unwrap();
        (reply.status.0, reply.value)
    }

    fn all(&mut self, commands: &str) {
        for command in commands.split(';').map(str::trim).filter(|command| !command.is_empty()) {
            assert_eq!(self.exchange(command).0, 100, "{command}");
        }
    }

    fn get(&mut self, id: Ap) -> i32 {
        self.bench.axis_parameter(0, id).unwrap()
    }

    fn flags(&mut self) -> u32 {
        self.get(Ap::StatusFlags) as u32
    }

    fn run_ms(&mut self, ms: u64) {
        self.bench.run_for(ms * 1000);
    }

    fn say(&mut self, line: &str) {
        console::execute(line, &mut self.bench).unwrap_or_else(|error| panic!("{line}: {error}"));
    }

    fn plant(&mut self) -> &mut ServoMachine {
        &mut self.bench.machine().servos[0].plant
    }

    fn rpm(&mut self) -> f64 {
        self.plant().velocity_rpm()
    }
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, not {expected}");
}

/// Commutation by hall sensors, by the encoder after an alignment, and by the encoder after a hall edge.
///
/// Hall sensors tell a velocity only at their edges, so that they bear a softer regulator.
const SENSORS: [&str; 3] =
    ["SAP 72, 0, 300; SAP 73, 0, 100; SAP 15, 0, 2; SAP 92, 0, 1", "SAP 15, 0, 3", "SAP 102, 0, 2; SAP 15, 0, 3"];

#[test]
fn rotate_and_stop_on_every_sensor() {
    for sensor in SENSORS {
        let mut host = Host::set_up(&format!("{TUNED}; SAP 11, 0, 6000; SAP 44, 0, 20000; {sensor}; ROR 0, 2000"));
        host.run_ms(2000);
        let rpm = host.rpm();
        near(rpm, 2000.0, 20.0, sensor);
        near(host.get(Ap::ActualSpeed).into(), rpm, 40.0, sensor);
        host.all("ROL 0, 1000");
        host.run_ms(1000);
        near(host.rpm(), -1000.0, 20.0, sensor);
        host.all("MST 0");
        host.run_ms(1000);
        near(host.rpm(), 0.0, 5.0, sensor);
        assert_eq!(host.flags() & 0xef, 0, "no faults: {sensor}");
    }
}

#[test]
fn open_loop_drags_the_rotor() {
    let mut host = Host::set_up("SAP 15, 0, 1; SAP 12, 0, 2000; SAP 44, 0, 500; ROR 0, 120");
    host.run_ms(2000);
    near(host.rpm(), 120.0, 12.0, "turns with the field");
    assert_eq!(host.get(Ap::RampSpeed), 120);
}

#[test]
fn ten_turns_end_in_the_window_and_stay() {
    let mut host = Host::set_up(&format!("{TUNED}; SAP 11, 0, 6000; SAP 44, 0, 5000; SAP 15, 0, 3; SAP 53, 0, 50"));
    host.run_ms(1100);
    let start = host.plant().position_turns();
    let position = host.get(Ap::ActualPosition);
    host.all("MVP REL, 0, 655360");
    assert_eq!(host.get(Ap::PositionReached), 0);
    host.run_ms(3000);
    let target = position + 655_360;
    for _ in 0..10 {
        host.run_ms(100);
        assert_eq!(host.get(Ap::PositionReached), 1);
        near(host.get(Ap::ActualPosition).into(), target.into(), 50.0, "position");
        near(host.plant().position_turns() - start, 10.0, 0.001, "turns of the shaft");
    }
}

#[test]
fn default_gains_end_in_the_default_window_in_both_directions() {
    for target in [655_360, -655_360] {
        let mut host = Host::set_up("SAP 15, 0, 3");
        host.run_ms(1200);
        host.all(&format!("SAP 52, 0, 0; MVP ABS, 0, {target}"));
        let mut ms = 0;
        while host.get(Ap::PositionReached) == 0 {
            host.run_ms(10);
            ms += 10;
            if ms % 200 == 0 {
                println!(
                    "{ms} {} {} {:.3}",
                    host.get(Ap::ActualPosition),
                    host.get(Ap::RampPosition),
                    host.plant().currents_dq_a()[1]
                );
            }
            assert!(ms < 600000, "{} of {target}", host.get(Ap::ActualPosition));
        }
        near(host.get(Ap::ActualPosition).into(), target.into(), 50.0, "AP 53");
        for _ in 0..20 {
            host.run_ms(50);
            near(host.get(Ap::ActualPosition).into(), target.into(), 50.0, "it stays");
        }
    }
}

#[test]
fn program_that_waits_for_a_position_goes_on_at_every_position_gain() {
    for gain in [5, 20, 50, 300, 2000] {
        let mut host = Host::set_up(&format!("SAP 74, 0, {gain}; SAP 15, 0, 3"));
        host.run_ms(1200);
        host.all("SAP 52, 0, 0; MVP ABS, 0, 65536");
        host.run_ms(60_000);
        near(host.get(Ap::ActualPosition).into(), 65_536.0, 50.0, &format!("P {gain}"));
        assert_eq!(host.get(Ap::PositionReached), 1, "P {gain}");
    }
}

#[test]
fn motor_follows_its_position_ramp_without_a_lag() {
    let mut host = Host::set_up("SAP 44, 0, 2000; SAP 43, 0, 1500; SAP 15, 0, 3");
    host.run_ms(1200);
    host.all("MVP REL, 0, 6553600");
    host.run_ms(2000);
    // At P 50 and 1500 rpm a regulator of its own would be 30 turns behind.
    let lag = host.get(Ap::RampPosition) - host.get(Ap::ActualPosition);
    assert!(lag.abs() < 65_536 / 8, "{lag}");
    near(host.rpm(), 1500.0, 15.0, "full speed");
}

#[test]
fn position_that_is_set_turns_no_shaft() {
    for commands in ["", "MVP REL, 0, 100000", "ROR 0, 0", "SAP 30, 0, 0", "SAP 45, 0, 0; MVP REL, 0, 1000"] {
        let mut host = Host::set_up(&format!("SAP 15, 0, 3; {commands}"));
        host.run_ms(8000);
        let turns = host.plant().position_turns();
        for position in [0, 5_000_000, -5_000_000, i32::MAX] {
            host.all(&format!("SAP 52, 0, {position}"));
            host.run_ms(1000);
            near(host.plant().position_turns(), turns, 0.002, commands);
        }
    }
}

#[test]
fn torque_is_that_of_the_current() {
    let mut host = Host::set_up(&format!("{TUNED}; SAP 15, 0, 2"));
    host.say("block 0");
    host.all("SAP 30, 0, 1500");
    host.run_ms(100);
    near(
        host.plant().torque_nm(),
        1.5 * 0.036,
        0.1 * 1.5 * 0.036,
        "0.036 Nm/A, and hall sensors are 30 degrees off at worst",
    );
    near(host.get(Ap::ActualCurrent).into(), 1500.0, 30.0, "current");
}

#[test]
fn modes_change_while_the_motor_runs_without_a_jump() {
    let setup = format!("{TUNED}; SAP 11, 0, 6000; SAP 43, 0, 1500; SAP 44, 0, 10000; SAP 15, 0, 3");
    let mut host = Host::set_up(&format!("{setup}; ROR 0, 1500"));
    host.run_ms(2500);
    let position = host.get(Ap::ActualPosition);
    for command in [&format!("MVP ABS, 0, {}", position + 4_000_000), "ROR 0, 1500", "SAP 30, 0, 80", "ROR 0, 1500"] {
        let before = host.rpm();
        host.all(command);
        for _ in 0..20 {
            host.run_ms(1);
            near(host.rpm(), before, 60.0, command);
        }
    }
}

#[test]
fn idle_module_costs_nothing_and_wakes_by_its_load() {
    let mut host = Host::set_up("SAP 25, 0, 1");
    assert_eq!(host.bench.next_event(), None);
    host.say("load 0 -0.01");
    host.run_ms(100);
    assert!(host.rpm() > 100.0, "the shaft is free: {} rpm", host.rpm());
    assert!(host.get(Ap::ActualPosition) > 1000, "and followed");
    host.say("load 0 0");
    host.run_ms(120_000);
    assert_eq!((host.bench.next_event(), host.rpm()), (None, 0.0));
}

#[test]
fn time_may_pass_in_any_portions() {
    let shaft = [10_000_000, 100_000, 7_919].map(|portion_us| {
        let mut host = Host::set_up("SAP 15, 0, 2; SAP 110, 0, 30000; ROR 0, 500");
        let end_us = 2_000_000;
        while host.bench.now() < end_us {
            if host.bench.now() == 1_000_000 {
                host.all("SAP 255, 0, 0");
            }
            let limit = if host.bench.now() < 1_000_000 { 1_000_000 } else { end_us };
            host.bench.run_until((host.bench.now() + portion_us).min(limit));
        }
        (host.plant().position_turns().to_bits(), host.plant().driver_c().to_bits(), host.get(Ap::ActualPosition))
    });
    assert_eq!(shaft[0], shaft[1]);
    assert_eq!(shaft[0], shaft[2]);
}

#[test]
fn chopper_keeps_the_supply_down_while_the_motor_brakes() {
    let brake = |chopper: i32| {
        let setup = ServoSetup {
            mechanics: Mechanics { inertia_kgm2: 3e-4, ..ServoSetup::default().mechanics },
            ..ServoSetup::default()
        };
        let mut host = Host::new(setup);
        host.all(&format!("{TUNED}; SAP 11, 0, 8000; SAP 44, 0, 20000; SAP 140, 0, {chopper}; SAP 141, 0, 270"));
        host.all("SAP 15, 0, 2; SAP 92, 0, 1; ROR 0, 3000");
        host.run_ms(2000);
        host.all("SAP 44, 0, 100000; ROR 0, 0");
        let mut highest = 0.0_f64;
        for _ in 0..500 {
            host.run_ms(1);
            highest = highest.max(host.plant().supply_v());
        }
        (highest, host.flags() & 4)
    };
    let (without, tripped) = brake(0);
    assert!(without >= 31.9 && tripped != 0, "over-voltage: {without} V");
    let (with, tripped) = brake(1);
    assert!((26.9..28.0).contains(&with) && tripped == 0, "{with} V");
}

/// Brakes from 4000 rpm with the module's defaults, until the over-voltage has switched the drive off.
fn braked_to_over_voltage() -> Host {
    let setup = ServoSetup {
        mechanics: Mechanics { inertia_kgm2: 3e-5, ..ServoSetup::default().mechanics },
        ..ServoSetup::default()
    };
    let mut host = Host::new(setup);
    host.all("SAP 15, 0, 3; ROR 0, 4000");
    host.run_ms(5000);
    near(host.rpm(), 4000.0, 60.0, "full speed");
    host.all("SAP 45, 0, 0; ROR 0, 0");
    while host.flags() & 1 << 2 == 0 {
        host.run_ms(1);
        assert!(host.bench.now() < 6_000_000, "no over-voltage: {} V", host.plant().supply_v());
    }
    host
}

#[test]
fn drive_comes_back_after_braking_has_charged_the_supply() {
    let mut host = braked_to_over_voltage();
    let notices = host.bench.take_notices();
    let [notice] = notices.as_slice() else { panic!("{notices:?}") };
    for words in ["over-voltage", "takes no energy back", "140 to 144"] {
        assert!(notice.text.contains(words), "{words}: {}", notice.text);
        assert!(console::execute("show", &mut host.bench).unwrap().contains(words), "{words}");
    }
    host.run_ms(1000);
    assert_eq!(host.flags() & 0xef, 0, "{} V", host.plant().supply_v());
    host.all("SAP 140, 0, 1; SAP 141, 0, 270; ROR 0, 300");
    host.run_ms(3000);
    near(host.rpm(), 300.0, 20.0, "it runs again");
    assert!(!console::execute("show", &mut host.bench).unwrap().contains("the drive is off"));
}

#[test]
fn loss_of_power_discharges_the_supply() {
    let mut host = braked_to_over_voltage();
    assert!(host.plant().supply_v() > 31.0);
    host.say("power off");
    host.say("power on");
    near(host.plant().supply_v(), 24.0, 0.01, "volts");
    assert_eq!(host.get(Ap::StatusFlags) & 0xef, 0);
}

#[test]
fn failed_initialisation_says_what_to_look_at() {
    let mut host = Host::set_up("SAP 101, 0, 1; SAP 15, 0, 3");
    host.run_ms(1500);
    assert_eq!(host.exchange("MVP ABS, 0, 5").0, 6);
    assert_eq!(host.flags() & (1 << 7 | 1 << 15), 1 << 7);
    let text = &host.bench.take_notices()[0].text;
    assert!(text.contains("initialisation of the encoder has failed") && text.contains("100, 101"), "{text}");
    assert!(host.bench.take_notices().is_empty());
}

#[test]
fn hall_sensors_commutate_with_the_settings_that_suit_their_wiring() {
    let wirings = [
        ("polarity = 1", "SAP 90, 0, 1"),
        ("direction = 1, offset = 10000", "SAP 91, 0, 1; SAP 93, 0, 10000"),
        ("polarity = 1, direction = 1, offset = -7000", "SAP 90, 0, 1; SAP 91, 0, 1; SAP 93, 0, -7000"),
        ("order = \"bca\", offset = -21845", "SAP 93, 0, 0"),
    ];
    for (wiring, settings) in wirings {
        let text = format!("module = \"tmcm-1617\"\n[servo]\nhall = {{ {wiring} }}");
        let mut bench = BenchFile::parse(&text).unwrap().build(Eeprom::of(&TMCM_1617));
        let link = bench.attach(LinkKind::Usb, 0);
        let mut host = Host { bench, link };
        host.all(&format!("{settings}; SAP 92, 0, 1; SAP 15, 0, 2; ROR 0, 1000"));
        host.run_ms(1500);
        near(host.rpm(), 1000.0, 30.0, wiring);
    }
}

#[test]
fn reversed_encoder_suits_the_other_direction() {
    for (reversed, direction, ok) in [(true, 1, true), (true, 0, false), (false, 0, true)] {
        let text =
            format!("module = \"tmcm-1617\"\n[servo]\nencoder = {{ counts_per_turn = 4096, reversed = {reversed} }}");
        let mut bench = BenchFile::parse(&text).unwrap().build(Eeprom::of(&TMCM_1617));
        let link = bench.attach(LinkKind::Usb, 0);
        let mut host = Host { bench, link };
        host.all(&format!("SAP 101, 0, {direction}; SAP 15, 0, 3"));
        host.run_ms(1500);
        assert_eq!(host.flags() & 1 << 7 == 0, ok, "{reversed} {direction}");
    }
}

#[test]
fn currents_at_rest_have_noise_of_a_step() {
    let mut host = Host::new(ServoSetup::default());
    let readings: Vec<f64> = (0..1000).map(|_| f64::from(host.exchange("GAP 0, 0").1)).collect();
    let mean = readings.iter().sum::<f64>() / 1000.0;
    let deviation = (readings.iter().map(|reading| (reading - mean).powi(2)).sum::<f64>() / 1000.0).sqrt();
    near(mean, 32_767.0, 0.2, "mean");
    near(deviation, 1.0, 0.15, "deviation");
    let mut quiet = Host::new(ServoSetup::default());
    quiet.bench.machine().servos[0].set_current_noise(0.0, 1);
    assert!((0..100).all(|_| quiet.exchange("GAP 0, 0").1 == 32_767));
}

/// A line of the console that its table knows, or a command.
fn anything() -> impl Strategy<Value = String> {
    let real = |name: &'static str, limit: f64| (-limit..limit).prop_map(move |value| format!("{name} {value}"));
    let lines = prop_oneof![
        real("load 0", 1000.0),
        real("push 0", 36_000.0),
        (0.0..1000.0).prop_map(|value| format!("friction 0 {value}")),
        (0.0..60.0).prop_map(|value| format!("supply {value}")),
        (-55.0..200.0).prop_map(|value| format!("temperature 0 {value}")),
        (-55.0..200.0).prop_map(|value| format!("temperature board {value}")),
        prop::sample::select(vec![
            "load 0 0",
            "block 0",
            "block 0 off",
            "encoder 0 off",
            "encoder 0 on",
            "hall 0 a stuck 1",
            "hall 0 a ok",
            "gate 0 fault",
            "gate 0 ok",
            "power off",
            "power on",
            "reset",
            "supply 24",
            "friction 0 0.001",
        ])
        .prop_map(str::to_owned),
    ];
    let rows = TMCM_1617.axis_parameters;
    let setting = (0..rows.len(), any::<bool>()).prop_map(move |(row, most)| {
        let row = &rows[row];
        format!("! SAP {}, 0, {}", row.number, if most { row.max as i32 } else { row.min as i32 })
    });
    let motion = prop::sample::select(vec![
        "! SAP 15, 0, 1",
        "! SAP 15, 0, 2",
        "! SAP 15, 0, 3",
        "! ROR 0, 4000",
        "! ROL 0, 4000",
        "! ROR 0, 200000",
        "! MVP ABS, 0, 1000000",
        "! MVP REL, 0, -2147483648",
        "! SAP 30, 0, 18000",
        "! SAP 255, 0, 1",
        "! SAP 102, 0, 2",
        "! SAP 140, 0, 1",
    ]);
    prop_oneof![3 => lines, 1 => setting, 3 => motion.prop_map(str::to_owned)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn every_reading_is_finite_whatever_happens(steps in prop::collection::vec((anything(), 0..80_u64), 1..25)) {
        let mut host = Host::new(ServoSetup::default());
        for (line, ms) in steps {
            match line.strip_prefix("! ") {
                Some(command) => {
                    let instruction = Instruction::parse(command, &TMCM_1617).unwrap();
                    host.bench.send(&mut host.link, &Request { address: 1, instruction }.emit());
                    while host.bench.take(&mut host.link).is_some() {}
                }
                None => host.say(&line),
            }
            host.run_ms(ms);
            let plant = host.plant();
            prop_assert!(plant.is_finite(), "{line}: {plant:?}");
            let powers = format!("{:?}", plant.powers());
            prop_assert!(!powers.contains("NaN") && !powers.contains("inf"), "{line}: {powers}");
            for row in TMCM_1617.axis_parameters {
                host.bench.axis_parameter(0, row.id);
            }
        }
    }
}

#[test]
fn faults_of_the_machine_switch_the_driver_off_until_they_are_gone() {
    // A line of the console, the flag, how it ends.
    let cases = [
        ("supply 7.5", 1 << 1, "supply 24"),
        ("supply 33", 1 << 2, "supply 24"),
        ("temperature 0 125", 1 << 3, "temperature 0 90"),
        ("gate 0 fault", 1 << 6, "gate 0 ok"),
    ];
    for (line, flag, end) in cases {
        let supply = Supply { takes_back: true, ..Supply::default() };
        let mut host = Host::new(ServoSetup { supply, ..ServoSetup::default() });
        host.all("SAP 15, 0, 2; ROR 0, 300");
        host.run_ms(500);
        host.say(line);
        host.run_ms(100);
        assert_eq!(host.flags() & 0xef, flag, "{line}");
        assert_eq!(host.exchange("ROR 0, 300").0, 6, "{line}");
        host.say(end);
        host.run_ms(1000);
        host.all("SAP 255, 0, 1; ROR 0, 300");
        host.run_ms(1000);
        near(host.rpm(), 300.0, 20.0, line);
    }
}

#[test]
fn hall_sensor_that_is_stuck_is_found() {
    let mut host = Host::set_up("SAP 15, 0, 2; ROR 0, 300");
    host.run_ms(500);
    host.say("hall 0 a stuck 1");
    host.run_ms(500);
    assert_eq!(host.flags() & (1 << 5 | 1 << 8), 1 << 5 | 1 << 8, "codes 7 and 0 do not exist");
    near(host.rpm(), 0.0, 1.0, "it has run down");
    host.say("hall 0 a ok");
    host.all("SAP 255, 0, 1; ROR 0, 300");
    host.run_ms(1000);
    near(host.rpm(), 300.0, 20.0, "it runs again");
}

#[test]
fn encoder_that_is_cut_or_turned_round_fails_its_initialisation() {
    for (line, setting, ok) in [("show", "", true), ("encoder 0 off", "", false), ("show", "SAP 101, 0, 1", false)] {
        let mut host = Host::set_up(&format!("SAP 12, 0, 2000; {setting}"));
        host.plant().place(0.03);
        host.say(line);
        host.all("SAP 15, 0, 3");
        host.run_ms(1500);
        assert_eq!(host.flags() & 1 << 7 == 0, ok, "{line} {setting}");
    }
}

#[test]
fn direct_current_motor_turns_on_its_encoder() {
    let setup = ServoSetup {
        motor: ServoMotor::named("DC").unwrap(),
        encoder: Encoder::default(),
        hall: HallSensors::default(),
        supply: Supply::default(),
        ..ServoSetup::default()
    };
    let mut host = Host::new(setup);
    host.all(
        "SAP 14, 0, 1; SAP 10, 0, 1; SAP 70, 0, 600; SAP 71, 0, 600; SAP 72, 0, 800; SAP 73, 0, 500; SAP 44, 0, 10000",
    );
    host.all("SAP 15, 0, 3; ROR 0, 1500");
    host.run_ms(1500);
    near(host.rpm(), 1500.0, 15.0, "direct current");
}
