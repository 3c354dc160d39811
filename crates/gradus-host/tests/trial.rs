//! Steps for the regulators of a virtual servo.

use std::time::Duration;

use gradus_host::{Error, Regulator, Session, Step, Trial};
use gradus_tmcl::catalogue::Ap;

/// A servo on its hall sensors or encoder, with gains for the motor that it has by default.
fn servo(commutation: i32) -> Session {
    let mut session = Session::open(&"sim:tmcm-1617".parse().unwrap()).unwrap();
    for (parameter, value) in [
        (Ap::TorqueP, 1450),
        (Ap::TorqueI, 7100),
        (Ap::VelocityP, 1460),
        (Ap::VelocityI, 3800),
        (Ap::PositionP, 1800),
        (Ap::MaxAcceleration, 5000),
        (Ap::CommutationMode, commutation),
    ] {
        session.set_axis(parameter, 0, value).unwrap();
    }
    session.sleep(Duration::from_millis(1200));
    session
}

const ENCODER: i32 = 3;

fn try_step(session: &mut Session, regulator: Regulator, size: i32, ms: u64, ramp: bool) -> Result<Trial, Error> {
    session.try_step(&Step { regulator, axis: 0, size, time: Duration::from_millis(ms), ramp })
}

#[test]
fn flux_rises_within_two_milliseconds_and_nothing_turns() {
    let mut session = servo(ENCODER);
    let before = session.get_axis(Ap::ActualPosition, 0).unwrap();
    let trial = try_step(&mut session, Regulator::Flux, 1_000, 20, false).unwrap();
    assert_eq!((trial.way, trial.period), ((0.0, 1_000.0), Duration::from_micros(500)));
    assert!(trial.response.settling.unwrap() <= Duration::from_millis(2), "{:?}", trial.response);
    assert!(trial.response.overshoot_percent <= 10.0, "{:?}", trial.response);
    assert!((session.get_axis(Ap::ActualPosition, 0).unwrap() - before).abs() < 200);
    assert_eq!(session.get_axis(Ap::TargetFlux, 0).unwrap(), 0, "is taken back");
}

#[test]
fn velocity_steps_without_ramp_and_the_ramp_is_as_before() {
    let mut session = servo(ENCODER);
    let trial = try_step(&mut session, Regulator::Velocity, 1_000, 500, false).unwrap();
    assert!(trial.response.rise.unwrap() < Duration::from_millis(20), "{:?}", trial.response);
    assert!((1.0..20.0).contains(&trial.response.overshoot_percent), "{:?}", trial.response);
    assert!(trial.response.settling.unwrap() < Duration::from_millis(150), "{:?}", trial.response);
    assert_eq!(session.get_axis(Ap::VelocityRampEnable, 0).unwrap(), 1);
    session.sleep(Duration::from_secs(1));
    assert!(session.get_axis(Ap::ActualSpeed, 0).unwrap().abs() < 20, "the motor is stopped");
}

#[test]
fn position_on_the_ramp_arrives_without_overshoot() {
    let mut session = servo(ENCODER);
    let trial = try_step(&mut session, Regulator::Position, -655_360, 2_000, true).unwrap();
    assert!(trial.response.settling.unwrap() < Duration::from_millis(900), "{:?}", trial.response);
    assert!(trial.response.overshoot_percent < 0.1, "{:?}", trial.response);
    let last = trial.actual.last().unwrap();
    assert!((last - trial.way.1).abs() <= 50.0, "{last} of {:?}", trial.way);
}

#[test]
fn stepper_module_has_nothing_to_step() {
    let mut session = Session::open(&"sim:tmcm-3351".parse().unwrap()).unwrap();
    let error = try_step(&mut session, Regulator::Velocity, 100, 100, false).unwrap_err();
    assert!(error.to_string().contains("TMCM-3351"), "{error}");
}
