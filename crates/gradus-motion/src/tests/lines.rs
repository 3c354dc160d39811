//! Coordinated moves.

use proptest::prelude::*;

use super::*;
use crate::Line;

/// Moves axes along a line and checks every tick of each; returns the number of ticks.
fn run_line(axes: &mut [Watched; 3]) -> u32 {
    let starts = axes.each_ref().map(|axis| axis.ramp.position());
    let distances = axes.each_ref().map(|axis| f64::from(axis.ramp.distance()));
    let mut line = Line::new(axes.each_ref().map(|axis| Some(axis.ramp.course())));
    let mut ticks = 0;
    while !line.is_done() {
        line.tick();
        ticks += 1;
        let mut done = [0.0; 3];
        for (number, axis) in axes.iter_mut().enumerate() {
            let before = pps(&axis.ramp);
            line.lead(number, &mut axis.ramp);
            check_step(&axis.limits, f64::from(axis.limits.max_speed_pps), before, pps(&axis.ramp));
            let start = i64::from(starts[number]) << 32;
            done[number] = axis.ramp.position_q32().wrapping_sub(start) as f64 / 2f64.powi(32);
        }
        check_straight(done, distances);
    }
    ticks
}

/// Asserts that all axes have done the same part of their ways.
fn check_straight(done: [f64; 3], distances: [f64; 3]) {
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let error = (done[a] * distances[b] - done[b] * distances[a]).abs();
        let longest = distances[a].abs().max(distances[b].abs());
        assert!(error <= longest * 1e-6 + 1e-6, "{done:?} of {distances:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn axes_stay_on_the_line_within_limits_and_arrive_together(
        limits in (1_000.0..1e6).prop_flat_map(|speed: f64| [six_point(speed), six_point(speed), six_point(speed)]),
        starts: [i32; 3], distances in [-9_999..9_999i32, -9_999..9_999i32, -9_999..9_999i32],
    ) {
        let mut axes = [0, 1, 2].map(|number| Watched::at(limits[number], starts[number]));
        for (axis, distance) in axes.iter_mut().zip(distances) {
            axis.move_to(axis.ramp.position().wrapping_add(distance));
        }
        run_line(&mut axes);
        for axis in &axes {
            prop_assert!(axis.ramp.at_target() && axis.ramp.is_idle() && axis.ramp.speed() == 0);
            prop_assert_eq!(axis.ramp.position_q32(), i64::from(axis.ramp.target()) << 32);
        }
    }
}

#[test]
fn longest_move_takes_as_long_as_alone() {
    let limits = trapezoid(51_200, 51_200, 51_200);
    let mut axes = [51_200, -25_600, 1].map(|target| {
        let mut axis = Watched::new(limits);
        axis.move_to(target);
        axis
    });
    assert_eq!(run_line(&mut axes), 20_000);
}

#[test]
fn speeds_on_the_line_read_in_proportion() {
    let mut axes = [100_000, -50_000, 10_000].map(|target| {
        let mut axis = Watched::new(trapezoid(51_200, 512_000, 512_000));
        axis.move_to(target);
        axis
    });
    let mut line = Line::new(axes.each_ref().map(|axis| Some(axis.ramp.course())));
    for _ in 0..10_000 {
        line.tick();
        axes.iter_mut().enumerate().for_each(|(number, axis)| line.lead(number, &mut axis.ramp));
    }
    assert_eq!(axes.map(|axis| axis.ramp.speed_pps()), [51_200, -25_600, 5_120]);
}

#[test]
fn slow_axis_slows_the_whole_line() {
    let mut axes = [(10_000, 51_200), (-5_000, 1_000), (0, 51_200)].map(|(target, speed)| {
        let mut axis = Watched::new(trapezoid(speed, 1_000_000, 1_000_000));
        axis.move_to(target);
        axis
    });
    let seconds = f64::from(run_line(&mut axes)) / f64::from(TICK_HZ);
    assert!((seconds - 5.0).abs() < 0.01, "{seconds} s");
}

#[test]
fn axis_no_longer_led_goes_on_by_itself() {
    let mut axes = [100_000, -50_000].map(|target| {
        let mut axis = Watched::new(trapezoid(51_200, 512_000, 512_000));
        axis.move_to(target);
        axis
    });
    let mut line = Line::new(axes.each_ref().map(|axis| Some(axis.ramp.course())));
    for _ in 0..5_000 {
        line.tick();
        axes.iter_mut().enumerate().for_each(|(number, axis)| line.lead(number, &mut axis.ramp));
    }
    axes[0].rotate(0);
    axes[0].run_until_idle();
    axes[1].arrive();
}

#[test]
fn line_over_the_whole_counter_ends_exactly() {
    let limits = trapezoid(16_777_215, i32::MAX as u32, i32::MAX as u32);
    let mut axes = [i32::MIN, i32::MAX, 7].map(|target| {
        let mut axis = Watched::new(limits);
        axis.move_to(target);
        axis
    });
    run_line(&mut axes);
    assert_eq!(axes.map(|axis| axis.ramp.position()), [i32::MIN, i32::MAX, 7]);
}

#[test]
fn line_without_axes_is_done() {
    let line = Line::<3>::new([None; 3]);
    assert!(line.is_done() && !line.leads(0));
}
