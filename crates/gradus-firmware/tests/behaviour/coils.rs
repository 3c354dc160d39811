//! Currents and coil vectors, encoder, deviation and stall (BEHAVIOUR 5).

use crate::support::{Bench, Machine, Memory};

// Currents and coils.

#[test]
fn current_follows_motion() {
    let mut bench = Bench::fast();
    assert_eq!(bench.stage(0).current, 32, "standby current at the start");
    bench.ask("MVP ABS, 0, 10000");
    bench.advance_ms(1);
    assert_eq!(bench.stage(0).current, 128);
    bench.arrive(0);
    bench.advance_us(1_999_000);
    assert_eq!(bench.stage(0).current, 128, "before the power down delay is over");
    bench.advance_us(2_000);
    assert_eq!(bench.stage(0).current, 32);
    assert_eq!([1, 2].map(|axis| bench.stage(axis).current), [32; 2]);
}

#[test]
fn power_down_delay_is_in_steps_of_10_ms() {
    for (delay, milliseconds) in [(0, 0), (1, 10), (50, 500)] {
        let mut bench = Bench::fast();
        bench.all(&format!("SAP 214, 0, {delay}; MVP ABS, 0, 1000"));
        bench.arrive(0);
        let took = bench.until(10_000, |bench| bench.stage(0).current == 32);
        assert!(took.abs_diff(milliseconds * 1000) <= 200, "{took} us for {delay}");
    }
}

#[test]
fn currents_hold_at_once() {
    let mut bench = Bench::fast();
    bench.ask("SAP 7, 0, 50");
    assert_eq!(bench.stage(0).current, 50, "standing");
    bench.ask("ROR 0, 1000");
    bench.advance_ms(100);
    bench.ask("SAP 6, 0, 200");
    bench.advance_ms(1);
    assert_eq!(bench.stage(0).current, 200, "turning");
    bench.ask("SAP 7, 0, 60");
    bench.advance_ms(1);
    assert_eq!(bench.stage(0).current, 200);
}

#[test]
fn currents_hold_at_once_during_the_power_down_delay() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 1000");
    bench.arrive(0);
    bench.all("SAP 6, 0, 90; SAP 7, 0, 60");
    assert_eq!(bench.stage(0).current, 90);
    bench.advance_ms(3000);
    assert_eq!(bench.stage(0).current, 60);
}

#[test]
fn boost_current_while_accelerating_and_decelerating() {
    let mut bench = Bench::fast();
    bench.all("SAP 200, 0, 250; MVP ABS, 0, 100000");
    let mut currents = Vec::new();
    for _ in 0..10_000 {
        bench.advance_us(100);
        let current = bench.stage(0).current;
        if currents.last() != Some(&current) {
            currents.push(current);
        }
    }
    assert_eq!(currents[..3], [250, 128, 250]);
}

#[test]
fn standby_current_comes_after_every_kind_of_stop() {
    let stall: fn(&mut Bench) = |bench| bench.stage(0).driver.flags = 1;
    let switch: fn(&mut Bench) = |bench| bench.stage(0).switches.right = true;
    let deviation: fn(&mut Bench) = |bench| bench.stage(0).encoder = 1_000_000;
    let mst: fn(&mut Bench) = |bench| assert_eq!(bench.ask("MST 0"), 0);
    for (name, setting, stop) in [
        ("stall", "SAP 181, 0, 100", stall),
        ("switch", "SAP 12, 0, 3", switch),
        ("deviation", "SAP 212, 0, 100000", deviation),
        ("MST", "", mst),
    ] {
        let mut bench = Bench::fast();
        bench.all(&format!("{setting}; ROR 0, 1000"));
        bench.advance_ms(100);
        stop(&mut bench);
        bench.advance_ms(1000);
        assert_eq!((bench.get(3, 0), bench.stage(0).current), (0, 128), "{name}");
        bench.advance_ms(1100);
        assert_eq!(bench.stage(0).current, 32, "{name}");
    }
}

#[test]
fn coil_vector_counts_256th_of_full_steps() {
    for resolution in 0..9 {
        let mut bench = Bench::fast();
        bench.all(&format!("SAP 140, 0, {resolution}; MVP ABS, 0, -300"));
        bench.arrive(0);
        assert_eq!(bench.stage(0).phase, -300 * (256 >> resolution), "resolution {resolution}");
    }
}

#[test]
fn reverse_shaft_turns_the_coil_vector_the_other_way() {
    let mut bench = Bench::fast();
    bench.all("SAP 251, 0, 1; MVP ABS, 0, 300");
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (300, -300));
}

#[test]
fn coil_vector_never_jumps_when_a_setting_changes() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 300");
    bench.arrive(0);
    for command in ["SAP 140, 0, 4", "SAP 251, 0, 1", "SAP 1, 0, 7777", "SAP 140, 0, 8", "SAP 6, 0, 3"] {
        bench.ask(command);
        bench.advance_ms(1);
        assert_eq!(bench.stage(0).phase, 300, "{command}");
    }
}

// Encoder and deviation.

#[test]
fn encoder_counts_become_microsteps() {
    for (settings, counts, position) in [
        ("", 4_096, 51_200),
        ("SAP 210, 0, 40000", 4_000, 5_120),
        ("SAP 210, 0, -4096", 4_096, -51_200),
        ("SAP 140, 0, 4", 4_096, 3_200),
        ("SAP 202, 0, 400", 4_096, 102_400),
        ("SAP 210, 0, 0", 4_096, 0),
    ] {
        let mut bench = Bench::set_up(settings);
        bench.stage(0).encoder += counts;
        assert_eq!(bench.get(209, 0), position, "{settings:?}");
    }
}

#[test]
fn encoder_position_can_be_set() {
    let mut bench = Bench::new();
    bench.stage(0).encoder = 12_345;
    bench.ask("SAP 209, 0, -500");
    assert_eq!(bench.get(209, 0), -500);
    bench.stage(0).encoder += 4_096;
    assert_eq!(bench.get(209, 0), 50_700);
}

#[test]
fn encoder_begins_at_0() {
    let mut machine = Machine::default();
    machine.axes[1].encoder = 777;
    assert_eq!(Bench::with(machine, Memory::blank(0)).get(209, 1), 0);
}

#[test]
fn deviation_stops_the_motor_where_the_encoder_is() {
    let mut bench = Bench::fast();
    bench.stage(0).coupled = true;
    bench.all("SAP 212, 0, 100; ROR 0, 10000");
    bench.advance_ms(500);
    assert_eq!(bench.get(3, 0), 10_000, "no deviation, no stop");
    bench.stage(0).coupled = false;
    bench.advance_ms(100);
    assert_eq!((bench.get(3, 0), bench.get(2, 0)), (0, 0));
    assert_eq!(bench.get(1, 0), bench.get(209, 0));
    assert_eq!((bench.get(207, 0), bench.get(207, 0)), (2, 0), "cleared by reading");
}

#[test]
fn deviation_does_not_reach_the_target() {
    let mut bench = Bench::fast();
    bench.control(138, 0, 1);
    bench.all("SAP 212, 0, 100; MVP ABS, 0, 10000");
    bench.advance_ms(500);
    assert_eq!([0, 1, 8, 207].map(|number| bench.get(number, 0)), [10_000, 0, 0, 2]);
    assert!(bench.drain().is_empty(), "an event for a target that was not reached");
}

#[test]
fn error_flags_are_cleared_by_the_next_motion_command() {
    for command in ["ROR 0, 0", "MVP REL, 0, 0", "MST 0"] {
        let mut bench = Bench::fast();
        bench.all("SAP 212, 0, 100; ROR 0, 10000");
        bench.advance_ms(500);
        bench.ask(command);
        assert_eq!(bench.get(207, 0), 0, "{command}");
    }
}

#[test]
fn deviation_sets_edv() {
    let mut bench = Bench::new();
    bench.run(
        "SAP 212, 0, 100; ROR 0, 10000; WAIT TICKS, 0, 100; JC EDV, 5; STOP; CLE EDV; JC EDV, 8; SGP 1, 2, 1; STOP",
    );
    assert_eq!(bench.variable(1), 1);
}

#[test]
fn stall_stops_above_the_speed_of_parameter_181_only() {
    for (speed, stops) in [(900, false), (1100, true), (-1100, true)] {
        let mut bench = Bench::fast();
        bench.all(&format!("SAP 181, 0, 1000; ROR 0, {speed}"));
        bench.advance_ms(100);
        bench.stage(0).driver.flags = 1;
        bench.advance_ms(1);
        assert_eq!(bench.get(3, 0) == 0, stops, "{speed} pps");
        assert_eq!(bench.get(207, 0), i32::from(stops));
    }
}
