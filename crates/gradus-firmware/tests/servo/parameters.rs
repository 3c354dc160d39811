//! Every axis parameter: defaults, ranges, what is measured, what is stored.

use gradus_tmcl::catalogue::{Access, TMCM_1617};
use gradus_tmcl::{Instruction, Opcode};

use crate::support::Bench;

/// What is measured, and what the fake hardware makes of it.
const MEASURED: [(u8, i32); 8] = [
    (55, 1),
    (94, 1),
    (156, 1 << 4 | 1 << 8 | 1 << 14 | 1 << 15),
    (220, 240),
    (221, 25),
    (230, 1000),
    (231, 25_000),
    (232, 25_000),
];

#[test]
fn parameters_begin_with_their_defaults() {
    let mut bench = Bench::new();
    for row in TMCM_1617.axis_parameters {
        let measured = MEASURED.iter().find(|(number, _)| *number == row.number).map(|(_, value)| *value);
        let expected = measured.unwrap_or(row.default.unwrap() as i32);
        assert_eq!(bench.get(row.number), expected, "{} {}", row.number, row.name);
    }
}

#[test]
fn settings_keep_what_was_written_and_refuse_the_rest() {
    for row in TMCM_1617.axis_parameters.iter().filter(|row| row.access.writable()) {
        for value in [row.min, row.max].map(|value| value as i32) {
            let mut bench = Bench::new();
            bench.set(row.number, value);
            assert_eq!(bench.get(row.number), value, "{} {}", row.number, row.name);
        }
        for value in [row.min - 1, row.max + 1].into_iter().filter_map(|value| i32::try_from(value).ok()) {
            assert_eq!(Bench::new().exchange(&format!("SAP {}, 0, {value}", row.number)), (4, value), "{}", row.name);
        }
    }
    for (number, value) in [(14, 2), (102, 1)] {
        assert_eq!(Bench::new().exchange(&format!("SAP {number}, 0, {value}")).0, 4, "a gap in the range");
    }
}

#[test]
fn what_is_measured_cannot_be_written() {
    for row in TMCM_1617.axis_parameters.iter().filter(|row| row.access == Access::R) {
        assert_eq!(Bench::new().exchange(&format!("SAP {}, 0, 0", row.number)).0, 3, "{}", row.name);
    }
}

#[test]
fn settings_are_stored_and_restored() {
    let mut bench = Bench::new();
    let rows = || TMCM_1617.axis_parameters.iter().filter(|row| row.access == Access::Rwe);
    for row in rows() {
        bench.set(row.number, row.max as i32);
        assert_eq!(bench.ask(&format!("STAP {}, 0", row.number)), 0, "{}", row.name);
    }
    let mut bench = bench.power_cycle();
    for row in rows() {
        assert_eq!(bench.get(row.number), row.max as i32, "{} after power-on", row.name);
    }
    bench.set(11, 5);
    bench.ask("RSAP 11, 0");
    assert_eq!(bench.get(11), 18_000);
    for command in ["STAP 209, 0", "STAP 50, 0", "RSAP 240, 0"] {
        assert_eq!(bench.exchange(command).0, 3, "{command}: RW without E");
    }
}

#[test]
fn currents_are_readings_less_their_offsets() {
    let mut bench = Bench::set_up("SAP 5, 0, 32000; SAP 6, 0, 33000");
    bench.drive().shunts = [33_000, 32_500];
    assert_eq!([0, 1, 2, 3, 4].map(|number| bench.get(number)), [33_000, 32_500, 1000, -500, -500]);
}

#[test]
fn raw_sensors_are_shown() {
    let mut bench = Bench::new();
    for bits in 0..8 {
        (bench.drive().hall, bench.drive().encoder_levels) = (bits, 7 - bits);
        assert_eq!([94, 109].map(|number| bench.get(number)), [bits, 7 - bits].map(i32::from));
    }
}

#[test]
fn hall_angle_has_polarity_direction_and_offset() {
    // Code 3 is sector 1: 60 degrees.
    let cases =
        [("", 3, 10_922), ("SAP 93, 0, 1000", 3, 11_922), ("SAP 90, 0, 1", 4, 10_922), ("SAP 91, 0, 1", 3, -10_923)];
    for (set_up, hall, angle) in cases {
        let mut bench = Bench::set_up(set_up);
        bench.drive().hall = hall;
        bench.advance_ms(1);
        assert_eq!(bench.get(18), angle, "{set_up}");
    }
}

#[test]
fn encoder_angle_has_pole_pairs_direction_and_offset() {
    let cases = [
        ("", 256, 16_384),
        ("SAP 101, 0, 1", 256, -16_384),
        ("SAP 10, 0, 2", 256, 8_192),
        ("SAP 106, 0, 1000", 256, 17_384),
        ("SAP 100, 0, 8192", 256, 8_192),
    ];
    for (set_up, counts, angle) in cases {
        let mut bench = Bench::set_up(set_up);
        bench.drive().encoder = counts;
        bench.advance_ms(1);
        assert_eq!(bench.get(17), angle, "{set_up}");
    }
}

#[test]
fn velocity_is_that_of_the_selected_sensor_and_unit() {
    // 4096 counts a turn, one a period: 25000 / 4096 turns a second are 366.2 rpm.
    for (set_up, rpm) in [
        ("SAP 26, 0, 1", 366),
        ("SAP 26, 0, 1; SAP 27, 0, 1", 1465),
        ("SAP 26, 0, 1; SAP 13, 0, 1", -366),
        ("SAP 15, 0, 2; SAP 26, 0, 0", 0),
    ] {
        let mut bench = Bench::set_up(set_up);
        bench.drive().counts_per_tick = 1;
        bench.drive().encoder = 1;
        bench.advance_ms(200);
        assert_eq!(bench.get(42), rpm, "{set_up}");
        assert_eq!(bench.has_flags(1 << 4), rpm == 0, "motor halted");
    }
}

#[test]
fn motor_is_halted_below_its_velocity() {
    let mut bench = Bench::set_up("SAP 26, 0, 1");
    bench.drive().counts_per_tick = 1;
    bench.drive().encoder = 1;
    bench.advance_ms(200);
    for (limit, halted) in [(366, false), (367, true)] {
        bench.set(47, limit);
        assert_eq!(bench.has_flags(1 << 4), halted, "below {limit} rpm");
    }
}

#[test]
fn null_channel_clears_the_position() {
    for (once, again) in [(1, false), (0, true)] {
        let mut bench = Bench::set_up(&format!("SAP 25, 0, 1; SAP 108, 0, {once}; SAP 107, 0, 1"));
        assert!(bench.drive().null_event.is_some_and(|event| event.n && event.ab.is_none()));
        bench.drive().encoder = 1100;
        bench.drive().null = Some(1000);
        bench.advance_ms(1);
        assert_eq!(bench.get(52), 1600, "100 counts beyond");
        assert_eq!((bench.get(107) == 1, bench.drive().null_event.is_some()), (again, again));
    }
    let mut bench = Bench::set_up("SAP 107, 0, 1; SAP 107, 0, 0");
    assert_eq!(bench.drive().null_event, None);
}

#[test]
fn debug_values_are_free() {
    let mut bench = Bench::new();
    for number in 240..250 {
        bench.set(number, -i32::from(number));
    }
    assert!((240..250).all(|number| bench.get(number) == -i32::from(number)));
}

#[test]
fn inactive_module_answers_all_it_has() {
    let mut bench = Bench::new();
    for number in 0..=255 {
        let expected = if TMCM_1617.axis_parameter(number).is_some() { 100 } else { 3 };
        assert_eq!(bench.obey(Instruction::new(Opcode::GAP, number, 0, 0)).0, expected, "GAP {number}");
    }
}
