//! Zero and extreme limits: no panic, no motion where there can be none.

use super::*;

const HIGHEST: u32 = i32::MAX as u32;
const TOP: u32 = (1 << 24) - 1;

#[test]
fn axis_with_a_limit_of_zero_does_not_start() {
    for limits in [trapezoid(0, 1_000, 1_000), trapezoid(1_000, 0, 1_000), Limits::default()] {
        let mut axis = Watched::new(Limits { start_speed_pps: 100, ..limits });
        axis.move_to(1_000);
        axis.run(100);
        assert!(axis.ramp.is_idle() && !axis.ramp.at_target());
        assert_eq!(axis.ramp.position(), 0);
    }
}

#[test]
fn axis_with_a_start_acceleration_alone_does_not_start() {
    let limits = Limits { break_speed_pps: 500, start_acceleration: 1_000, ..trapezoid(1_000, 0, 1_000) };
    let mut axis = Watched::new(limits);
    axis.move_to(1_000);
    assert!(axis.ramp.is_idle());
}

#[test]
fn waiting_axis_starts_when_its_limits_allow_it() {
    let mut axis = Watched::new(Limits::default());
    axis.move_to(1_000);
    assert!(axis.ramp.is_idle());
    axis.set_limits(trapezoid(1_000, 1_000, 0));
    axis.arrive_straight_at(1_000);
}

#[test]
fn moving_axis_whose_acceleration_becomes_zero_keeps_its_speed_and_brakes() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.move_to(51_200);
    axis.run(2_000);
    axis.set_limits(trapezoid(51_200, 0, 51_200));
    axis.run(1_000);
    assert!((axis.ramp.speed_pps() - 10_240).abs() <= 6);
    axis.arrive_straight_at(51_200);
}

#[test]
fn moving_axis_without_any_deceleration_stops_within_a_tick() {
    let mut axis = Watched::new(trapezoid(51_200, 51_200, 51_200));
    axis.rotate(51_200);
    axis.run(20_000);
    axis.set_limits(Limits::default());
    axis.rotate(0);
    assert!(axis.run_until_idle() <= 0.0001);
}

#[test]
fn extreme_limits_keep_within_limits() {
    let values = [0, 1, HIGHEST];
    for index in 0..3usize.pow(6) {
        let pick = |place: u32| values[index / 3usize.pow(place) % 3];
        let limits = Limits {
            max_speed_pps: pick(0).min(TOP),
            acceleration: pick(1),
            deceleration: pick(2),
            break_speed_pps: pick(3).min(TOP),
            start_acceleration: pick(4),
            final_deceleration: pick(5),
            start_speed_pps: pick(4).min(TOP),
            stop_speed_pps: pick(5).min(TOP),
        };
        for (start, target) in [(0, 1), (5, i32::MAX), (0, i32::MIN), (-3, 40_000_000)] {
            let mut axis = Watched::at(limits, start);
            axis.move_to(target);
            axis.run(30);
            axis.rotate(-(TOP as i32));
            axis.run(10);
            axis.move_to(target);
            axis.run(10);
        }
    }
}

#[test]
fn every_tick_rate_reaches_the_target() {
    for tick_hz in [0, 1, 2, 100, 1_000, 25_000, 1_000_000, u32::MAX] {
        for limits in [trapezoid(TOP, HIGHEST, HIGHEST), trapezoid(2_000, 1_000_000, 500_000)] {
            let mut ramp = Ramp::new(limits.gains(tick_hz));
            ramp.move_to(-1);
            for _ in 0..20_000_000 {
                ramp.tick();
                if ramp.is_idle() {
                    break;
                }
            }
            assert!(ramp.at_target(), "{tick_hz} Hz, {limits:?}: {ramp:?}");
        }
    }
}
