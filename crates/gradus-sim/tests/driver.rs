//! The driver chip on a motor with physics: QSH5718-51 with a light load at 24 V.

mod host;

use gradus_sim::{Bench, BenchFile, Eeprom, console};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use host::Host;

const MS_US: u64 = 1_000;

/// Microseconds of a full step at one turn a second.
const FULL_STEP_US: u64 = 5_000;

/// A turn a second.
const RPS: i32 = 51_200;

/// Torque in Nm of the whole run current of 255: 3.3 A RMS, and 1.01 Nm belong to 2.8 A.
const FULL_NM: f64 = 1.01 / 2.8 * 3.3;

/// A motor that turns with a speed at full current, after some settings.
fn turning(settings: &str, rps: f64) -> Host {
    turning_on(Bench::with_defaults(&TMCM_3351), settings, rps)
}

fn turning_on(bench: Bench, settings: &str, rps: f64) -> Host {
    let mut host = Host::new(bench);
    host.tell(&format!("SAP 6, 0, 255; SAP 5, 0, 2000000; {settings}; ROR 0, {}", (rps * f64::from(RPS)) as i32));
    host.bench.run_for(2_000 * MS_US);
    host
}

fn work(host: &mut Host, line: &str) {
    assert_eq!(console::execute(line, &mut host.bench).as_deref(), Ok(""), "{line}");
}

/// Loads the shaft with a share of the motor's torque. The friction of the bench belongs to it.
fn load(host: &mut Host, share: f64, rps: f64) {
    let friction_nm = 0.01 + 1e-3 * rps * std::f64::consts::TAU;
    work(host, &format!("load 0 {}", share * FULL_NM - friction_nm));
}

/// A bench with a noise of so many counts.
fn bench(noise: u32, seed: u64) -> Bench {
    let text = format!("module = 'tmcm-3351'\n[axis.0]\nstallguard = {{ noise = {noise}, seed = {seed} }}");
    BenchFile::parse(&text).unwrap().build(Eeprom::of(&TMCM_3351))
}

/// Microseconds after which a shaft that is blocked some time later is detected, if it is within a second.
fn stall_after_us(settings: &str, at_us: u64) -> Option<u64> {
    let mut host = turning_on(bench(10, at_us), settings, 1.0);
    host.tell("SAP 181, 0, 50000");
    host.bench.run_for(100 * MS_US);
    assert_eq!(host.get(Ap::ActualSpeed), RPS, "no stall without a block");
    host.bench.run_for(at_us);
    work(&mut host, "block 0");
    let blocked_us = host.bench.now();
    while host.get(Ap::ActualSpeed) != 0 {
        host.bench.run_for(100);
        if host.bench.now() > blocked_us + 1_000 * MS_US {
            return None;
        }
    }
    assert_eq!(host.get(Ap::ExtendedErrorFlags), 1);
    assert_eq!(host.get(Ap::DriverErrorFlags) & 1, 1);
    Some(host.bench.now() - blocked_us)
}

#[test]
fn blocked_shaft_is_detected_within_two_full_steps_or_eight_with_the_filter() {
    for at_us in (0..FULL_STEP_US).step_by(700) {
        let plain = stall_after_us("SAP 174, 0, 0", at_us).unwrap();
        let filtered = stall_after_us("SAP 174, 0, 1; SAP 173, 0, 1", at_us).unwrap();
        assert!(plain <= 2 * FULL_STEP_US, "{plain} us after {at_us}");
        assert!(filtered <= 8 * FULL_STEP_US, "{filtered} us after {at_us}");
    }
}

/// One turn a second: the reading of an overloaded motor is 0 at a threshold of 2.1, give or take the noise.
#[test]
fn threshold_says_how_likely_a_blocked_shaft_is_detected_in_a_full_step() {
    let found = [0, 2, 3, 5].map(|threshold| {
        let settings = format!("SAP 174, 0, {threshold}");
        (0..12).filter_map(|at| stall_after_us(&settings, at * 1_700)).collect::<Vec<_>>()
    });
    let mean = |times: &[u64]| times.iter().sum::<u64>() as f64 / times.len() as f64 / FULL_STEP_US as f64;
    println!("full steps: {:?}", found.each_ref().map(|times| (times.len(), mean(times))));
    assert_eq!(found.each_ref().map(Vec::len)[..2], [12, 12]);
    assert!(mean(&found[0]) < 1.5 && (1.0..5.0).contains(&mean(&found[1])), "{found:?}");
    assert!((1..12).contains(&found[2].len()), "25 counts above: seldom: {found:?}");
    assert!(found[3].is_empty(), "75 counts above: never: {found:?}");
    assert!(found[1].iter().collect::<std::collections::BTreeSet<_>>().len() > 3, "not the same each time: {found:?}");
}

/// Readings of a second, one a full step.
fn readings(host: &mut Host, rps: u64) -> Vec<f64> {
    let reading = |_| {
        host.bench.run_for(FULL_STEP_US / rps);
        f64::from(host.get(Ap::LoadValue))
    };
    (0..200 * rps).map(reading).collect()
}

fn deviation(readings: &[f64]) -> f64 {
    let mean = readings.iter().sum::<f64>() / readings.len() as f64;
    (readings.iter().map(|reading| (reading - mean).powi(2)).sum::<f64>() / readings.len() as f64).sqrt()
}

#[test]
fn reading_has_noise_that_its_load_does_not_change_and_a_filter_that_halves_it() {
    for share in [0.0, 0.5] {
        let [plain, filtered] = [0, 1].map(|filter| {
            let mut host = turning(&format!("SAP 174, 0, 12; SAP 173, 0, {filter}"), 3.0);
            load(&mut host, share, 3.0);
            host.bench.run_for(500 * MS_US);
            deviation(&readings(&mut host, 3))
        });
        println!("load {share}: {plain:.1}, filtered {filtered:.1} counts");
        // 10 counts of noise, and a ripple of 0.02 of the range of 330 counts.
        assert!((9.0..16.0).contains(&plain) && (3.5..7.0).contains(&filtered), "{share}: {plain}, {filtered}");
    }
    let mut host = Host::new(bench(0, 1));
    host.tell("SAP 6, 0, 255; SAP 5, 0, 2000000; SAP 174, 0, 12; SAP 173, 0, 1; ROR 0, 153600");
    host.bench.run_for(2_000 * MS_US);
    assert!(deviation(&readings(&mut host, 3)) < 1.5, "without noise");
}

/// What the chip shows at standstill: the share of the time that the chopper of coil A is on.
#[test]
fn reading_at_standstill_is_the_voltage_of_coil_a() {
    let mut host = Host::new(bench(0, 1));
    // All the current, 3.3 A RMS, for ever: 4.67 A in 0.83 ohm at 24 V. A full step on, coil A carries none.
    host.tell("SAP 6, 0, 255; SAP 7, 0, 255; MVP ABS, 0, 1024");
    host.bench.run_for(1_000 * MS_US);
    let expected = 1023.0 * 4.67 * 0.83 / 24.0;
    assert!((f64::from(host.get(Ap::LoadValue)) - expected).abs() < 3.0, "{}", host.get(Ap::LoadValue));
    assert_eq!(host.get(Ap::DriverErrorFlags) & 1, 0, "no stall");
    host.tell("MVP ABS, 0, 1280");
    host.bench.run_for(1_000 * MS_US);
    assert_eq!((host.get(Ap::LoadValue), host.get(Ap::DriverErrorFlags) & 1), (0, 0), "no stall either");
}

#[test]
fn warm_winding_lowers_the_reading() {
    let mut host = Host::new(bench(0, 1));
    host.tell("SAP 6, 0, 217; SAP 5, 0, 2000000; SAP 174, 0, 12; SAP 173, 0, 1; ROR 0, 153600");
    host.bench.run_for(2_000 * MS_US);
    let cold = mean(&readings(&mut host, 3));
    host.bench.run_for(300_000 * MS_US);
    let warm = mean(&readings(&mut host, 3));
    let winding_c = host.bench.readings(0).unwrap().winding_c;
    // 28 of 32 steps of 3.3 A RMS: 4.08 A; 0.39 % of 0.83 ohm a kelvin.
    let expected = 1000.0 * 4.08 * 0.83 * 0.0039 * (winding_c - 25.0) / 24.0;
    assert!((cold - warm - expected).abs() < 3.0 && expected > 5.0, "{cold} to {warm} at {winding_c} degC: {expected}");
}

fn mean(readings: &[f64]) -> f64 {
    readings.iter().sum::<f64>() / readings.len() as f64
}

/// The threshold that the book recommends: the largest at which the reading of an overloaded motor is 0.
#[test]
fn half_load_is_no_stall_with_the_recommended_threshold() {
    for (rps, threshold) in [(1.0, 2), (2.0, 4), (3.0, 6), (5.0, 10)] {
        let mut host = turning(&format!("SAP 174, 0, {threshold}; SAP 181, 0, {}", RPS / 2 + RPS / 4), rps);
        load(&mut host, 0.5, rps);
        host.bench.run_for(10_000 * MS_US);
        assert_eq!(host.get(Ap::ActualSpeed), (rps * f64::from(RPS)) as i32, "{rps} turns a second");
        work(&mut host, "load 0 1.5");
        host.bench.run_for(500 * MS_US);
        assert_eq!(host.get(Ap::ActualSpeed), 0, "{rps} turns a second");
    }
}

/// StallGuard2 reading at a share of the torque, a mean of 1 s.
fn mean_reading(host: &mut Host, share: f64, rps: f64) -> f64 {
    load(host, share, rps);
    host.bench.run_for(500 * MS_US);
    let readings = (0..200).map(|_| {
        host.bench.run_for(FULL_STEP_US);
        f64::from(host.get(Ap::LoadValue))
    });
    readings.sum::<f64>() / 200.0
}

#[test]
fn reading_falls_in_a_line_with_load_and_is_0_at_90_degrees() {
    let mut host = turning("SAP 174, 0, 6", 3.0);
    let readings = [0.0, 0.25, 0.5, 0.75].map(|share| mean_reading(&mut host, share, 3.0));
    let no_load = readings[0];
    assert!((250.0..400.0).contains(&no_load), "{readings:?}");
    for (reading, share) in readings.into_iter().zip([0.0, 0.25, 0.5, 0.75]) {
        let line = no_load * (1.0 - share);
        assert!((reading - line).abs() < 0.06 * no_load, "{readings:?}");
    }
}

#[test]
fn threshold_raises_the_reading() {
    let readings = [-10, 0, 6, 12, 63]
        .map(|threshold| mean_reading(&mut turning(&format!("SAP 174, 0, {threshold}"), 3.0), 0.3, 3.0));
    assert_eq!(readings[0], 0.0);
    assert!(readings.is_sorted_by(|a, b| a < b), "{readings:?}");
    assert!((readings[3] - readings[2] - 150.0).abs() < 5.0, "25 a step: {readings:?}");
    assert_eq!(readings[4], 1023.0);
}

/// CoolStep between readings of 64 and 128 at 3 turns a second.
const COOL: &str =
    "SAP 174, 0, 6; SAP 173, 0, 1; SAP 172, 0, 2; SAP 170, 0, 1; SAP 171, 0, 3; SAP 169, 0, 3; SAP 182, 0, 51200";

#[test]
fn cool_step_falls_to_its_least_current_and_is_back_within_100_ms_of_a_load_step() {
    for (least, expected) in [(0, 15), (1, 7)] {
        let mut host = turning(&format!("{COOL}; SAP 168, 0, {least}"), 3.0);
        assert_eq!(host.get(Ap::CoolStepCurrent), expected);
        load(&mut host, 0.2, 3.0);
        host.bench.run_for(500 * MS_US);
        let middle = host.get(Ap::CoolStepCurrent);
        load(&mut host, 0.85, 3.0);
        host.bench.run_for(100 * MS_US);
        assert_eq!(host.get(Ap::CoolStepCurrent), 31, "{middle} before");
        assert_eq!(host.get(Ap::ActualSpeed), 3 * RPS);
    }
}

#[test]
fn cool_step_rests_below_its_speed_and_when_it_is_off() {
    for (settings, rps) in [(COOL, 0.9), ("SAP 174, 0, 6", 3.0), ("SAP 174, 0, 6; SAP 172, 0, 0", 3.0)] {
        assert_eq!(turning(settings, rps).get(Ap::CoolStepCurrent), 31, "{settings}");
    }
}

#[test]
fn stealth_chop_is_used_up_to_its_speed() {
    for (settings, rps, mode) in [
        ("SAP 187, 0, 4; SAP 186, 0, 102400", 1.0, 1),
        ("SAP 187, 0, 4; SAP 186, 0, 102400", 3.0, 0),
        ("SAP 187, 0, 0; SAP 186, 0, 102400", 1.0, 0),
    ] {
        let mut host = turning(settings, rps);
        assert_eq!(host.get(Ap::PwmMode), mode, "{settings}, {rps}");
        assert_eq!(host.get(Ap::PwmScale) != 0, mode == 1, "{settings}, {rps}");
        assert_eq!(host.get(Ap::LoadValue) == 0, mode == 1, "StallGuard2 measures without StealthChop");
    }
}

/// AP 187 is how far the amplitude goes in a half wave, 10 ms apart at the longest.
#[test]
fn stealth_chop_comes_to_its_current_in_steps() {
    for (gradient, ms) in [(1, 430.0), (4, 110.0), (15, 30.0)] {
        let mut host = Host::new(Bench::with_defaults(&TMCM_3351));
        host.tell(&format!("SAP 6, 0, 255; SAP 7, 0, 255; SAP 188, 0, 200; SAP 187, 0, {gradient}; MVP ABS, 0, 1"));
        let started = host.bench.now();
        while host.bench.readings(0).unwrap().current_a < 0.97 * 3.3 {
            host.bench.run_for(MS_US);
            assert!(host.bench.now() < started + 2_000 * MS_US, "gradient {gradient}");
        }
        let took_ms = (host.bench.now() - started) as f64 * 1e-3;
        assert!((took_ms - ms).abs() < 0.2 * ms + 10.0, "gradient {gradient}: {took_ms} ms, not {ms}");
    }
}

/// AP 188 limits the amplitude, and with it the current: 20 of 374 of 24 V are 1.28 V RMS, 1.55 A in 0.83 ohm.
#[test]
fn stealth_chop_keeps_below_its_largest_amplitude() {
    let mut host = turning("SAP 7, 0, 255; SAP 187, 0, 4; SAP 188, 0, 20", 0.02);
    assert_eq!(host.get(Ap::PwmScale), 20);
    let current_a = host.bench.readings(0).unwrap().current_a;
    assert!((current_a - 1.55).abs() < 0.05, "{current_a} A");
}

/// TMC5160: the RMS voltage is supply * scale / 374; 3.3 A RMS in 0.83 ohms need 2.74 V at rest.
#[test]
fn stealth_chop_regulates_the_voltage_that_the_current_needs() {
    let mut host = turning("SAP 187, 0, 4", 0.02);
    let scale = host.get(Ap::PwmScale);
    assert!((scale - 43).abs() <= 2, "{scale}");
}

#[test]
fn coils_at_rest_are_as_freewheeling_and_standby_current_say() {
    // Turns after 0.2 s of a load that pulls.
    for (settings, holds, falls_fast) in [
        ("SAP 7, 0, 64", true, false),
        ("SAP 7, 0, 0", false, true),
        ("SAP 7, 0, 0; SAP 204, 0, 1", false, true),
        ("SAP 7, 0, 0; SAP 204, 0, 2", false, false),
        ("SAP 7, 0, 0; SAP 204, 0, 3", false, false),
    ] {
        let mut host = Host::new(Bench::with_defaults(&TMCM_3351));
        host.tell(settings);
        work(&mut host, "load 0 0.1");
        host.bench.run_for(200 * MS_US);
        let fallen = host.bench.machine().axes[0].plant.position().abs() as f64 / 51_200.0;
        assert_eq!((fallen < 0.01, fallen > 1.0), (holds, falls_fast), "{settings}: {fallen} turns");
    }
}

#[test]
fn faults_of_the_driver_are_flagged_and_switch_it_off() {
    // A line, the flags of parameter 208 (without standstill), and whether the motor goes on.
    for (line, flags, follows) in [
        ("temperature 0 119", 0, true),
        ("temperature 0 120", 4, true),
        ("temperature 0 150", 6, false),
        ("coil 0 a open", 32, true),
        ("coil 0 b open", 64, true),
        ("coil 0 a short", 8, false),
        ("coil 0 b short", 16, false),
    ] {
        let mut host = turning("SAP 174, 0, 63", 3.0);
        work(&mut host, line);
        host.bench.run_for(100 * MS_US);
        assert_eq!(host.get(Ap::DriverErrorFlags), flags, "{line}");
        host.bench.run_for(1_000 * MS_US);
        let before = host.bench.machine().axes[0].plant.position();
        host.bench.run_for(1_000 * MS_US);
        let turned = host.bench.machine().axes[0].plant.position() - before;
        assert_eq!(turned > 10_000, follows, "{line}: {turned} microsteps in a second");
    }
}

#[test]
fn driver_that_was_too_hot_comes_back_when_the_warning_is_gone() {
    let mut host = turning("SAP 174, 0, 63", 1.0);
    let flags = [160, 130, 119].map(|temperature_c| {
        work(&mut host, &format!("temperature 0 {temperature_c}"));
        host.bench.run_for(10 * MS_US);
        host.get(Ap::DriverErrorFlags)
    });
    assert_eq!(flags, [6, 6, 0]);
}

#[test]
fn short_is_over_when_the_drivers_have_been_off() {
    let mut host = turning("SAP 174, 0, 63", 1.0);
    let flags = ["coil 0 a short", "coil 0 a ok", "enable 0", "enable 1"].map(|line| {
        work(&mut host, line);
        host.bench.run_for(10 * MS_US);
        host.get(Ap::DriverErrorFlags) & 0x7f
    });
    assert_eq!(flags, [8, 8, 0, 0]);
}

#[test]
fn chopper_without_off_time_gives_no_current() {
    let mut host = turning("SAP 167, 0, 0", 1.0);
    host.bench.run_for(1_000 * MS_US);
    assert_eq!(host.bench.machine().axes[0].plant.position(), 0);
}

#[test]
fn supply_that_breaks_down_loses_a_fast_motor() {
    let mut host = turning("", 10.0);
    let turned = ["supply 24", "supply 2"].map(|line| {
        work(&mut host, line);
        host.bench.run_for(500 * MS_US);
        let before = host.bench.machine().axes[0].plant.position();
        host.bench.run_for(1_000 * MS_US);
        (host.bench.machine().axes[0].plant.position() - before) as f64 / 51_200.0
    });
    assert!((turned[0] - 10.0).abs() < 0.01 && turned[1].abs() < 5.0, "{turned:?} turns a second");
}

#[test]
fn unloaded_motor_stalls_neither_at_rest_nor_at_low_speed() {
    const STALL: i32 = 1;
    let mut host = Host::new(Bench::with_defaults(&TMCM_3351));
    host.tell("SAP 5, 0, 51200; SAP 17, 0, 51200; MVP ABS, 0, 40000");
    for _ in 0..300 {
        host.bench.run_for(10 * MS_US);
        assert_eq!(host.get(Ap::DriverErrorFlags) & STALL, 0);
    }
    assert_eq!((host.get(Ap::ActualPosition), host.get(Ap::ExtendedErrorFlags)), (40_000, 0));
}

#[test]
fn blocked_motor_stalls_without_a_speed_that_stops_it() {
    let mut host = turning("", 2.0);
    assert_eq!(host.get(Ap::ExtendedErrorFlags), 0);
    work(&mut host, "block 0");
    host.bench.run_for(200 * MS_US);
    assert_eq!(host.get(Ap::DriverErrorFlags) & 1, 1);
    assert_eq!(host.get(Ap::ExtendedErrorFlags), 1);
    assert_eq!(host.get(Ap::ActualSpeed), 102_400, "it goes on");
}
