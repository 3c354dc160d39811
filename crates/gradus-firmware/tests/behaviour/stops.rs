//! What stops motors: switches, ENABLE, silence of the host (BEHAVIOUR 5).

use gradus_firmware::{Link, LinkKind, Switches};
use gradus_tmcl::Request;
use gradus_tmcl::catalogue::Ap;

use crate::support::{Bench, Machine, Memory, frame, instruction, request};

const NOT_AVAILABLE: u8 = 6;

// Stop switches.

/// Sets the level of a stop switch.
fn set_switch(bench: &mut Bench, axis: usize, right: bool, level: bool) {
    let switches = &mut bench.stage(axis).switches;
    *(if right { &mut switches.right } else { &mut switches.left }) = level;
}

#[test]
fn stop_switch_stops_motion_towards_it_only() {
    for (setting, right, level, speed, stops) in [
        ("SAP 12, 0, 3", true, true, 10_000, true),
        ("SAP 12, 0, 3", true, true, -10_000, false),
        ("SAP 12, 0, 3", true, false, 10_000, false),
        ("SAP 12, 0, 1", true, false, 10_000, true),
        ("SAP 12, 0, 1", true, true, 10_000, false),
        ("SAP 12, 0, 0", true, true, 10_000, false),
        ("SAP 13, 0, 3", false, true, -10_000, true),
        ("SAP 13, 0, 3", false, true, 10_000, false),
        ("SAP 13, 0, 1", false, false, -10_000, true),
        ("SAP 13, 0, 0", false, true, -10_000, false),
        ("SAP 13, 0, 3", true, true, -10_000, false),
        // Swapped: the right input with all its settings stops motion to the left.
        ("SAP 12, 0, 3; SAP 33, 0, 1", true, true, -10_000, true),
        ("SAP 12, 0, 3; SAP 33, 0, 1", true, true, 10_000, false),
        ("SAP 12, 0, 3; SAP 33, 0, 1", false, true, 10_000, false),
        ("SAP 12, 0, 1; SAP 33, 0, 1", true, false, -10_000, true),
        ("SAP 12, 0, 1; SAP 33, 0, 1", true, true, -10_000, false),
        ("SAP 13, 0, 3; SAP 33, 0, 1", false, true, 10_000, true),
        ("SAP 13, 0, 3; SAP 33, 0, 1", true, true, -10_000, false),
        ("SAP 12, 0, 1; SAP 13, 0, 0; SAP 33, 0, 1", false, true, 10_000, false),
    ] {
        let mut bench = Bench::fast();
        set_switch(&mut bench, 0, right, !level);
        bench.all(&format!("ROR 0, {speed}"));
        bench.advance_ms(200);
        bench.all(setting);
        set_switch(&mut bench, 0, right, level);
        bench.advance_ms(1);
        let expected = if stops { 0 } else { speed };
        assert_eq!(bench.get(3, 0), expected, "{setting}, right {right}, {level}, {speed} pps");
    }
}

#[test]
fn closed_stop_switch_blocks_before_the_first_step() {
    let mut bench = Bench::set_up("SAP 12, 0, 3");
    set_switch(&mut bench, 0, true, true);
    for command in ["ROR 0, 1000", "MVP ABS, 0, 500"] {
        bench.ask(command);
        bench.advance_ms(100);
        assert_eq!((bench.get(1, 0), bench.get(3, 0), bench.stage(0).phase), (0, 0, 0), "{command}");
    }
}

#[test]
fn motor_may_leave_a_stop_switch_in_the_other_direction() {
    let mut bench = Bench::fast();
    bench.all("SAP 12, 0, 3; ROR 0, 10000");
    bench.advance_ms(100);
    set_switch(&mut bench, 0, true, true);
    bench.advance_ms(10);
    let here = bench.get(1, 0);
    bench.ask("MVP ABS, 0, 100");
    bench.arrive(0);
    assert!(here > 100);
    assert_eq!(bench.get(1, 0), 100);
}

#[test]
fn motor_goes_on_when_the_stop_switch_opens() {
    let mut bench = Bench::fast();
    bench.all("SAP 12, 0, 3; MVP ABS, 0, 10000");
    bench.advance_ms(50);
    set_switch(&mut bench, 0, true, true);
    bench.advance_ms(100);
    assert_eq!((bench.get(3, 0), bench.get(8, 0), bench.get(0, 0)), (0, 0, 10_000));
    set_switch(&mut bench, 0, true, false);
    bench.arrive(0);
    assert_eq!(bench.get(1, 0), 10_000);
}

#[test]
fn relative_move_of_a_motor_at_its_stop_switch_begins_at_the_target() {
    let mut bench = Bench::fast();
    bench.all("SAP 12, 0, 3; MVP ABS, 0, 100000");
    bench.advance_ms(100);
    set_switch(&mut bench, 0, true, true);
    bench.advance_ms(100);
    assert_eq!(bench.get(3, 0), 0);
    assert_eq!(bench.ask("MVP REL, 0, -500"), 99_500);
}

#[test]
fn stopped_motor_stays_when_the_switch_opens_after_mst() {
    let mut bench = Bench::fast();
    bench.all("SAP 12, 0, 3; ROR 0, 10000");
    bench.advance_ms(50);
    set_switch(&mut bench, 0, true, true);
    bench.advance_ms(1);
    bench.ask("MST 0");
    set_switch(&mut bench, 0, true, false);
    bench.advance_ms(100);
    assert_eq!(bench.get(3, 0), 0);
}

#[test]
fn soft_stop_brakes_with_the_stop_deceleration() {
    for (settings, milliseconds) in [
        ("SAP 34, 0, 1; SAP 21, 0, 100000", 100),
        ("SAP 34, 0, 1; SAP 21, 0, 20000", 500),
        ("SAP 34, 0, 0; SAP 21, 0, 20000", 0),
        ("SAP 34, 0, 1; SAP 21, 0, 0", 0),
    ] {
        let mut bench = Bench::fast();
        bench.all(&format!("SAP 12, 0, 3; {settings}; ROR 0, 10000"));
        bench.advance_ms(200);
        set_switch(&mut bench, 0, true, true);
        if milliseconds > 0 {
            bench.advance_ms(milliseconds - 5);
            assert_ne!(bench.get(3, 0), 0, "{settings}");
        }
        bench.advance_ms(10);
        assert_eq!(bench.get(3, 0), 0, "{settings}");
        let here = bench.get(1, 0);
        bench.advance_ms(500);
        assert_eq!(bench.get(1, 0), here, "{settings}");
    }
}

#[test]
fn switch_levels_can_be_read() {
    let mut bench = Bench::new();
    bench.stage(1).switches = Switches { left: true, right: false, home: true };
    assert_eq!([9, 10, 11].map(|number| bench.get(number, 1)), [1, 0, 1]);
    bench.stage(1).switches = Switches { left: false, right: true, home: false };
    assert_eq!([9, 10, 11].map(|number| bench.get(number, 1)), [0, 1, 0]);
}

// Virtual stops.

/// A motor at 10 000 pps, braking with 100 000 pps^2, runs towards a virtual stop at 5000 or -5000 microsteps.
fn run_to_virtual_stop(settings: &str, command: &str) -> Bench {
    let mut bench = Bench::fast();
    bench.all("SAP 5, 0, 100000; SAP 17, 0, 100000; SAP 4, 0, 10000; SAP 26, 0, -5000; SAP 27, 0, 5000");
    bench.all(&format!("{settings}; {command}"));
    bench.advance_ms(2_000);
    bench
}

#[test]
fn virtual_stop_stops_motion_towards_it() {
    // A braking ramp takes 500 microsteps, a stop with 20 000 pps^2 takes 2500; a tick is one microstep.
    for (settings, command, expected) in [
        ("SAP 28, 0, 3; SAP 29, 0, 1", "ROR 0, 10000", 5_000),
        ("SAP 28, 0, 3; SAP 29, 0, 1", "MVP ABS, 0, 8000", 5_000),
        ("SAP 28, 0, 3; SAP 29, 0, 1", "ROL 0, 10000", -5_000),
        ("SAP 28, 0, 2; SAP 29, 0, 0", "MVP ABS, 0, 8000", 5_500),
        ("SAP 28, 0, 1; SAP 29, 0, 0", "MVP ABS, 0, -8000", -5_500),
        ("SAP 28, 0, 2; SAP 29, 0, 2; SAP 21, 0, 20000", "ROR 0, 10000", 7_500),
        ("SAP 28, 0, 2; SAP 29, 0, 2; SAP 21, 0, 0", "ROR 0, 10000", 5_000),
        ("SAP 28, 0, 1; SAP 29, 0, 1", "MVP ABS, 0, 8000", 8_000),
        ("SAP 28, 0, 0; SAP 29, 0, 1", "MVP ABS, 0, -8000", -8_000),
        ("SAP 28, 0, 3; SAP 29, 0, 0", "MVP ABS, 0, 5000", 5_000),
    ] {
        let mut bench = run_to_virtual_stop(settings, command);
        let position = bench.get(1, 0);
        assert!((position - expected).abs() <= 2, "{settings}, {command}: stands at {position}, not {expected}");
        assert_eq!(bench.get(3, 0), 0, "{settings}, {command}");
    }
}

#[test]
fn motor_may_leave_a_virtual_stop_and_goes_on_when_it_is_disabled() {
    let mut bench = run_to_virtual_stop("SAP 28, 0, 3; SAP 29, 0, 1", "MVP ABS, 0, 8000");
    assert_eq!(bench.get(8, 0), 0);
    bench.ask("MVP ABS, 0, 100");
    bench.arrive(0);
    assert_eq!(bench.get(1, 0), 100);
    bench.ask("MVP ABS, 0, 8000");
    bench.advance_ms(2_000);
    bench.ask("SAP 28, 0, 0");
    bench.arrive(0);
    assert_eq!(bench.get(1, 0), 8_000);
}

#[test]
fn motor_that_a_stop_brakes_past_its_target_comes_back() {
    // From 1000 pps the stop takes 500 microsteps, beyond the target at 5200.
    let mut bench = Bench::fast();
    bench.all("SAP 4, 0, 1000; SAP 21, 0, 1000; SAP 27, 0, 5000; SAP 28, 0, 2; SAP 29, 0, 2; MVP ABS, 0, 5200");
    let mut farthest = 0;
    bench.until(10_000, |bench| {
        farthest = farthest.max(bench.peek(0, Ap::ActualPosition));
        let reached = bench.peek(0, Ap::PositionReached) == 1;
        assert!(!reached || bench.peek(0, Ap::ActualSpeed) == 0, "reached at full speed");
        reached
    });
    assert!((farthest - 5_500).abs() <= 2, "{farthest}");
    assert_eq!(bench.get(1, 0), 5_200);
}

#[test]
fn motor_that_arrives_at_a_virtual_stop_stays_when_it_is_disabled() {
    // The target speed of an earlier rotation means nothing any more.
    let mut bench = run_to_virtual_stop("SAP 28, 0, 2; SAP 29, 0, 1; ROR 0, 1000", "MVP ABS, 0, 5000");
    assert_eq!((bench.get(1, 0), bench.get(8, 0)), (5_000, 1));
    bench.ask("SAP 28, 0, 0");
    bench.advance_ms(1_000);
    assert_eq!(bench.get(1, 0), 5_000);
}

// ENABLE.

#[test]
fn enable_low_switches_the_drivers_off_and_refuses_motion() {
    let mut bench = Bench::fast();
    bench.all("ROR 0, 10000; MVP ABS, 1, 100000");
    bench.advance_ms(100);
    bench.board().enable = false;
    bench.advance_ms(1);
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [0; 3]);
    assert_eq!(bench.all_axes(Ap::ActualSpeed), [0; 3]);
    for command in ["ROR 0, 1", "ROL 0, 1", "MVP ABS, 1, 5", "MVP REL, 1, 5", "MVP COORD, 1, 1", "SAP 0, 2, 5"]
        .into_iter()
        .chain(["SAP 2, 2, 5", "MVP COORD, $87, 1"])
    {
        assert_eq!(bench.exchange(command).0, NOT_AVAILABLE, "{command}");
    }
    for command in ["MST 0", "SAP 4, 0, 1000", "SAP 1, 0, 0", "GAP 1, 1", "SIO 0, 2, 1", "SAP 6, 0, 200"] {
        assert_eq!(bench.exchange(command).0, 100, "{command}");
    }
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [0; 3]);
}

#[test]
fn enable_high_again_lets_motors_move_but_starts_none() {
    let mut bench = Bench::fast();
    bench.all("ROR 0, 10000; MVP ABS, 1, 100000");
    bench.advance_ms(100);
    bench.board().enable = false;
    bench.advance_ms(1);
    let stopped = bench.positions();
    bench.board().enable = true;
    bench.advance_ms(1000);
    assert_eq!(bench.positions(), stopped);
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [32; 3]);
    bench.ask("MVP ABS, 1, 10");
    bench.arrive(1);
    assert_eq!(bench.get(1, 1), 10);
}

#[test]
fn module_that_starts_disabled_has_its_drivers_off() {
    let mut machine = Machine::default();
    machine.board.enable = false;
    machine.axes[1].recording = true;
    let mut bench = Bench::with(machine, Memory::blank(0));
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [0; 3]);
    assert!(bench.stage(1).vectors.iter().all(|(_, current)| *current == 0), "not for a moment");
    assert_eq!(bench.exchange("ROR 0, 1").0, NOT_AVAILABLE);
    bench.board().enable = true;
    bench.advance_us(100);
    assert_eq!(bench.exchange("ROR 0, 1").0, 100);
}

#[test]
fn motion_is_refused_in_programs_too_while_disabled() {
    let mut bench = Bench::new();
    bench.board().enable = false;
    bench.run("MVP ABS, 0, 100; STOP");
    assert_eq!(bench.last_error(), (6, 0));
}

// Heartbeats.

#[test]
fn silence_on_a_serial_line_stops_the_motors() {
    let mut bench = Bench::fast();
    bench.all("SGP 68, 0, 100; ROR 0, 10000; MVP ABS, 2, 1000000");
    bench.advance_us(99_999);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 10_000);
    bench.ask("GIO 0, 0");
    bench.advance_us(99_999);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 10_000, "the command has started the time again");
    bench.advance_us(2);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 0);
    bench.advance_ms(1000);
    assert_eq!(bench.all_axes(Ap::ActualSpeed), [0; 3]);
}

#[test]
fn heartbeat_waits_for_the_first_command() {
    let mut bench = Bench::set_up("SGP 68, 0, 100; SGP 77, 0, 1");
    bench.download("ROR 0, 1000; STOP");
    let mut bench = bench.power_cycle();
    bench.advance_ms(1000);
    assert_eq!(bench.peek(0, Ap::ActualSpeed), 1000);
    bench.ask("GAP 1, 0");
    bench.advance_ms(1000);
    assert_eq!(bench.peek(0, Ap::ActualSpeed), 0);
}

#[test]
fn heartbeats_of_serial_lines_and_can_are_apart() {
    let heartbeat = |parameter: u8, on_can: bool| {
        let mut bench = Bench::set_up(&format!("SGP {parameter}, 0, 100; ROR 0, 1000"));
        let mut can = Link::new(5, LinkKind::Can, 0);
        if on_can {
            bench.module.receive_frame(&mut can, &frame(1, false, instruction("GAP 1, 0"), 7));
        }
        for _ in 0..10 {
            bench.advance_ms(50);
            if on_can {
                bench.raw(&request(instruction("GAP 1, 0")).emit());
            } else {
                bench.module.receive_frame(&mut can, &frame(1, false, instruction("GAP 1, 0"), 7));
                while bench.module.transmit_frame(&mut can).is_some() {}
            }
        }
        bench.peek(0, Ap::TargetSpeed)
    };
    assert_eq!(heartbeat(68, false), 0, "serial silence, CAN alive");
    assert_eq!(heartbeat(68, true), 1000, "CAN silence does not count for GP 68");
    assert_eq!(heartbeat(82, true), 0, "CAN silence, serial alive");
    assert_eq!(heartbeat(82, false), 1000, "serial silence does not count for GP 82");
}

#[test]
fn foreign_and_damaged_datagrams_are_no_heartbeat() {
    let foreign = Request { address: 9, instruction: instruction("GAP 1, 0") }.emit();
    let mut damaged = request(instruction("GAP 1, 0")).emit();
    damaged[8] ^= 1;
    for datagram in [foreign, damaged] {
        let mut bench = Bench::set_up("SGP 68, 0, 100; ROR 0, 1000");
        bench.link = Link::new(7, LinkKind::Rs485, 0);
        for _ in 0..10 {
            bench.advance_ms(50);
            bench.raw(&datagram);
        }
        assert_eq!(bench.peek(0, Ap::TargetSpeed), 0, "{datagram:?}");
    }
}

#[test]
fn heartbeat_stops_again_after_the_next_silence() {
    let mut bench = Bench::set_up("SGP 68, 0, 100");
    for _ in 0..3 {
        bench.ask("ROR 0, 1000");
        bench.advance_ms(99);
        assert_eq!(bench.peek(0, Ap::TargetSpeed), 1000);
        bench.advance_ms(2);
        assert_eq!(bench.peek(0, Ap::TargetSpeed), 0);
    }
}
