//! S-shaped ramps whose target changes in flight, against the time-optimal trajectory of a program written by others.

use std::vec::Vec;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rsruckig::prelude::*;

use super::smooth::{Curved, Sample, Smooth};
use super::*;

/// Time that a change may cost above the optimum.
const SHARE: f64 = 0.005;

/// Rounding of the two programs, in ticks.
const ROUNDING_TICKS: f64 = 1e-3;

/// Limits whose acceleration and deceleration are equal, and whose bows are.
fn even(top_speed_pps: f64, acceleration: f64, bow: f64) -> Curved {
    let acceleration = top_speed_pps * acceleration.exp2();
    let limit = acceleration as u32;
    Curved::new(top_speed_pps as u32, limit, limit, [(acceleration * bow.exp2()) as u64; 4])
}

/// Time in seconds to bring an axis to top speed.
fn rise_time(curved: &Curved) -> f64 {
    let [acceleration, _] = curved.accelerations();
    f64::from(curved.limits.max_speed_pps) / acceleration + acceleration / curved.bow(0)
}

/// Shortest time in seconds from where the axis is to rest at its target. Lengths are in seconds of top speed.
fn optimum(axis: &Smooth) -> f64 {
    let unit = f64::from(axis.curved.limits.max_speed_pps);
    let now = Sample::of(&axis.ramp);
    let mut input = InputParameter::new(None);
    let target = i64::from(axis.ramp.target()) << 32;
    input.target_position[0] = (target - axis.ramp.position_q32()) as f64 / 2f64.powi(32) / unit;
    input.current_velocity[0] = now.speed / unit;
    input.current_acceleration[0] = now.acceleration / unit;
    // Room for rounding: an axis that is about to reach exactly its top speed is not to slow down first.
    input.max_velocity[0] = 1.0 + 1e-9;
    input.max_acceleration[0] = axis.curved.accelerations()[0] / unit;
    input.max_jerk[0] = axis.curved.bow(0) / unit;
    let mut trajectory = Trajectory::new(None);
    Ruckig::<1, ThrowErrorHandler>::new(None, 1.0).calculate(&input, &mut trajectory).unwrap();
    trajectory.get_duration()
}

/// Moves to a target in parts of the way up to top speed and down, and lets a part of that time go by.
fn go(axis: &mut Smooth, part: f64, time: f64) {
    let seconds = rise_time(&axis.curved);
    let way = seconds * f64::from(axis.curved.limits.max_speed_pps);
    axis.move_to((way * part * part.abs()) as i32);
    axis.run((seconds * time * f64::from(TICK_HZ)) as u32);
}

/// Asserts that the axis arrives in the shortest time.
fn check_arrival(mut axis: Smooth) {
    let optimum = optimum(&axis) * f64::from(TICK_HZ);
    let begin = axis.clone();
    let ticks = axis.arrive() * f64::from(TICK_HZ);
    let late = ticks - optimum;
    assert!(
        late >= -ROUNDING_TICKS && late <= SHARE * optimum + 1.0 + ROUNDING_TICKS,
        "{ticks} ticks, the shortest time is {optimum}: {begin:?}"
    );
}

proptest! {
    // The same cases in every run: the other program has rare faults of rounding at the edges of its own limits.
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(5_000) })]

    #[test]
    fn changes_of_target_in_flight_take_the_shortest_time(
        curved in (1e3..1e6, -1.0..8.0, -1.0..8.0).prop_map(|(speed, acceleration, bow)| even(speed, acceleration, bow)),
        changes in proptest::collection::vec((-2.0..2.0, 0.0..1.5), 1..5),
        last in -2.0..2.0,
    ) {
        let changes: Vec<(f64, f64)> = changes;
        let mut axis = Smooth::new(curved);
        changes.into_iter().for_each(|(part, time)| go(&mut axis, part, time));
        go(&mut axis, last, 0.0);
        check_arrival(axis);
    }
}

#[test]
fn turning_back_passes_through_zero_speed_with_full_deceleration() {
    let curved = Curved::new(51_200, 102_400, 102_400, [1_024_000; 4]);
    let mut axis = Smooth::new(curved);
    axis.move_to(1_000_000);
    axis.run(10_000);
    axis.move_to(0);
    while axis.ramp.speed_pps() > 0 {
        axis.tick();
    }
    assert!((axis.ramp.acceleration_pps2() + 102_400).abs() <= 1, "{}", axis.ramp.acceleration_pps2());
    check_arrival(axis);
}

#[test]
fn unequal_bows_2_and_4_come_to_rest_before_they_turn_back() {
    let mut axis = Smooth::new(Curved::new(51_200, 102_400, 102_400, [1_024_000, 1_024_000, 1_024_000, 512_000]));
    axis.move_to(1_000_000);
    axis.run(10_000);
    axis.move_to(0);
    while axis.ramp.speed() > 0 {
        axis.tick();
    }
    assert!(axis.ramp.acceleration_pps2().abs() <= 103, "{}", axis.ramp.acceleration_pps2());
    axis.arrive();
}

#[test]
fn turning_back_with_a_higher_deceleration_has_the_acceleration_at_zero_speed() {
    for (acceleration, deceleration, at_zero) in [(50_000, 200_000, 50_000), (200_000, 50_000, 50_000)] {
        let mut axis = Smooth::new(Curved::new(51_200, acceleration, deceleration, [1_024_000; 4]));
        axis.rotate(51_200);
        axis.run(15_000);
        axis.rotate(-51_200);
        while axis.ramp.speed_pps() > 0 {
            axis.tick();
        }
        let reading = axis.ramp.acceleration_pps2();
        assert!((reading + at_zero).abs() <= 103, "{reading}, not {at_zero}");
        axis.run(20_000);
        assert_eq!((axis.ramp.speed_pps(), axis.ramp.acceleration_pps2()), (-51_200, 0));
    }
}

#[test]
fn slow_reversal_does_not_overshoot_its_speed() {
    let mut axis = Smooth::new(Curved::new(51_200, 102_400, 102_400, [1_024_000; 4]));
    axis.rotate(51_200);
    axis.run(10_000);
    axis.rotate(-100);
    for _ in 0..10_000 {
        axis.tick();
        assert!(axis.ramp.speed_pps() >= -100, "{}", axis.ramp.speed_pps());
    }
    assert_eq!(axis.ramp.speed_pps(), -100);
}

#[test]
fn bows_made_unequal_while_turning_change_nothing_before_the_speed_is_constant() {
    let even = Curved::new(51_200, 102_400, 102_400, [1_024_000; 4]);
    for ticks in (250..9_000).step_by(250) {
        let mut axis = Smooth::new(even);
        axis.rotate(40_960);
        axis.run(5_000);
        axis.rotate(-40_960);
        axis.run(ticks);
        axis.set(Curved { bows: [1_024_000, 4_096_000, 1_024_000, 1_024_000], ..even });
        axis.run(9_001 - ticks);
        assert_eq!((axis.ramp.speed_pps(), axis.ramp.acceleration_pps2()), (-40_960, 0), "after {ticks} ticks");
    }
}
