//! Motion: moves, groups, lines, switches, currents.

use gradus_plant::{Travel, Vane};

use crate::support::{Host, SECOND_US};

#[test]
fn move_takes_the_time_of_its_trapezoid() {
    let mut host = Host::new();
    host.all("SAP 4, 2, 500; SAP 5, 2, 50; MVP ABS, 2, 10000");
    let start = host.bench.now();
    host.arrive(2);
    let seconds = (host.bench.now() - start) as f64 / SECOND_US as f64;
    // 500 * 16e6 / (2^2 * 65536) pps and 50 * 16e6^2 / 2^(2 + 3 + 29) pps^2
    let (v, a) = (30_517.6, 745_058.0);
    let trapezoid = 10_000.0 / v + v / a;
    assert!((trapezoid..trapezoid + 0.005).contains(&seconds), "{seconds} s, trapezoid {trapezoid} s");
    assert_eq!((host.get(1, 2), host.get(135, 2)), (10_000, 0));
}

#[test]
fn acceleration_is_read_while_the_speed_changes() {
    let mut host = Host::new();
    host.all("SAP 5, 0, 10; ROR 0, 1000");
    host.run_ms(50);
    assert_eq!(host.get(135, 0), 10);
    host.run_ms(2000);
    assert_eq!((host.get(135, 0), host.get(3, 0)), (0, 1000));
}

#[test]
fn target_in_velocity_mode_is_a_register() {
    let mut host = Host::new();
    host.all("ROR 0, 0; SAP 0, 0, 1000");
    host.run_ms(500);
    assert_eq!((host.get(0, 0), host.get(1, 0)), (1000, 0));
    host.ask("SAP 138, 0, 0");
    host.arrive(0);
    assert_eq!(host.get(1, 0), 1000);
}

#[test]
fn positions_have_32_bits() {
    let mut host = Host::new();
    host.all(
        "SAP 154, 0, 0; SAP 153, 0, 0; SAP 4, 0, 2047; SAP 5, 0, 2047; SAP 1, 0, 2147483000; MVP ABS, 0, -2147483000",
    );
    host.arrive(0);
    assert_eq!(host.get(1, 0), -2_147_483_000);
}

#[test]
fn line_brings_the_motors_of_its_mask_to_a_coordinate_together() {
    let mut host = Host::new();
    host.all("SCO 2, 0, 20000; SCO 2, 1, -10000; SCO 2, 2, 5000; MVP COORD, $47, 2");
    for _ in 0..100 {
        host.run_ms(1);
        let [a, b, c] = [0, 1, 2].map(|axis| host.get(1, axis));
        assert!((a + 2 * b).abs() <= 3 && (a - 4 * c).abs() <= 5, "{a} {b} {c}");
    }
    (0..3).for_each(|axis| host.arrive(axis));
    assert_eq!([0, 1, 2].map(|axis| host.get(1, axis)), [20_000, -10_000, 5000]);
    host.all("SCO 3, 0, 0; SCO 3, 1, 0; SCO 3, 2, 0; MVP COORD, $85, 3");
    (0..3).for_each(|axis| host.arrive(axis));
    assert_eq!([0, 1, 2].map(|axis| host.get(1, axis)), [0, -10_000, 0]);
}

#[test]
fn switch_stops_at_once_or_with_the_ramp() {
    for (soft, farthest) in [(0, 20_100), (1, 27_000)] {
        let mut host = Host::new();
        // 20000 microsteps of the plant are 5000 of the ramp.
        host.bench.machine().axes[0].plant.travel = Travel { right: Some(Vane::above(80_000)), ..Travel::default() };
        host.all(&format!("SAP 12, 0, 0; SAP 149, 0, {soft}; SAP 5, 0, 20; ROR 0, 1000"));
        host.run_ms(3000);
        let position = host.get(1, 0);
        assert_eq!(host.get(3, 0), 0);
        assert!((20_000..farthest).contains(&position), "soft stop {soft}: {position}");
        assert_eq!(position > 20_100, soft == 1, "soft stop {soft}: {position}");
    }
}

#[test]
fn three_switch_mode_does_not_stop_at_the_reference_switch() {
    for (mode, tolerance, stops) in [(3, 1000, false), (3, 10, true), (1, 1000, true)] {
        let mut host = Host::new();
        host.all(&format!("SAP 13, 0, 0; SAP 193, 0, {mode}; SAP 141, 0, {tolerance}; SAP 1, 0, 3000; ROL 0, 500"));
        host.until(2000, |host| host.get(1, 0) <= 500);
        host.console("switch 0 home 1");
        host.until(2000, |host| host.get(1, 0) <= 0 || host.get(3, 0) == 0);
        host.console("switch 0 home 0");
        assert_eq!(host.get(3, 0) == 0, stops, "mode {mode}, tolerance {tolerance}");
    }
}
