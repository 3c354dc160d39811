//! Moves from rest to rest with constant limits.

use proptest::prelude::*;

use super::*;

/// Ticks that a plain trapezoid may take more or less than in continuous time.
const TRAPEZOID_TICKS: f64 = 3.0;

/// The same for a six-point ramp, which has two more phases and steps at both ends.
const SIX_POINT_TICKS: f64 = 6.0;

/// Asserts that a duration differs from the optimum by some ticks only (and by one millionth, for rounding).
fn check_duration(seconds: f64, optimum: f64, ticks: f64) {
    let error = (seconds - optimum).abs();
    assert!(error <= ticks / f64::from(TICK_HZ) + 1e-6 * optimum, "{seconds} s, closed form {optimum} s");
}

/// A target, by an even spread of the orders of magnitude, not farther than about two seconds.
fn target(limits: &Limits, part: f64) -> i32 {
    let slowest = limits.acceleration.min(limits.deceleration).min(limits.max_speed_pps);
    let distance = (f64::from(slowest) + 1.0).powf(part.abs()).min(f64::from(i32::MAX));
    (distance * part.signum()) as i32
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn trapezoid_arrives_straight_in_the_closed_form_time(
        limits in any_trapezoid(), start: i32, part in -1.0..1.0,
    ) {
        let target = target(&limits, part);
        let duration = Watched::at(limits, start).arrive_straight_at(start.wrapping_add(target));
        let optimal = closed_form(&limits, f64::from(target).abs());
        check_duration(duration, optimal, TRAPEZOID_TICKS);
    }

    #[test]
    fn six_point_ramp_arrives_straight_in_the_closed_form_time(
        limits in top_speed().prop_flat_map(six_point), start: i32, part in -1.0..1.0,
    ) {
        let target = target(&limits, part);
        let duration = Watched::at(limits, start).arrive_straight_at(start.wrapping_add(target));
        let optimal = closed_form(&limits, f64::from(target).abs());
        check_duration(duration, optimal, SIX_POINT_TICKS);
    }

    #[test]
    fn new_target_ahead_is_reached_in_the_closed_form_time_from_the_present_speed(
        limits in any_trapezoid(), ticks in magnitude(12.0), part in -1.0..1.0, second in 0.0..1.0,
    ) {
        let mut axis = Watched::new(limits);
        axis.move_to(target(&limits, part));
        axis.run(ticks);
        let speed = pps(&axis.ramp);
        let braking = speed.abs() * (speed.abs() / 2.0 / f64::from(limits.deceleration) + 1.0 / f64::from(TICK_HZ));
        let distance = braking.ceil() as i32 + 1 + target(&limits, second);
        let ahead = if speed < 0.0 { -distance } else { distance };
        let target = axis.ramp.position().wrapping_add(ahead);
        let distance = f64::from(target) - axis.ramp.position_q32() as f64 / 2f64.powi(32);
        let duration = axis.arrive_straight_at(target);
        let optimal = closed_form_from(speed.abs(), &limits, distance.abs());
        check_duration(duration, optimal, TRAPEZOID_TICKS);
    }
}

#[test]
fn durations_are_those_of_the_table_of_optimal_moves() {
    let mut table = csv::Reader::from_reader(include_bytes!("../../tests/s-ramp-optimal-moves.csv").as_slice());
    for row in table.records() {
        let row = row.unwrap();
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        let limits = trapezoid(number(1) as u32, number(2) as u32, number(2) as u32);
        let duration = Watched::new(limits).arrive_straight_at(number(0) as i32);
        check_duration(duration, number(6), TRAPEZOID_TICKS);
    }
}

#[test]
fn six_point_ramps_take_the_closed_form_time() {
    let full = Limits {
        max_speed_pps: 100_000,
        acceleration: 100_000,
        deceleration: 200_000,
        break_speed_pps: 20_000,
        start_acceleration: 400_000,
        final_deceleration: 50_000,
        start_speed_pps: 1_000,
        stop_speed_pps: 3_000,
    };
    let cases = [
        full,
        Limits { break_speed_pps: 0, ..full },
        Limits { start_speed_pps: 0, stop_speed_pps: 0, ..full },
        Limits { start_speed_pps: 30_000, stop_speed_pps: 25_000, ..full },
        Limits { start_acceleration: 0, ..full },
        Limits { final_deceleration: 0, ..full },
        Limits { break_speed_pps: 200_000, ..full },
    ];
    for limits in cases {
        for distance in [20_000, -60_000, 1_000_000] {
            let duration = Watched::new(limits).arrive_straight_at(distance);
            let optimal = closed_form(&limits, f64::from(distance).abs());
            check_duration(duration, optimal, SIX_POINT_TICKS);
        }
    }
}

#[test]
fn motion_starts_at_start_speed_and_ends_from_stop_speed() {
    let limits = Limits { start_speed_pps: 4_000, stop_speed_pps: 6_000, ..trapezoid(50_000, 100_000, 100_000) };
    let mut axis = Watched::new(limits);
    axis.move_to(20_000);
    axis.tick();
    assert_eq!(axis.ramp.speed_pps(), 4_000);
    let mut last = 0;
    while axis.ramp.position() != 20_000 {
        if axis.ramp.speed_pps() >= 6_000 {
            last = axis.ramp.speed_pps();
        }
        axis.tick();
    }
    assert_eq!(last, 6_000);
    assert!(axis.arrive() <= 0.0001);
}

#[test]
fn start_speed_is_limited_by_top_speed_and_distance() {
    let cases = [(1_000_000, 500, 500), (1_000_000, 50_000, 4_000), (0, 1_000, 0)];
    for (distance, max_speed_pps, first) in cases {
        let limits = Limits { start_speed_pps: 4_000, ..trapezoid(max_speed_pps, 100_000, 100_000) };
        let mut axis = Watched::new(limits);
        axis.move_to(distance);
        axis.tick();
        assert_eq!(axis.ramp.speed_pps(), first);
    }
    let limits = Limits { start_speed_pps: 1_000_000, ..trapezoid(2_000_000, 100_000, 100_000) };
    let mut axis = Watched::new(limits);
    axis.arrive_straight_at(3);
}

#[test]
fn cruising_speed_reads_exactly_the_top_speed() {
    for max_speed_pps in [1, 333, 51_200, 8_388_607, 16_777_215] {
        for sign in [1, -1] {
            let mut axis = Watched::new(trapezoid(max_speed_pps, 2_000_000_000, 2_000_000_000));
            axis.move_to(sign * i32::MAX);
            axis.run(200);
            assert_eq!(axis.ramp.speed_pps(), sign * max_speed_pps as i32);
            assert_eq!(axis.ramp.acceleration_pps2(), 0);
        }
    }
}

#[test]
fn acceleration_reads_the_limit_in_force() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 102_400));
    axis.move_to(51_200);
    axis.run(100);
    assert_eq!(axis.ramp.acceleration_pps2(), 51_200);
    axis.run(12_000);
    assert_eq!(axis.ramp.acceleration_pps2(), 0);
    axis.run(3_000);
    assert_eq!(axis.ramp.acceleration_pps2(), -102_400);
}

#[test]
fn a_million_moves_leave_no_drift() {
    let limits = trapezoid(700_000, 1_234_567_891, 987_654_321);
    let mut ramp = Ramp::new(limits.gains(TICK_HZ));
    for number in 0..1_000_000 {
        let target = if number % 2 == 0 { 100 + number % 89 } else { -(number % 97) };
        ramp.move_to(target);
        while !ramp.is_idle() {
            ramp.tick();
        }
        assert_eq!(ramp.position(), target);
    }
    ramp.move_to(0);
    while !ramp.is_idle() {
        ramp.tick();
    }
    assert_eq!((ramp.position_q32(), ramp.speed()), (0, 0));
}

#[test]
fn targets_beyond_the_counters_end_are_reached_by_the_short_way() {
    let cases = [(i32::MAX - 100, i32::MIN + 100), (i32::MIN + 5, i32::MAX - 5), (2_000_000_000, -2_000_000_000)];
    for (start, target) in cases {
        let duration = Watched::at(trapezoid(16_777_215, 400_000_000, 400_000_000), start).arrive_straight_at(target);
        assert!(duration < 18.0);
    }
}
