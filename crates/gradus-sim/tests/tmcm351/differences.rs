//! The numbers that mean something else than on the TMCM-3351 (ERRATA 6).

use crate::support::Host;

#[test]
fn speeds_and_accelerations_are_units_of_the_chip() {
    let mut host = Host::new();
    for line in ["SAP 4, 0, 2048", "SAP 5, 0, 2048", "ROR 0, 2048", "SAP 153, 0, 14", "SAP 154, 0, 14", "SAP 140, 0, 7"]
    {
        assert_eq!(host.exchange(line).0, 4, "{line}");
    }
    host.all("SAP 154, 0, 3; SAP 153, 0, 7; SAP 4, 0, 2047; SAP 5, 0, 2047; ROR 0, 1000");
    host.run_ms(1000);
    let start = host.get(1, 0);
    host.run_ms(1000);
    // 1000 * 16e6 / (2^3 * 65536)
    assert!((host.get(1, 0) - start - 30_518).abs() <= 1, "{}", host.get(1, 0) - start);
    assert_eq!((host.get(2, 0), host.get(3, 0)), (1000, 1000));
}

#[test]
fn parameters_12_and_13_disable_the_switches() {
    for (disabled, stops) in [(1, false), (0, true)] {
        let mut host = Host::new();
        host.all(&format!("SAP 12, 0, {disabled}; ROR 0, 1000"));
        host.run_ms(200);
        host.console("switch 0 right 1");
        host.run_ms(200);
        assert_eq!(host.get(3, 0) == 0, stops, "disabled {disabled}");
        host.ask("ROL 0, 1000");
        host.run_ms(200);
        assert_eq!(host.get(3, 0), -1000, "the way back is free");
    }
}

#[test]
fn parameter_138_is_the_ramp_mode() {
    let mut host = Host::new();
    assert_eq!(host.get(138, 0), 0);
    host.ask("ROR 0, 100");
    assert_eq!(host.get(138, 0), 2);
    host.run_ms(100);
    host.ask("MST 0");
    assert_eq!(host.get(138, 0), 2);
    host.ask("MVP ABS, 0, 0");
    assert_eq!(host.get(138, 0), 0);
    host.arrive(0);
    host.all("SAP 138, 0, 1; SAP 0, 0, 5000");
    assert_eq!(host.get(138, 0), 1);
    host.arrive(0);
    assert_eq!(host.get(1, 0), 5000);
}

#[test]
fn parameter_140_is_up_to_64_microsteps() {
    for (resolution, turn) in [(6, 12_800), (4, 3_200), (0, 200)] {
        let mut host = Host::new();
        host.all(&format!("SAP 140, 0, {resolution}; MVP ABS, 0, {turn}"));
        host.arrive(0);
        assert_eq!(host.shaft(0), 51_200, "resolution {resolution}");
    }
}

#[test]
fn parameter_204_is_a_delay_in_milliseconds() {
    let mut host = Host::new();
    host.all("SAP 204, 0, 500; SAP 214, 0, 10; MVP ABS, 0, 1000");
    host.arrive(0);
    let lost = |host: &mut Host| {
        // Without current nothing pulls the shaft back.
        host.bench.machine().axes[0].plant.place(77);
        host.run_ms(1);
        host.all("SAP 7, 0, 33");
        host.shaft(0) == 77
    };
    host.run_ms(400);
    assert!(!lost(&mut host));
    host.run_ms(200);
    assert!(lost(&mut host));
    host.ask("MVP REL, 0, 100");
    host.run_ms(1000);
    assert_ne!(host.shaft(0), 77);
}

#[test]
fn parameter_207_has_its_bits_the_other_way_and_keeps_them_when_read() {
    let mut host = Host::new();
    host.all("SAP 210, 0, 512; SAP 212, 0, 100; MVP ABS, 0, 20000");
    // 4096 counts a turn with factor 1 stay behind 12800 microsteps.
    host.until(2000, |host| host.get(207, 0) != 0);
    assert_eq!([host.get(207, 0), host.get(207, 0), host.get(3, 0)], [1, 1, 0]);
    host.all("SAP 212, 0, 0; MVP REL, 0, 0");
    assert_eq!(host.get(207, 0), 0);
}

#[test]
fn parameter_211_drives_full_steps_above_a_speed() {
    let mut host = Host::new();
    host.all("SAP 140, 0, 6; SAP 211, 0, 500; ROR 0, 400");
    let places = |host: &mut Host| {
        (0..200)
            .filter(|_| {
                host.run_ms(1);
                host.shaft(0).rem_euclid(256) == 128
            })
            .count()
    };
    host.run_ms(500);
    assert!(places(&mut host) < 20);
    host.ask("ROR 0, 1000");
    host.run_ms(500);
    assert_eq!(places(&mut host), 200);
    host.all("SAP 211, 0, 2048");
    assert!(places(&mut host) < 20);
}

#[test]
fn parameter_213_is_the_group() {
    let mut host = Host::new();
    host.all("SAP 213, 0, 5; SAP 213, 2, 5; MVP ABS, 2, 1000");
    host.arrive(2);
    host.arrive(0);
    assert_eq!([0, 1, 2].map(|axis| host.get(1, axis)), [1000, 0, 1000]);
}

#[test]
fn parameters_of_the_other_module_do_not_exist() {
    let mut host = Host::new();
    for number in [14, 15, 17, 34, 50, 127, 129, 131, 181, 202, 249, 251, 255] {
        assert_eq!(host.exchange(&format!("DATA 6, {number}, 0, 0")).0, 3, "GAP {number}");
    }
}

#[test]
fn command_131_leaves_the_registers_alone() {
    let mut host = Host::new();
    host.start(&["CALC LOAD, 42", "JA 1"]);
    host.run_ms(10);
    host.ask("DATA 131, 0, 0, 0");
    assert_eq!((host.ask("GGP 130, 0"), host.ask("GGP 128, 0")), (0, 3));
    // The accumulator still goes to the outputs.
    host.ask("SIO 255, 2, -1");
    assert_eq!(host.bench.machine().io.outputs(), 42);
}

#[test]
fn command_135_answers_the_state_whatever_its_type() {
    let mut host = Host::new();
    assert_eq!(host.ask("DATA 135, 0, 0, 0"), 0);
    host.start(&["JA 0"]);
    for kind in [0, 1, 2, 3, 77] {
        assert_eq!(host.ask(&format!("DATA 135, {kind}, 0, 0")), 1 << 24, "type {kind}");
    }
    host.ask("DATA 131, 0, 0, 0");
    assert_eq!(host.ask("DATA 135, 1, 0, 0"), 3 << 24);
}

#[test]
fn command_138_reports_every_move_whatever_its_type() {
    let mut host = Host::new();
    host.ask("DATA 138, 0, 0, 1");
    for target in [1000, 0, 500] {
        host.ask(&format!("MVP ABS, 0, {target}"));
        host.run_ms(2000);
        let event = host.bench.take(&mut host.link).expect("an event for every move");
        assert_eq!(event[2..8], [128, 138, 0, 0, 0, 1]);
    }
}

#[test]
fn cle_is_for_programs_only() {
    assert_eq!(Host::new().exchange("DATA 36, 0, 0, 0").0, 6);
}
