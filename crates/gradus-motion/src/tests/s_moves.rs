//! S-shaped moves from rest to rest with constant limits.

use proptest::prelude::*;

use super::smooth::{Curved, Smooth, curved, stepped};
use super::*;

/// Ticks that an S-shaped move may take more than in continuous time: the last one is begun.
const S_TICKS: f64 = 1.0;

/// Asserts that a move takes the shortest time, rounded up to ticks (and one millionth, for rounding).
fn check_optimal(seconds: f64, optimum: f64) {
    let late = (seconds - optimum) * f64::from(TICK_HZ);
    let rounding = 1e-6 * (1.0 + optimum * f64::from(TICK_HZ));
    assert!(late >= -rounding && late <= S_TICKS + rounding, "{seconds} s, closed form {optimum} s");
}

/// Duration of the shortest move from rest to rest in continuous time, in seconds.
fn closed_form(curved: &Curved, distance: f64) -> f64 {
    let [up, down] = curved.accelerations();
    let ramps = |peak: f64| {
        let (rise, fall) =
            (swing(peak, up, curved.bow(0), curved.bow(1)), swing(peak, down, curved.bow(3), curved.bow(2)));
        (rise.0 + fall.0, rise.1 + fall.1)
    };
    let top_speed = f64::from(curved.limits.max_speed_pps);
    let peak = if ramps(top_speed).1 <= distance {
        top_speed
    } else {
        bisect(0.0, top_speed, |peak| ramps(peak).1 <= distance)
    };
    let (time, way) = ramps(peak);
    time + (distance - way) / peak
}

/// Time and distance from rest to `speed`.
fn swing(speed: f64, limit: f64, rise: f64, fall: f64) -> (f64, f64) {
    let peak = (2.0 * speed / (1.0 / rise + 1.0 / fall)).sqrt().min(limit);
    let (first, last) = (peak / rise, peak / fall);
    let hold = speed / peak - (first + last) / 2.0;
    let (low, high) = (peak * first / 2.0, speed - peak * last / 2.0);
    let way = peak * first * first / 6.0 + hold * (low + high) / 2.0 + last * high + peak * last * last / 3.0;
    (first + hold + last, way)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn moves_with_unequal_bows_arrive_straight_in_the_shortest_time(
        curved in top_speed().prop_flat_map(curved), start: i32, part in -1.0..1.0,
    ) {
        let mut axis = Smooth::new(curved);
        axis.ramp.set_position(start);
        let distance = (f64::from(curved.limits.max_speed_pps) + 1.0).powf(f64::abs(part)) as i32;
        let duration = axis.arrive_straight_at(start.wrapping_add(if part < 0.0 { -distance } else { distance }));
        check_optimal(duration, closed_form(&curved, f64::from(distance)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn moves_with_start_and_stop_speed_arrive_straight(
        curved in top_speed().prop_flat_map(stepped), part in -1.0..1.0,
    ) {
        let distance = (f64::from(curved.limits.max_speed_pps) + 1.0).powf(f64::abs(part)) * part.signum();
        Smooth::new(curved).arrive_straight_at(distance as i32);
    }
}

#[test]
fn durations_are_those_of_the_table_of_optimal_moves() {
    let mut table = csv::Reader::from_reader(include_bytes!("../../tests/s-ramp-optimal-moves.csv").as_slice());
    for row in table.records() {
        let row = row.unwrap();
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        let curved = Curved::new(number(1) as u32, number(2) as u32, number(2) as u32, [number(3) as u64; 4]);
        for direction in [1, -1] {
            let duration = Smooth::new(curved).arrive_straight_at(direction * number(0) as i32);
            check_optimal(duration, number(4));
        }
    }
}

#[test]
fn bows_of_zero_make_a_trapezoid() {
    for (distance, seconds) in [(51_200, 2.0), (12_800, 1.0), (102_400, 3.0)] {
        let duration = Smooth::new(Curved::new(51_200, 51_200, 51_200, [0; 4])).arrive_straight_at(distance);
        check_optimal(duration, seconds);
    }
}

#[test]
fn stages_follow_one_another_with_their_own_bows() {
    // 10 000 pps after 0.1 s of bow 1, 0.3 s of full acceleration and 0.1 s of bow 2
    let curved = Curved::new(10_000, 25_000, 20_000, [250_000, 250_000, 400_000, 100_000]);
    let mut axis = Smooth::new(curved);
    axis.rotate(10_000);
    // (ticks, speed, acceleration)
    for (ticks, speed, acceleration) in [(1_000, 1_250, 25_000), (3_000, 8_750, 25_000), (1_000, 10_000, 0)] {
        axis.run(ticks);
        assert!((axis.ramp.speed_pps() - speed).abs() <= 1, "{}", axis.ramp.speed_pps());
        assert!((axis.ramp.acceleration_pps2() - acceleration).abs() <= 1, "{}", axis.ramp.acceleration_pps2());
    }
    axis.rotate(0);
    for (ticks, speed, acceleration) in [(500, 9_500, -20_000), (3_750, 2_000, -20_000), (2_000, 0, 0)] {
        axis.run(ticks);
        assert!((axis.ramp.speed_pps() - speed).abs() <= 1, "{}", axis.ramp.speed_pps());
        assert!((axis.ramp.acceleration_pps2() - acceleration).abs() <= 1, "{}", axis.ramp.acceleration_pps2());
    }
    axis.run(1);
    assert!(axis.ramp.is_idle());
}

#[test]
fn motion_starts_at_start_speed_and_ends_from_stop_speed() {
    let curved = Curved::new(50_000, 100_000, 100_000, [1_000_000; 4]);
    let limits = Limits { start_speed_pps: 4_000, stop_speed_pps: 6_000, ..curved.limits };
    let mut axis = Smooth::new(Curved { limits, ..curved });
    axis.move_to(20_000);
    axis.tick();
    // bow 1 is left out: full acceleration from the first tick on
    assert_eq!((axis.ramp.speed_pps(), axis.ramp.acceleration_pps2()), (4_010, 100_000));
    let mut last = 0;
    while !axis.ramp.is_idle() {
        last = axis.ramp.speed_pps();
        axis.tick();
    }
    assert!((6_000..6_010).contains(&last) && axis.ramp.at_target(), "{last}");
}

#[test]
fn start_speed_is_limited_by_top_speed_and_distance() {
    for (distance, max_speed_pps, most) in [(1_000, 500, 500), (1, 50_000, 1_000)] {
        let curved = Curved::new(max_speed_pps, 1_000_000, 1_000_000, [10_000_000; 4]);
        let limits = Limits { start_speed_pps: 4_000, ..curved.limits };
        let mut axis = Smooth::new(Curved { limits, ..curved });
        axis.move_to(distance);
        axis.tick();
        assert!((1..=most).contains(&axis.ramp.speed_pps()), "{}", axis.ramp.speed_pps());
        axis.arrive();
    }
}

#[test]
fn cruising_speed_reads_exactly_the_top_speed() {
    for max_speed_pps in [1, 333, 51_200, 8_388_607, 16_777_215] {
        for sign in [1, -1] {
            let mut axis = Smooth::new(Curved::new(max_speed_pps, 2_000_000_000, 2_000_000_000, [500_000_000_000; 4]));
            axis.move_to(sign * i32::MAX);
            axis.run(400);
            assert_eq!(axis.ramp.speed_pps(), sign * max_speed_pps as i32);
            assert_eq!(axis.ramp.acceleration_pps2(), 0);
        }
    }
}

#[test]
fn smallest_and_largest_bows_are_kept_to_their_rounding() {
    // (bow, ticks, relative error); the acceleration of a bow over some ticks
    for (bow, ticks, error) in [(1, 1_000_000, 2e-9), (1_000, 100_000, 2e-9), (2_147_483_647 * 255, 30, 1e-9)] {
        let mut axis = Smooth::new(Curved::new(16_777_215, 2_147_483_647, 2_147_483_647, [bow; 4]));
        axis.rotate(16_777_215);
        axis.run(ticks);
        let expected = bow as f64 * f64::from(ticks) / f64::from(TICK_HZ);
        let reading = axis.ramp.curve_acceleration() as f64 * f64::from(TICK_HZ).powi(2) / 2f64.powi(48);
        assert!((reading / expected - 1.0).abs() <= error + 1e-6 / expected, "bow {bow}: {reading} pps^2");
    }
}

#[test]
fn a_hundred_thousand_moves_leave_no_drift() {
    let mut ramp =
        Curved::new(700_000, 1_234_567_891, 987_654_321, [400_000_000_000, 0, 77_777_777_777, 1 << 38]).ramp();
    for number in 0..100_000 {
        let target = if number % 2 == 0 { 100 + number % 89 } else { -(number % 97) };
        ramp.move_to(target);
        while !ramp.is_idle() {
            ramp.tick();
        }
        assert_eq!(ramp.position_q32(), i64::from(target) << 32);
    }
}

#[test]
fn longest_move_arrives_by_the_short_way() {
    for (start, target) in [(i32::MAX - 100, i32::MIN + 100), (0, i32::MIN + 1), (-1, i32::MAX - 1)] {
        let mut axis = Smooth::new(Curved::new(16_777_215, 400_000_000, 300_000_000, [2_000_000_000; 4]));
        axis.ramp.set_position(start);
        assert!(axis.arrive_straight_at(target) < 130.0);
    }
}
