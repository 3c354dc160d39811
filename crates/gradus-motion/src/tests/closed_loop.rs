//! The closed loop: its arithmetic by tables, and with a rotor that has inertia, friction and a load.

use core::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::TICK_HZ;
use crate::closed_loop::{Demand, Gains, Settings, Sight, State};

/// The settings of the manual's program in section 6.3.
const MANUAL: Settings = Settings {
    beta: 255,
    gamma: 255,
    gamma_start_pps: 300_000,
    gamma_add_pps: 1_600_000,
    position_p: 65_536,
    tolerance: 255,
    current_min: 50,
    current_max: 255,
    start_up: 255,
    upscale_clocks: 1_000,
    downscale_clocks: 10_000,
    speed_p: 3_000,
    speed_i: 20,
    speed_i_clip: 2_000,
    speed_d_clock: 0,
    speed_clip_pps: 100_000,
};

fn gains(settings: Settings) -> Gains {
    settings.gains(TICK_HZ)
}

/// Seen from a rotor that stands.
fn standing(error: i32) -> Sight {
    Sight { error, moved: 0 }
}

/// Angles for errors, without limit of speed.
fn angles<const N: usize>(settings: Settings, errors: [i32; N]) -> [i32; N] {
    errors.map(|error| State::new(0).angle(&gains(settings), standing(error), Demand::Speed))
}

#[test]
fn field_is_where_the_ramp_is_until_the_largest_load_angle() {
    let errors = [0, 1, -100, 255, -255, 256, 10_000, i32::MAX, i32::MIN];
    assert_eq!(angles(MANUAL, errors), [0, 1, -100, 255, -255, 255, 255, 255, -255]);
}

#[test]
fn error_outside_the_tolerance_is_multiplied() {
    let settings = Settings { tolerance: 100, position_p: 2 * 65_536, ..MANUAL };
    assert_eq!(angles(settings, [99, 100, 101, -101, 127, 128]), [99, 100, 202, -202, 254, 255]);
    assert_eq!(angles(Settings { position_p: 32_768, ..settings }, [100, 200, -400, 2_000]), [100, 100, -200, 255]);
}

#[test]
fn speed_adds_to_the_largest_angle_in_its_direction() {
    let gains = gains(MANUAL);
    for (speed_pps, forwards, backwards) in [
        (0, 255, -255),
        (300_000, 255, -255),
        (1_100_000, 255 + 127, -255),
        (-1_100_000, 255, -255 - 127),
        (1_900_000, 510, -255),
        (i32::MIN, 255, -510),
    ] {
        let mut state = State::new(0);
        state.see_speed(&gains, speed_pps);
        let angles = [20_000, -20_000].map(|error| state.angle(&gains, standing(error), Demand::Speed));
        assert_eq!(angles, [forwards, backwards], "{speed_pps} pps");
    }
    let whole = Settings { beta: 511, gamma_add_pps: 0, ..MANUAL };
    let mut state = State::new(0);
    state.see_speed(&whole.gains(TICK_HZ), 300_001);
    assert_eq!(state.angle(&whole.gains(TICK_HZ), standing(20_000), Demand::Speed), 511, "never 180 degrees");
}

#[test]
fn limits_of_the_angle_go_along_with_the_rotor() {
    for (moved, angles) in [(0, [-255, 100, 255]), (40, [-235, 100, 275]), (-41, [-275, 100, 235])] {
        let seen = [-1_000, 100, 1_000]
            .map(|error| State::new(0).angle(&gains(MANUAL), Sight { error, moved }, Demand::Speed));
        assert_eq!(seen, angles, "{moved} microsteps a tick");
    }
}

#[test]
fn current_rises_from_start_up_to_the_largest_load_angle() {
    let currents = |start_up, errors: [i32; 6]| {
        let settings = Settings { start_up, beta: 250, upscale_clocks: 0, downscale_clocks: 0, ..MANUAL };
        errors.map(|error| State::new(7).current(&gains(settings), error))
    };
    assert_eq!(currents(0, [0, 50, -125, 200, 250, -9_999]), [50, 91, 152, 214, 255, 255]);
    assert_eq!(currents(50, [0, 50, -150, 200, 250, i32::MIN]), [50, 50, 152, 204, 255, 255]);
    assert_eq!(currents(255, [0, 50, 249, 255, 256, -256]), [50, 50, 50, 50, 255, 255]);
}

#[test]
fn current_changes_by_one_in_its_delay() {
    let gains = gains(MANUAL);
    let mut state = State::new(50);
    let ticks = |state: &mut State, error, end| (1..).find(|_| state.current(&gains, error) == end).unwrap();
    // 205 steps of 62.5 us and of 625 us.
    for (error, end, duration) in [(1_000, 255, 128), (0, 50, 1_281)] {
        let ticks = ticks(&mut state, error, end);
        assert!((duration - 4..=duration + 4).contains(&ticks), "{ticks} ticks to {end}");
    }
}

#[test]
fn current_of_a_torque_is_reached_whatever_the_error() {
    let gains = gains(MANUAL);
    for torque in [0, 10, 255] {
        let mut state = State::new(50);
        for _ in 0..2_000 {
            state.current_to(&gains, torque);
        }
        assert_eq!(state.scale(), torque);
    }
}

/// How far a rotor without load comes in a time when it was held by `error` and is set free.
fn caught_up_in(settings: Settings, error: i32, ticks: u32) -> i32 {
    let gains = gains(settings);
    let (mut state, mut encoder) = (State::new(0), -error);
    state.angle(&gains, standing(error), Demand::Position);
    for _ in 0..ticks {
        encoder += state.angle(&gains, standing(-encoder), Demand::Position);
    }
    encoder + error
}

#[test]
fn field_catches_up_with_the_speed_of_the_regulator() {
    let p_only = Settings { speed_i: 0, ..MANUAL };
    // The rotor may go 255 microsteps at once, then 3000 / 256 pps for each microstep of error.
    let way = caught_up_in(p_only, 1_000, 10) - 255;
    assert!((way - 8).abs() <= 1, "{way} in 0.9 ms with 745 * 11.7 pps");
    let way = caught_up_in(p_only, 100_000, 101) - 255;
    assert!((way - 1_000).abs() <= 1, "{way} in 10 ms with 100 000 pps at most");
    let unclipped = Settings { speed_clip_pps: u32::MAX, speed_i_clip: 32_767, ..MANUAL };
    let faster = caught_up_in(unclipped, 3_000, 1_000);
    let slower = caught_up_in(Settings { speed_i: 0, ..unclipped }, 3_000, 1_000);
    // The error falls as exp(-11.7 t) by P alone.
    assert!((slower - 2_148).abs() < 20 && faster > slower + 200, "with I {faster}, without {slower}");
}

#[test]
fn pid_mode_turns_the_field_by_p_i_and_d() {
    let moved = |settings: Settings, error: i32, ticks: u32| {
        let (gains, mut state) = (gains(settings), State::new(0));
        (0..ticks).map(|_| state.correction(&gains, error)).sum::<i32>()
    };
    let only = Settings { speed_i: 0, position_p: 0, tolerance: 100, ..MANUAL };
    assert_eq!([100, -100].map(|error| moved(only, error, 10_000)), [0, 0], "within the tolerance");
    assert_eq!([2_560, -2_560].map(|error| moved(only, error, 10_000)), [30_000, -30_000], "P");
    let i = Settings { speed_p: 0, speed_i: 256, ..only };
    // The sum grows by 125 000 * 256 a second, and the speed with it to 100 000 pps in 0.8 s.
    let way = moved(i, 256, 10_000);
    assert!((way - 60_000).abs() < 10, "I: {way}");
    let way = moved(Settings { speed_i_clip: 10, ..i }, 256, 10_000);
    assert!((way - 2_507).abs() < 100, "I clipped at 10 * 256 pps: {way}");
    // 65536 / 256 pps for each microstep of change, clipped at 100 000, for as long as an interval lasts.
    for (clock, ticks) in [(0, 1), (12, 1), (13, 2), (125, 10)] {
        let d = Settings { speed_p: 0, position_p: 65_536, speed_d_clock: clock, ..only };
        assert_eq!(moved(d, 3_000, 100), 10 * ticks, "D of {clock}");
    }
}

/// A rotor with an inertia of 550 gcm2 on a motor of 1.01 Nm, in microsteps.
struct Rotor {
    position: f64,
    speed: f64,
    /// Load in holding torques, against positive motion.
    load: f64,
    blocked: bool,
}

/// Microsteps/s^2 by the holding torque.
const STRENGTH: f64 = 1.01 / 550e-7 * 51_200.0 / TAU;

/// Speed lost by friction each second.
const FRICTION: f64 = 9.0;

impl Rotor {
    fn new() -> Self {
        Self { position: 0.0, speed: 0.0, load: 0.0, blocked: false }
    }

    fn turn(&mut self, field: i32, scale: u8) {
        const STEPS: u32 = 4;
        let dt = 1.0 / f64::from(STEPS * TICK_HZ);
        for _ in 0..STEPS {
            let angle = (f64::from(field) - self.position) * PI / 512.0;
            let torque = f64::from(scale) / 255.0 * angle.sin() - self.load;
            self.speed += (torque * STRENGTH - self.speed * FRICTION) * dt;
            if self.blocked {
                self.speed = 0.0;
            }
            self.position += self.speed * dt;
        }
    }

    /// An encoder with 10 000 counts.
    fn encoder(&self) -> i32 {
        ((self.position / 5.12).floor() * 5.12).round() as i32
    }
}

/// A loop with its rotor.
struct Servo {
    gains: Gains,
    state: State,
    rotor: Rotor,
    encoder: i32,
    scale: u8,
    largest_error: i32,
}

impl Servo {
    fn new(settings: Settings) -> Self {
        Self {
            gains: settings.gains(TICK_HZ),
            state: State::new(settings.current_max),
            rotor: Rotor::new(),
            encoder: 0,
            scale: 0,
            largest_error: 0,
        }
    }

    fn run(&mut self, ms: u32, mut ramp: impl FnMut(f64) -> i32) {
        for tick in 0..ms * TICK_HZ / 1_000 {
            let encoder = self.rotor.encoder();
            let error = ramp(f64::from(tick) / f64::from(TICK_HZ)) - encoder;
            let sight = Sight { error, moved: encoder - self.encoder };
            self.encoder = encoder;
            self.largest_error = self.largest_error.max(error.abs());
            self.state.see_speed(&self.gains, self.rotor.speed as i32);
            let field = encoder + self.state.angle(&self.gains, sight, Demand::Position);
            self.scale = self.state.current(&self.gains, error);
            self.rotor.turn(field, self.scale);
        }
    }
}

#[test]
fn current_without_load_falls_to_its_minimum() {
    for settings in [MANUAL, Settings { start_up: 20, ..MANUAL }] {
        let mut servo = Servo::new(settings);
        servo.run(1_000, |_| 0);
        assert_eq!(servo.scale, 50);
    }
}

#[test]
fn load_above_the_smallest_current_is_held_with_more_current() {
    let mut servo = Servo::new(Settings { start_up: 20, ..MANUAL });
    servo.run(200, |_| 0);
    servo.rotor.load = 0.7;
    servo.run(2_000, |_| 0);
    assert!(servo.rotor.position.abs() < 256.0 && servo.scale > 180, "{} at {}", servo.scale, servo.rotor.position);
}

#[test]
fn overload_is_followed_without_a_lost_step_and_caught_up_without_overshoot() {
    for speed_p in [3_000, 10_000] {
        let mut servo = Servo::new(Settings { speed_p, ..MANUAL });
        servo.run(100, |_| 0);
        servo.rotor.load = 1.2;
        servo.run(50, |_| 0);
        assert!(servo.rotor.position < -2_000.0, "overpowered");
        servo.rotor.load = 0.0;
        let mut top = f64::MIN;
        for _ in 0..1_500 {
            servo.run(1, |_| 0);
            top = top.max(servo.rotor.position);
        }
        assert!(servo.rotor.position.abs() < 30.0, "P {speed_p}: {}", servo.rotor.position);
        assert!(top < 256.0, "P {speed_p}: overshoot of {top}");
    }
}

#[test]
fn blocked_shaft_catches_up_with_the_ramp() {
    let mut servo = Servo::new(MANUAL);
    let speed = 51_200.0;
    servo.run(500, |t| (t * speed) as i32);
    servo.rotor.blocked = true;
    servo.run(200, |t| ((0.5 + t) * speed) as i32);
    assert!(servo.largest_error > 10_000);
    servo.rotor.blocked = false;
    servo.run(800, |t| ((0.7 + t).min(1.0) * speed) as i32);
    assert!((servo.rotor.position - speed).abs() < 50.0, "{}", servo.rotor.position);
}

prop_compose! {
    fn any_settings()(
        angles in any::<(u16, u8, u8, u8)>(), scales in any::<(u8, u8)>(), speeds in any::<[u32; 7]>(),
        clips in any::<(u16, u16, u32)>(),
    ) -> Settings {
        Settings {
            beta: angles.0, gamma: angles.1, tolerance: angles.2, start_up: angles.3,
            current_min: scales.0, current_max: scales.1,
            gamma_start_pps: speeds[0], gamma_add_pps: speeds[1], position_p: speeds[2], upscale_clocks: speeds[3],
            downscale_clocks: speeds[4], speed_p: speeds[5], speed_i: speeds[6],
            speed_i_clip: clips.0, speed_d_clock: clips.1, speed_clip_pps: clips.2,
        }
    }
}

proptest! {
    #[test]
    fn any_settings_keep_the_largest_angle(
        settings in any_settings(),
        sights in prop::collection::vec((any::<i32>(), any::<i32>(), any::<i32>(), 0..3_usize), 1..50),
        hz in prop_oneof![Just(0), Just(1), Just(10_000), any::<u32>()],
    ) {
        let gains = settings.gains(hz);
        let mut state = State::new(0);
        for (error, moved, speed, demand) in sights {
            state.see_speed(&gains, speed);
            let angle = i64::from(state.angle(&gains, Sight { error, moved }, [Demand::Position, Demand::Speed, Demand::Torque][demand]));
            let largest = (i64::from(settings.beta) + i64::from(settings.gamma)).min(511);
            prop_assert!((angle - i64::from(moved) / 2).abs() <= largest + 1);
            state.current(&gains, error);
            state.correction(&gains, error);
        }
    }
}
