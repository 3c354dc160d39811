//! Motion: velocity mode, position mode, groups (BEHAVIOUR 5).

use gradus_tmcl::catalogue::Ap;

use crate::support::Bench;

// Velocity mode.

#[test]
fn ror_rol_and_mst_set_the_target_speed() {
    let mut bench = Bench::fast();
    for (command, speed) in [("ROR 1, 5000", 5000), ("ROL 1, 7000", -7000), ("ROR 1, -20", -20), ("MST 1", 0)] {
        bench.ask(command);
        assert_eq!(bench.get(2, 1), speed, "{command}");
        bench.advance_ms(1000);
        assert_eq!(bench.get(3, 1), speed, "{command}");
    }
    assert_eq!(bench.all_axes(Ap::TargetSpeed), [0; 3]);
}

#[test]
fn target_speed_parameter_starts_velocity_mode() {
    let mut bench = Bench::fast();
    bench.ask("SAP 2, 2, -3000");
    bench.advance_ms(1000);
    assert_eq!(bench.get(3, 2), -3000);
}

#[test]
fn rotation_speeds_up_with_the_acceleration() {
    let mut bench = Bench::set_up("SAP 5, 0, 10000; ROR 0, 20000");
    bench.advance_ms(500);
    let speed = bench.get(3, 0);
    assert!((4_990..=5_010).contains(&speed), "{speed} pps after 0.5 s");
}

#[test]
fn motor_stop_brakes_with_the_deceleration() {
    let mut bench = Bench::set_up("SAP 5, 0, 1000000; SAP 17, 0, 20000; ROR 0, 20000");
    bench.advance_ms(500);
    let start = bench.get(1, 0);
    bench.ask("MST 0");
    bench.advance_ms(990);
    assert_ne!(bench.get(3, 0), 0);
    bench.advance_ms(20);
    assert_eq!(bench.get(3, 0), 0);
    let way = bench.get(1, 0) - start;
    assert!((9_990..=10_010).contains(&way), "{way} microsteps for v^2 / 2a = 10000");
}

// Position mode.

#[test]
fn trapezoid_takes_its_time() {
    for (settings, seconds) in [
        ("", 11.0),
        ("SAP 17, 0, 102400", 10.75),
        ("SAP 15, 0, 51200; SAP 20, 0, 51200", 10.0),
        ("SAP 18, 0, 25600; SAP 16, 0, 25600; SAP 19, 0, 25600", 11.75),
        ("SAP 4, 0, 25600", 20.5),
    ] {
        let mut bench = Bench::set_up(settings);
        bench.ask("MVP ABS, 0, 512000");
        let took = bench.arrive(0) as f64 / 1e6;
        assert_eq!(bench.get(1, 0), 512_000);
        assert!((took - seconds).abs() <= 0.001 + 0.001 * seconds, "{took} s instead of {seconds} s with {settings:?}");
    }
}

#[test]
fn mvp_sets_the_target_and_replies_it() {
    let mut bench = Bench::fast();
    bench.all("SCO 3, 1, -1234; SCO 0, 1, 77");
    for (command, target) in [
        ("MVP ABS, 1, 5000", 5000),
        ("MVP REL, 1, 200", 5200),
        ("MVP REL, 1, -300", 4900),
        ("MVP COORD, 1, 3", -1234),
        ("MVP COORD, 1, 0", 77),
    ] {
        assert_eq!(bench.exchange(command), (100, target), "{command}");
        assert_eq!(bench.get(0, 1), target, "{command}");
    }
    bench.arrive(1);
    assert_eq!(bench.positions(), [0, 77, 0]);
}

#[test]
fn target_position_parameter_starts_a_move() {
    let mut bench = Bench::fast();
    bench.ask("SAP 0, 2, -800");
    bench.arrive(2);
    assert_eq!(bench.positions(), [0, 0, -800]);
}

#[test]
fn relative_moves_begin_where_parameter_127_says() {
    // Moving to 10000 with the encoder at 4096 counts, 51200 microsteps.
    for (option, base) in [(0, 10_000), (2, 51_200)] {
        let mut bench = Bench::set_up(&format!("SAP 127, 0, {option}; MVP ABS, 0, 10000"));
        bench.advance_ms(200);
        bench.stage(0).encoder = 4_096;
        assert_eq!(bench.ask("MVP REL, 0, 5"), base + 5, "option {option}");
    }
    let mut bench = Bench::set_up("SAP 127, 0, 1; MVP ABS, 0, 10000");
    bench.advance_ms(200);
    let actual = bench.get(1, 0);
    assert!(actual > 100);
    assert_eq!(bench.ask("MVP REL, 0, 5"), actual + 5);
}

#[test]
fn relative_move_out_of_velocity_mode_begins_at_the_actual_position() {
    let mut bench = Bench::fast();
    bench.ask("ROR 0, 1000");
    bench.advance_ms(500);
    let actual = bench.get(1, 0);
    assert_eq!(bench.ask("MVP REL, 0, 100"), actual + 100);
    assert_eq!(bench.ask("MVP REL, 0, 100"), actual + 200);
}

#[test]
fn position_reached_is_told_by_parameter_8() {
    let mut bench = Bench::fast();
    assert_eq!(bench.get(8, 0), 1, "at the start");
    bench.ask("MVP ABS, 0, 1000");
    assert_eq!(bench.get(8, 0), 0);
    bench.until(1000, |bench| bench.peek(0, Ap::ActualPosition) == 1000);
    bench.advance_ms(1);
    assert_eq!((bench.get(8, 0), bench.get(3, 0)), (1, 0));
    bench.ask("ROR 0, 1000");
    bench.advance_ms(100);
    assert_eq!(bench.get(8, 0), 0);
}

#[test]
fn position_reached_needs_rest_in_position_mode() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 10000");
    bench.advance_ms(100);
    let here = bench.get(1, 0);
    bench.ask(&format!("MVP ABS, 0, {here}"));
    assert_eq!((bench.get(8, 0), bench.get(0, 0)), (0, here));
    bench.arrive(0);
    assert_eq!(bench.get(1, 0), here);
}

#[test]
fn moves_across_the_end_of_the_counter_take_the_short_way() {
    for (start, offset, target) in
        [(i32::MAX - 100, 200, i32::MIN + 99), (i32::MIN + 100, -200, i32::MAX - 99), (i32::MAX, 1, i32::MIN)]
    {
        let mut bench = Bench::fast();
        bench.ask(&format!("SAP 1, 0, {start}"));
        bench.stage(0).recording = true;
        assert_eq!(bench.ask(&format!("MVP REL, 0, {offset}")), target);
        bench.arrive(0);
        assert_eq!(bench.get(1, 0), target);
        assert_eq!(bench.stage(0).phase, offset);
        let farthest = bench.stage(0).vectors.iter().map(|(phase, _)| phase.abs()).max();
        assert_eq!(farthest, Some(offset.abs()), "no more way than needed");
    }
    let mut bench = Bench::set_up("SAP 1, 0, 2147483600; MVP ABS, 0, -2147483600");
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (-2_147_483_600, 96));
}

#[test]
fn rotation_goes_on_across_the_end_of_the_counter() {
    let mut bench = Bench::fast();
    bench.all("SAP 1, 0, 2147483647; ROR 0, 10000");
    bench.advance_ms(100);
    assert!(bench.get(1, 0) < -2_147_480_000);
}

#[test]
fn target_speed_and_acceleration_change_while_moving() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 30000");
    bench.advance_ms(100);
    for command in ["MVP ABS, 0, -20000", "SAP 4, 0, 5000", "SAP 5, 0, 50000", "SAP 17, 0, 30000", "SAP 4, 0, 90000"] {
        bench.ask(command);
        bench.advance_ms(150);
    }
    assert_ne!(bench.get(3, 0), 0);
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (-20_000, -20_000));
}

#[test]
fn lower_top_speed_holds_at_once() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 1000000");
    bench.advance_ms(300);
    assert_eq!(bench.get(3, 0), 200_000);
    bench.ask("SAP 4, 0, 50000");
    bench.advance_ms(200);
    assert_eq!(bench.get(3, 0), 50_000);
}

#[test]
fn modes_change_while_moving() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 30000");
    bench.advance_ms(50);
    bench.ask("ROL 0, 1000");
    bench.advance_ms(500);
    assert_eq!((bench.get(3, 0), bench.get(0, 0)), (-1000, 30_000));
    bench.ask("MVP ABS, 0, 12");
    bench.arrive(0);
    assert_eq!(bench.get(1, 0), 12);
}

#[test]
fn writing_the_position_of_a_standing_motor_moves_nothing() {
    let mut bench = Bench::fast();
    bench.all("MVP ABS, 0, 500");
    bench.arrive(0);
    bench.ask("SAP 1, 0, -70000");
    bench.advance_ms(1000);
    assert_eq!((bench.get(1, 0), bench.get(0, 0), bench.get(8, 0)), (-70_000, -70_000, 1));
    assert_eq!(bench.stage(0).phase, 500);
}

#[test]
fn writing_the_position_of_a_moving_motor_leaves_its_target() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 100000");
    bench.advance_ms(100);
    bench.ask("SAP 1, 0, 50000");
    let phase = bench.stage(0).phase;
    assert_eq!(bench.get(0, 0), 100_000);
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (100_000, phase + 50_000));
}

// Groups.

#[test]
fn motion_commands_go_to_the_whole_group() {
    for (command, id, expected) in [
        ("ROR 0, 1000", Ap::TargetSpeed, [1000, 0, 1000]),
        ("ROL 2, 1000", Ap::TargetSpeed, [-1000, 0, -1000]),
        ("ROR 1, 1000", Ap::TargetSpeed, [0, 1000, 0]),
        ("MVP ABS, 0, 50", Ap::TargetPosition, [50, 0, 50]),
        ("MVP REL, 2, 50", Ap::TargetPosition, [150, 0, 350]),
        ("MVP COORD, 0, 5", Ap::TargetPosition, [10, 0, 30]),
        ("SAP 0, 0, 70", Ap::TargetPosition, [70, 0, 300]),
        ("SAP 2, 0, 70", Ap::TargetSpeed, [70, 0, 0]),
    ] {
        let mut bench = Bench::set_up(
            "SAP 249, 0, 9; SAP 249, 2, 9; SAP 1, 0, 100; SAP 1, 2, 300; SCO 5, 0, 10; SCO 5, 1, 20; SCO 5, 2, 30",
        );
        bench.ask(command);
        assert_eq!(bench.all_axes(id), expected, "{command}");
    }
}

#[test]
fn motor_stop_goes_to_the_whole_group() {
    let mut bench = Bench::set_up("ROR 0, 10; ROR 1, 20; ROR 2, 30; SAP 249, 0, 255; SAP 249, 1, 255; MST 1");
    assert_eq!(bench.all_axes(Ap::TargetSpeed), [0, 0, 30]);
}

/// A group of all motors, of which the last or the first cannot move: its closed loop still starts up.
fn group_that_cannot_move(axis: u8) -> Bench {
    let set_up = "SAP 249, 0, 9; SAP 249, 1, 9; SAP 249, 2, 9; SCO 5, 0, 10; SCO 5, 1, 20; SCO 5, 2, 30";
    let mut bench = Bench::set_up(set_up);
    bench.all(&format!("SAP 202, {axis}, 200; SAP 210, {axis}, 4000; SAP 129, {axis}, 1"));
    bench
}

#[test]
fn command_that_one_motor_refuses_starts_none() {
    for command in [
        "ROR 1, 1000",
        "ROL 1, 1000",
        "MVP ABS, 1, 5000",
        "MVP REL, 1, 5000",
        "MVP COORD, 1, 5",
        "MVP COORD, $87, 5",
        "MVP COORD, $47, 5",
        "RFS START, 1",
    ] {
        for refuses in [0, 2] {
            let mut bench = group_that_cannot_move(refuses);
            assert_eq!(bench.exchange(command).0, 6, "{command}");
            assert_eq!(bench.all_axes(Ap::TargetPosition), [0; 3], "{command}");
            assert_eq!(bench.all_axes(Ap::TargetSpeed), [0; 3], "{command}");
            assert_eq!(bench.ask("RFS STATUS, 1"), 0, "{command}");
            bench.advance_us(5_000);
            assert_eq!(bench.all_axes(Ap::ActualSpeed)[1], 0, "{command}");
        }
    }
}

#[test]
fn motor_stop_of_a_group_stops_all_that_turn_though_one_cannot() {
    let mut bench = Bench::set_up("ROR 0, 1000; ROR 1, 1000; SAP 249, 0, 9; SAP 249, 1, 9; SAP 249, 2, 9");
    bench.all("SAP 202, 2, 200; SAP 210, 2, 4000; SAP 129, 2, 1; MST 2");
    assert_eq!(bench.all_axes(Ap::TargetSpeed), [0; 3]);
}

#[test]
fn speed_that_one_motor_of_a_group_does_not_take_starts_none() {
    // In register units (255 = 0) a speed may be greater than in pps.
    let mut bench = Bench::set_up("SAP 249, 0, 9; SAP 249, 2, 9; SAP 255, 0, 0");
    assert_eq!(bench.exchange("ROR 0, 100000000").0, 4);
    assert_eq!(bench.all_axes(Ap::TargetSpeed), [0; 3]);
    bench.all("SAP 255, 2, 0; ROR 0, 100000000");
    assert_eq!(bench.all_axes(Ap::TargetSpeed), [100_000_000, 0, 100_000_000]);
}

#[test]
fn relative_move_of_a_group_replies_the_target_of_the_named_motor() {
    let mut bench = Bench::set_up("SAP 249, 0, 9; SAP 249, 2, 9; SAP 1, 0, 100; SAP 1, 2, 300");
    assert_eq!(bench.ask("MVP REL, 2, 50"), 350);
}

// Ramp types.

/// Time of a move of motor 0 from rest to rest, in ms.
fn duration_ms(settings: &str, distance: i32) -> f64 {
    let mut bench = Bench::set_up(settings);
    bench.ask(&format!("MVP ABS, 0, {distance}"));
    let us = bench.arrive(0);
    assert_eq!(bench.get(1, 0), distance, "{settings}");
    us as f64 / 1000.0
}

#[test]
fn s_shaped_ramp_takes_the_time_of_its_bows() {
    // The optimal times of double-S moves: distance, speed, acceleration, bow, seconds.
    for (distance, speed, acceleration, bow, seconds) in [
        (51_200, 51_200, 51_200, 51_200, 3.174802104),
        (51_200, 51_200, 51_200, 512_000, 2.102498439),
        (-51_200, 200_000, 400_000, 4_000_000, 0.822495675),
        (200_000, 300_000, 800_000, 8_000_000, 1.141666667),
    ] {
        for (bow, scale) in [(bow, 1), (bow / 100, 100)] {
            let bows: String = (22..=25).map(|number| format!("; SAP {number}, 0, {bow}")).collect();
            let settings = format!(
                "SAP 14, 0, 1; SAP 4, 0, {speed}; SAP 5, 0, {acceleration}; SAP 17, 0, {acceleration}{bows}; \
                 SAP 35, 0, {scale}"
            );
            let (found, wanted) = (duration_ms(&settings, distance), seconds * 1000.0);
            assert!((found - wanted).abs() <= 1.0 + 0.002 * wanted, "{settings}: {found} ms, not {wanted} ms");
        }
    }
}

#[test]
fn ramp_type_0_ignores_the_bows() {
    let settings = "SAP 4, 0, 51200; SAP 5, 0, 51200; SAP 17, 0, 51200; SAP 22, 0, 1000; SAP 25, 0, 1000";
    assert!((duration_ms(settings, 51_200) - 2000.0).abs() <= 1.0);
}

// Sleep.

#[test]
fn standing_module_sleeps() {
    let mut bench = Bench::fast();
    assert_eq!(bench.module.poll_at(), None);
    bench.ask("MVP ABS, 0, 1000");
    assert!(bench.module.poll_at().is_some());
    bench.advance_ms(5000);
    assert_eq!(bench.module.poll_at(), None);
}

#[test]
fn long_times_pass_at_once() {
    let mut bench = Bench::set_up("SAP 5, 0, 1000000; SAP 17, 0, 1000000; SAP 4, 0, 10; MVP ABS, 0, 100");
    bench.advance_ms(3_600_000);
    bench.advance_us(u64::from(u32::MAX) * 1_000_000);
    assert_eq!(bench.get(1, 0), 100);
}

#[test]
fn end_of_time_is_survived() {
    let mut bench = Bench::new();
    bench.module.poll(u64::MAX);
    assert_eq!(bench.module.poll_at(), None);
}
