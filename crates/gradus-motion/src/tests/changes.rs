//! Changes while the axis moves, velocity mode and stops.

use std::vec::Vec;

use proptest::prelude::*;

use super::*;

/// What may happen to an axis on its way.
#[derive(Clone, Debug)]
enum Change {
    Target(i32),
    Speed(i32),
    Limits(Limits),
    Counter(i32),
}

impl Change {
    fn apply(&self, axis: &mut Watched) {
        match *self {
            Self::Target(target) => axis.move_to(target),
            Self::Speed(speed_pps) => axis.rotate(speed_pps),
            Self::Limits(limits) => axis.set_limits(limits),
            Self::Counter(position) => axis.ramp.set_position(position),
        }
    }
}

/// Changes at random times, for an axis of a certain top speed.
fn changes(top_speed: f64) -> impl Strategy<Value = (Limits, Vec<(u32, Change)>)> {
    let position = move || (-1.0..1.0).prop_map(move |part: f64| (part * part * part * top_speed) as i32);
    let change = prop_oneof![
        4 => position().prop_map(Change::Target),
        1 => (-1.0..1.0).prop_map(move |part: f64| Change::Speed((part * top_speed) as i32)),
        2 => six_point(top_speed).prop_map(Change::Limits),
        1 => position().prop_map(Change::Counter),
    ];
    (six_point(top_speed), proptest::collection::vec((magnitude(11.0), change), 1..8))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn changes_while_moving_break_no_limit_and_the_axis_arrives(
        (limits, changes) in top_speed().prop_flat_map(changes), target in -100_000..100_000,
    ) {
        let mut axis = Watched::new(limits);
        for (wait, change) in &changes {
            change.apply(&mut axis);
            axis.run(*wait);
        }
        axis.move_to(axis.ramp.position().wrapping_add(target % axis.limits.max_speed_pps as i32));
        axis.arrive();
    }
}

#[test]
fn cruising_axis_gets_a_farther_target_and_keeps_its_speed() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.move_to(200_000);
    axis.run(20_000);
    axis.move_to(300_000);
    for _ in 0..20_000 {
        axis.tick();
        assert_eq!(axis.ramp.speed_pps(), 51_200);
    }
    axis.arrive_straight_at(300_000);
}

#[test]
fn braking_axis_gets_a_farther_target_and_does_not_stop() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.move_to(51_200);
    axis.run(18_000);
    axis.move_to(500_000);
    axis.tick();
    assert!(axis.ramp.speed_pps() > 10_000 && axis.ramp.acceleration_pps2() == 51_200);
    axis.arrive_straight_at(500_000);
}

#[test]
fn target_behind_or_too_near_is_overrun_by_the_braking_distance_only() {
    for target in [0, 11_000, 20_000, 12_800 + 25_600] {
        let mut axis = Watched::new(trapezoid(51_200, 102_400, 51_200));
        axis.move_to(1_000_000);
        axis.run(5_000); // now at 12 800 with full speed, and 25 600 needed to stop
        axis.move_to(target);
        let mut farthest = 0;
        while !axis.ramp.is_idle() {
            axis.tick();
            farthest = farthest.max(axis.ramp.position());
        }
        assert!(axis.ramp.at_target());
        assert!((farthest - (12_800 + 25_600)).abs() <= 6, "{target}: turned at {farthest}");
    }
}

#[test]
fn lowered_top_speed_is_braked_to_and_raised_one_is_taken_up() {
    let mut axis = Watched::new(trapezoid(50_000, 100_000, 200_000));
    axis.move_to(1_000_000);
    axis.run(10_000);
    axis.set_limits(trapezoid(10_000, 100_000, 200_000));
    axis.run(2_001);
    assert_eq!(axis.ramp.speed_pps(), 10_000);
    axis.set_limits(trapezoid(80_000, 100_000, 200_000));
    axis.run(7_001);
    assert_eq!(axis.ramp.speed_pps(), 80_000);
    axis.arrive();
}

#[test]
fn velocity_mode_reaches_its_speed_and_passes_through_zero() {
    let mut axis = Watched::new(trapezoid(10, 100_000, 50_000));
    // (target speed, ticks that the change takes)
    for (speed, ticks) in [(40_000, 4_000), (50_000, 1_000), (20_000, 6_000), (-30_000, 4_000 + 3_000), (0, 6_000)] {
        axis.rotate(speed);
        axis.run(ticks - 2);
        assert_ne!(axis.ramp.speed_pps(), speed, "too early");
        axis.run(4);
        assert_eq!(axis.ramp.speed_pps(), speed);
    }
    assert!(axis.ramp.is_idle());
}

#[test]
fn velocity_mode_runs_over_the_end_of_the_counter() {
    let mut axis = Watched::at(trapezoid(0, 100_000_000, 0), i32::MAX - 10);
    axis.rotate(10_000);
    axis.run(20_000);
    assert!((axis.ramp.position() - (i32::MIN + 19_990)).abs() < 10);
}

#[test]
fn moving_axis_in_velocity_mode_can_be_sent_to_a_position() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.rotate(100_000);
    axis.run(30_000);
    axis.move_to(0);
    assert!(!axis.ramp.at_target());
    axis.arrive();
}

#[test]
fn hard_stop_stands_at_once_and_stays() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.move_to(51_200);
    axis.run(5_000);
    axis.ramp.hard_stop();
    let position = axis.ramp.position();
    assert!(axis.ramp.is_idle() && axis.ramp.speed_pps() == 0 && !axis.ramp.at_target());
    assert_eq!(axis.ramp.position_q32(), i64::from(position) << 32, "stands between two microsteps");
    axis.run(10);
    assert_eq!(axis.ramp.position(), position);
    axis.arrive_straight_at(51_200);
}

#[test]
fn soft_stop_brakes_with_its_own_deceleration() {
    for (deceleration, seconds) in [(51_200, 0.5), (512_000, 0.05), (0, 0.0001)] {
        let mut axis = Watched::new(trapezoid(51_200, 51_200, 2_000_000));
        axis.move_to(-512_000);
        axis.run(5_000);
        axis.ramp.soft_stop(deceleration);
        axis.limits.deceleration = if deceleration == 0 { u32::MAX } else { deceleration };
        let duration = axis.run_until_idle();
        assert!((duration - seconds).abs() <= 0.0002, "{deceleration}: {duration} s");
    }
}

#[test]
fn counter_overwritten_at_rest_takes_the_target_along() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.arrive_straight_at(1_000);
    axis.ramp.set_position(-77);
    assert!(axis.ramp.is_idle() && axis.ramp.at_target());
    assert_eq!((axis.ramp.position(), axis.ramp.target()), (-77, -77));
}

#[test]
fn counter_overwritten_while_moving_leaves_the_target() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.move_to(51_200);
    axis.run(10_000);
    axis.ramp.set_position(0);
    axis.arrive();
    assert_eq!(axis.ramp.position(), 51_200);
}
