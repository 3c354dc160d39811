//! Motion: commands, groups, coordinates, switches, ENABLE, heartbeats, events, coils, encoder (BEHAVIOUR 5).

use gradus_firmware::{Link, LinkKind, Switches};
use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Instruction, Opcode, Reply, Request, can};

use crate::support::{Bench, Memory, frame, instruction, request};

/// Short moves.
const FAST: &str = "SAP 4, 0, 200000; SAP 5, 0, 1000000; SAP 17, 0, 1000000; SAP 4, 1, 200000; SAP 5, 1, 1000000; \
                    SAP 17, 1, 1000000; SAP 4, 2, 200000; SAP 5, 2, 1000000; SAP 17, 2, 1000000";

const NOT_AVAILABLE: u8 = 6;

fn fast() -> Bench {
    Bench::set_up(FAST)
}

/// A parameter of all axes.
fn all_axes(bench: &mut Bench, id: Ap) -> [i32; 3] {
    [0, 1, 2].map(|axis| bench.peek(axis, id))
}

fn positions(bench: &mut Bench) -> [i32; 3] {
    all_axes(bench, Ap::ActualPosition)
}

// Velocity mode.

#[test]
fn ror_rol_and_mst_set_the_target_speed() {
    let mut bench = fast();
    for (command, speed) in [("ROR 1, 5000", 5000), ("ROL 1, 7000", -7000), ("ROR 1, -20", -20), ("MST 1", 0)] {
        bench.ask(command);
        assert_eq!(bench.get(2, 1), speed, "{command}");
        bench.advance_ms(1000);
        assert_eq!(bench.get(3, 1), speed, "{command}");
    }
    assert_eq!(all_axes(&mut bench, Ap::TargetSpeed), [0; 3]);
}

#[test]
fn target_speed_parameter_starts_velocity_mode() {
    let mut bench = fast();
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
    let mut bench = fast();
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
    assert_eq!(positions(&mut bench), [0, 77, 0]);
}

#[test]
fn target_position_parameter_starts_a_move() {
    let mut bench = fast();
    bench.ask("SAP 0, 2, -800");
    bench.arrive(2);
    assert_eq!(positions(&mut bench), [0, 0, -800]);
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
    let mut bench = fast();
    bench.ask("ROR 0, 1000");
    bench.advance_ms(500);
    let actual = bench.get(1, 0);
    assert_eq!(bench.ask("MVP REL, 0, 100"), actual + 100);
    assert_eq!(bench.ask("MVP REL, 0, 100"), actual + 200);
}

#[test]
fn position_reached_is_told_by_parameter_8() {
    let mut bench = fast();
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
    let mut bench = fast();
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
        let mut bench = fast();
        bench.ask(&format!("SAP 1, 0, {start}"));
        bench.stage(0).recording = true;
        assert_eq!(bench.ask(&format!("MVP REL, 0, {offset}")), target);
        bench.arrive(0);
        assert_eq!(bench.get(1, 0), target);
        assert_eq!(bench.stage(0).phase, offset, "no more way than {offset}");
    }
    let mut bench = Bench::set_up("SAP 1, 0, 2147483600; MVP ABS, 0, -2147483600");
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (-2_147_483_600, 96));
}

#[test]
fn rotation_goes_on_across_the_end_of_the_counter() {
    let mut bench = fast();
    bench.all("SAP 1, 0, 2147483647; ROR 0, 10000");
    bench.advance_ms(100);
    assert!(bench.get(1, 0) < -2_147_480_000);
}

#[test]
fn target_speed_and_acceleration_change_while_moving() {
    let mut bench = fast();
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
    let mut bench = fast();
    bench.ask("MVP ABS, 0, 1000000");
    bench.advance_ms(300);
    assert_eq!(bench.get(3, 0), 200_000);
    bench.ask("SAP 4, 0, 50000");
    bench.advance_ms(200);
    assert_eq!(bench.get(3, 0), 50_000);
}

#[test]
fn modes_change_while_moving() {
    let mut bench = fast();
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
    let mut bench = fast();
    bench.all("MVP ABS, 0, 500");
    bench.arrive(0);
    bench.ask("SAP 1, 0, -70000");
    bench.advance_ms(1000);
    assert_eq!((bench.get(1, 0), bench.get(0, 0), bench.get(8, 0)), (-70_000, -70_000, 1));
    assert_eq!(bench.stage(0).phase, 500);
}

#[test]
fn writing_the_position_of_a_moving_motor_leaves_its_target() {
    let mut bench = fast();
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
        assert_eq!(all_axes(&mut bench, id), expected, "{command}");
    }
}

#[test]
fn motor_stop_goes_to_the_whole_group() {
    let mut bench = Bench::set_up("ROR 0, 10; ROR 1, 20; ROR 2, 30; SAP 249, 0, 255; SAP 249, 1, 255; MST 1");
    assert_eq!(all_axes(&mut bench, Ap::TargetSpeed), [0, 0, 30]);
}

#[test]
fn relative_move_of_a_group_replies_the_target_of_the_named_motor() {
    let mut bench = Bench::set_up("SAP 249, 0, 9; SAP 249, 2, 9; SAP 1, 0, 100; SAP 1, 2, 300");
    assert_eq!(bench.ask("MVP REL, 2, 50"), 350);
}

// Coordinates.

#[test]
fn coordinates_are_set_captured_and_read() {
    let mut bench = Bench::set_up("SAP 1, 1, 4321");
    for number in 0..21 {
        bench.ask(&format!("SCO {number}, 2, {}", 100 - number));
    }
    for number in 0..21 {
        assert_eq!(bench.ask(&format!("GCO {number}, 2")), 100 - number);
        assert_eq!(bench.ask(&format!("GCO {number}, 0")), 0);
    }
    bench.all("CCO 20, 1; CALC LOAD, -6; ACO 0, 1");
    assert_eq!((bench.ask("GCO 20, 1"), bench.ask("GCO 0, 1")), (4321, -6));
}

/// Sets coordinates 0 to 2 of all axes to number * 10 + axis + 1.
const COORDINATES: &str = "SCO 0, 0, 1; SCO 0, 1, 2; SCO 0, 2, 3; SCO 1, 0, 11; SCO 1, 1, 12; SCO 1, 2, 13; \
                           SCO 2, 0, 21; SCO 2, 1, 22; SCO 2, 2, 23";

fn coordinates(bench: &mut Bench) -> [[i32; 3]; 3] {
    [0, 1, 2].map(|number| [0, 1, 2].map(|axis| bench.ask(&format!("GCO {number}, {axis}"))))
}

#[test]
fn coordinates_are_lost_at_power_off_unless_stored() {
    let zero = [0; 3];
    let (one, two) = ([11, 12, 13], [21, 22, 23]);
    for (commands, expected) in [
        ("", [zero, zero, zero]),
        ("SCO 0, 255, 0", [zero, one, two]),
        ("SCO 1, 255, 0", [zero, one, zero]),
        ("SCO 2, 255, 0", [zero, zero, two]),
    ] {
        let mut bench = Bench::set_up(&format!("{COORDINATES}; {commands}")).power_cycle();
        assert_eq!(coordinates(&mut bench), expected, "{commands:?}");
    }
}

#[test]
fn global_parameter_84_stores_coordinates_as_they_are_written() {
    let mut bench = Bench::set_up(&format!("SGP 84, 0, 1; {COORDINATES}; SAP 1, 1, 99; CCO 1, 1; CALC LOAD, 98"));
    bench.all("ACO 2, 2");
    assert_eq!(coordinates(&mut bench.power_cycle()), [[0; 3], [11, 99, 13], [21, 22, 98]]);
}

#[test]
fn gco_255_reads_coordinates_from_the_eeprom() {
    for (command, expected) in
        [("GCO 0, 255", [[5; 3], [11, 12, 13], [21, 22, 23]]), ("GCO 2, 255", [[5; 3], [5; 3], [21, 22, 23]])]
    {
        let mut bench = Bench::set_up(&format!("{COORDINATES}; SCO 0, 255, 0"));
        for number in 0..3 {
            bench.all(&format!("SCO {number}, 0, 5; SCO {number}, 1, 5; SCO {number}, 2, 5"));
        }
        bench.ask(command);
        assert_eq!(coordinates(&mut bench), expected, "{command}");
    }
}

// Several motors.

const TARGETS: &str = "SCO 1, 0, 20000; SCO 1, 1, -5000; SCO 1, 2, 8000";

/// What a control tick shows of all axes.
struct Sample {
    positions: [i32; 3],
    turning: [bool; 3],
}

/// All control ticks until the last axis has arrived.
fn sample(bench: &mut Bench) -> Vec<Sample> {
    let mut samples: Vec<Sample> = Vec::new();
    while samples.is_empty() || all_axes(bench, Ap::PositionReached) != [1; 3] {
        bench.advance_us(100);
        let turning = all_axes(bench, Ap::DriverErrorFlags).map(|flags| flags & 128 == 0);
        samples.push(Sample { positions: positions(bench), turning });
        assert!(samples.len() < 100_000, "they never arrive");
    }
    samples
}

/// The first and the last tick in which each axis turns.
fn turning(samples: &[Sample]) -> [[Option<usize>; 2]; 3] {
    [0, 1, 2].map(|axis| {
        let turns = |sample: &Sample| sample.turning[axis];
        [samples.iter().position(turns), samples.iter().rposition(turns)]
    })
}

#[test]
fn motors_of_a_mask_with_bit_7_start_together_on_their_own_ramps() {
    let mut bench = fast();
    bench.all(TARGETS);
    assert_eq!(bench.ask("MVP COORD, $87, 1"), 1);
    let samples = sample(&mut bench);
    assert_eq!(positions(&mut bench), [20_000, -5_000, 8_000]);
    let [long, short, middle] = turning(&samples);
    assert!(long[0] == short[0] && short[0] == middle[0], "{:?}", turning(&samples));
    assert!(short[1] < middle[1] && middle[1] < long[1], "{:?}", turning(&samples));
}

#[test]
fn motors_of_a_mask_with_bit_6_arrive_in_the_same_tick() {
    for mask in ["$47", "$C7"] {
        let mut bench = fast();
        bench.all(TARGETS);
        bench.ask(&format!("MVP COORD, {mask}, 1"));
        let [first, second, third] = turning(&sample(&mut bench));
        assert!(first == second && second == third, "{first:?} {second:?} {third:?}");
        assert_eq!(positions(&mut bench), [20_000, -5_000, 8_000]);
    }
}

#[test]
fn interpolated_move_is_a_straight_line() {
    let mut bench = fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    for Sample { positions: [x, y, z], .. } in sample(&mut bench) {
        assert!((f64::from(x) / -4.0 - f64::from(y)).abs() <= 1.5, "{x} {y}");
        assert!((f64::from(x) * 0.4 - f64::from(z)).abs() <= 1.5, "{x} {z}");
    }
}

#[test]
fn interpolated_move_takes_as_long_as_the_longest_one_alone() {
    let mut bench = fast();
    bench.ask("MVP ABS, 0, 20000");
    let alone = sample(&mut bench).len();
    let mut bench = fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    let together = sample(&mut bench).len();
    assert!(alone.abs_diff(together) <= 2, "{alone} ticks alone, {together} together");
}

#[test]
fn mask_names_the_motors_that_move() {
    for (mask, expected) in
        [("$81", [20_000, 0, 0]), ("$86", [0, -5_000, 8_000]), ("$42", [0, -5_000, 0]), ("$45", [20_000, 0, 8_000])]
    {
        let mut bench = fast();
        bench.all(TARGETS);
        bench.ask(&format!("MVP COORD, {mask}, 1"));
        sample(&mut bench);
        assert_eq!(positions(&mut bench), expected, "mask {mask}");
    }
}

#[test]
fn interpolated_move_with_nothing_to_do_is_at_its_end() {
    let mut bench = fast();
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(1);
    assert_eq!((positions(&mut bench), all_axes(&mut bench, Ap::PositionReached)), ([0; 3], [1; 3]));
    assert_eq!(bench.module.poll_at().map(|at| at > bench.now + 1_000_000), None, "the axes sleep");
}

#[test]
fn motor_that_is_stopped_leaves_the_line_to_the_others() {
    let mut bench = fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(100);
    bench.ask("MST 1");
    bench.advance_ms(1000);
    let [x, y, z] = positions(&mut bench);
    assert_eq!((x, z), (20_000, 8_000));
    assert!(y < -100 && y > -5_000, "{y}");
}

#[test]
fn motor_that_is_sent_elsewhere_leaves_the_line() {
    let mut bench = fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(100);
    bench.ask("MVP ABS, 0, 1000");
    sample(&mut bench);
    assert_eq!(positions(&mut bench), [1_000, -5_000, 8_000]);
}

#[test]
fn second_line_lets_the_first_one_end() {
    let mut bench = fast();
    bench.all("SCO 1, 0, 20000; SCO 1, 1, 0; SCO 1, 2, 8000; SCO 2, 1, 3000; SCO 2, 2, 9000");
    bench.ask("MVP COORD, $43, 1");
    bench.advance_ms(100);
    let speed = bench.get(3, 0);
    bench.ask("MVP COORD, $46, 2");
    bench.advance_us(100);
    assert!(bench.get(3, 0).abs_diff(speed) <= 201, "motor 0 goes on smoothly");
    sample(&mut bench);
    assert_eq!(positions(&mut bench), [20_000, 3_000, 9_000]);
}

#[test]
fn line_of_moving_motors_still_arrives() {
    let mut bench = fast();
    bench.all(TARGETS);
    bench.all("ROR 0, 10000");
    bench.advance_ms(100);
    bench.ask("MVP COORD, $47, 1");
    sample(&mut bench);
    assert_eq!(positions(&mut bench), [20_000, -5_000, 8_000]);
}

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
        // Swapped.
        ("SAP 12, 0, 3; SAP 33, 0, 1", false, true, 10_000, true),
        ("SAP 12, 0, 3; SAP 33, 0, 1", true, true, 10_000, false),
        ("SAP 13, 0, 3; SAP 33, 0, 1", true, true, -10_000, true),
    ] {
        let mut bench = fast();
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
    let mut bench = fast();
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
    let mut bench = fast();
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
fn stopped_motor_stays_when_the_switch_opens_after_mst() {
    let mut bench = fast();
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
        let mut bench = fast();
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

// ENABLE.

#[test]
fn enable_low_switches_the_drivers_off_and_refuses_motion() {
    let mut bench = fast();
    bench.all("ROR 0, 10000; MVP ABS, 1, 100000");
    bench.advance_ms(100);
    bench.board().enable = false;
    bench.advance_ms(1);
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [0; 3]);
    assert_eq!(all_axes(&mut bench, Ap::ActualSpeed), [0; 3]);
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
    let mut bench = fast();
    bench.all("ROR 0, 10000; MVP ABS, 1, 100000");
    bench.advance_ms(100);
    bench.board().enable = false;
    bench.advance_ms(1);
    let stopped = positions(&mut bench);
    bench.board().enable = true;
    bench.advance_ms(1000);
    assert_eq!(positions(&mut bench), stopped);
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [32; 3]);
    bench.ask("MVP ABS, 1, 10");
    bench.arrive(1);
    assert_eq!(bench.get(1, 1), 10);
}

#[test]
fn module_that_starts_disabled_has_its_drivers_off() {
    let mut machine = crate::support::Machine::default();
    machine.board.enable = false;
    let mut bench = Bench::with(machine, Memory::blank(0));
    assert_eq!([0, 1, 2].map(|axis| bench.stage(axis).current), [0; 3]);
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
    let mut bench = fast();
    bench.all("SGP 68, 0, 100; ROR 0, 10000; MVP ABS, 2, 1000000");
    bench.advance_us(99_999);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 10_000);
    bench.ask("GIO 0, 0");
    bench.advance_us(99_999);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 10_000, "the command has started the time again");
    bench.advance_us(2);
    assert_eq!(bench.peek(0, Ap::TargetSpeed), 0);
    bench.advance_ms(1000);
    assert_eq!(all_axes(&mut bench, Ap::ActualSpeed), [0; 3]);
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

// Events.

/// The event of command 138 with its mask.
fn event(mask: i32) -> [u8; 9] {
    let status = gradus_tmcl::Status::POSITION_REACHED;
    Reply { host: 2, module: 1, status, command: Opcode::POSITION_EVENT, value: mask }.emit()
}

#[test]
fn event_is_confirmed_at_once_and_comes_when_all_motors_have_arrived() {
    let mut bench = fast();
    assert_eq!(bench.control(138, 0, 5), (100, 5));
    bench.all("MVP ABS, 0, 1000; MVP ABS, 2, 5000; MVP ABS, 1, 100000");
    bench.arrive(0);
    assert!(bench.drain().is_empty(), "motor 2 is still under way");
    bench.arrive(2);
    assert_eq!(bench.drain(), [event(5)], "motor 1 does not count");
    bench.advance_ms(5000);
    assert!(bench.drain().is_empty());
}

#[test]
fn event_counts_only_the_motors_that_were_moved() {
    let mut bench = fast();
    bench.control(138, 0, 7);
    bench.ask("MVP ABS, 1, 1000");
    bench.arrive(1);
    assert_eq!(bench.drain(), [event(7)]);
}

#[test]
fn event_of_type_0_comes_for_the_next_move_only_and_of_type_1_for_every_one() {
    for (kind, moves) in [(0, 1), (1, 3)] {
        let mut bench = fast();
        bench.control(138, kind, 1);
        let mut events = 0;
        for target in [1000, 2000, 3000] {
            bench.ask(&format!("MVP ABS, 0, {target}"));
            bench.advance_ms(1000);
            events += bench.drain().len();
        }
        assert_eq!(events, moves, "type {kind}");
    }
}

#[test]
fn event_comes_for_a_move_to_where_the_motor_is() {
    let mut bench = Bench::new();
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 0");
    bench.advance_ms(1);
    assert_eq!(bench.drain(), [event(1)]);
}

#[test]
fn event_goes_to_the_link_that_asked() {
    let mut bench = fast();
    let mut other = Link::new(2, LinkKind::Usb, 0);
    let ask = request(Instruction::new(Opcode::POSITION_EVENT, 1, 0, 2)).emit();
    bench.module.receive(&mut other, &ask);
    assert!(bench.module.transmit(&mut other).is_some());
    bench.control(138, 1, 1);
    bench.all("MVP ABS, 0, 1000; MVP ABS, 1, 2000");
    bench.advance_ms(1000);
    assert_eq!(bench.drain(), [event(1)]);
    assert_eq!(bench.module.transmit(&mut other), Some(event(2)));
    assert_eq!(bench.module.transmit(&mut other), None);
}

#[test]
fn event_on_can() {
    let mut bench = fast();
    let mut link = Link::new(2, LinkKind::Can, 0);
    let ask = Instruction::new(Opcode::POSITION_EVENT, 0, 0, 1);
    bench.module.receive_frame(&mut link, &can::Frame::request(1, &ask));
    assert!(bench.module.transmit_frame(&mut link).is_some());
    bench.ask("MVP ABS, 0, 1000");
    bench.advance_ms(1000);
    let frame = bench.module.transmit_frame(&mut link).unwrap();
    assert_eq!((frame.id, frame.data()), (2, &[1, 128, 138, 0, 0, 0, 1][..]));
}

#[test]
fn mask_0_takes_a_request_back() {
    let mut bench = fast();
    bench.control(138, 1, 1);
    assert_eq!(bench.control(138, 1, 0), (100, 0));
    bench.ask("MVP ABS, 0, 1000");
    bench.advance_ms(1000);
    assert!(bench.drain().is_empty());
}

#[test]
fn event_waits_until_a_stopped_motor_arrives() {
    let mut bench = fast();
    bench.control(138, 0, 1);
    bench.ask("MVP ABS, 0, 10000");
    bench.advance_ms(50);
    bench.ask("MST 0");
    bench.advance_ms(500);
    assert!(bench.drain().is_empty());
    bench.ask("MVP ABS, 0, 20");
    bench.advance_ms(500);
    assert_eq!(bench.drain(), [event(1)]);
}

// Currents and coils.

#[test]
fn current_follows_motion() {
    let mut bench = fast();
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
        let mut bench = fast();
        bench.all(&format!("SAP 214, 0, {delay}; MVP ABS, 0, 1000"));
        bench.arrive(0);
        let took = bench.until(10_000, |bench| bench.stage(0).current == 32);
        assert!(took.abs_diff(milliseconds * 1000) <= 200, "{took} us for {delay}");
    }
}

#[test]
fn currents_hold_at_once() {
    let mut bench = fast();
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
    let mut bench = fast();
    bench.ask("MVP ABS, 0, 1000");
    bench.arrive(0);
    bench.all("SAP 6, 0, 90; SAP 7, 0, 60");
    assert_eq!(bench.stage(0).current, 90);
    bench.advance_ms(3000);
    assert_eq!(bench.stage(0).current, 60);
}

#[test]
fn boost_current_while_accelerating_and_decelerating() {
    let mut bench = fast();
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
        let mut bench = fast();
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
        let mut bench = fast();
        bench.all(&format!("SAP 140, 0, {resolution}; MVP ABS, 0, -300"));
        bench.arrive(0);
        assert_eq!(bench.stage(0).phase, -300 * (256 >> resolution), "resolution {resolution}");
    }
}

#[test]
fn reverse_shaft_turns_the_coil_vector_the_other_way() {
    let mut bench = fast();
    bench.all("SAP 251, 0, 1; MVP ABS, 0, 300");
    bench.arrive(0);
    assert_eq!((bench.get(1, 0), bench.stage(0).phase), (300, -300));
}

#[test]
fn coil_vector_never_jumps_when_a_setting_changes() {
    let mut bench = fast();
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
    let mut machine = crate::support::Machine::default();
    machine.axes[1].encoder = 777;
    assert_eq!(Bench::with(machine, Memory::blank(0)).get(209, 1), 0);
}

#[test]
fn deviation_stops_the_motor_where_the_encoder_is() {
    let mut bench = fast();
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
fn error_flags_are_cleared_by_the_next_motion_command() {
    for command in ["ROR 0, 0", "MVP REL, 0, 0", "MST 0"] {
        let mut bench = fast();
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
        let mut bench = fast();
        bench.all(&format!("SAP 181, 0, 1000; ROR 0, {speed}"));
        bench.advance_ms(100);
        bench.stage(0).driver.flags = 1;
        bench.advance_ms(1);
        assert_eq!(bench.get(3, 0) == 0, stops, "{speed} pps");
        assert_eq!(bench.get(207, 0), i32::from(stops));
    }
}

#[test]
fn driver_load_and_flags_can_be_read() {
    let mut bench = Bench::new();
    bench.stage(2).driver = gradus_firmware::DriverState { load: 321, flags: 6 };
    assert_eq!((bench.get(206, 2), bench.get(208, 2)), (321, 6 | 128));
    bench.ask("ROR 2, 1000");
    bench.advance_ms(10);
    assert_eq!(bench.get(208, 2), 6, "no standstill");
}

// Sleep.

#[test]
fn standing_module_sleeps() {
    let mut bench = fast();
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
