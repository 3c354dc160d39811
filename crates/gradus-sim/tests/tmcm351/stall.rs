//! Stall detection on a motor with physics.

use gradus_sim::Machine;
use gradus_tmcl::catalogue::TMCM_351;

use crate::support::Host;

/// A blocked shaft for the first motor.
const BLOCK: &str = "block 0";

fn turning(settings: &str) -> Host {
    let mut host = Host::on(Machine::of(&TMCM_351));
    host.all("SAP 154, 0, 5; SAP 153, 0, 7; SAP 5, 0, 500");
    host.all(settings);
    host.ask("ROR 0, 800");
    host.run_ms(1500);
    assert_eq!(host.get(3, 0), 800);
    host
}

#[test]
fn load_rises_with_the_torque() {
    let mut host = turning("");
    let light = host.get(206, 0);
    host.console("load 0 0.6");
    host.run_ms(500);
    let heavy = host.get(206, 0);
    assert!(light <= 2 && heavy > light, "{light} without, {heavy} with a load");
    host.console(BLOCK);
    host.run_ms(300);
    assert_eq!(host.get(206, 0), 7);
    assert_eq!(host.get(3, 0), 800, "nothing stops the motor without a threshold");
}

#[test]
fn load_above_the_threshold_stops_the_motor() {
    let mut host = turning("SAP 205, 0, 5");
    host.console(BLOCK);
    host.until(500, |host| host.get(3, 0) == 0);
    assert_eq!(host.get(207, 0), 2);
    host.ask("ROL 0, 100");
    assert_eq!(host.get(207, 0), 0);
}

#[test]
fn load_does_not_stop_the_motor_while_its_speed_changes() {
    let mut host = turning("SAP 205, 0, 5");
    host.ask("SAP 5, 0, 5");
    host.ask("ROR 0, 1600");
    host.run_ms(10);
    host.console(BLOCK);
    host.run_ms(500);
    assert_ne!((host.get(3, 0), host.get(135, 0)), (0, 0));
}

#[test]
fn mixed_decay_makes_the_load_useless() {
    for threshold in [-1, 500] {
        let mut host = turning(&format!("SAP 205, 0, 5; SAP 203, 0, {threshold}"));
        host.console(BLOCK);
        host.run_ms(500);
        assert_eq!((host.get(206, 0), host.get(3, 0)), (0, 800), "threshold {threshold}");
    }
}

#[test]
fn faults_of_the_driver_are_flagged() {
    for (line, flags) in [
        ("coil 0 a short", 1 << 0 | 1 << 4),
        ("coil 0 b short", 1 << 1 | 1 << 4),
        ("coil 0 a open", 1 << 2),
        ("coil 0 b open", 1 << 3),
        ("supply 6.9", 1 << 5),
        ("supply 7.1", 0),
        ("temperature 0 120", 1 << 6),
        ("temperature 0 150", 1 << 6 | 1 << 7),
    ] {
        let mut host = turning("");
        host.console(line);
        host.run_ms(10);
        assert_eq!(host.get(208, 0), flags, "{line}");
    }
}
