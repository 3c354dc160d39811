//! What the module keeps without power.

use gradus_tmcl::catalogue::{Access, TMCM_351};

use crate::support::Host;

#[test]
fn stored_axis_parameters_come_back_with_the_power() {
    let mut host = Host::new();
    let stored = || TMCM_351.axis_parameters.iter().filter(|row| row.access == Access::Rwe);
    let value = |row: &gradus_tmcl::catalogue::AxisParameter| {
        (1..=500).rev().chain(64..=1024).find(|value| row.accepts(*value)).unwrap()
    };
    for row in stored() {
        host.all(&format!("SAP {0}, 1, {1}; STAP {0}, 1", row.number, value(row)));
    }
    host.all("SAP 213, 1, 9");
    assert_eq!(host.exchange("STAP 213, 1").0, 3);
    host.power_cycle();
    for row in stored() {
        assert_eq!(host.get(row.number, 1), value(row), "{}", row.name);
        assert_eq!(Some(i64::from(host.get(row.number, 0))), row.default, "{}", row.name);
    }
    assert_eq!(host.get(213, 1), 0);
}

#[test]
fn rsap_takes_back_what_was_changed_since() {
    let mut host = Host::new();
    host.all("SAP 4, 0, 700; STAP 4, 0; SAP 4, 0, 800; RSAP 4, 0");
    assert_eq!(host.get(4, 0), 700);
}

#[test]
fn lock_keeps_everything_as_it_is() {
    let mut host = Host::new();
    host.ask("SGP 73, 0, 1234");
    assert_eq!(host.ask("GGP 73, 0"), 1);
    for line in ["STAP 4, 0", "STGP 1, 2", "SGP 67, 0, 1", "SGP 64, 0, 0"] {
        assert_eq!(host.exchange(line).0, 5, "{line}");
    }
    host.ask("SGP 73, 0, 4321");
    assert_eq!(host.exchange("STAP 4, 0").0, 100);
}

#[test]
fn lock_survives_the_loss_of_power() {
    let mut host = Host::new();
    host.ask("SGP 73, 0, 1234");
    host.power_cycle();
    assert_eq!((host.ask("GGP 73, 0"), host.exchange("STAP 4, 0").0), (1, 5));
    host.ask("SGP 73, 0, 4321");
    host.power_cycle();
    assert_eq!((host.ask("GGP 73, 0"), host.exchange("STAP 4, 0").0), (0, 100));
}

#[test]
fn lock_holds_for_coordinates_in_the_eeprom() {
    let mut host = Host::new();
    host.all("SCO 1, 0, 10; SCO 0, 255, 0; SGP 73, 0, 1234; SCO 1, 0, 11");
    for line in ["SCO 1, 255, 0", "SCO 0, 255, 0"] {
        assert_eq!(host.exchange(line).0, 5, "{line}");
    }
    assert_eq!(host.exchange("SCO 21, 255, 0").0, 3, "the number comes first");
    host.ask("GCO 0, 255");
    assert_eq!(host.ask("GCO 1, 0"), 10, "reading is free");
    host.all("SGP 73, 0, 4321; SGP 84, 0, 1; SGP 73, 0, 1234; SCO 0, 0, 9");
    for line in ["SCO 1, 0, 12", "CCO 1, 0", "ACO 1, 0"] {
        assert_eq!(host.exchange(line).0, 5, "{line}");
        assert_eq!(host.ask("GCO 1, 0"), 10, "{line} changes nothing");
    }
    host.power_cycle();
    assert_eq!(host.ask("GCO 1, 0"), 10);
}

#[test]
fn another_magic_does_not_uncover_a_protected_program() {
    for (protection, kept) in [(0, true), (1, false), (2, true), (3, false)] {
        let mut host = Host::new();
        host.start(&["CALC LOAD, 1193046", "STOP"]);
        host.all(&format!("SGP 81, 0, {protection}; SGP 64, 0, 0"));
        host.power_cycle();
        host.bench.send(&mut host.link, &[1, 134, 0, 0, 0, 0, 0, 0, 135]);
        let command = host.bench.take(&mut host.link).unwrap();
        assert_eq!(command[1..8] != [0; 7], kept, "protection {protection}");
    }
}

#[test]
fn another_magic_brings_the_factory_settings_back() {
    let mut host = Host::new();
    host.all("SAP 4, 0, 700; STAP 4, 0; SGP 3, 2, 33; STGP 3, 2; SGP 75, 0, 7; SGP 67, 0, 16");
    host.power_cycle();
    assert_eq!([host.get(4, 0), host.ask("GGP 3, 2"), host.ask("GGP 75, 0"), host.ask("GGP 67, 0")], [700, 33, 7, 16]);
    host.ask("SGP 64, 0, 1");
    assert_eq!(host.get(4, 0), 700, "not before the next start");
    host.power_cycle();
    assert_eq!([host.get(4, 0), host.ask("GGP 3, 2"), host.ask("GGP 75, 0"), host.ask("GGP 67, 0")], [1000, 0, 0, 0]);
    assert_eq!(host.ask("GGP 64, 0"), 228);
}
