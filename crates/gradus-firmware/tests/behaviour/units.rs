//! Unit mode: axis parameter 255.

use crate::support::Bench;

/// Speeds in 1/256 pps, accelerations in 1/4 pps^2.
const REGISTERS: &str = "SAP 255, 0, 0";

#[test]
fn registers_are_read_and_written_as_they_are() {
    for (number, pps, register) in [
        (2, -1_000, -256_000),
        (4, 51_200, 13_107_200),
        (15, 7, 1_792),
        (18, 1, 256),
        (20, 0, 0),
        (194, 8_388_607, 2_147_483_392),
        (195, 5_120, 1_310_720),
        (5, 51_200, 204_800),
        (16, 3, 12),
        (17, 536_870_911, 2_147_483_644),
        (19, 1, 4),
        (21, 10_000, 40_000),
        (22, 12_345, 12_345),
        (181, 1_000, 1_000),
        (108, 300_000, 300_000),
    ] {
        let mut bench = Bench::set_up(&format!("SAP {number}, 0, {pps}"));
        bench.ask(REGISTERS);
        assert_eq!(bench.get(number, 0), register, "AP {number}");
        bench.ask(&format!("SAP {number}, 0, {register}"));
        bench.ask("SAP 255, 0, 1");
        assert_eq!(bench.get(number, 0), pps, "AP {number}");
    }
}

#[test]
fn register_that_is_too_small_ends_at_its_largest_value_and_fractions_are_rounded() {
    let mut bench = Bench::set_up("SAP 4, 0, 16777215; SAP 5, 0, 2147483647; SAP 255, 0, 0");
    assert_eq!([4, 5].map(|number| bench.get(number, 0)), [i32::MAX, i32::MAX]);
    bench.all("SAP 4, 0, 127; SAP 15, 0, 128; SAP 5, 0, 5; SAP 17, 0, 6; SAP 255, 0, 1");
    assert_eq!([4, 15, 5, 17].map(|number| bench.get(number, 0)), [0, 1, 1, 2]);
}

#[test]
fn registers_take_31_bits_and_a_sign_where_there_is_one() {
    let mut bench = Bench::set_up(REGISTERS);
    for (command, status) in [
        ("SAP 4, 0, 2147483647", 100),
        ("SAP 4, 0, -1", 4),
        ("SAP 5, 0, -1", 4),
        ("SAP 2, 0, -2147483647", 100),
        ("ROR 0, 2147483647", 100),
        ("ROL 0, 2147483647", 100),
        ("SAP 3, 0, 1", 3),
        ("SAP 12, 0, 2", 4),
        // The mode is the axis's own.
        ("SAP 4, 1, 16777216", 4),
        ("ROR 1, 16777216", 4),
        ("SAP 255, 0, 2", 4),
    ] {
        assert_eq!(bench.exchange(command).0, status, "{command}");
    }
}

#[test]
fn motion_is_that_of_the_registers() {
    let mut bench = Bench::set_up(REGISTERS);
    // 1000.5 pps, 1000.25 pps^2.
    bench.all("SAP 4, 0, 256128; SAP 5, 0, 4001; SAP 17, 0, 4001; MVP ABS, 0, 100000");
    let took = bench.arrive(0) as f64 / 1e6;
    let want = 100_000.0 / 1_000.5 + 1_000.5 / 1_000.25;
    assert!((took - want).abs() < 1e-3, "{took} s, not {want} s");
    bench.ask("ROR 0, 128000");
    bench.advance_ms(2_000);
    assert_eq!((bench.get(2, 0), bench.get(3, 0)), (128_000, 500), "the actual speed is in pps");
}

#[test]
fn motion_goes_on_when_the_mode_changes() {
    for (before, after) in [(1, 0), (0, 1)] {
        let mut bench = Bench::set_up("SAP 4, 0, 20000; SAP 5, 0, 40000; SAP 17, 0, 40000");
        bench.all(&format!("SAP 255, 0, {before}; MVP ABS, 0, 40000"));
        bench.advance_ms(700);
        bench.ask(&format!("SAP 255, 0, {after}"));
        let left = bench.arrive(0);
        assert!((left as i64 - 1_800_000).abs() <= 300, "{left} us left of 2.5 s");
    }
}

#[test]
fn stops_and_searches_use_the_registers() {
    // 100000 pps^2 from 20000 pps: 2000 microsteps.
    let mut bench = Bench::set_up("SAP 21, 0, 100000; SAP 34, 0, 1; SAP 12, 0, 3; SAP 5, 0, 1000000; SAP 255, 0, 0");
    bench.ask("ROR 0, 5120000");
    bench.advance_ms(100);
    let before = bench.get(1, 0);
    bench.stage(0).switches.right = true;
    bench.advance_ms(500);
    let way = bench.get(1, 0) - before;
    assert!((way - 2_000).abs() <= 3, "{way}");

    let mut bench = Bench::set_up("SAP 194, 0, 30000; SAP 255, 0, 0; RFS START, 0");
    bench.advance_ms(2_000);
    assert_eq!(bench.get(3, 0), -30_000);
}

#[test]
fn restart_is_in_pps() {
    let mut bench = Bench::set_up(REGISTERS);
    bench.control(255, 0, 1234);
    bench.advance_ms(1);
    assert_eq!([255, 4].map(|number| bench.get(number, 0)), [1, 51_200]);
}
