//! S-shaped ramps: changes while the axis moves, velocity mode, stops, lines, and extreme limits.

use std::vec::Vec;

use proptest::prelude::*;

use super::smooth::{Curved, Sample, Smooth, check_sample, curved, stepped};
use super::*;
use crate::Line;

const HIGHEST: u32 = i32::MAX as u32;

/// What may happen to an axis on its way.
#[derive(Clone, Debug)]
enum Change {
    Target(i32),
    Speed(i32),
    Limits(Curved),
    Counter(i32),
}

fn changes(top_speed: f64) -> impl Strategy<Value = (Curved, Vec<(u32, Change)>)> {
    let part = move || (-1.0..1.0).prop_map(move |part: f64| (part * part * part * top_speed) as i32);
    let change = prop_oneof![
        4 => part().prop_map(Change::Target),
        2 => part().prop_map(Change::Speed),
        2 => stepped(top_speed).prop_map(Change::Limits),
        1 => part().prop_map(Change::Counter),
    ];
    (stepped(top_speed), proptest::collection::vec((magnitude(13.0), change), 1..8))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn changes_while_moving_break_no_limit_and_the_axis_arrives(
        (curved, changes) in top_speed().prop_flat_map(changes), target in -100_000..100_000,
    ) {
        let mut axis = Smooth::new(curved);
        for (wait, change) in changes {
            match change {
                Change::Target(target) => axis.move_to(target),
                Change::Speed(speed_pps) => axis.rotate(speed_pps),
                Change::Limits(curved) => axis.set(curved),
                Change::Counter(position) => axis.ramp.set_position(position),
            }
            axis.run(wait);
        }
        axis.move_to(axis.ramp.position().wrapping_add(target % axis.curved.limits.max_speed_pps as i32));
        axis.arrive();
    }

    #[test]
    fn axes_stay_on_an_s_shaped_line_within_limits_and_arrive_together(
        curved in (1_000.0..1e6).prop_flat_map(|speed: f64| [curved(speed), curved(speed), curved(speed)]),
        distances in [-9_999..9_999i32, -9_999..9_999i32, -9_999..9_999i32],
    ) {
        let mut ramps = curved.map(|curved| curved.ramp());
        ramps.iter_mut().zip(distances).for_each(|(ramp, distance)| ramp.move_to(distance));
        let mut line = Line::new(ramps.each_ref().map(|ramp| Some(ramp.course())));
        while !line.is_done() {
            line.tick();
            for (number, ramp) in ramps.iter_mut().enumerate() {
                let before = Sample::of(ramp);
                line.lead(number, ramp);
                check_sample(&curved[number], f64::from(curved[number].limits.max_speed_pps), before, Sample::of(ramp));
            }
            let done = ramps.each_ref().map(|ramp| ramp.position_q32() as f64 / 2f64.powi(32));
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                let error = done[a] * f64::from(distances[b]) - done[b] * f64::from(distances[a]);
                prop_assert!(error.abs() <= 0.02, "{done:?} of {distances:?}");
            }
        }
        for ramp in &ramps {
            prop_assert!(ramp.at_target() && ramp.is_idle());
            prop_assert_eq!(ramp.position_q32(), i64::from(ramp.target()) << 32);
        }
    }
}

const EVEN: Curved = Curved {
    limits: Limits {
        max_speed_pps: 51_200,
        acceleration: 102_400,
        deceleration: 102_400,
        break_speed_pps: 0,
        start_acceleration: 0,
        final_deceleration: 0,
        start_speed_pps: 0,
        stop_speed_pps: 0,
    },
    bows: [1_024_000; 4],
};

#[test]
fn planning_again_in_every_tick_changes_nothing() {
    let (mut once, mut always) = (Smooth::new(EVEN), Smooth::new(EVEN));
    once.move_to(51_200);
    always.move_to(51_200);
    while !once.ramp.is_idle() {
        once.tick();
        always.tick();
        always.set(EVEN);
        let apart = once.ramp.position_q32() - always.ramp.position_q32();
        assert!(apart.abs() <= 1 << 16, "{apart} / 2^32 microsteps apart");
    }
    always.run(1);
    assert!(always.ramp.is_idle() && always.ramp.at_target());
}

#[test]
fn farther_target_while_braking_does_not_stop_the_axis() {
    let mut axis = Smooth::new(EVEN);
    axis.move_to(51_200);
    axis.run(13_000);
    assert!(axis.ramp.acceleration_pps2() < 0);
    axis.move_to(500_000);
    let mut slowest = i32::MAX;
    while axis.ramp.speed_pps() < 51_200 {
        axis.tick();
        slowest = slowest.min(axis.ramp.speed_pps());
    }
    assert!(slowest > 5_000, "{slowest}");
    axis.arrive_straight_at(500_000);
}

#[test]
fn target_behind_is_overrun_by_the_braking_distance_only() {
    let mut axis = Smooth::new(EVEN);
    axis.move_to(1_000_000);
    axis.run(10_000);
    // from 51 200 pps: 0.1 s of bow 3, and 0.45 s of full deceleration to no speed
    let farthest = axis.ramp.position() + 4_949 + 10_368;
    axis.move_to(0);
    let mut turned = 0;
    while !axis.ramp.is_idle() {
        axis.tick();
        turned = turned.max(axis.ramp.position());
    }
    assert!(axis.ramp.at_target());
    assert!((turned - farthest).abs() <= 1, "turned at {turned}, not {farthest}");
}

#[test]
fn velocity_mode_reaches_its_speed_and_reverses() {
    let mut axis = Smooth::new(EVEN);
    // a change of 40 960 pps takes 0.5 s, and one through no speed only once the time of the bows
    for (speed, ticks) in [(40_960, 5_000), (81_920, 5_000), (40_960, 5_000), (-40_960, 9_000), (0, 5_000)] {
        axis.rotate(speed);
        axis.run(ticks - 20);
        assert_ne!(axis.ramp.speed_pps(), speed, "too early");
        axis.run(21);
        assert_eq!(axis.ramp.speed_pps(), speed);
    }
    assert!(axis.ramp.is_idle());
}

#[test]
fn bows_lowered_while_accelerating_hold_once_the_speed_is_constant() {
    let mut axis = Smooth::new(EVEN);
    axis.rotate(40_960);
    axis.run(2_000);
    axis.set(Curved { bows: [1_000; 4], ..EVEN });
    axis.run(3_001);
    assert_eq!((axis.ramp.speed_pps(), axis.ramp.acceleration_pps2()), (40_960, 0));
    axis.rotate(0);
    axis.run(1_000);
    assert_eq!(axis.ramp.acceleration_pps2(), -100);
}

#[test]
fn hard_stop_stands_at_once_and_soft_stop_brakes_with_its_own_deceleration() {
    let mut axis = Smooth::new(EVEN);
    axis.move_to(51_200);
    axis.run(5_000);
    axis.ramp.hard_stop();
    assert!(axis.ramp.is_idle() && axis.ramp.speed_pps() == 0 && !axis.ramp.at_target());
    axis.arrive_straight_at(51_200);

    let mut ramp = EVEN.ramp();
    ramp.rotate(51_200);
    (0..10_000).for_each(|_| ramp.tick());
    ramp.soft_stop(512_000);
    let mut ticks = 0;
    while !ramp.is_idle() {
        ramp.tick();
        ticks += 1;
    }
    assert!((ticks - 1_000i32).abs() <= 1, "{ticks} ticks");
}

#[test]
fn shape_can_be_changed_while_moving() {
    let [s_shaped, trapezoid] = [EVEN.limits.gains(TICK_HZ).s_shaped(EVEN.bows), EVEN.limits.gains(TICK_HZ)];
    for ticks in [10, 500, 3_000, 6_000, 9_000] {
        let mut ramp = EVEN.ramp();
        ramp.move_to(25_600);
        let mut most = 0;
        for gains in [trapezoid, s_shaped].into_iter().cycle().take(20) {
            (0..ticks).for_each(|_| ramp.tick());
            most = most.max(ramp.speed_pps());
            ramp.set_gains(gains);
        }
        (0..20_000).for_each(|_| ramp.tick());
        assert!(ramp.is_idle() && ramp.at_target() && most <= 51_200, "{ramp:?}");
    }
}

#[test]
fn axis_no_longer_led_goes_on_by_itself() {
    let mut ramps = [EVEN.ramp(); 2];
    ramps[0].move_to(100_000);
    ramps[1].move_to(-50_000);
    let mut line = Line::new(ramps.each_ref().map(|ramp| Some(ramp.course())));
    for _ in 0..3_000 {
        line.tick();
        ramps.iter_mut().enumerate().for_each(|(number, ramp)| line.lead(number, ramp));
    }
    for (mut ramp, target) in ramps.into_iter().zip([100_000, -50_000]) {
        while !ramp.is_idle() {
            let before = Sample::of(&ramp);
            ramp.tick();
            check_sample(&EVEN, 51_200.0, before, Sample::of(&ramp));
        }
        assert_eq!(ramp.position(), target);
    }
}

#[test]
fn line_has_the_shape_of_its_longest_move() {
    for (distances, s_shaped) in [([51_200, 20_000], true), ([20_000, -51_200], false)] {
        let mut ramps = [EVEN.ramp(), Ramp::new(EVEN.limits.gains(TICK_HZ))];
        ramps.iter_mut().zip(distances).for_each(|(ramp, distance)| ramp.move_to(distance));
        let mut line = Line::new(ramps.each_ref().map(|ramp| Some(ramp.course())));
        let mut ticks = 0;
        while !line.is_done() {
            line.tick();
            ramps.iter_mut().enumerate().for_each(|(number, ramp)| line.lead(number, ramp));
            ticks += 1;
        }
        assert!(ramps.iter().all(|ramp| ramp.is_idle() && ramp.at_target()));
        assert_eq!(ticks, if s_shaped { 16_000 } else { 15_000 });
    }
}

#[test]
fn axis_with_a_limit_of_zero_does_not_start() {
    for limits in [trapezoid(0, 1_000, 1_000), trapezoid(1_000, 0, 1_000), Limits::default()] {
        for bows in [[0; 4], [1_000; 4]] {
            let mut axis = Smooth::new(Curved { limits: Limits { start_speed_pps: 100, ..limits }, bows });
            axis.move_to(1_000);
            axis.run(100);
            assert!(axis.ramp.is_idle() && !axis.ramp.at_target());
            axis.set(EVEN);
            axis.arrive_straight_at(1_000);
        }
    }
}

#[test]
fn moving_axis_whose_acceleration_becomes_zero_keeps_its_speed_and_brakes() {
    let mut axis = Smooth::new(EVEN);
    axis.move_to(51_200);
    axis.run(2_000);
    axis.set(Curved { limits: trapezoid(51_200, 0, 102_400), ..EVEN });
    axis.run(1_001);
    assert_eq!(axis.ramp.acceleration_pps2(), 0);
    let speed = axis.ramp.speed_pps();
    axis.run(1_000);
    assert_eq!(axis.ramp.speed_pps(), speed);
    axis.arrive_straight_at(51_200);
}

#[test]
fn extreme_limits_keep_within_limits() {
    for index in 0..4usize.pow(6) {
        let digit = |place: u32| index / 4usize.pow(place) % 4;
        let pick = |place: u32| [0, 1, 1_000_000, HIGHEST][digit(place)];
        let bow = |place: u32| [0, 1, 1_000_000, u64::from(HIGHEST) * 255][digit(place)];
        let curved = Curved::new(pick(0).min(16_777_215), pick(1), pick(2), [bow(3), bow(4), bow(5), bow(3)]);
        for (start, target) in [(0, 1), (5, i32::MAX), (0, i32::MIN), (-3, 40_000_000)] {
            let mut axis = Smooth::new(curved);
            axis.ramp.set_position(start);
            axis.move_to(target);
            axis.run(30);
            axis.rotate(-16_777_215);
            axis.run(10);
            axis.move_to(target);
            axis.run(10);
        }
    }
}

#[test]
fn every_tick_rate_reaches_the_target() {
    for tick_hz in [0, 1, 2, 100, 1_000, 25_000, 1_000_000, u32::MAX] {
        for bows in [[0; 4], [u64::MAX; 4], [1_000_000_000, 2_000_000_000, 500_000_000, 4_000_000_000]] {
            let mut ramp = Ramp::new(trapezoid(2_000, 1_000_000, 500_000).gains(tick_hz).s_shaped(bows));
            ramp.move_to(-1);
            for _ in 0..50_000_000 {
                ramp.tick();
                if ramp.is_idle() {
                    break;
                }
            }
            assert!(ramp.at_target(), "{tick_hz} Hz, {bows:?}: {ramp:?}");
        }
    }
}
