//! Modes of motion, and the way from one to the other.

use crate::support::Bench;

const STOP: u32 = 1 << 8;
const VELOCITY: u32 = 1 << 9;
const POSITION: u32 = 1 << 10;
const TORQUE: u32 = 1 << 11;
const POSITION_END: u32 = 1 << 14;

/// A bench that commutates by an encoder which need not be aligned.
fn bench() -> Bench {
    Bench::set_up("SAP 15, 0, 3; SAP 102, 0, 2")
}

#[test]
fn commands_and_targets_choose_the_mode() {
    let cases = [
        ("ROR 0, 500", VELOCITY, 40, 500),
        ("ROL 0, 500", VELOCITY, 40, -500),
        ("MST 0", VELOCITY, 40, 0),
        ("SAP 40, 0, -77", VELOCITY, 40, -77),
        ("MVP ABS, 0, -1234", POSITION, 50, -1234),
        ("SAP 50, 0, 99", POSITION, 50, 99),
        ("SAP 30, 0, -400", TORQUE, 30, -400),
        ("SAP 32, 0, 300", TORQUE, 32, 300),
    ];
    let mut bench = bench();
    assert!(bench.has_flags(STOP));
    for (command, mode, number, target) in cases {
        bench.ask(command);
        let modes = bench.get(156) as u32 & (STOP | VELOCITY | POSITION | TORQUE);
        assert_eq!((modes, bench.get(number)), (mode, target), "{command}");
    }
}

#[test]
fn torque_and_flux_targets_stand_together() {
    let mut bench = Bench::set_up("SAP 15, 0, 2; SAP 30, 0, 700; SAP 32, 0, -300");
    assert_eq!([30, 32].map(|number| bench.get(number)), [700, -300]);
}

#[test]
fn relative_moves_go_from_where_the_motor_is() {
    let mut bench = bench();
    bench.drive().encoder = 512;
    bench.advance_ms(1);
    for _ in 0..3 {
        assert_eq!(bench.ask("MVP REL, 0, 100"), 8192 + 100, "512 of 4096 counts are an eighth of a turn");
        assert_eq!(bench.get(50), 8292);
    }
    bench.ask("SAP 40, 0, 10");
    assert_eq!(bench.ask("MVP REL, 0, -8192"), 0, "from where the motor is");
}

#[test]
fn target_follows_the_motor_outside_position_mode() {
    let mut bench = bench();
    bench.ask("MVP ABS, 0, 5000");
    bench.ask("ROR 0, 100");
    bench.drive().encoder = 1024;
    bench.advance_ms(1);
    assert_eq!([50, 52].map(|number| bench.get(number)), [16_384, 16_384]);
}

#[test]
fn position_is_reached_inside_both_windows() {
    // Counts away from a target of 100 counts, counts a period, whether it is reached.
    let cases = [(3, 0, true), (-3, 0, true), (4, 0, false), (-4, 0, false), (0, 1, false)];
    for (away, speed, expected) in cases {
        let mut bench = bench();
        bench.all("SAP 53, 0, 48; SAP 54, 0, 100; MVP ABS, 0, 1600");
        bench.drive().encoder = 100 + away - 500 * speed;
        bench.advance_ms(200);
        bench.drive().counts_per_tick = speed;
        bench.advance_ms(20);
        assert_eq!(bench.get(55) == 1, expected, "{away} counts away at {speed} counts a period");
        assert_eq!(bench.has_flags(POSITION_END), expected);
    }
}

#[test]
fn module_that_nobody_has_moved_stands_on_its_target() {
    let mut bench = Bench::new();
    assert_eq!((bench.get(55), bench.has_flags(POSITION_END)), (1, true));
    bench.all("SAP 25, 0, 1; SAP 26, 0, 1");
    bench.drive().counts_per_tick = 3;
    bench.drive().encoder = 1;
    bench.advance_ms(100);
    assert_eq!(bench.get(55), 0, "at 1098 rpm, more than AP 54");
}

#[test]
fn position_that_is_set_moves_nothing() {
    let modes = ["", "ROR 0, 0", "MVP ABS, 0, 16", "MVP ABS, 0, 0", "SAP 30, 0, 0", "SAP 45, 0, 0; MVP ABS, 0, 0"];
    for commands in modes {
        for position in [1_000_000, -1_000_000, i32::MIN, i32::MAX, 0] {
            let mut bench = bench();
            bench.all(commands);
            bench.advance_ms(500);
            let before = bench.drive().duties;
            bench.set(52, position);
            assert_eq!([50, 52].map(|number| bench.get(number)), [position; 2], "{commands}");
            bench.advance_ms(500);
            assert_eq!([50, 51, 52, 55, 81].map(|number| bench.get(number)), [position, position, position, 1, 0]);
            let modulation =
                bench.drive().duties.map(|duties| duties.iter().max().unwrap() - duties.iter().min().unwrap());
            let old = before.map(|duties| duties.iter().max().unwrap() - duties.iter().min().unwrap());
            assert!(modulation <= old, "{commands} and {position}: {modulation:?} after {old:?}");
        }
    }
}

#[test]
fn target_follows_the_scaler() {
    let mut bench = bench();
    bench.all("MVP ABS, 0, 65536; SAP 56, 0, 4096");
    assert_eq!(bench.get(50), 4096, "a turn still");
    bench.set(56, 65_536);
    assert_eq!(bench.get(50), 65_536);
}

#[test]
fn positions_are_scaled() {
    for (scaler, counts, outside) in [(65_536, 4096, 65_536), (3600, 4096, 3600), (3600, -1024, -900), (131_072, 1, 32)]
    {
        let mut bench = Bench::set_up(&format!("SAP 25, 0, 1; SAP 56, 0, {scaler}"));
        bench.drive().encoder = counts;
        bench.advance_ms(1);
        assert_eq!(bench.get(52), outside, "scaler {scaler}");
    }
    let mut bench = Bench::set_up("SAP 15, 0, 3; SAP 102, 0, 2; SAP 56, 0, 3600");
    bench.all("SAP 52, 0, 1800");
    assert_eq!(bench.get(52), 1800);
    assert_eq!(bench.ask("MVP ABS, 0, 3601"), 3601);
    assert_eq!(bench.get(50), 3601);
    assert_eq!(bench.exchange("MVP ABS, 0, 2000000000").0, 4, "more turns than a position has inside");
    assert_eq!(bench.get(50), 3601, "a command that fails changes nothing");
}

#[test]
fn every_position_that_is_set_is_read_back() {
    for scaler in [6, 100, 3600, 65_535, 65_536] {
        let mut bench = Bench::set_up(&format!("SAP 25, 0, 1; SAP 56, 0, {scaler}"));
        for position in (-60..60).map(|part| part * 1_517) {
            bench.set(52, position);
            assert_eq!(bench.get(52), position, "scaler {scaler}");
        }
    }
}

#[test]
fn driver_that_is_off_takes_no_motion() {
    let mut bench = Bench::set_up("SAP 15, 0, 2; ROR 0, 500");
    bench.set(255, 0);
    assert!(bench.has_flags(STOP));
    for command in ["ROR 0, 5", "MVP ABS, 0, 5", "SAP 30, 0, 5", "SAP 32, 0, 5", "SAP 40, 0, 5", "SAP 50, 0, 5"] {
        assert_eq!(bench.exchange(command).0, 6, "{command}");
    }
    assert_eq!(bench.exchange("MST 0").0, 100);
    bench.set(255, 1);
    bench.advance_ms(1);
    assert!(bench.has_flags(STOP), "nothing moves by itself");
    assert!(bench.drive().duties.is_some(), "but the driver works");
    assert_eq!(bench.ask("ROR 0, 5"), 5);
}

#[test]
fn switches_brake_a_motion_towards_them() {
    // Inputs: REF_R, REF_L, REF_H are 2, 3, 4.
    let cases = [
        ("ROR 0, 500", 1 << 2, true),
        ("ROR 0, 500", 1 << 3, false),
        ("ROR 0, 500", 1 << 4, false),
        ("ROL 0, 500", 1 << 3, true),
        ("ROL 0, 500", 1 << 2, false),
        ("MVP ABS, 0, 9999", 1 << 2, true),
        ("MVP ABS, 0, -9999", 1 << 3, true),
        ("SAP 30, 0, 100", 1 << 2, true),
        ("SAP 30, 0, -100", 1 << 2, false),
    ];
    for (command, inputs, braked) in cases {
        let mut bench = Bench::set_up("SAP 15, 0, 3; SAP 102, 0, 2; SAP 209, 0, 7; SAP 210, 0, 7");
        bench.ask(command);
        bench.advance_ms(10);
        let mode = bench.get(156) as u32 & (VELOCITY | POSITION | TORQUE);
        bench.board().inputs = inputs;
        bench.advance_ms(1);
        let after = bench.get(156) as u32 & (VELOCITY | POSITION | TORQUE);
        assert_eq!(after, if braked { VELOCITY } else { mode }, "{command}, inputs {inputs:#b}");
        assert_eq!(bench.get(40) == 0 && after == VELOCITY, braked, "{command}, inputs {inputs:#b}");
    }
}

#[test]
fn switches_have_a_polarity_and_must_be_enabled() {
    // Enable, polarity, inputs, what 211 to 213 read.
    let cases = [
        (0, 0, 0, [0, 0, 0]),
        (0, 7, 0b11100, [0, 0, 0]),
        (7, 0, 0, [1, 1, 1]),
        (7, 7, 0b10100, [1, 0, 1]),
        (3, 2, 0b11000, [1, 1, 0]),
    ];
    for (enable, polarity, inputs, active) in cases {
        let mut bench = Bench::set_up(&format!("SAP 209, 0, {enable}; SAP 210, 0, {polarity}"));
        bench.board().inputs = inputs;
        assert_eq!([211, 212, 213].map(|number| bench.get(number)), active, "{enable} {polarity} {inputs:#b}");
    }
}

#[test]
fn regression_target_half_the_positions_away_and_a_counter_that_jumps() {
    // Both overflowed the arithmetic of the ramp and of the velocity.
    let mut bench = Bench::set_up("SAP 15, 0, 2; MVP ABS, 0, -2147483648");
    bench.advance_ms(10);
    assert!(bench.has_flags(POSITION));
    let mut bench = Bench::set_up("SAP 26, 0, 1; SAP 27, 0, 1; SAP 10, 0, 255; SAP 110, 0, 100000");
    for encoder in [i32::MAX, i32::MIN, 0, 1_500_000_000] {
        bench.drive().encoder = encoder;
        bench.advance_ms(1);
    }
    bench.advance_ms(300);
    assert_eq!(bench.get(42), 0, "it stands");
}
