//! The stepper motor against its closed forms.

mod motor_rig;

use std::f64::consts::TAU;

use gradus_plant::{Currents, DriverSettings, MOTORS, Mechanics, Motor, Readings, STEP_US, StepperAxis, Surroundings};

use motor_rig::Rig;

/// No friction at all, and a load with the inertia of the rotor.
fn frictionless(motor: &Motor) -> Mechanics {
    Mechanics { inertia_kgm2: motor.inertia_kgm2, friction_nm: 0.0, viscous_nms: 0.0, load_nm: 0.0 }
}

/// The same with what makes an oscillation die out.
fn damped(motor: &Motor) -> Mechanics {
    Mechanics { viscous_nms: 2e-3, ..frictionless(motor) }
}

/// Pull-out torque of a motor whose voltage has a fixed length and any angle.
fn pull_out_nm(motor: &Motor, rps: f64, volts: f64) -> f64 {
    let km = motor.torque_constant();
    let omega = rps * TAU;
    let x = f64::from(motor.full_steps / 4) * omega * motor.inductance_h;
    let z = (motor.resistance_ohm.powi(2) + x * x).sqrt();
    motor.holding_torque_nm.min(km * (volts / z - motor.resistance_ohm * km * omega / (z * z)))
}

/// Raises the load slowly on a motor that turns with a constant speed until it falls out of step.
///
/// The dynamometer damps: besides the load it has a torque in proportion to the deviation from the speed of the vector, which
/// is nothing on average. Without that the electrical model oscillates itself out of step at 450 and 600 rpm with 30 % less
/// load, where the current begins to lag: the mid-band instability of stepper motors.
fn measured_pull_out_nm(motor: Motor, rps: f64, currents: Currents) -> f64 {
    const DAMPING_NMS: f64 = 0.03;
    let expected_nm = pull_out_nm(&motor, rps, 24.0);
    let mechanics = frictionless(&motor);
    let mut rig = Rig::new(motor, mechanics, currents);
    let (mut speed, mut load_nm) = (0.0, 0.0);
    while rig.lag() < 4.0 {
        speed = f64::min(speed + 20.0 * 1e-4, rps);
        if speed == rps {
            load_nm += expected_nm * 1e-4 * if load_nm < 0.8 * expected_nm { 1.0 } else { 0.2 };
        }
        let damping_nm = DAMPING_NMS * TAU * (rig.readings().speed_rps - speed);
        rig.axis.set_mechanics(Mechanics { load_nm: load_nm + damping_nm, ..mechanics });
        rig.step(speed);
    }
    load_nm
}

fn check_pull_out(name: &str, motor: Motor, currents: Currents, speeds_rpm: &[f64]) {
    for rpm in speeds_rpm {
        let expected_nm = pull_out_nm(&motor, rpm / 60.0, 24.0);
        let found_nm = measured_pull_out_nm(motor, rpm / 60.0, currents);
        let deviation = found_nm / expected_nm - 1.0;
        assert!(deviation.abs() < 0.05, "{name} {currents:?}, {rpm} rpm: {found_nm:.3} Nm, not {expected_nm:.3}");
    }
}

#[test]
fn pull_out_torque_falls_with_speed_as_its_closed_form() {
    let speeds_rpm = [60.0, 150.0, 300.0, 450.0, 600.0, 750.0, 900.0];
    check_pull_out("QSH5718-51", Motor::default(), Currents::QuasiStatic, &speeds_rpm);
    // Coils with an inductance get more than a vector of fixed length: where that matters, see `saturation`.
    check_pull_out("QSH5718-51", Motor::default(), Currents::Electrical, &speeds_rpm[..3]);
    check_pull_out("QSH5718-51", Motor::default(), Currents::Hybrid, &speeds_rpm[..3]);
}

#[test]
fn all_motors_have_their_pull_out_torque() {
    for (name, motor) in MOTORS {
        check_pull_out(name, *motor, Currents::QuasiStatic, &[60.0, 600.0]);
    }
}

/// Hertz of a small oscillation about a vector that stands.
fn resonance_hz(motor: Motor, currents: Currents) -> f64 {
    let mut rig = Rig::new(motor, frictionless(&motor), currents);
    rig.step(0.0);
    rig.axis.place(10);
    let positions: Vec<f64> = (0..10_000).map(|_| rig.stepped(0.0).position).collect();
    let upward = |pair: &[f64]| pair[0] < 0.0 && pair[1] >= 0.0;
    let crossings: Vec<usize> = (1..10_000).filter(|step| upward(&positions[step - 1..=*step])).collect();
    let steps = crossings[crossings.len() - 1] - crossings[0];
    (crossings.len() - 1) as f64 / (steps as f64 * 1e-4)
}

#[test]
fn rotor_resonates_at_the_frequency_of_its_stiffness() {
    for (name, motor) in MOTORS {
        let motor = Motor { detent_torque_nm: 0.0, ..*motor };
        let stiffness = f64::from(motor.full_steps / 4) * motor.holding_torque_nm;
        let expected = (stiffness / (2.0 * motor.inertia_kgm2)).sqrt() / TAU;
        for currents in [Currents::Hybrid, Currents::QuasiStatic, Currents::Electrical] {
            let found = resonance_hz(motor, currents);
            assert!((found / expected - 1.0).abs() < 0.01, "{name} {currents:?}: {found:.1} Hz, not {expected:.1}");
        }
    }
}

/// The detent torque has four periods in one of the vector: it adds 4 times its share to the stiffness at a full step.
#[test]
fn detent_torque_stiffens_a_full_step() {
    let motor = Motor::default();
    let share = 4.0 * motor.detent_torque_nm / motor.holding_torque_nm;
    let plain = resonance_hz(Motor { detent_torque_nm: 0.0, ..motor }, Currents::QuasiStatic);
    let found = resonance_hz(motor, Currents::QuasiStatic) / plain;
    assert!((found / (1.0 + share).sqrt() - 1.0).abs() < 0.01, "{found}");
}

#[test]
fn load_turns_the_rotor_by_the_load_angle() {
    for (load_nm, expected_deg) in [(0.0, 0.0), (0.505, 30.0), (-0.505, -30.0), (0.65, 40.06)] {
        let motor = Motor { detent_torque_nm: 0.0, ..Motor::default() };
        let mut rig = Rig::new(motor, Mechanics { load_nm, ..damped(&motor) }, Currents::QuasiStatic);
        rig.run(0.0, 10_000);
        let Readings { load_angle_deg, torque_nm, position, .. } = rig.readings();
        assert!((load_angle_deg - expected_deg).abs() < 0.1, "{load_nm} Nm: {load_angle_deg} degrees");
        assert!((torque_nm - load_nm).abs() < 1e-3, "{load_nm} Nm: {torque_nm}");
        assert!((position + expected_deg / 360.0 * 1024.0).abs() < 0.3, "{load_nm} Nm: at {position}");
    }
}

#[test]
fn overloaded_or_hurried_motor_loses_steps() {
    let motor = Motor::default();
    // Load in Nm, acceleration in turns per s^2, speed in turns per s, and whether the motor follows.
    for (load_nm, acceleration, speed, follows) in [
        (0.2, 50.0, 5.0, true),
        (0.65, 5.0, 5.0, true),
        (1.1, 5.0, 5.0, false),
        (0.2, 1_000.0, 5.0, true),
        (0.2, 5_000.0, 10.0, false),
        (0.2, 50.0, 40.0, false),
    ] {
        let mut rig = Rig::new(motor, Mechanics { load_nm, ..damped(&motor) }, Currents::QuasiStatic);
        rig.ramp(acceleration, speed);
        rig.run(speed, 5_000);
        let lag = rig.lag();
        assert_eq!(lag.abs() < 2.0, follows, "{load_nm} Nm, {acceleration} /s^2, {speed} /s: {lag} full steps behind");
    }
}

#[test]
fn pushed_rotor_comes_back_or_loses_whole_periods() {
    // A push in full steps and where the rotor comes to rest.
    for (full_steps, expected) in [(1.0, 0.0), (-1.9, 0.0), (2.1, 4.0), (-5.0, -4.0), (40.0, 40.0)] {
        let mut rig = Rig::new(Motor::default(), damped(&Motor::default()), Currents::QuasiStatic);
        rig.run(0.0, 100);
        rig.axis.push(full_steps * 1.8);
        rig.run(0.0, 10_000);
        let rest = rig.readings().position / 256.0;
        assert!((rest - expected).abs() < 0.05, "{full_steps} full steps: at {rest}");
    }
}

#[test]
fn blocked_rotor_stands_and_an_end_stop_holds_it() {
    let mut rig = Rig::new(Motor::default(), damped(&Motor::default()), Currents::QuasiStatic);
    rig.ramp(20.0, 1.0);
    rig.axis.block(true);
    let stood = rig.readings().position;
    rig.run(1.0, 5_000);
    assert_eq!(rig.readings().position, stood);
    rig.axis.block(false);
    let end = stood as i64 + 5_000;
    rig.axis.travel.ends = [None, Some(end)];
    let farthest = (0..20_000).map(|_| rig.stepped(1.0).position).fold(stood, f64::max);
    assert_eq!(farthest, end as f64);
}

#[test]
fn coils_without_current_leave_the_rotor_free_and_shorted_coils_brake_it() {
    // Turns a second after 0.1 s of coasting from 5.
    for (shorted, expected) in [(false, 4.5..5.0), (true, 0.0..2.0)] {
        let mechanics = Mechanics { viscous_nms: 1e-5, ..frictionless(&Motor::default()) };
        let mut rig = Rig::new(Motor { detent_torque_nm: 0.0, ..Motor::default() }, mechanics, Currents::QuasiStatic);
        rig.ramp(20.0, 5.0);
        rig.axis.configure(DriverSettings { shorted, ..DriverSettings::default() });
        rig.axis.release();
        for _ in 0..1_000 {
            rig.advance();
        }
        let speed = rig.readings().speed_rps;
        assert!(expected.contains(&speed), "shorted {shorted}: {speed} turns a second");
    }
}

#[test]
fn rotor_that_rests_falls_asleep_and_is_woken() {
    let mut axis = StepperAxis::default();
    let surroundings = Surroundings::default();
    let steps_until_sleep = |axis: &mut StepperAxis, from: u64| {
        (0..100_000)
            .take_while(|step| {
                axis.advance((from + step + 1) * STEP_US, &surroundings);
                axis.is_awake()
            })
            .count()
    };
    assert!(!axis.is_awake());
    axis.set_coils(100, 128);
    assert!(axis.is_awake());
    let steps = steps_until_sleep(&mut axis, 0);
    assert!((60..5_000).contains(&steps), "{steps} steps");
    axis.set_coils(100, 128);
    assert!(!axis.is_awake(), "the same vector wakes nobody");
    let place = axis.position();
    axis.push(1.0);
    let steps = steps_until_sleep(&mut axis, 1_000_000);
    assert!((60..5_000).contains(&steps), "{steps} steps");
    assert!(axis.position().abs_diff(place) < 30, "{} after {place}", axis.position());
}

#[test]
fn winding_warms_while_the_axis_sleeps() {
    let mut rig = Rig::new(Motor::default(), damped(&Motor::default()), Currents::QuasiStatic);
    rig.run(0.0, 1_000);
    let at = |now_us| rig.axis.readings(now_us, &Surroundings::default()).winding_c;
    assert!((at(1_500_000_000) - (25.0 + 80.0 * 0.632)).abs() < 0.1, "{}", at(1_500_000_000));
    assert!((at(36_000_000_000) - 105.0).abs() < 0.1);
}

/// These bits are those of every machine: nothing in the plant depends on a library of the platform.
#[test]
fn motion_is_equal_to_the_bit_everywhere() {
    let bits = [Currents::Hybrid, Currents::QuasiStatic, Currents::Electrical].map(|currents| {
        let mut rig = Rig::new(Motor::default(), Mechanics { load_nm: 0.3, ..Mechanics::default() }, currents);
        rig.ramp(20.0, 10.0);
        let Readings { position, speed_rps, winding_c, .. } = rig.readings();
        [position, speed_rps, winding_c].map(f64::to_bits)
    });
    assert_eq!(
        bits,
        [
            [4_683_524_002_988_050_299, 4_621_797_146_789_142_219, 4_627_736_487_832_948_871],
            [4_683_527_318_298_598_097, 4_621_814_242_012_594_980, 4_627_735_607_838_787_758],
            [4_683_524_002_988_051_498, 4_621_797_146_789_134_055, 4_627_736_484_282_080_340],
        ]
    );
}
