//! A module with its encoder on the simulated machine.

mod host;

use gradus_plant::Encoder;
use gradus_sim::Bench;
use gradus_tmcl::catalogue::{Ap, TMCM_3351};

use host::Host;

const SECOND_US: u64 = 1_000_000;

/// A host of a bench with this encoder on axis 0, on which the commands have been executed.
fn host(encoder: Encoder, commands: &str) -> Host {
    let mut bench = Bench::rigid(&TMCM_3351);
    bench.machine().axes[0].plant.encoder = Some(encoder);
    let mut host = Host::new(bench);
    host.tell(commands);
    host
}

const FAST: &str = "SAP 4, 0, 500000; SAP 5, 0, 2000000; SAP 17, 0, 2000000";

#[test]
fn index_is_found_at_any_speed() {
    // Count 1000 of 4096 begins at 12 500 microsteps; at 500 000 pps a tick goes over four counts.
    let encoder = Encoder { index: Some(1_000), ..Encoder::default() };
    for speed in ["SAP 4, 0, 10000", "SAP 4, 0, 500000"] {
        let mut host = host(encoder, FAST);
        host.tell(speed);
        host.tell("SAP 201, 0, 28");
        host.tell("MVP ABS, 0, 50000");
        host.bench.run_for(10 * SECOND_US);
        let (motor, latch) = (host.get(Ap::LatchedPosition), host.get(Ap::LatchedEncoderPosition));
        assert_eq!(latch, 12_500, "{speed}");
        assert!((motor - latch).abs() <= 25, "{speed}: motor at {motor}");
    }
}

#[test]
fn encoder_that_is_cleared_at_the_index_shows_the_place_in_the_turn() {
    let mut host = host(Encoder::default(), FAST);
    host.tell("SAP 201, 0, 284");
    host.tell("MVP ABS, 0, 512500");
    host.bench.run_for(10 * SECOND_US);
    let (position, encoder) = (host.get(Ap::ActualPosition), host.get(Ap::EncoderPosition));
    assert_eq!((position, encoder), (512_500, 500));
}

#[test]
fn wrong_resolution_stops_the_motor_where_the_deviation_is_too_great() {
    // 4096 counts a turn taken for 4000: the encoder is 2.4 % ahead, 1000 microsteps after 41 667.
    let mut host = host(Encoder::default(), FAST);
    host.tell("SAP 210, 0, 4000");
    host.tell("SAP 212, 0, 1000");
    host.tell("MVP ABS, 0, 512000");
    host.bench.run_for(10 * SECOND_US);
    let shaft = host.bench.machine().axes[0].plant.position();
    assert!((41_667 - 700..41_667 + 700).contains(&shaft), "shaft at {shaft}");
    assert_eq!(host.get(Ap::ActualPosition), host.get(Ap::EncoderPosition));
    assert_eq!(host.get(Ap::ExtendedErrorFlags), 2);
}

#[test]
fn slipping_coupling_stops_the_motor() {
    for (settings, slip, limit_ms) in [("SAP 212, 0, 1000", 2_000, 1), ("SAP 213, 0, 30000", 100, 20)] {
        let mut host = host(Encoder::default(), FAST);
        host.tell(settings);
        host.tell("ROR 0, 51200");
        host.bench.run_for(SECOND_US);
        assert_eq!(host.get(Ap::ActualSpeed), 51_200, "{settings}: nothing slips");
        let mut after_ms = 0;
        while host.get(Ap::ActualSpeed) != 0 {
            let encoder = host.bench.machine().axes[0].plant.encoder.as_mut().unwrap();
            encoder.slip += slip;
            host.bench.run_for(1_000);
            after_ms += 1;
            assert!(after_ms <= limit_ms, "{settings}: still turning after {after_ms} ms");
        }
        assert_eq!(host.get(Ap::ExtendedErrorFlags), 2, "{settings}");
    }
}

#[test]
fn measured_speed_is_that_of_the_shaft() {
    let mut host = host(Encoder { counts_per_turn: 40_000, ..Encoder::default() }, FAST);
    host.tell("SAP 210, 0, 40000");
    host.tell("ROR 0, -300000");
    host.bench.run_for(SECOND_US);
    // A count in 8 ms is 160 pps.
    for id in [Ap::MeasuredSpeed, Ap::MeasuredSpeedNow] {
        let speed = host.get(id);
        assert!((speed + 300_000).abs() <= 160, "{id:?} {speed}");
    }
    host.tell("MST 0");
    host.bench.run_for(SECOND_US);
    assert_eq!([Ap::MeasuredSpeed, Ap::MeasuredSpeedNow].map(|id| host.get(id)), [0, 0]);
}
