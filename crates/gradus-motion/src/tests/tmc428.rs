//! The TMC428: its units, its factor, and what its ramps do at every setting.

use std::vec;

use proptest::prelude::*;

use crate::{Approach, Factor, Tmc428Limits, Tmc428Ramp, Tmc428Units};

const TICK_HZ: u32 = 10_000;

fn units(ramp_div: u8, pulse_div: u8) -> Tmc428Units {
    Tmc428Units { pulse_div, ramp_div }
}

fn limits(ramp_div: u8, pulse_div: u8, acceleration: u16, max_speed: u16) -> Tmc428Limits {
    Tmc428Limits { units: units(ramp_div, pulse_div), min_speed: 1, max_speed, acceleration }
}

fn ramp(limits: Tmc428Limits) -> Tmc428Ramp {
    Tmc428Ramp::new(limits.gains(TICK_HZ))
}

/// Ticks until it is idle, which it must be after `most`.
fn run(ramp: &mut Tmc428Ramp, most: u64) -> u64 {
    (0..most)
        .find(|_| {
            let idle = ramp.is_idle();
            ramp.tick();
            idle
        })
        .unwrap_or_else(|| panic!("not idle after {most} ticks: {ramp:?}"))
}

#[test]
fn speeds_in_physical_units() {
    for (speed, pulse_div, pps) in [
        (2047.0, 0, 499_755.9),
        (2047.0, 3, 62_469.5),
        (2047.0, 5, 15_617.4),
        (2047.0, 13, 61.0),
        (1.0, 0, 244.140_625),
    ] {
        let units = units(0, pulse_div);
        assert!((units.pps(speed) - pps).abs() < 0.06, "{speed} with {pulse_div}: {}", units.pps(speed));
        assert_eq!(units.speed(units.pps(speed)), speed);
    }
}

#[test]
fn accelerations_in_physical_units() {
    for (ramp_div, pulse_div, pps2) in [(7, 3, 465.66), (0, 0, 476_837.16), (7, 5, 116.415), (13, 13, 0.007_105)] {
        let units = units(ramp_div, pulse_div);
        assert!((units.pps2(1.0) / pps2 - 1.0).abs() < 1e-4, "{ramp_div} {pulse_div}: {}", units.pps2(1.0));
        assert_eq!(units.acceleration(units.pps2(2047.0)), 2047.0);
    }
}

#[test]
fn factors_of_the_worked_examples() {
    for (acceleration, pmul_and_pdiv) in
        [(500, Some((109, 7))), (1000, Some((109, 6))), (2047, Some((115, 5))), (100, Some((62, 9))), (1, None)]
    {
        let factor = Factor::of(acceleration, units(7, 3), 950);
        assert_eq!(factor.map(|factor| (factor.pmul, factor.pdiv)), pmul_and_pdiv, "a_max {acceleration}");
    }
}

#[test]
fn factor_is_the_next_one_below_the_ideal() {
    for ramp_div in 0..=13 {
        for pulse_div in 0..=13 {
            for acceleration in [1, 2, 3, 100, 500, 1023, 2047] {
                let ideal = f64::from(acceleration) / 128.0 * 2f64.powi(i32::from(pulse_div) - i32::from(ramp_div));
                let Some(factor) = Factor::of(acceleration, units(ramp_div, pulse_div), 988) else {
                    assert!(!(0.002..31.0).contains(&ideal), "{acceleration} {ramp_div} {pulse_div}");
                    continue;
                };
                let p = (128.0 + f64::from(factor.pmul)) / 2f64.powi(3 + i32::from(factor.pdiv));
                let share = p / ideal;
                assert!(share <= 0.988 && share > 0.98, "{acceleration} {ramp_div} {pulse_div}: {share}");
            }
        }
    }
}

#[test]
fn cruising_is_exact_for_hours() {
    for (speed, pulse_div) in [(1000, 2), (-2047, 0), (1, 13), (777, 7)] {
        let mut ramp = ramp(limits(0, pulse_div, 2047, 2047));
        ramp.rotate(speed);
        (0..100).for_each(|_| ramp.tick());
        assert_eq!((ramp.speed(), ramp.acceleration()), (speed, 0));
        let start = ramp.position();
        let seconds = 100;
        (0..seconds * u64::from(TICK_HZ)).for_each(|_| ramp.tick());
        let want = units(0, pulse_div).pps(f64::from(speed)) * seconds as f64;
        let moved = f64::from(ramp.position().wrapping_sub(start));
        assert!((moved - want).abs() <= 1.0, "{speed} with {pulse_div}: {moved}, not {want}");
    }
}

#[test]
fn speed_rises_by_a_part_of_the_acceleration_in_every_tick_of_the_chip() {
    // A tick of the ramp generator with divisor 7 takes 256 us.
    let mut ramp = ramp(limits(7, 3, 500, 2047));
    ramp.rotate(2000);
    (0..256).for_each(|_| ramp.tick());
    assert_eq!(ramp.speed(), 100 * 500 / 256);
    assert_eq!(ramp.acceleration(), 500);
}

#[test]
fn move_is_a_trapezoid_whose_end_is_a_little_slower() {
    for (ramp_div, pulse_div, acceleration, max_speed, way) in
        [(7, 3, 500, 1000, 100_000), (3, 2, 500, 1000, 50_000), (3, 2, 50, 500, 10_000), (5, 5, 100, 2047, 40_000)]
    {
        let limits = limits(ramp_div, pulse_div, acceleration, max_speed);
        let (v, a) = (limits.units.pps(max_speed.into()), limits.units.pps2(acceleration.into()));
        let mut ramp = ramp(limits);
        ramp.move_to(way);
        let ticks = run(&mut ramp, 1_000_000);
        assert_eq!((ramp.position(), ramp.at_target()), (way, true));
        let seconds = ticks as f64 / f64::from(TICK_HZ);
        let trapezoid = f64::from(way) / v + v / a;
        // Braking with 98 to 98.8 % of the acceleration takes half of 1.2 to 2 % of its time longer.
        let slower = seconds - trapezoid;
        let braking = v / a;
        assert!(
            slower > 0.004 * braking && slower < 0.02 * braking + 0.003,
            "{seconds} s, the trapezoid {trapezoid} s"
        );
    }
}

#[test]
fn soft_mode_falls_exponentially() {
    let limits = limits(3, 2, 500, 1000);
    let mut ramp = ramp(limits);
    ramp.set_approach(Approach::Soft);
    ramp.move_to(20_000);
    let mut ticks_down_to = |speed| {
        let falls = |ramp: &Tmc428Ramp| ramp.position() > 10_000 && ramp.speed() <= speed;
        let mut ticks = 0;
        while !falls(&ramp) {
            ramp.tick();
            ticks += 1;
        }
        f64::from(ticks) / f64::from(TICK_HZ)
    };
    ticks_down_to(512);
    let p = 500.0 / 256.0 * 0.985;
    let half_life = 2f64.ln() / (p * limits.units.pps(1.0));
    for speed in [256, 128, 64] {
        let seconds = ticks_down_to(speed);
        assert!((seconds / half_life - 1.0).abs() < 0.08, "to {speed} in {seconds} s, half life {half_life} s");
    }
    run(&mut ramp, 100_000);
    assert_eq!(ramp.position(), 20_000);
}

#[test]
fn large_acceleration_without_a_factor_creeps_to_its_target() {
    // a_max is above 2^(0 - 13 + 12): no pair fits, and the registers make p = 255 / 2^18.
    let limits = limits(0, 8, 2047, 2047);
    assert_eq!(Factor::of(2047, limits.units, Factor::FIRMWARE_PER_MILLE), None);
    let mut ramp = ramp(limits);
    ramp.move_to(100);
    let seconds = run(&mut ramp, 10_000_000) as f64 / f64::from(TICK_HZ);
    assert_eq!(ramp.position(), 100);
    let trapezoid = 2.0 * (100.0 / limits.units.pps2(2047.0)).sqrt();
    assert!(seconds > 50.0 * trapezoid, "{seconds} s, a trapezoid takes {trapezoid} s");
}

#[test]
fn small_acceleration_without_a_factor_passes_its_target() {
    let limits = limits(7, 3, 1, 2047);
    assert_eq!(Factor::of(1, limits.units, Factor::FIRMWARE_PER_MILLE), None);
    let mut ramp = ramp(limits);
    ramp.move_to(100_000);
    let mut farthest = 0;
    for _ in 0..3_000_000 {
        ramp.tick();
        farthest = farthest.max(ramp.position());
    }
    assert!(farthest > 120_000, "{farthest}");
}

#[test]
fn larger_minimum_speed_stops_at_once() {
    let mut ramp = ramp(Tmc428Limits { min_speed: 500, ..limits(3, 2, 50, 1000) });
    ramp.move_to(20_000);
    let mut last = 0;
    while !ramp.is_idle() {
        last = ramp.speed();
        ramp.tick();
    }
    assert_eq!((ramp.position(), last), (20_000, 500));
}

#[test]
fn last_microstep_needs_a_minimum_speed() {
    // A step of the speed is 8 units, too much for a microstep.
    for (min_speed, position) in [(0, 0), (1, 1)] {
        let mut ramp = ramp(Tmc428Limits { min_speed, ..limits(10, 0, 2047, 2047) });
        ramp.move_to(1);
        (0..10_000).for_each(|_| ramp.tick());
        assert_eq!((ramp.position(), ramp.speed()), (position, 0), "minimum speed {min_speed}");
    }
}

#[test]
fn nothing_moves_without_acceleration_or_top_speed() {
    for limits in [limits(3, 2, 0, 1000), limits(3, 2, 500, 0)] {
        let mut ramp = ramp(limits);
        ramp.move_to(1000);
        assert!(ramp.is_idle() && !ramp.at_target());
    }
}

#[test]
fn moving_axis_without_acceleration_cannot_stop() {
    let limits = limits(3, 2, 500, 1000);
    let mut ramp = ramp(limits);
    ramp.rotate(1000);
    (0..1000).for_each(|_| ramp.tick());
    ramp.set_gains(Tmc428Limits { acceleration: 0, ..limits }.gains(TICK_HZ));
    ramp.rotate(0);
    (0..1000).for_each(|_| ramp.tick());
    assert_eq!(ramp.speed(), 1000);
    ramp.hard_stop();
    assert!(ramp.is_idle() && ramp.speed() == 0);
}

#[test]
fn target_speed_is_the_top_speed_until_it_brakes() {
    let mut ramp = ramp(limits(3, 2, 50, 500));
    ramp.move_to(-10_000);
    let mut seen = vec![ramp.target_speed()];
    while !ramp.is_idle() {
        ramp.tick();
        if seen.last() != Some(&ramp.target_speed()) {
            seen.push(ramp.target_speed());
        }
    }
    assert_eq!(seen, [-500, 0]);
}

#[test]
fn position_written_at_rest_moves_nothing_and_wraps() {
    let mut ramp = ramp(limits(0, 0, 2047, 2047));
    ramp.set_position(i32::MAX - 10);
    assert!(ramp.is_idle() && ramp.at_target());
    ramp.move_to(i32::MIN + 10);
    run(&mut ramp, 1000);
    assert_eq!(ramp.position(), i32::MIN + 10);
}

/// Limits for which there is a factor.
fn limits_with_a_factor() -> impl Strategy<Value = Tmc428Limits> {
    (0..=13u8, 0..=13u8, 1..=2047u16, 1..=2047u16)
        .prop_map(|(ramp_div, pulse_div, acceleration, max_speed)| limits(ramp_div, pulse_div, acceleration, max_speed))
        .prop_filter("has a factor", |limits| {
            Factor::of(limits.acceleration, limits.units, Factor::FIRMWARE_PER_MILLE).is_some()
        })
}

proptest! {
    #[test]
    fn arrival_is_exact_and_straight_wherever_there_is_a_factor(
        limits in limits_with_a_factor(), seconds in 0.01..3.0f64, sign in prop::sample::select(vec![-1.0, 1.0])
    ) {
        // As far as it gets in the time, so that a test takes no hours.
        let (v, a) = (limits.units.pps(limits.max_speed.into()), limits.units.pps2(limits.acceleration.into()));
        let target = (sign * (v * seconds).min(a * seconds * seconds / 4.0)).clamp(-2e9, 2e9) as i32;
        let mut ramp = ramp(limits);
        ramp.move_to(target);
        let most = 10_000.0 * (seconds + 2.0 * v / a) + 40_000.0 + 10_000.0 * 4.0 / limits.units.pps(1.0);
        let mut ticks = 0.0;
        while !ramp.is_idle() {
            let before = ramp;
            ramp.tick();
            ticks += 1.0;
            prop_assert!(ticks < most, "still at {} of {target}: {ramp:?}", ramp.position());
            prop_assert!((i64::from(ramp.position()) - i64::from(before.position())) * i64::from(target) >= 0, "turned back");
            prop_assert!(i64::from(ramp.position()).abs() <= i64::from(target).abs(), "passed the target");
            prop_assert!(ramp.speed().unsigned_abs() <= limits.max_speed.into());
        }
        prop_assert!(ramp.at_target());
    }

    #[test]
    fn new_target_on_the_way_is_reached(limits in limits_with_a_factor(), share in 0.0..1.0f64, second in -1.0..1.0f64) {
        let (v, a) = (limits.units.pps(limits.max_speed.into()), limits.units.pps2(limits.acceleration.into()));
        let far = (v * 0.5).min(a / 4.0).min(1e9);
        let mut ramp = ramp(limits);
        ramp.move_to(far as i32);
        (0..(share * 10_000.0) as u32).for_each(|_| ramp.tick());
        ramp.move_to((far * second) as i32);
        let most = 10_000.0 * (10.0 + 8.0 * v / a + 4.0 / limits.units.pps(1.0));
        run(&mut ramp, most as u64);
        prop_assert!(ramp.at_target());
    }

    #[test]
    fn any_commands_keep_top_speed_and_acceleration(
        limits in limits_with_a_factor(), commands in prop::collection::vec((any::<bool>(), any::<i32>(), 1..300u32), 1..6)
    ) {
        let mut ramp = ramp(limits);
        for (moves, value, ticks) in commands {
            if moves { ramp.move_to(value) } else { ramp.rotate(value % 2048) }
            for _ in 0..ticks {
                let before = ramp.speed();
                ramp.tick();
                // Up to 50 ticks of the chip within one of ours, and one more at its start.
                let steps = 50 / (1 << limits.units.ramp_div) + 1;
                let most = i32::from(limits.acceleration) * steps / 256 + 1;
                prop_assert!((ramp.speed() - before).abs() <= most, "{before} to {}", ramp.speed());
            }
        }
    }
}
