//! Reference search on a rigid machine: every mode from everywhere, and everything that can end a search.
//!
//! Positions are those of the machine, in microsteps. AP 195 is 5120 pps, which is 0.5 microsteps a tick, so that a zero point
//! is right to one microstep.

mod travel;

use gradus_firmware::Switches;
use travel::{Area, Bench, NOWHERE, Slide};

const TOLERANCE: i32 = 1;

const SPEEDS: &str = "SAP 5, 0, 1024000; SAP 17, 0, 1024000; SAP 194, 0, 51200; SAP 195, 0, 5120";

/// Bits of AP 207.
const STALLED: i32 = 1;
const NOT_FOUND: i32 = 4;

/// The middles of the switches.
const LEFT: i32 = 0;
const HOME: i32 = 10_000;
const RIGHT: i32 = 20_000;

/// Where a search may start: left of all switches, on each, between them, right of them.
const LEFT_OF_ALL: i32 = -3_000;
const LEFT_OF_HOME: i32 = 5_000;
const RIGHT_OF_HOME: i32 = 15_000;
const RIGHT_OF_ALL: i32 = 23_000;
const STARTS: [i32; 7] = [LEFT_OF_ALL, LEFT, LEFT_OF_HOME, HOME, RIGHT_OF_HOME, RIGHT, RIGHT_OF_ALL];

/// Half widths of the switches. The rough search overruns the narrow ones when it brakes with the ramp.
const NARROW: i32 = 50;
const WIDE: i32 = 1_000;

fn around(middle: i32, half: i32) -> Area {
    middle - half..=middle + half
}

/// A slide with all three switches, blocked far outside them.
fn slide(half: i32) -> Slide {
    Slide {
        left: around(LEFT, half),
        right: around(RIGHT, half),
        home: around(HOME, half),
        free: -10_000..=30_000,
        ..Slide::default()
    }
}

/// A bench before a search of a mode.
fn bench(slide: Slide, mode: i32) -> Bench {
    let mut bench = Bench::new(slide);
    bench.all(SPEEDS);
    bench.all(&format!("SAP 181, 0, 1; SAP 193, 0, {mode}"));
    bench
}

/// A bench after a search.
fn search(slide: Slide, mode: i32, setup: &str) -> Bench {
    let mut bench = bench(slide, mode);
    bench.all(setup);
    bench.ask("RFS START, 0");
    bench.finish();
    bench
}

#[track_caller]
fn assert_near(got: i32, want: i32, what: &str) {
    assert!((got - want).abs() <= TOLERANCE, "{what}: {got}, not {want}");
}

/// Checks everything that a search that has found zero leaves behind.
#[track_caller]
fn assert_found(bench: &mut Bench, zero: i32, what: &str) {
    assert_eq!(bench.get(207), 0, "{what}: error flags");
    assert_near(bench.zero(), zero, what);
    for (parameter, name) in [(0, "target"), (1, "position"), (2, "target speed"), (3, "speed"), (209, "encoder")] {
        assert_eq!(bench.get(parameter), 0, "{what}: {name}");
    }
    assert_eq!(bench.get(8), 1, "{what}: position reached");
    let inwards = if zero > HOME { -5_000 } else { 5_000 };
    bench.all(&format!("MVP ABS, 0, {inwards}"));
    bench.advance_ms(300);
    // A count is 12.5 microsteps.
    assert!((bench.get(209) - inwards).abs() <= 13, "{what}: encoder goes along");
}

/// What a mode ends with from a starting point, in the manual's words of section 6.1.
struct Expectation {
    mode: i32,
    /// Zero when switches have this half width.
    zero: fn(i32) -> i32,
    /// Starting points from which the search meets no switch on its way.
    hopeless: &'static [i32],
    /// Distance between the end switches when the mode measures it.
    distance: Option<fn(i32) -> i32>,
}

const fn row(
    mode: i32,
    zero: fn(i32) -> i32,
    hopeless: &'static [i32],
    distance: Option<fn(i32) -> i32>,
) -> Expectation {
    Expectation { mode, zero, hopeless, distance }
}

const EXPECTATIONS: &[Expectation] = &[
    row(1, |half| LEFT + half, &[LEFT_OF_ALL], None),
    row(2, |half| LEFT + half, &[RIGHT_OF_ALL], Some(|half| RIGHT - LEFT - 2 * half)),
    row(3, |_| LEFT, &[RIGHT_OF_ALL], Some(|half| RIGHT - LEFT - half)),
    row(4, |_| LEFT, &[LEFT_OF_ALL], None),
    row(5, |_| HOME, &[LEFT_OF_ALL], None),
    row(6, |_| HOME, &[RIGHT_OF_ALL], None),
    row(7, |_| HOME, &[RIGHT_OF_HOME, RIGHT, RIGHT_OF_ALL], None),
    row(8, |_| HOME, &[LEFT_OF_ALL, LEFT, LEFT_OF_HOME], None),
    row(65, |half| RIGHT - half, &[RIGHT_OF_ALL], None),
    row(66, |half| RIGHT - half, &[LEFT_OF_ALL], Some(|half| RIGHT - LEFT - 2 * half)),
    row(67, |_| RIGHT, &[LEFT_OF_ALL], Some(|half| RIGHT - LEFT - half)),
    row(68, |_| RIGHT, &[RIGHT_OF_ALL], None),
    row(133, |_| HOME, &[LEFT_OF_ALL], None),
    row(134, |_| HOME, &[RIGHT_OF_ALL], None),
    row(135, |_| HOME, &[RIGHT_OF_HOME, RIGHT, RIGHT_OF_ALL], None),
    row(136, |_| HOME, &[LEFT_OF_ALL, LEFT, LEFT_OF_HOME], None),
];

/// What end switches do; a soft stop overruns a narrow switch.
const HARD_STOP: &str = "SAP 34, 0, 0";
const SOFT_STOP: &str = "SAP 34, 0, 1; SAP 21, 0, 1024000";

fn check_everywhere(half: i32, stop: &str) {
    for row in EXPECTATIONS {
        for start in STARTS {
            let what = format!("mode {} from {start}, half width {half}, {stop}", row.mode);
            let released = Switches { home: row.mode >= 128, ..Switches::default() };
            let mut bench = search(Slide { start, released, ..slide(half) }, row.mode, stop);
            if row.hopeless.contains(&start) {
                assert_eq!(bench.get(207), STALLED | NOT_FOUND, "{what}");
                continue;
            }
            assert_near(bench.get(197), (row.zero)(half) - start, &what);
            let distance = row.distance.map_or(0, |distance| distance(half));
            assert!((bench.get(196) - distance).abs() <= 2 * TOLERANCE, "{what}: distance {}", bench.get(196));
            assert_found(&mut bench, (row.zero)(half), &what);
        }
    }
}

#[test]
fn wide_switches_are_found_from_everywhere() {
    check_everywhere(WIDE, HARD_STOP);
}

#[test]
fn narrow_switches_are_found_from_everywhere() {
    check_everywhere(NARROW, HARD_STOP);
}

#[test]
fn overrun_switches_are_found_from_everywhere() {
    check_everywhere(NARROW, SOFT_STOP);
}

#[test]
fn bouncing_switches_are_found() {
    for row in EXPECTATIONS {
        let bounce = 30;
        let released = Switches { home: row.mode >= 128, ..Switches::default() };
        let start = if row.mode == 8 || row.mode == 136 { RIGHT_OF_HOME } else { LEFT_OF_HOME };
        let mut bench = search(Slide { start, bounce, released, ..slide(WIDE) }, row.mode, "");
        assert_found(&mut bench, (row.zero)(WIDE), &format!("mode {}", row.mode));
    }
}

#[test]
fn shaft_that_rings_over_an_edge_for_long_finds_the_middle() {
    // The switch flickers for 40 ms after each change, as it does when a hard stop lets a motor ring.
    for (mode, zero) in [(3, LEFT), (4, LEFT), (67, RIGHT), (68, RIGHT), (7, HOME), (8, HOME)] {
        let start = if mode == 8 { RIGHT_OF_HOME } else { LEFT_OF_HOME };
        let mut bench = search(Slide { start, bounce: 400, ..slide(WIDE) }, mode, HARD_STOP);
        assert_found(&mut bench, zero, &format!("mode {mode}"));
    }
}

#[test]
fn shaft_that_comes_to_rest_outside_of_the_switch_goes_back_in() {
    for (mode, zero, shift) in [(1, LEFT + WIDE, -20), (4, LEFT, -20), (65, RIGHT - WIDE, 20), (68, RIGHT, 20)] {
        let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, mode);
        bench.all(HARD_STOP);
        bench.ask("RFS START, 0");
        while bench.ask("RFS STATUS, 0") < 2 {
            bench.advance_ms(1);
        }
        let slide = bench.slide(0);
        (slide.left, slide.right) = (around(LEFT + shift, WIDE), around(RIGHT + shift, WIDE));
        bench.finish();
        assert_found(&mut bench, zero + shift, &format!("mode {mode}"));
    }
}

#[test]
fn switch_that_never_comes_to_rest_fails() {
    let mut bench = search(Slide { start: HOME, bounce: u32::MAX, ..slide(WIDE) }, 4, HARD_STOP);
    assert_eq!((bench.get(207), bench.get(3)), (NOT_FOUND, 0));
}

#[test]
fn speeds_and_directions_of_the_legs_are_those_of_the_parameters() {
    for (mode, start, rough, exact) in
        [(1, HOME, -51_200, 5_120), (65, HOME, 51_200, -5_120), (7, LEFT, 51_200, -5_120), (8, RIGHT, -51_200, 5_120)]
    {
        let mut bench = bench(Slide { start, ..slide(WIDE) }, mode);
        bench.all(SOFT_STOP);
        bench.ask("RFS START, 0");
        let mut speeds = vec![];
        // The fourth stage is the move to zero.
        while bench.ask("RFS STATUS, 0") < 4 {
            bench.advance_ms(1);
            speeds.push(bench.get(3));
        }
        let extremes = (*speeds.iter().min().unwrap(), *speeds.iter().max().unwrap());
        assert_eq!(extremes, (rough.min(exact), rough.max(exact)), "mode {mode}");
        let first = speeds.iter().find(|speed| **speed != 0).unwrap();
        assert_eq!(first.signum(), rough.signum(), "mode {mode}");
    }
}

#[test]
fn status_counts_the_legs() {
    let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 2);
    let mut stages = vec![bench.ask("RFS STATUS, 0")];
    bench.ask("RFS START, 0");
    loop {
        let stage = bench.ask("RFS STATUS, 0");
        if stages.last() != Some(&stage) {
            stages.push(stage);
        }
        if stage == 0 {
            break;
        }
        bench.advance_ms(1);
    }
    assert_eq!(stages, [0, 1, 2, 3, 4, 5, 6, 0]);
}

// Polarity and exchange of switches.

#[test]
fn polarity_of_end_switches_is_that_of_their_stop_function() {
    let high = Switches { left: true, right: true, home: false };
    for (mode, zero) in [(1, LEFT + WIDE), (65, RIGHT - WIDE), (2, LEFT + WIDE), (5, HOME), (6, HOME)] {
        for (setup, released) in
            [("SAP 12, 0, 1; SAP 13, 0, 1", high), ("SAP 12, 0, 3; SAP 13, 0, 3", Switches::default())]
        {
            let start = if mode == 5 { LEFT_OF_HOME } else { RIGHT_OF_HOME };
            let mut bench = search(Slide { start, released, ..slide(WIDE) }, mode, setup);
            assert_found(&mut bench, zero, &format!("mode {mode}, {setup}"));
        }
    }
}

#[test]
fn search_does_not_care_whether_the_stop_functions_are_on() {
    let high = Switches { left: true, right: true, home: false };
    for (on, off, released) in [
        ("SAP 12, 0, 3; SAP 13, 0, 3", "SAP 12, 0, 0; SAP 13, 0, 0", Switches::default()),
        ("SAP 12, 0, 1; SAP 13, 0, 1", "SAP 12, 0, 0; SAP 13, 0, 0", high),
    ] {
        for (mode, zero) in [(1, LEFT + WIDE), (65, RIGHT - WIDE), (2, LEFT + WIDE), (4, LEFT), (6, HOME)] {
            for setup in [on.to_owned(), format!("{on}; {off}")] {
                let mut bench = search(Slide { start: RIGHT_OF_HOME, released, ..slide(WIDE) }, mode, &setup);
                assert_near(bench.zero(), zero, &format!("mode {mode}, {setup}"));
                assert_eq!(bench.get(207), 0, "mode {mode}, {setup}");
            }
        }
    }
}

#[test]
fn swapped_end_switches_take_their_levels_along() {
    // The left input is normally closed and at the right end.
    let released = Switches { left: true, ..Switches::default() };
    let crossed = Slide { start: HOME, left: around(RIGHT, WIDE), right: around(LEFT, WIDE), released, ..slide(WIDE) };
    for (mode, zero) in [(1, LEFT + WIDE), (65, RIGHT - WIDE), (3, LEFT), (6, HOME)] {
        let mut bench = search(crossed.clone(), mode, "SAP 12, 0, 3; SAP 13, 0, 1; SAP 33, 0, 1");
        assert_near(bench.zero(), zero, &format!("mode {mode}"));
    }
}

#[test]
fn swapped_end_switches_are_exchanged() {
    let crossed = Slide { start: HOME, left: around(RIGHT, WIDE), right: around(LEFT, WIDE), ..slide(WIDE) };
    for (mode, zero) in [(1, LEFT + WIDE), (65, RIGHT - WIDE), (3, LEFT), (6, HOME)] {
        let mut bench = search(crossed.clone(), mode, "SAP 33, 0, 1");
        assert_found(&mut bench, zero, &format!("mode {mode}"));
    }
}

#[test]
fn stop_functions_rest_during_the_search_and_work_after_it() {
    let setup = "SAP 12, 0, 3; SAP 13, 0, 3";
    // Mode 4 has to cross the switch that would stop it; mode 8 passes the right one, in which it starts.
    let mut bench = search(Slide { start: HOME, ..slide(WIDE) }, 4, setup);
    assert_eq!(bench.get(207), 0);
    bench.ask("MVP ABS, 0, -1000");
    bench.advance_ms(1_000);
    assert_eq!(bench.get(1), 0, "the left switch holds the motor");

    let both = Slide { start: RIGHT, left: around(HOME, 5_000), ..slide(WIDE) };
    let mut bench = search(both, 8, setup);
    assert_eq!(bench.get(207), 0);
    assert_near(bench.zero(), HOME, "mode 8 inside the area of an end switch");
}

// The end of a search by command.

#[test]
fn command_ends_the_search_without_zeroing() {
    for (command, speed, target) in [
        ("RFS STOP, 0", 0, None),
        ("MST 0", 0, None),
        ("ROR 0, 1000", 1_000, None),
        ("SAP 2, 0, -1000", -1_000, None),
        ("MVP ABS, 0, -20000", 0, Some(-20_000)),
        ("MVP REL, 0, 0", 0, None),
        ("SAP 0, 0, 300", 0, Some(300)),
        ("SAP 1, 0, 777", 0, None),
    ] {
        let mut bench = bench(Slide { start: RIGHT_OF_HOME, ..slide(WIDE) }, 1);
        bench.ask("RFS START, 0");
        bench.advance_ms(200);
        assert!(bench.is_searching());
        assert!(bench.get(3) < 0, "under way");
        bench.ask(command);
        assert!(!bench.is_searching(), "{command}");
        bench.advance_ms(2_000);
        assert_eq!(bench.get(3), speed, "{command}: speed");
        if let Some(target) = target {
            assert_eq!(bench.get(1), target, "{command}: position");
        }
        assert_eq!((bench.get(207), bench.get(197)), (0, 0), "{command}: flags, last position");
    }
}

#[test]
fn stopped_search_brakes_with_the_ramp() {
    let mut bench = bench(Slide { start: RIGHT_OF_HOME, ..slide(WIDE) }, 1);
    bench.ask("RFS START, 0");
    bench.advance_ms(200);
    let (before, speed) = (bench.get(1), bench.get(3));
    assert_eq!(speed, -51_200);
    bench.ask("RFS STOP, 0");
    bench.rest();
    // v^2 / 2a, and half a tick's travel.
    assert!((before - bench.get(1) - 1_280).abs() <= 3, "{}", before - bench.get(1));
}

#[test]
fn stop_without_a_search_leaves_a_motion_alone() {
    let mut bench = Bench::new(slide(WIDE));
    bench.all("RFS STOP, 0; MVP ABS, 0, 10000; RFS STOP, 0");
    bench.advance_ms(3_000);
    assert_eq!(bench.get(1), 10_000);
}

#[test]
fn moving_motor_brakes_before_it_searches() {
    let mut bench = bench(Slide { start: LEFT_OF_HOME, ..slide(WIDE) }, 1);
    bench.ask("ROR 0, 51200");
    bench.advance_ms(200);
    bench.ask("RFS START, 0");
    bench.finish();
    assert_found(&mut bench, LEFT + WIDE, "mode 1");
}

#[test]
fn search_starts_again_from_its_beginning() {
    let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 2);
    bench.ask("RFS START, 0");
    while bench.ask("RFS STATUS, 0") < 4 {
        bench.advance_ms(5);
    }
    bench.ask("RFS START, 0");
    assert_eq!(bench.ask("RFS STATUS, 0"), 1);
    bench.finish();
    assert!((bench.get(196) - (RIGHT - LEFT - 2 * WIDE)).abs() <= 2 * TOLERANCE, "distance");
    assert_found(&mut bench, LEFT + WIDE, "mode 2");
}

// Searches that cannot succeed.

#[test]
fn home_switch_missing_between_both_end_switches_fails() {
    for mode in [5, 6, 133, 134] {
        let released = Switches { home: mode >= 128, ..Switches::default() };
        let mut bench =
            search(Slide { start: LEFT_OF_HOME, home: NOWHERE, released, ..slide(WIDE) }, mode, "SAP 1, 0, 4444");
        assert_eq!(bench.get(207), NOT_FOUND, "mode {mode}");
        assert_eq!(bench.get(207), 0, "cleared by reading");
        assert_eq!((bench.get(3), bench.get(197)), (0, 0), "mode {mode}: stands, nothing zeroed");
        let edge = if mode & 1 != 0 { RIGHT - WIDE } else { LEFT + WIDE };
        let at = bench.slide(0).position();
        assert!((at - edge).abs() < 10, "mode {mode}: stopped at {at}");
    }
}

#[test]
fn both_end_switches_active_at_once_fail_where_they_matter() {
    for (mode, flags) in [(5, NOT_FOUND), (6, NOT_FOUND), (7, 0), (8, 0)] {
        let start = if mode == 8 { RIGHT_OF_HOME } else { LEFT_OF_HOME };
        let released = Switches { left: true, right: true, home: false };
        let slide = Slide { start, left: NOWHERE, right: NOWHERE, released, ..slide(WIDE) };
        assert_eq!(search(slide, mode, "").get(207), flags, "mode {mode}");
    }
}

#[test]
fn home_switch_that_reaches_into_an_end_switch_fails() {
    let mut bench = search(Slide { start: HOME, home: LEFT..=5_000, ..slide(WIDE) }, 5, "");
    assert_eq!(bench.get(207), NOT_FOUND);
}

#[test]
fn speed_of_zero_fails_at_once() {
    for (parameter, stage) in [(194, 1), (195, 2)] {
        let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 1);
        bench.all(&format!("SAP {parameter}, 0, 0; RFS START, 0"));
        bench.finish();
        assert_eq!(bench.get(207), NOT_FOUND, "leg {stage}");
    }
}

#[test]
fn leg_without_end_fails_after_a_thousand_turns() {
    for (resolutions, turns) in
        [("", 51_200_000), ("SAP 140, 0, 4; SAP 202, 0, 400", 6_400_000), ("SAP 202, 0, 0", 1 << 30)]
    {
        let mut bench = bench(Slide { free: i32::MIN..=i32::MAX, ..Slide::default() }, 1);
        bench.all(resolutions);
        bench.all("SAP 5, 0, 200000000; SAP 194, 0, 16777215; RFS START, 0");
        bench.finish();
        assert_eq!(bench.get(207), NOT_FOUND);
        let travel = bench.get(1).unsigned_abs();
        assert!((turns..turns + 5_000).contains(&travel), "{resolutions}: {travel}");
    }
}

#[test]
fn blocked_shaft_fails_within_a_turn_if_there_is_an_encoder() {
    // The encoder stops where the slide does; the wrong resolution does not hide it.
    for (settings, turn) in [("", 51_200), ("SAP 210, 0, -1000", 51_200), ("SAP 202, 0, 400", 102_400)] {
        for (mode, start) in [(1, LEFT_OF_ALL), (65, RIGHT_OF_ALL), (7, RIGHT_OF_HOME), (8, LEFT_OF_HOME)] {
            let shaft = Slide::stopped_position;
            let mut bench = bench(Slide { start, shaft, ..slide(WIDE) }, mode);
            bench.all(settings);
            bench.all("SAP 181, 0, 0; RFS START, 0");
            bench.finish();
            assert_eq!(bench.get(207), NOT_FOUND, "mode {mode}, {settings}");
            bench.rest();
            let beyond = (bench.slide(0).position() - bench.slide(0).stopped_position()).abs();
            assert!((1_000..2 * turn).contains(&beyond), "mode {mode}, {settings}: {beyond} microsteps beyond");
        }
    }
}

#[test]
fn missing_encoder_fails_no_search() {
    let mut bench = search(Slide { start: 300_000, free: -10_000..=400_000, shaft: |_| 0, ..slide(WIDE) }, 1, "");
    assert_eq!(bench.get(207), 0);
    assert_near(bench.zero(), LEFT + WIDE, "mode 1 after six turns");
}

#[test]
fn deviation_from_the_encoder_ends_the_search() {
    let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 1);
    bench.all("SAP 212, 0, 500; RFS START, 0");
    bench.advance_ms(100);
    bench.slide(0).start += 2_000;
    bench.finish();
    assert_eq!(bench.get(207), 2 | NOT_FOUND);
}

#[test]
fn enable_low_ends_the_search_and_refuses_another() {
    let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 1);
    bench.ask("RFS START, 0");
    bench.advance_ms(100);
    bench.board().enable = false;
    bench.advance_ms(1);
    assert_eq!((bench.is_searching(), bench.get(3), bench.get(207)), (false, 0, NOT_FOUND));
    assert_eq!(bench.exchange("RFS START, 0").0, 6);
    assert!(!bench.is_searching());
    bench.board().enable = true;
    bench.advance_ms(1);
    bench.ask("RFS START, 0");
    bench.finish();
    assert_found(&mut bench, LEFT + WIDE, "after ENABLE has come back");
}

// Around the search.

#[test]
fn group_searches_together() {
    let mut bench = Bench::new(Slide { start: HOME, ..slide(WIDE) });
    for axis in 0..3 {
        bench.all(&SPEEDS.replace(", 0,", &format!(", {axis},")));
    }
    bench.all("SAP 249, 0, 5; SAP 249, 2, 5; SAP 193, 2, 4; RFS START, 2");
    assert_eq!([0, 1, 2].map(|axis| bench.ask(&format!("RFS STATUS, {axis}"))), [1, 0, 1]);
    bench.finish();
    bench.advance_ms(2_000);
    assert_eq!([0, 1, 2].map(|axis| bench.ask(&format!("RFS STATUS, {axis}"))), [0, 0, 0]);
    let positions = [0, 1, 2].map(|axis| bench.slide(axis).position());
    assert_near(positions[0], LEFT + WIDE, "mode 1");
    assert_eq!(positions[1], HOME, "not of the group");
    assert_near(positions[2], LEFT, "mode 4");

    bench.all("RFS START, 0; RFS STOP, 2");
    assert!(!bench.is_searching(), "stopped with its group");
}

#[test]
fn kinds_and_modes_that_do_not_exist_are_refused() {
    let mut bench = Bench::new(slide(WIDE));
    assert_eq!(bench.exchange("RFS 3, 0").0, 3);
    assert_eq!(bench.exchange("RFS START, 3").0, 4);
    for mode in [-1, 0, 9, 63, 64, 69, 128, 132, 137] {
        assert_eq!(bench.exchange(&format!("SAP 193, 0, {mode}")).0, 4, "mode {mode}");
    }
    for parameter in [196, 197] {
        assert_eq!(bench.exchange(&format!("SAP {parameter}, 0, 1")).0, 3, "AP {parameter}");
    }
}

#[test]
fn program_waits_for_the_search() {
    let mut bench = bench(Slide { start: HOME, ..slide(WIDE) }, 4);
    let program =
        "RFS START, 0; WAIT RFS, 0, 0; SGP 10, 2, 1; ROR 0, 100; RFS START, 0; WAIT RFS, 0, 1; SGP 11, 2, 1; STOP";
    bench.download(program);
    bench.run();
    bench.advance_ms(50);
    assert_eq!(bench.ask("GGP 10, 2"), 0, "waits");
    while bench.ask("GGP 10, 2") == 0 {
        assert!(bench.get(197) == 0 || !bench.is_searching());
        bench.advance_ms(1);
    }
    assert_near(bench.get(197), LEFT - HOME, "found before the program goes on");
    bench.advance_ms(30);
    assert_eq!((bench.ask("GGP 11, 2"), bench.is_searching()), (1, true), "the second WAIT has timed out");
}
