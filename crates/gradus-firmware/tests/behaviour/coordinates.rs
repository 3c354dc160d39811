//! Coordinates, and moves of several motors to them (BEHAVIOUR 5).

use gradus_tmcl::catalogue::Ap;

use crate::support::Bench;

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
fn stored_coordinates_come_back_when_they_are_asked_for() {
    let zero = [0; 3];
    let (one, two) = ([11, 12, 13], [21, 22, 23]);
    for (commands, expected) in [
        ("", [zero, zero, zero]),
        ("SCO 0, 255, 0", [zero, one, two]),
        ("SCO 1, 255, 0", [zero, one, zero]),
        ("SCO 2, 255, 0", [zero, zero, two]),
    ] {
        let mut bench = Bench::set_up(&format!("{COORDINATES}; {commands}")).power_cycle();
        assert_eq!(coordinates(&mut bench), [zero; 3], "{commands:?}: nothing comes back by itself");
        bench.ask("GCO 0, 255");
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
    while samples.is_empty() || bench.all_axes(Ap::PositionReached) != [1; 3] {
        bench.advance_us(100);
        let turning = bench.all_axes(Ap::ActualSpeed).map(|speed| speed != 0);
        samples.push(Sample { positions: bench.positions(), turning });
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
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    assert_eq!(bench.ask("MVP COORD, $87, 1"), 1);
    let samples = sample(&mut bench);
    assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
    let [long, short, middle] = turning(&samples);
    assert!(long[0] == short[0] && short[0] == middle[0], "{:?}", turning(&samples));
    assert!(short[1] < middle[1] && middle[1] < long[1], "{:?}", turning(&samples));
}

#[test]
fn motors_of_a_mask_with_bit_6_arrive_in_the_same_tick() {
    for mask in ["$47", "$C7"] {
        let mut bench = Bench::fast();
        bench.all(TARGETS);
        bench.ask(&format!("MVP COORD, {mask}, 1"));
        let [first, second, third] = turning(&sample(&mut bench));
        assert!(first == second && second == third, "{first:?} {second:?} {third:?}");
        assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
    }
}

#[test]
fn interpolated_move_is_a_straight_line() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    for Sample { positions: [x, y, z], .. } in sample(&mut bench) {
        assert!((f64::from(x) / -4.0 - f64::from(y)).abs() <= 1.5, "{x} {y}");
        assert!((f64::from(x) * 0.4 - f64::from(z)).abs() <= 1.5, "{x} {z}");
    }
}

#[test]
fn interpolated_move_takes_as_long_as_the_longest_one_alone() {
    let mut bench = Bench::fast();
    bench.ask("MVP ABS, 0, 20000");
    let alone = sample(&mut bench).len();
    let mut bench = Bench::fast();
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
        let mut bench = Bench::fast();
        bench.all(TARGETS);
        bench.ask(&format!("MVP COORD, {mask}, 1"));
        sample(&mut bench);
        assert_eq!(bench.positions(), expected, "mask {mask}");
    }
}

#[test]
fn interpolated_move_with_nothing_to_do_is_at_its_end() {
    let mut bench = Bench::fast();
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(1);
    assert_eq!((bench.positions(), bench.all_axes(Ap::PositionReached)), ([0; 3], [1; 3]));
    assert_eq!(bench.module.poll_at().map(|at| at > bench.now + 1_000_000), None, "the axes sleep");
}

#[test]
fn motor_that_is_stopped_leaves_the_line_to_the_others() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(100);
    bench.ask("MST 1");
    bench.advance_ms(1000);
    let [x, y, z] = bench.positions();
    assert_eq!((x, z), (20_000, 8_000));
    assert!(y < -100 && y > -5_000, "{y}");
}

#[test]
fn motor_that_is_sent_elsewhere_leaves_the_line() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(100);
    bench.ask("MVP ABS, 0, 1000");
    sample(&mut bench);
    assert_eq!(bench.positions(), [1_000, -5_000, 8_000]);
}

#[test]
fn second_line_lets_the_first_one_end() {
    let mut bench = Bench::fast();
    bench.all("SCO 1, 0, 20000; SCO 1, 1, 0; SCO 1, 2, 8000; SCO 2, 1, 3000; SCO 2, 2, 9000");
    bench.ask("MVP COORD, $43, 1");
    bench.advance_ms(100);
    let speed = bench.get(3, 0);
    bench.ask("MVP COORD, $46, 2");
    bench.advance_us(100);
    assert!(bench.get(3, 0).abs_diff(speed) <= 201, "motor 0 goes on smoothly");
    sample(&mut bench);
    assert_eq!(bench.positions(), [20_000, 3_000, 9_000]);
}

/// Whether two axes keep the proportion of a line from one sample to the end.
fn is_straight(samples: &[Sample], [a, b]: [usize; 2]) -> bool {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return false };
    let way = |sample: &Sample, axis: usize| f64::from(sample.positions[axis] - first.positions[axis]);
    let proportion = way(last, b) / way(last, a);
    samples.iter().all(|sample| (way(sample, a) * proportion - way(sample, b)).abs() <= 1.5)
}

/// The samples from the first one on in which no axis turns.
fn from_rest(samples: &[Sample]) -> &[Sample] {
    let rest = samples.iter().position(|sample| sample.turning == [false; 3]).expect("they never rest");
    &samples[rest..]
}

#[test]
fn line_of_moving_motors_begins_when_all_have_come_to_rest() {
    for turning_motors in ["ROR 0, 50000", "ROR 0, 50000; ROL 1, 20000", "MVP ABS, 2, 30000; ROL 0, 40000; ROR 1, 900"]
    {
        let mut bench = Bench::fast();
        bench.all(TARGETS);
        bench.all(turning_motors);
        bench.advance_ms(100);
        assert_eq!(bench.ask("MVP COORD, $47, 1"), 1);
        assert_eq!(bench.all_axes(Ap::TargetPosition), [20_000, -5_000, 8_000]);
        assert_eq!(bench.all_axes(Ap::PositionReached), [0; 3]);
        let samples = sample(&mut bench);
        assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
        let line = from_rest(&samples);
        assert!(line.len() > 1000 && is_straight(line, [0, 1]) && is_straight(line, [0, 2]), "{turning_motors}");
        let [first, second, third] = self::turning(line);
        assert!(first == second && second == third, "{first:?} {second:?} {third:?}");
    }
}

#[test]
fn motors_come_to_rest_at_once_before_their_line() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.ask("ROR 0, 100000");
    bench.advance_ms(500);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(99);
    assert!(bench.get(3, 0) > 0, "100000 pps at 1000000 pps^2 take 100 ms to brake");
    assert_eq!(bench.positions()[1..], [0; 2], "the others wait");
    bench.advance_ms(10);
    assert!(bench.positions()[1] < 0 && bench.get(3, 0) < 0);
}

#[test]
fn motor_that_waits_for_its_line_has_not_arrived() {
    let mut bench = Bench::fast();
    bench.all("SCO 1, 0, 20000; SCO 1, 1, 0; SCO 1, 2, 0; ROR 0, 100000");
    bench.advance_ms(500);
    assert_eq!(bench.control(138, 0, 2), (100, 2));
    bench.ask("MVP COORD, $43, 1");
    bench.advance_ms(50);
    assert_eq!((bench.peek(1, Ap::PositionReached), bench.drain().len()), (0, 0), "motor 1 stands on its target");
    bench.advance_ms(100);
    assert_eq!((bench.peek(1, Ap::PositionReached), bench.drain().len()), (1, 1));
}

#[test]
fn command_takes_a_waiting_motor_out_of_its_line() {
    for (command, expected) in [("MST 1", 0), ("MVP ABS, 1, 300", 300), ("ROR 1, 0", 0)] {
        let mut bench = Bench::fast();
        bench.all(TARGETS);
        bench.ask("ROR 0, 100000");
        bench.advance_ms(500);
        bench.ask("MVP COORD, $47, 1");
        bench.advance_ms(10);
        bench.ask(command);
        bench.until(5_000, |bench| bench.peek(0, Ap::PositionReached) == 1 && bench.peek(2, Ap::PositionReached) == 1);
        assert_eq!(bench.positions(), [20_000, expected, 8_000], "{command}");
    }
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.ask("ROR 0, 100000");
    bench.advance_ms(500);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(10);
    bench.ask("MST 0");
    bench.advance_ms(1_000);
    let [x, y, z] = bench.positions();
    assert!(x > 20_000 && (y, z) == (-5_000, 8_000), "{x} {y} {z}: the line goes without the motor that left");
}

#[test]
fn line_of_other_motors_does_not_end_one_under_way() {
    let mut bench = Bench::fast();
    bench.all("SCO 1, 0, 20000; SCO 1, 1, -5000; SCO 2, 2, 30000");
    bench.ask("MVP COORD, $43, 1");
    bench.advance_ms(100);
    bench.ask("MVP COORD, $44, 2");
    let samples = sample(&mut bench);
    assert!(is_straight(&samples, [0, 1]));
    let [first, second, _] = turning(&samples);
    assert_eq!(first, second, "they arrive together");
    assert_eq!(bench.positions(), [20_000, -5_000, 30_000]);
}

#[test]
fn lines_can_be_as_many_as_motors() {
    let mut bench = Bench::fast();
    bench.all("SCO 1, 0, 20000; SCO 1, 1, -5000; SCO 1, 2, 8000; SCO 2, 0, -700; SCO 2, 1, 900");
    for command in ["$47, 1", "$44, 1", "$42, 1", "$41, 1", "$43, 2", "$44, 1", "$41, 1", "$42, 1"] {
        bench.ask(&format!("MVP COORD, {command}"));
        bench.advance_ms(30);
    }
    sample(&mut bench);
    assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
}

#[test]
fn stop_switch_in_the_way_of_a_waiting_motor_holds_it_and_lets_the_line_go() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.all("SAP 13, 1, 3; ROR 0, 100000");
    bench.stage(1).switches.left = true;
    bench.advance_ms(500);
    bench.ask("MVP COORD, $47, 1");
    bench.advance_ms(2_000);
    assert_eq!(bench.positions(), [20_000, 0, 8_000]);
    bench.stage(1).switches.left = false;
    bench.advance_ms(2_000);
    assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
}

#[test]
fn line_of_moving_motors_still_arrives() {
    let mut bench = Bench::fast();
    bench.all(TARGETS);
    bench.all("ROR 0, 10000");
    bench.advance_ms(100);
    bench.ask("MVP COORD, $47, 1");
    sample(&mut bench);
    assert_eq!(bench.positions(), [20_000, -5_000, 8_000]);
}
