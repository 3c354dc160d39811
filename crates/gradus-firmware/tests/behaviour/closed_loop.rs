//! Closed loop: start-up, position, speed, torque, PID modes, and the way out.

use gradus_tmcl::catalogue::Ap;

use crate::rotor::Rotor;
use crate::support::Bench;

const NOT_AVAILABLE: u8 = 6;

/// Fast moves with full current; small current without load, which rises from the first microstep of error.
const SET_UP: &str =
    "SAP 6, 0, 255; SAP 113, 0, 50; SAP 114, 0, 255; SAP 4, 0, 100000; SAP 5, 0, 500000; SAP 17, 0, 500000";

/// A motor with a rotor in open loop.
fn open() -> Bench {
    let mut bench = Bench::set_up(SET_UP);
    bench.stage(0).rotor = Some(Rotor::default());
    bench
}

/// The same in closed loop, ready to move.
fn closed(settings: &str) -> Bench {
    let mut bench = open();
    bench.all(settings);
    bench.ask("SAP 129, 0, 1");
    bench.until(2_200, |bench| bench.get(133, 0) == 1);
    bench
}

fn rotor(bench: &mut Bench) -> &mut Rotor {
    bench.stage(0).rotor.as_mut().unwrap()
}

/// Lets a motor arrive within its window.
fn arrive(bench: &mut Bench) {
    bench.until(10_000, |bench| bench.get(8, 0) == 1 && bench.get(3, 0) == 0);
}

#[track_caller]
fn assert_near(got: i32, want: i32, tolerance: i32) {
    assert!((got - want).abs() <= tolerance, "{got}, not {want}");
}

// Start-up.

#[test]
fn start_up_takes_two_seconds_with_the_run_current_at_a_full_step() {
    for (start, full_step) in [(0, 128), (300, 384), (-500, -384), (128, 128)] {
        let mut bench = open();
        bench.ask(&format!("MVP ABS, 0, {start}"));
        bench.arrive(0);
        bench.ask("SAP 129, 0, 1");
        bench.advance_us(200);
        let duration = bench.until(3_000, |bench| {
            assert_eq!(bench.stage(0).current, 255);
            bench.get(133, 0) == 1
        });
        assert!((1_999_800..2_100_000).contains(&duration), "{duration} us");
        let settled = bench.stage(0).phase;
        assert_eq!(settled, full_step, "from {start}");
        assert_eq!([0, 1, 209, 8].map(|number| bench.get(number, 0)), [full_step, full_step, full_step, 1]);
        bench.advance_ms(100);
        assert_near(bench.stage(0).phase, full_step, 13);
    }
}

#[test]
fn moving_motor_brakes_before_it_starts_up() {
    let mut bench = open();
    bench.ask("ROR 0, 50000");
    bench.advance_ms(500);
    bench.ask("SAP 129, 0, 1");
    bench.advance_ms(50);
    assert_near(bench.get(3, 0), 25_000, 100);
    bench.until(2_300, |bench| bench.get(133, 0) == 1);
    assert_near(bench.get(1, 0), bench.stage(0).phase, 13);
}

#[test]
fn motion_waits_for_the_end_of_the_start_up() {
    let mut bench = open();
    bench.ask("SAP 129, 0, 1");
    bench.advance_ms(500);
    for command in ["MVP ABS, 0, 1000", "ROR 0, 1000", "RFS START, 0", "SAP 0, 0, 1000", "SAP 50, 0, 100"] {
        assert_eq!(bench.exchange(command).0, NOT_AVAILABLE, "{command}");
    }
    bench.all("MST 0; ROR 0, 0");
    assert_eq!((bench.get(129, 0), bench.get(133, 0)), (1, 0));
    bench.advance_ms(1_600);
    bench.ask("MVP ABS, 0, 1000");
    arrive(&mut bench);
    assert_near(rotor(&mut bench).position as i32, 1_000, 100);
}

#[test]
fn loop_needs_256_microsteps_and_resolutions_and_keeps_them() {
    for setting in ["SAP 140, 0, 7", "SAP 202, 0, 0", "SAP 210, 0, 0"] {
        let mut bench = open();
        bench.ask(setting);
        for mode in 1..=3 {
            assert_eq!(bench.exchange(&format!("SAP 129, 0, {mode}")).0, NOT_AVAILABLE, "{setting}");
        }
        assert_eq!(bench.get(129, 0), 0);
    }
    let mut bench = closed("");
    for command in ["SAP 140, 0, 8", "SAP 202, 0, 400", "SAP 210, 0, 10000", "SAP 251, 0, 1"] {
        assert_eq!(bench.exchange(command).0, NOT_AVAILABLE, "{command}");
    }
    bench.all("SAP 129, 0, 0; SAP 251, 0, 1; SAP 210, 0, 10000");
}

#[test]
fn offset_is_what_the_rotor_moved_while_it_was_taken() {
    let mut bench = open();
    bench.ask("SAP 129, 0, 1");
    bench.advance_ms(1_500);
    // A load that turns the rotor by 30 degrees of load angle.
    rotor(&mut bench).load = 0.5;
    bench.advance_ms(1_000);
    assert_near(bench.get(112, 0), -85, 15);
    rotor(&mut bench).load = 0.0;
    bench.advance_ms(2_000);
    assert!(bench.get(123, 0) > 100, "the rotor is 85 microsteps ahead of what was measured");
    bench.ask("SAP 112, 0, 0");
    bench.advance_ms(500);
    assert_near(bench.get(123, 0), 50, 10);
}

// Position.

#[test]
fn load_that_loses_steps_in_open_loop_is_held_in_closed_loop() {
    let lost = |bench: &mut Bench| {
        bench.all("SAP 4, 0, 20000; MVP ABS, 0, 100000");
        for load in [1.1, -1.3] {
            bench.advance_ms(500);
            rotor(bench).load = load;
            bench.advance_ms(30);
            rotor(bench).load = 0.0;
        }
        bench.advance_ms(5_000);
        bench.get(1, 0) - bench.get(209, 0)
    };
    let steps = lost(&mut open());
    assert!(steps.abs() >= 1_000, "open loop lost {steps} microsteps only");
    assert_near(lost(&mut closed("")), 0, 50);
}

#[test]
fn current_follows_the_load() {
    let mut bench = closed("");
    bench.advance_ms(500);
    assert_near(bench.get(123, 0), 50, 6);
    assert_eq!((i32::from(bench.stage(0).scale), bench.stage(0).current), (bench.get(123, 0), 255));
    rotor(&mut bench).load = 0.6;
    bench.advance_ms(500);
    let scale = bench.get(123, 0);
    assert!((160..220).contains(&scale), "{scale}");
    bench.all("SAP 6, 0, 200");
    bench.advance_ms(500);
    assert!(bench.get(123, 0) > scale + 20, "less run current: more scale for the same torque");
    assert_eq!(bench.stage(0).current, 200);
}

#[test]
fn overload_during_a_move_is_caught_up_and_the_target_reached() {
    let mut bench = closed("");
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 100000");
    bench.advance_ms(500);
    rotor(&mut bench).load = 1.2;
    bench.advance_ms(25);
    assert!(bench.peek(0, Ap::ActualPosition) - bench.peek(0, Ap::EncoderPosition) > 5_000, "overpowered");
    rotor(&mut bench).load = 0.1;
    bench.advance_ms(680);
    assert_eq!(bench.peek(0, Ap::ActualPosition), 100_000, "the ramp has not waited");
    let late = bench.until(500, |bench| bench.peek(0, Ap::PositionReached) == 1);
    assert!(late < 300_000, "{late} us after the ramp");
    assert_near(bench.peek(0, Ap::EncoderPosition), 100_000, 100);
    assert_eq!(bench.drain().len(), 1, "one event");
}

#[test]
fn position_is_reached_within_the_window() {
    let mut bench = closed("SAP 134, 0, 40");
    rotor(&mut bench).load = 0.3;
    bench.ask("MVP ABS, 0, 20000");
    bench.advance_ms(2_000);
    assert_eq!((bench.get(1, 0), bench.get(8, 0)), (20_000, 0));
    let deviation = 20_000 - bench.get(209, 0);
    assert!((50..200).contains(&deviation), "{deviation}");
    bench.ask("SAP 134, 0, 200");
    bench.advance_ms(1);
    assert_eq!(bench.get(8, 0), 1);
}

#[test]
fn deviation_stops_the_motor_where_the_encoder_is() {
    let mut bench = closed("SAP 212, 0, 1000");
    bench.ask("MVP ABS, 0, 100000");
    bench.advance_ms(500);
    rotor(&mut bench).blocked = true;
    bench.advance_ms(200);
    assert_eq!([3, 8, 207].map(|number| bench.get(number, 0)), [0, 0, 2]);
    assert_near(bench.get(1, 0), bench.get(209, 0), 0);
    assert_eq!(bench.get(129, 0), 1, "still closed");
    rotor(&mut bench).blocked = false;
    bench.ask("MVP ABS, 0, 100000");
    arrive(&mut bench);
    assert_near(bench.get(209, 0), 100_000, 100);
}

// Speed and torque.

#[test]
fn ramp_in_velocity_mode_waits_for_the_rotor() {
    let mut bench = closed("");
    let gone = |bench: &mut Bench| {
        let start = bench.get(209, 0);
        bench.advance_ms(500);
        bench.get(209, 0) - start
    };
    bench.ask("ROR 0, 50000");
    bench.advance_ms(500);
    assert_near(gone(&mut bench), 25_000, 300);
    rotor(&mut bench).blocked = true;
    bench.advance_ms(500);
    assert_near(bench.get(1, 0) - bench.get(209, 0), 768, 5);
    rotor(&mut bench).blocked = false;
    bench.advance_ms(500);
    assert_near(gone(&mut bench), 25_000, 300);
    bench.ask("MST 0");
    bench.advance_ms(500);
    assert_eq!(bench.get(3, 0), 0);
    assert_near(gone(&mut bench), 0, 20);
}

#[test]
fn torque_is_proportional_to_its_parameter() {
    let mut bench = closed("");
    rotor(&mut bench).blocked = true;
    for torque in [-255_i32, -100, -20, 0, 50, 128, 255] {
        bench.ask(&format!("SAP 50, 0, {torque}"));
        bench.advance_ms(400);
        assert_eq!((bench.get(50, 0), bench.get(123, 0)), (torque, torque.abs()));
        let got = rotor(&mut bench).torque;
        let want = f64::from(torque) / 255.0;
        assert!((got - want).abs() <= 0.01 * want.abs(), "{torque}: {got}, not {want}");
    }
}

#[test]
fn torque_turns_a_free_shaft_until_a_motion_command() {
    for command in ["MST 0", "ROR 0, 0", "MVP ABS, 0, 500000", "ROL 0, 1000"] {
        // 119 limits the speed.
        let mut bench = closed("SAP 119, 0, 60000; SAP 213, 0, 20000; SAP 212, 0, 1000");
        bench.ask("SAP 50, 0, 100");
        bench.advance_ms(500);
        assert_near(bench.get(131, 0), 60_000, 2_000);
        assert_near(bench.get(1, 0), bench.get(209, 0), 20);
        bench.all("SAP 212, 0, 0; SAP 213, 0, 0");
        bench.ask(command);
        assert_eq!(bench.get(50, 0), 0, "{command}");
        bench.advance_ms(1_000);
        let speed = bench.get(3, 0);
        assert_near(bench.get(131, 0), speed, 5_000);
    }
}

#[test]
fn torque_needs_the_closed_loop() {
    let mut bench = open();
    assert_eq!(bench.exchange("SAP 50, 0, 10").0, NOT_AVAILABLE);
    bench.ask("SAP 129, 0, 2");
    bench.advance_ms(10);
    assert_eq!((bench.get(133, 0), bench.exchange("SAP 50, 0, 10").0), (1, NOT_AVAILABLE));
}

#[test]
fn stop_switch_ends_torque_mode() {
    for (torque, right) in [(50, true), (-50, false)] {
        let mut bench = closed("SAP 12, 0, 3; SAP 13, 0, 3");
        bench.ask(&format!("SAP 50, 0, {torque}"));
        bench.advance_ms(50);
        let switches = &mut bench.stage(0).switches;
        *(if right { &mut switches.right } else { &mut switches.left }) = true;
        bench.advance_ms(300);
        assert_eq!(bench.get(50, 0), 0);
        assert_near(bench.get(131, 0), 0, 500);
        bench.ask(&format!("SAP 50, 0, {}", -torque));
        bench.advance_ms(50);
        assert_eq!(bench.get(50, 0), -torque, "away from it");
    }
}

// Origin.

#[test]
fn position_and_encoder_have_one_origin() {
    for command in ["SAP 1, 0, 5000", "SAP 209, 0, 5000"] {
        let mut bench = closed("");
        rotor(&mut bench).load = 0.2;
        bench.ask("MVP ABS, 0, 20000");
        bench.advance_ms(2_000);
        let lag = bench.get(1, 0) - bench.get(209, 0);
        assert!(lag > 30, "{lag}");
        let phase = bench.stage(0).phase;
        bench.ask(command);
        assert_eq!(bench.get(1, 0) - bench.get(209, 0), lag, "{command}");
        assert_eq!(bench.get(if command.contains("209") { 209 } else { 1 }, 0), 5_000);
        assert_eq!(bench.get(0, 0), bench.get(1, 0), "nothing moves");
        bench.advance_ms(100);
        assert_near(bench.stage(0).phase, phase, 13);
    }
}

#[test]
fn pid_mode_does_not_turn_when_the_origin_moves() {
    for command in ["SAP 1, 0, 5000", "SAP 209, 0, 5000"] {
        let mut bench = open();
        bench.all("SAP 7, 0, 255; SAP 129, 0, 2");
        bench.advance_ms(10);
        let phase = bench.stage(0).phase;
        bench.ask(command);
        bench.advance_ms(500);
        assert_eq!([0, 1, 209].map(|number| bench.get(number, 0)), [5_000; 3], "{command}");
        assert_eq!(bench.stage(0).phase, phase, "{command}");
    }
}

#[test]
fn null_event_does_not_clear_the_encoder_of_a_closed_loop() {
    let mut bench = closed("SAP 201, 0, 280");
    let position = bench.get(209, 0);
    bench.stage(0).null = Some(3);
    assert_eq!(bench.get(209, 0), position);
    assert_ne!(bench.get(199, 0), 0, "but latches it");
}

// Power and the way out.

#[test]
fn enable_low_lets_the_shaft_go_and_high_holds_it_where_it_is() {
    let mut bench = closed("");
    bench.ask("SAP 50, 0, 100");
    bench.advance_ms(20);
    bench.board().enable = false;
    bench.advance_ms(1);
    assert_eq!((bench.stage(0).current, bench.get(50, 0)), (0, 0));
    assert_eq!(bench.exchange("MVP ABS, 0, 0").0, NOT_AVAILABLE);
    rotor(&mut bench).speed = 100_000.0;
    bench.advance_ms(100);
    let place = bench.get(209, 0);
    assert!(place > 3_000, "turned by hand");
    rotor(&mut bench).speed = 0.0;
    bench.board().enable = true;
    bench.advance_ms(500);
    assert_near(bench.get(209, 0), place, 50);
    bench.ask("MVP ABS, 0, 0");
    arrive(&mut bench);
    assert_near(rotor(&mut bench).position as i32, 0, 100);
}

#[test]
fn pid_mode_does_not_turn_back_what_was_turned_while_enable_was_low() {
    let mut bench = open();
    bench.all("SAP 7, 0, 255; SAP 115, 0, 1000; SAP 119, 0, 50000; SAP 124, 0, 0; SAP 129, 0, 2");
    bench.advance_ms(10);
    bench.board().enable = false;
    bench.advance_ms(1);
    rotor(&mut bench).position += 51_200.0;
    bench.advance_ms(500);
    bench.board().enable = true;
    bench.advance_ms(1_000);
    assert_near(bench.get(209, 0), 51_200, 260);
}

#[test]
fn run_current_flows_while_the_speed_changes() {
    let mut bench = closed("SAP 6, 0, 100; SAP 200, 0, 255");
    bench.ask("MVP ABS, 0, 100000");
    bench.advance_ms(50);
    assert_ne!(bench.get(3, 0), 0);
    assert_eq!(bench.stage(0).current, 100);
}

#[test]
fn enable_low_ends_a_start_up() {
    let mut bench = open();
    bench.ask("SAP 129, 0, 1");
    bench.advance_ms(1_000);
    bench.board().enable = false;
    bench.advance_ms(1);
    assert_eq!((bench.get(129, 0), bench.get(133, 0)), (0, 0));
    assert_eq!(bench.exchange("SAP 129, 0, 1").0, NOT_AVAILABLE);
}

#[test]
fn open_loop_goes_on_where_the_field_is_and_comes_to_rest() {
    let mut bench = closed("SAP 7, 0, 10");
    rotor(&mut bench).load = 0.3;
    bench.ask("MVP ABS, 0, 20000");
    bench.advance_ms(2_000);
    bench.stage(0).recording = true;
    bench.ask("SAP 129, 0, 0");
    let phase = bench.stage(0).phase;
    assert_near(bench.get(1, 0), phase, 0);
    assert_eq!([129, 133, 123].map(|number| bench.get(number, 0)), [0, 0, 0]);
    bench.advance_ms(1_000);
    assert!(bench.stage(0).vectors.iter().all(|vector| *vector == (phase, 255)), "run current, no jump");
    bench.advance_ms(1_100);
    assert_eq!((bench.stage(0).current, bench.stage(0).scale), (10, 255), "standby current");
    assert_eq!(bench.module.poll_at(), None, "sleeps");
}

#[test]
fn closed_loop_left_while_moving_brakes_with_the_ramp() {
    let mut bench = closed("");
    bench.ask("MVP ABS, 0, 200000");
    bench.advance_ms(500);
    bench.ask("SAP 129, 0, 0");
    assert_near(bench.get(3, 0), 100_000, 100);
    bench.advance_ms(500);
    assert_eq!(bench.get(3, 0), 0);
    assert_near(bench.get(209, 0), bench.get(1, 0), 20);
}

#[test]
fn restart_opens_the_loop() {
    let mut bench = closed("");
    bench.control(255, 0, 1234);
    bench.advance_ms(1);
    assert_eq!((bench.get(129, 0), bench.get(133, 0)), (0, 0));
}

// PID modes.

#[test]
fn pid_modes_make_lost_steps_good() {
    for mode in [2, 3] {
        let mut bench = open();
        bench.all(&format!("SAP 7, 0, 255; SAP 115, 0, 1000; SAP 119, 0, 50000; SAP 124, 0, 0; SAP 129, 0, {mode}"));
        bench.advance_ms(1);
        assert_eq!((bench.get(129, 0), bench.get(133, 0)), (mode, 1), "no start-up");
        bench.ask("MVP ABS, 0, 50000");
        bench.advance_ms(3_000);
        assert_near(bench.get(209, 0), 50_000, 110);
        // A turn is lost by hand.
        rotor(&mut bench).position += 51_200.0;
        bench.advance_ms(6_000);
        assert_near(bench.get(209, 0), 50_000, 110);
        assert_eq!((bench.get(8, 0), bench.get(1, 0)), (i32::from((bench.get(209, 0) - 50_000).abs() <= 100), 50_000));
    }
}
