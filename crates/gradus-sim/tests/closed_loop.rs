//! Closed loop on a motor with physics: QSH5718-51 with a light load at 24 V, and the settings of the manual's program in
//! section 6.3.

mod host;

use gradus_plant::{Encoder, Mechanics, StepperAxis};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use host::Host;

const SECOND_US: u64 = 1_000_000;
const MS_US: u64 = 1_000;

/// The manual's program without what belongs to the start-up. Without stops on deviation, if an overload is to be survived.
const MANUAL: &str = "SAP 6, 0, 85; SAP 7, 0, 10; SAP 210, 0, 10000; SAP 108, 0, 300000; SAP 109, 0, 1600000; SAP 110, 0, 255;
    SAP 111, 0, 255; SAP 113, 0, 50; SAP 114, 0, 255; SAP 126, 0, 255; SAP 125, 0, 255; SAP 134, 0, 100; SAP 120, 0, 1000;
    SAP 121, 0, 10000; SAP 115, 0, 3000; SAP 116, 0, 20; SAP 117, 0, 2000; SAP 118, 0, 0; SAP 119, 0, 100000;
    SAP 124, 0, 65536; SAP 4, 0, 600000; SAP 5, 0, 800000; SAP 17, 0, 800000";

/// Torque of the motor at the run current of the program in Nm: 85 is the driver chip's step 11 of 32 to 3.3 A RMS, and
/// 1.01 Nm belong to 2.8 A.
const FULL_NM: f64 = 1.01 / 2.8 * 3.3 * 11.0 / 32.0;

fn open() -> Host {
    let mut bench = Bench::with_defaults(&TMCM_3351);
    plant(&mut bench).encoder = Some(Encoder { counts_per_turn: 10_000, ..Encoder::default() });
    let mut host = Host::new(bench);
    host.tell(MANUAL);
    host
}

fn closed(settings: &str) -> Host {
    let mut host = open();
    host.tell(settings);
    host.tell("SAP 129, 0, 1");
    host.bench.run_for(2_100 * MS_US);
    assert_eq!(host.get(Ap::ClInitialized), 1);
    host
}

fn plant(bench: &mut Bench) -> &mut StepperAxis {
    &mut bench.machine().axes[0].plant
}

fn set_load(host: &mut Host, load_nm: f64) {
    let plant = plant(&mut host.bench);
    let mechanics = *plant.mechanics().unwrap();
    plant.set_mechanics(Mechanics { load_nm, ..mechanics });
}

/// A load for a time.
fn load_for(host: &mut Host, load_nm: f64, ms: u64) {
    set_load(host, load_nm);
    host.bench.run_for(ms * MS_US);
    set_load(host, 0.0);
}

/// How far the shaft is from where the module was told to put it, in microsteps.
fn deviation(host: &mut Host) -> i64 {
    i64::from(host.get(Ap::ActualPosition)) - plant(&mut host.bench).position()
}

#[test]
fn load_that_loses_steps_in_open_loop_is_held_in_closed_loop() {
    let lost = |host: &mut Host, load: f64| {
        let before = deviation(host);
        host.tell("SAP 4, 0, 50000; MVP REL, 0, 100000");
        for sign in [1.0, -1.0] {
            host.bench.run_for(500 * MS_US);
            load_for(host, sign * load * FULL_NM, 60);
        }
        host.bench.run_for(6 * SECOND_US);
        deviation(host) - before
    };
    for load in [0.9, 1.1] {
        let open = lost(&mut open(), load);
        assert!(open.abs() >= 1_000, "open loop lost only {open} microsteps under {load} times its torque");
        for settings in ["", "SAP 126, 0, 0"] {
            let closed = lost(&mut closed(settings), load);
            assert!(closed.abs() < 30, "closed loop lost {closed} microsteps, {load}, {settings}");
        }
    }
}

#[test]
fn load_peak_during_a_move_is_caught_up_and_the_target_reached() {
    for load in [1.2, -1.2] {
        let mut host = closed("");
        host.tell("MVP ABS, 0, 300000");
        host.bench.run_for(700 * MS_US);
        load_for(&mut host, load * FULL_NM, 40);
        let behind = deviation(&mut host);
        assert!(behind.abs() > 1_000, "the peak was felt: {behind}");
        host.bench.run_for(1_500 * MS_US);
        assert_eq!([Ap::ActualPosition, Ap::PositionReached].map(|id| host.get(id)), [300_000, 1]);
        assert!(deviation(&mut host).abs() < 30, "{}", deviation(&mut host));
    }
}

#[test]
fn torque_mode_gives_a_torque_in_proportion() {
    // A brake whose torque is proportional to the speed, and all the current that the module has: 1.01 Nm at 2.8 A.
    const BRAKE: f64 = 0.1;
    const FULL_NM: f64 = 1.01 / 2.8 * 3.3;
    for torque in [-255, -128, -40, 30, 80, 160, 255] {
        let mut host = closed("SAP 6, 0, 255");
        let mechanics = Mechanics { viscous_nms: BRAKE, friction_nm: 0.0, ..Mechanics::default() };
        plant(&mut host.bench).set_mechanics(mechanics);
        host.tell(&format!("SAP 50, 0, {torque}"));
        host.bench.run_for(SECOND_US);
        let start = plant(&mut host.bench).position();
        host.bench.run_for(SECOND_US);
        let turns = (plant(&mut host.bench).position() - start) as f64 / 51_200.0;
        let got = turns * std::f64::consts::TAU * BRAKE;
        let want = FULL_NM * f64::from(torque) / 255.0;
        assert!((got - want).abs() < 0.1 * want.abs(), "AP 50 = {torque}: {got:.4} Nm, not {want:.4} Nm");
    }
}

#[test]
fn current_without_load_falls_to_its_minimum() {
    for settings in ["", "SAP 126, 0, 100"] {
        let mut host = closed(settings);
        host.tell("MVP REL, 0, 51200");
        host.bench.run_for(2 * SECOND_US);
        assert_eq!(host.get(Ap::ClScaler), 50, "{settings}");
        let current = host.bench.readings(0).unwrap().current_a;
        let want = 3.3 * 11.0 / 32.0 * 50.0 / 255.0;
        assert!((current - want).abs() <= 0.01 * want, "{current} A, not {want} A");
        set_load(&mut host, 0.5 * FULL_NM);
        host.bench.run_for(SECOND_US);
        assert!(host.get(Ap::ClScaler) > 100, "more under load");
    }
}

#[test]
fn field_weakening_gives_torque_at_a_speed_beyond_the_reach_of_the_supply() {
    let speed = |gamma: i32| {
        let mut host = closed(&format!("SAP 110, 0, {gamma}; SAP 115, 0, 16777215; SAP 119, 0, 1073741823"));
        host.tell("SAP 50, 0, 255");
        host.bench.run_for(3 * SECOND_US);
        host.get(Ap::MeasuredSpeed)
    };
    // By half a right angle: the whole one, which is there from 900 000 pps on, leaves no torque at more than that. So it is
    // with the independent model of `tools/reference`.
    let (without, with) = (speed(0), speed(128));
    assert!(f64::from(with) > 1.15 * f64::from(without), "{with} pps with field weakening, {without} pps without");
}

#[test]
fn fast_move_keeps_the_deviations_of_the_manual() {
    // Current from the first microstep of error: the printed 255 leaves the current at its minimum up to the largest angle.
    let mut host = closed("SAP 126, 0, 0; SAP 212, 0, 1000; SAP 213, 0, 30000");
    host.tell("MVP ABS, 0, 1000000");
    host.bench.run_for(4 * SECOND_US);
    assert_eq!([Ap::ExtendedErrorFlags, Ap::PositionReached].map(|id| host.get(id)), [0, 1]);
    assert!(deviation(&mut host).abs() < 50, "{}", deviation(&mut host));
}

/// How a standing motor comes back after a peak of 1.2 times its torque for 40 ms: the farthest that the shaft was behind and
/// ahead, in microsteps, and the time from the end of the peak until it stays within 100 microsteps.
fn recovery(speed_p: u32, inertia_gcm2: u32) -> String {
    let mut host = closed(&format!("SAP 126, 0, 0; SAP 115, 0, {speed_p}"));
    let inertia_kgm2 = f64::from(inertia_gcm2) * 1e-7;
    plant(&mut host.bench).set_mechanics(Mechanics { inertia_kgm2, ..Mechanics::default() });
    load_for(&mut host, 1.2 * FULL_NM, 40);
    let (mut behind, mut ahead, mut late_ms) = (deviation(&mut host), 0, 0);
    for ms in 1..=2_000 {
        host.bench.run_for(MS_US);
        let deviation = deviation(&mut host);
        (behind, ahead) = (behind.max(deviation), ahead.max(-deviation));
        if deviation.abs() > 100 {
            late_ms = ms;
        }
    }
    format!("{behind:>7} {ahead:>4} {late_ms:>5}")
}

#[test]
fn recovery_from_an_overload_by_gain_and_inertia() {
    let mut grid = String::from("115     inertia   behind ahead   ms\n");
    for speed_p in [1_000, 3_000, 10_000, 30_000] {
        for inertia in [100, 500, 2_000] {
            grid += &format!("{speed_p:>6} {inertia:>5} gcm2 {}\n", recovery(speed_p, inertia));
        }
    }
    insta::assert_snapshot!(grid, @"
    115     inertia   behind ahead   ms
      1000   100 gcm2   18134   44   265
      1000   500 gcm2   11900  194   264
      1000  2000 gcm2    5660  222   329
      3000   100 gcm2   18134   67   209
      3000   500 gcm2   11900  194   204
      3000  2000 gcm2    5660  293   289
     10000   100 gcm2   18134   89   190
     10000   500 gcm2   11900  142   156
     10000  2000 gcm2    5660   49    78
     30000   100 gcm2   18134   51   184
     30000   500 gcm2   11900  132   147
     30000  2000 gcm2    5660  507   309
    ");
}

#[test]
fn motor_stands_when_the_line_of_its_encoder_is_cut() {
    for (settings, flags) in [("SAP 212, 0, 0", 0), ("SAP 212, 0, 1000", 2)] {
        let mut host = closed(settings);
        host.tell("SAP 4, 0, 100000; MVP ABS, 0, 100000");
        host.bench.run_for(600 * MS_US);
        plant(&mut host.bench).cut_encoder(true);
        let cut_at = plant(&mut host.bench).position();
        host.bench.run_for(SECOND_US);
        let way = plant(&mut host.bench).position() - cut_at;
        assert!(way.abs() <= 512, "{settings}: {way} microsteps further");
        assert_eq!([Ap::PositionReached, Ap::ExtendedErrorFlags].map(|id| host.get(id)), [0, flags], "{settings}");
    }
}
