//! Reference search on a motor with physics: it finds its switches, and ends when it cannot.

mod host;

use gradus_plant::{StepperAxis, Travel, Vane};
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use host::Host;

const SECOND_US: u64 = 1_000_000;

/// Bits of axis parameter 207.
const STALLED: i32 = 1;
const NOT_FOUND: i32 = 4;

/// Two turns of travel between end switches, which are before end stops.
const TRAVEL: Travel = Travel {
    left: Some(Vane::below(-51_200)),
    right: Some(Vane::above(51_200)),
    home: Some(Vane::between(19_500, 20_500)),
    ends: [Some(-60_000), Some(60_000)],
    bounce_us: [0; 3],
};

fn plant(host: &mut Host) -> &mut StepperAxis {
    &mut host.bench.machine().axes[0].plant
}

/// A host of a machine with this travel, on which a search of this mode has begun.
fn search(travel: Travel, mode: i32) -> Host {
    let mut bench = Bench::with_defaults(&TMCM_3351);
    bench.machine().axes[0].plant.travel = travel;
    let mut host = Host::new(bench);
    host.tell(&format!("SAP 5, 0, 512000; SAP 17, 0, 512000; SAP 194, 0, 51200; SAP 195, 0, 5120; SAP 193, 0, {mode}"));
    host.tell("RFS START, 0");
    host
}

/// How long the search takes, in seconds.
fn finish(host: &mut Host) -> f64 {
    let start = host.bench.now();
    while host.ask("RFS STATUS, 0") != 0 {
        host.bench.run_for(10_000);
        assert!(host.bench.now() < start + 300 * SECOND_US, "it runs for ever");
    }
    (host.bench.now() - start) as f64 / SECOND_US as f64
}

#[test]
fn zero_is_where_the_switch_is() {
    for (mode, zero) in [(1, -51_200), (65, 51_200), (2, -51_200), (5, 20_000), (6, 20_000), (7, 20_000)] {
        let mut host = search(TRAVEL, mode);
        finish(&mut host);
        assert_eq!(host.get(Ap::ExtendedErrorFlags), 0, "mode {mode}");
        host.bench.run_for(SECOND_US);
        // Friction and detent torque hold the rotor some microsteps beside the field.
        let at = plant(&mut host).position();
        assert!((at - zero).abs() < 40, "mode {mode}: zero is at {at}");
        assert_eq!(host.get(Ap::ActualPosition), 0);
        assert!(host.get(Ap::EncoderPosition).abs() < 40, "mode {mode}");
    }
}

/// Asserts that the bench has said once why the search has found nothing.
fn check_notice(host: &mut Host, reason: &str) {
    let texts: Vec<String> = host.bench.take_notices().into_iter().map(|notice| notice.text).collect();
    assert_eq!(texts, [format!("the reference search of axis 0 has found no zero: {reason}")]);
}

#[test]
fn search_that_begins_again_and_again_says_each_time_that_it_cannot_turn() {
    let mut host = search(TRAVEL, 1);
    finish(&mut host);
    host.tell("SAP 194, 0, 0");
    for _ in 0..3 {
        host.tell("RFS START, 0");
        finish(&mut host);
        check_notice(&mut host, "the search speed is 0");
    }
}

#[test]
fn search_that_the_user_ends_is_no_failure() {
    for command in ["RFS STOP, 0", "MST 0", "MVP ABS, 0, 0", "ROR 0, 100"] {
        let mut host = search(TRAVEL, 1);
        host.bench.run_for(SECOND_US / 10);
        host.tell(command);
        host.bench.run_for(SECOND_US);
        assert!(host.bench.take_notices().is_empty(), "{command}");
    }
}

#[test]
fn search_without_its_switch_ends_at_the_end_stop() {
    for (mode, travel) in [(1, Travel { left: None, ..TRAVEL }), (7, Travel { home: None, ..TRAVEL })] {
        let mut host = search(travel, mode);
        let seconds = finish(&mut host);
        // To the stop, then at most two turns of which the encoder sees nothing.
        assert!(seconds < 4.0, "mode {mode}: {seconds} s");
        assert_eq!(host.get(Ap::ExtendedErrorFlags), NOT_FOUND, "mode {mode}");
        check_notice(&mut host, "the shaft does not follow the motor");
    }
}

#[test]
fn search_of_a_blocked_shaft_ends() {
    let mut host = search(TRAVEL, 1);
    host.bench.run_for(SECOND_US / 2);
    plant(&mut host).block(true);
    let seconds = finish(&mut host);
    assert!(seconds < 2.5, "{seconds} s");
    assert_eq!(host.get(Ap::ExtendedErrorFlags), NOT_FOUND);
}

#[test]
fn search_of_a_shaft_without_encoder_ends_after_a_thousand_turns() {
    let mut host = search(TRAVEL, 1);
    plant(&mut host).encoder = None;
    host.tell("SAP 194, 0, 1000000");
    plant(&mut host).block(true);
    let seconds = finish(&mut host);
    assert!((50.0..55.0).contains(&seconds), "{seconds} s");
    // StallGuard2 has seen the block; without axis parameter 181 that stops nothing.
    assert_eq!(host.get(Ap::ExtendedErrorFlags), STALLED | NOT_FOUND);
    check_notice(&mut host, "no switch within 1000 turns of the motor");
}

#[test]
fn search_in_closed_loop_zeroes_ramp_and_encoder_alike() {
    let mut host = search(TRAVEL, 1);
    host.tell("RFS STOP, 0; SAP 129, 0, 1");
    host.bench.run_for(3 * SECOND_US);
    host.tell("RFS START, 0");
    finish(&mut host);
    host.bench.run_for(SECOND_US);
    let at = plant(&mut host).position();
    assert!((at + 51_200).abs() < 150, "zero is at {at}");
    assert_eq!([Ap::ExtendedErrorFlags, Ap::ActualPosition, Ap::PositionReached].map(|id| host.get(id)), [0, 0, 1]);
}
