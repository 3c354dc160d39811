//! The stepper motor where the supply does not suffice, against a reference with steps of 1 us.
//!
//! The numbers are those of `tools/reference/stepper.py`, whose bridges give plus or minus the supply to each coil. The motor
//! carries the default load; the current is the rated one, 2.8 A RMS.

mod motor_rig;

use gradus_plant::{Currents, DriverSettings, Mechanics, Motor, STEP_US, StepperAxis, Surroundings};

use motor_rig::Rig;

/// The models that must agree with the reference.
const MODELS: [Currents; 2] = [Currents::Hybrid, Currents::Electrical];

fn rig(motor: &str, supply_v: f64, currents: Currents) -> Rig {
    let motor = Motor::named(motor).unwrap();
    Rig::new(motor, Mechanics::default(), currents).with(supply_v, 1)
}

/// A line for `tools/reference/compare.py`.
fn report(what: &str, motor: &str, supply_v: f64, value: f64, currents: Currents, found: f64, expected: f64) {
    println!("= {what} | {motor} | {supply_v} V | {value} | {currents:?} | {found:.3} | {expected}");
}

/// Load in Nm, rising by 1 Nm a second, at which a motor that turns falls four full steps behind.
fn pull_out_nm(mut rig: Rig, rpm: f64) -> f64 {
    let mut load_nm = 0.0;
    rig.ramp(20.0, rpm / 60.0);
    while rig.lag() < 4.0 {
        load_nm += 1e-4;
        rig.axis.set_mechanics(Mechanics { load_nm, ..Mechanics::default() });
        rig.step(rpm / 60.0);
    }
    load_nm
}

#[test]
fn pull_out_torque_is_that_of_the_reference() {
    // Motor, supply in V, rpm, and the reference in Nm with a tolerance.
    for (motor, supply_v, rpm, expected_nm, tolerance) in [
        ("QSH5718-51", 24.0, 300.0, 0.982, 0.01),
        ("QSH5718-51", 24.0, 400.0, 0.971, 0.015),
        ("QSH5718-51", 24.0, 600.0, 0.837, 0.015),
        ("QSH5718-51", 24.0, 900.0, 0.323, 0.3),
        ("QSH5718-51", 48.0, 1000.0, 0.885, 0.015),
        ("QSH5718-51", 48.0, 1300.0, 0.745, 0.015),
        ("QSH5718-51", 24.0, 500.0, 0.927, 0.015),
        ("QSH5718-51", 24.0, 550.0, 0.884, 0.015),
        ("QSH5718-51", 48.0, 1100.0, 0.844, 0.015),
        ("QSH6018-65", 24.0, 120.0, 2.091, 0.01),
        ("QSH6018-65", 24.0, 200.0, 2.079, 0.015),
        ("QSH6018-65", 48.0, 500.0, 1.970, 0.015),
    ] {
        for currents in MODELS {
            let found_nm = pull_out_nm(rig(motor, supply_v, currents), rpm);
            report("pull-out Nm", motor, supply_v, rpm, currents, found_nm, expected_nm);
            let deviation = found_nm / expected_nm - 1.0;
            assert!(deviation.abs() < tolerance, "{motor}, {rpm} rpm, {currents:?}: {found_nm} Nm, not {expected_nm}");
        }
    }
}

/// Mean load angle in degrees and current in A RMS, over a second in which nothing but friction loads the motor.
fn unloaded(mut rig: Rig, rpm: f64) -> (f64, f64) {
    rig.ramp(20.0, rpm / 60.0);
    // It settles under a brake that pulls it to the speed of the vector.
    for step in 0..20_000 {
        let against =
            if step < 10_000 { 0.03 * std::f64::consts::TAU * (rig.readings().speed_rps - rpm / 60.0) } else { 0.0 };
        rig.axis.set_mechanics(Mechanics { load_nm: against, ..Mechanics::default() });
        rig.step(rpm / 60.0);
    }
    let (mut degrees, mut square) = (0.0, 0.0);
    for _ in 0..10_000 {
        let readings = rig.stepped(rpm / 60.0);
        degrees += readings.load_angle_deg;
        square += readings.current_a * readings.current_a;
    }
    (degrees / 1e4, (square / 1e4).sqrt())
}

#[test]
fn unloaded_motor_has_the_load_angle_and_the_current_of_the_reference() {
    for (motor, supply_v, rpm, degrees, amps) in [
        ("QSH5718-51", 24.0, 350.0, 3.5, 2.78),
        ("QSH5718-51", 24.0, 500.0, 25.6, 2.06),
        ("QSH5718-51", 24.0, 600.0, 41.8, 1.52),
        ("QSH5718-51", 48.0, 1100.0, 38.0, 1.79),
        ("QSH6018-65", 24.0, 200.0, 9.6, 2.51),
        ("QSH6018-65", 48.0, 500.0, 27.4, 1.95),
    ] {
        for currents in MODELS {
            let (found_deg, found_a) = unloaded(rig(motor, supply_v, currents), rpm);
            report("unloaded deg", motor, supply_v, rpm, currents, found_deg, degrees);
            report("unloaded A", motor, supply_v, rpm, currents, found_a, amps);
            assert!(
                (found_deg - degrees).abs() < 3.0,
                "{motor}, {rpm} rpm, {currents:?}: {found_deg} degrees, not {degrees}"
            );
            assert!((found_a / amps - 1.0).abs() < 0.05, "{motor}, {rpm} rpm, {currents:?}: {found_a} A, not {amps}");
        }
    }
}

#[test]
fn load_that_is_too_heavy_falls_as_fast_as_with_the_reference() {
    for (motor, load_nm, expected) in [("QSH5718-51", 0.8, 47.1), ("QSH5718-51", 1.2, 78.8), ("QSH6018-65", 2.0, 126.1)]
    {
        for currents in MODELS {
            let mut rig = rig(motor, 24.0, currents);
            rig.run(0.0, 1);
            rig.axis.set_mechanics(Mechanics { load_nm, ..Mechanics::default() });
            rig.run(0.0, 5_000);
            let turns = rig.readings().position.abs() / 51_200.0;
            report("falling turns", motor, 24.0, load_nm, currents, turns, expected);
            assert!(
                (turns / expected - 1.0).abs() < 0.06,
                "{motor}, {load_nm} Nm, {currents:?}: {turns} turns, not {expected}"
            );
        }
    }
}

/// At 4 microsteps a full step the vector stands for two or three steps and then jumps.
#[test]
fn coarse_microsteps_have_the_frequency_of_their_mean() {
    let expected_nm = pull_out_nm(rig("QSH5718-51", 24.0, Currents::QuasiStatic), 300.0);
    for currents in [Currents::Hybrid, Currents::QuasiStatic] {
        let found_nm = pull_out_nm(rig("QSH5718-51", 24.0, currents).with(24.0, 64), 300.0);
        println!("{currents:?}: {found_nm:.3} of {expected_nm:.3} Nm");
        assert!((found_nm / expected_nm - 1.0).abs() < 0.05, "{currents:?}: {found_nm} of {expected_nm} Nm");
    }
}

/// A motor that lives in the fast model and one with inductances stay together below saturation.
#[test]
fn models_agree_below_saturation() {
    let [hybrid, electrical] = MODELS.map(|currents| {
        let mut rig = rig("QSH5718-51", 24.0, currents);
        rig.axis.set_mechanics(Mechanics { load_nm: 0.3, ..Mechanics::default() });
        rig.ramp(20.0, 4.0);
        rig.run(4.0, 20_000);
        rig.readings()
    });
    assert!((hybrid.position - electrical.position).abs() < 0.01 * 256.0, "{hybrid:?}, {electrical:?}");
    assert!((hybrid.current_a - electrical.current_a).abs() < 1e-3, "{hybrid:?}, {electrical:?}");
}

#[test]
fn axis_falls_asleep_when_its_currents_have_ended() {
    let mut axis = StepperAxis::with_motor(Motor::default(), Mechanics::default(), Currents::Electrical);
    let surroundings = Surroundings::default();
    let mut step = 0;
    let mut run = |axis: &mut StepperAxis, steps: u64| {
        for _ in 0..steps {
            step += 1;
            axis.advance(step * STEP_US, &surroundings);
        }
        axis.readings(step * STEP_US, &surroundings)
    };
    axis.set_coils(0, 255);
    run(&mut axis, 5_000);
    axis.configure(DriverSettings { shorted: true, ..DriverSettings::default() });
    axis.release();
    let readings = run(&mut axis, 5_000);
    assert!(!axis.is_awake() && readings.current_a < 1e-3, "{readings:?}");
}
