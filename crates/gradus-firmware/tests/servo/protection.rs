//! What switches the driver off, and the way back.

use crate::support::{Bench, Drive};

const OVER_CURRENT: u32 = 1 << 0;
const UNDER_VOLTAGE: u32 = 1 << 1;
const OVER_VOLTAGE: u32 = 1 << 2;
const OVER_TEMPERATURE: u32 = 1 << 3;
const HALL_ERROR: u32 = 1 << 5;
const DRIVER_ERROR: u32 = 1 << 6;
const INIT_ERROR: u32 = 1 << 7;
const FAULTS: u32 = 0xef & !(1 << 4);
const STOP: u32 = 1 << 8;
const INITIALIZED: u32 = 1 << 15;

fn turning() -> Bench {
    let mut bench = Bench::set_up("SAP 15, 0, 2; ROR 0, 500");
    bench.advance_ms(10);
    bench
}

fn faults(bench: &mut Bench) -> u32 {
    bench.get(156) as u32 & FAULTS
}

#[test]
fn faults_switch_the_driver_off_and_some_go_by_themselves() {
    type Change = fn(&mut Drive);
    // What happens, its flag, what is not enough to end it, what ends it.
    let cases: [(Change, u32, Change, Option<Change>); 6] = [
        (|d| d.voltage_dv = 80, UNDER_VOLTAGE, |d| d.voltage_dv = 90, Some(|d| d.voltage_dv = 91)),
        (|d| d.voltage_dv = 320, OVER_VOLTAGE, |d| d.voltage_dv = 310, Some(|d| d.voltage_dv = 309)),
        (|d| d.temperature_c = 120, OVER_TEMPERATURE, |d| d.temperature_c = 100, Some(|d| d.temperature_c = 99)),
        (|d| d.hall = 7, HALL_ERROR, |d| d.hall = 2, None),
        (|d| d.shunts = [32_767 + 30_001, 32_767 - 10_000], OVER_CURRENT, |d| d.shunts = [32_767; 2], None),
        (|d| d.gate_fault = true, DRIVER_ERROR, |d| d.gate_fault = false, None),
    ];
    for (happens, flag, not_enough, ends) in cases {
        let mut bench = turning();
        happens(bench.drive());
        bench.advance_ms(3);
        assert_eq!((faults(&mut bench), bench.drive().duties), (flag, None));
        assert!(bench.has_flags(STOP));
        assert_eq!(bench.exchange("ROR 0, 500").0, 6, "flag {flag:#x}");
        not_enough(bench.drive());
        bench.advance_ms(500);
        assert_eq!(faults(&mut bench), flag);
        match ends {
            Some(end) => end(bench.drive()),
            None => bench.set(255, 1),
        }
        bench.advance_ms(3);
        assert_eq!(faults(&mut bench), 0, "flag {flag:#x}");
        assert!(bench.has_flags(STOP), "nothing moves by itself");
        assert_eq!(bench.exchange("ROR 0, 500").0, 100);
        bench.advance_ms(1);
        assert!(bench.drive().duties.is_some());
    }
}

#[test]
fn limits_themselves_are_no_faults() {
    let mut bench = turning();
    let harmless: [fn(&mut Drive); 6] = [
        |d| d.voltage_dv = 81,
        |d| d.voltage_dv = 319,
        |d| d.temperature_c = 119,
        |d| d.shunts = [32_767 + 30_000, 32_767 - 15_000],
        |d| d.shunts = [32_767; 2],
        |d| d.encoder_levels = 7,
    ];
    for change in harmless {
        change(bench.drive());
        bench.advance_ms(3);
        assert_eq!(faults(&mut bench), 0);
    }
}

#[test]
fn hall_sensors_may_be_wrong_for_a_millisecond_and_where_they_do_not_commutate() {
    let mut bench = turning();
    for _ in 0..20 {
        bench.drive().hall = 7;
        bench.advance_us(960);
        bench.drive().hall = 3;
        bench.advance_us(200);
    }
    assert_eq!(faults(&mut bench), 0);
    let mut bench = Bench::set_up("SAP 15, 0, 1; ROR 0, 10");
    bench.drive().hall = 7;
    bench.advance_ms(10);
    assert_eq!(faults(&mut bench), 0, "open loop");
}

#[test]
fn fault_is_seen_and_gone_while_the_module_rests() {
    let mut bench = Bench::new();
    bench.drive().voltage_dv = 50;
    bench.advance_ms(1);
    assert_eq!((faults(&mut bench), bench.get(220)), (UNDER_VOLTAGE, 50));
    bench.drive().voltage_dv = 240;
    bench.advance_ms(1);
    assert_eq!(faults(&mut bench), 0);
}

#[test]
fn chopper_is_on_between_its_voltages() {
    let mut bench = Bench::set_up("SAP 140, 0, 1; SAP 141, 0, 280; SAP 142, 0, 10; SAP 15, 0, 2; ROR 0, 1");
    for (voltage_dv, on) in [(279, false), (280, true), (270, true), (269, false), (279, false), (300, true)] {
        bench.drive().voltage_dv = voltage_dv;
        bench.advance_ms(1);
        assert_eq!((bench.drive().chopper, bench.get(144) != 0), (on, on), "{voltage_dv}");
    }
    bench.set(140, 0);
    bench.advance_ms(1);
    assert_eq!((bench.drive().chopper, bench.get(144)), (false, 0));
}

/// Runs an alignment during which the encoder goes by so many counts while the field turns to zero.
fn align(counts: i32) -> Bench {
    let mut bench = Bench::set_up("SAP 104, 0, 400; SAP 15, 0, 3");
    assert_eq!(bench.get(103), 0, "it begins with the next period");
    bench.advance_ms(40);
    assert_eq!((bench.get(103), bench.has_flags(INITIALIZED)), (1, false));
    bench.drive().encoder += 1000;
    bench.advance_ms(80);
    assert_eq!(bench.get(103), 2, "wherever the rotor was before does not count");
    bench.drive().encoder += counts;
    bench.advance_ms(200);
    assert_eq!(bench.get(103), 3);
    bench.advance_ms(81);
    assert_eq!(bench.get(103), 0);
    bench
}

#[test]
fn encoder_must_count_what_an_alignment_turns() {
    // A quarter of an electrical turn is 256 of 4096 counts with four pole pairs.
    for (counts, ok) in
        [(-256, true), (-200, true), (-400, true), (0, false), (256, false), (-20, false), (-600, false)]
    {
        let mut bench = align(counts);
        assert_eq!(
            (faults(&mut bench), bench.drive().duties.is_some()),
            if ok { (0, true) } else { (INIT_ERROR, false) }
        );
        assert_eq!(bench.has_flags(INITIALIZED), ok, "{counts}");
    }
}

#[test]
fn module_is_not_initialized_while_there_is_an_initialisation_error() {
    let mut bench = align(0);
    for commands in ["", "SAP 100, 0, 4000", "SAP 102, 0, 2", "SAP 14, 0, 1"] {
        bench.all(commands);
        bench.advance_ms(10);
        assert!(bench.has_flags(INIT_ERROR) && !bench.has_flags(INITIALIZED), "{commands}");
    }
    bench.set(15, 2);
    assert!(!bench.has_flags(INIT_ERROR) && bench.has_flags(INITIALIZED), "hall sensors commutate");
}

#[test]
fn failed_alignment_is_tried_again_on_request() {
    for retry in ["SAP 255, 0, 1", "SAP 15, 0, 3"] {
        let mut bench = align(0);
        assert_eq!(bench.exchange("ROR 0, 5").0, 6);
        bench.ask(retry);
        bench.advance_ms(120);
        bench.drive().encoder -= 256;
        bench.advance_ms(320);
        assert_eq!(faults(&mut bench), 0, "{retry}");
        assert!(bench.has_flags(INITIALIZED));
        assert_eq!(bench.exchange("ROR 0, 5").0, 100, "{retry}");
    }
}

#[test]
fn rotor_that_does_not_settle_ends_the_initialisation_with_an_error() {
    let mut bench = Bench::set_up("SAP 104, 0, 400; SAP 15, 0, 3");
    bench.drive().counts_per_tick = 1;
    bench.advance_ms(4_700);
    assert_eq!((bench.get(103), faults(&mut bench)), (1, 0), "it waits");
    bench.advance_ms(200);
    assert_eq!((bench.get(103), faults(&mut bench)), (0, INIT_ERROR), "twice its time and four seconds");
}
