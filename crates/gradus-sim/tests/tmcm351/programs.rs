//! The programs of the manual in `examples/tmcm-351`, and what they do.

use std::fs;
use std::path::Path;

use gradus_asm::{Options, assemble};
use gradus_plant::Encoder;
use gradus_sim::Machine;
use gradus_tmcl::catalogue::TMCM_351;

use crate::support::Host;

/// A module of motors on which an example runs.
fn running(example: &str, settings: &str) -> Host {
    let mut host = Host::on(Machine::of(&TMCM_351));
    host.bench.machine().axes[0].plant.encoder = Some(Encoder { counts_per_turn: 2000, ..Encoder::default() });
    host.all(settings);
    let path = format!("{}/../../examples/tmcm-351/{example}.tmc", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read(&path).unwrap();
    let assembly = assemble(path, &text, &TMCM_351, &Options::default(), &|path: &Path| fs::read(path));
    assert!(assembly.problems.is_empty(), "{:?}", assembly.problems);
    host.ask("DATA 132, 0, 0, 0");
    for instruction in assembly.program {
        assert_eq!(host.send(instruction).0, 101);
    }
    host.all("DATA 133, 0, 0, 0; DATA 129, 1, 0, 0");
    host
}

#[test]
fn simple_program_turns_two_motors_and_moves_the_third() {
    let mut host = running("two-positions", "");
    for (until_ms, speeds) in [(4900, [-500, 0]), (5100, [0, 250]), (9900, [0, 250]), (10_100, [0, 0])] {
        host.run_ms(until_ms - host.bench.now() / 1000);
        assert_eq!([0, 1].map(|axis| host.get(3, axis)), speeds, "after {until_ms} ms");
    }
    // 5 s of 500 and 250 units of 61.035 pps
    assert!((host.get(1, 0) + 152_588).abs() < 100 && (host.get(1, 1) - 76_294).abs() < 100);
    let mut reached = vec![];
    host.until(15_000, |host| {
        let position = host.get(1, 2);
        if host.get(0, 2) == position && position != 0 && reached.last() != Some(&position) {
            reached.push(position);
        }
        reached.len() == 4
    });
    assert_eq!(reached, [10_000, -10_000, 10_000, -10_000]);
}

#[test]
fn encoder_program_comes_to_its_ends_past_an_obstruction() {
    // A motor cannot speed up as fast as the units of the factory settings say.
    let mut host = running("encoder", "SAP 154, 0, 4; SAP 153, 0, 6");
    host.run_ms(1000);
    host.console("block 0");
    host.until(2000, |host| host.get(207, 0) == 1);
    assert_eq!(host.get(3, 0), 0);
    host.run_ms(3000);
    let blocked_at = host.get(209, 0);
    assert!((1000..127_000).contains(&blocked_at), "{blocked_at}");
    host.console("block 0 off");
    for end in [128_000, 0, 128_000] {
        host.until(60_000, |host| host.get(1, 0) == end && host.get(8, 0) == 1);
        host.run_ms(100);
        assert!((host.get(209, 0) - end).abs() <= 64, "encoder at {}, not {end}", host.get(209, 0));
    }
    assert_eq!(host.get(207, 0), 0);
}

#[test]
fn stall_reference_ends_where_the_motor_is_stopped() {
    let mut host = running("stall-reference", "SAP 154, 0, 4; SAP 153, 0, 7");
    host.run_ms(1500);
    assert_eq!((host.get(3, 0), host.ask("GGP 128, 0")), (-500, 1));
    host.console("block 0");
    host.until(1000, |host| host.ask("GGP 128, 0") == 0);
    assert_eq!((host.get(3, 0), host.get(1, 0), host.get(207, 0)), (0, 0, 2));
}

#[test]
fn routine_of_the_manual_waits_for_the_position() {
    let mut host = running("subroutine", "SAP 154, 0, 4; SAP 153, 0, 6");
    host.until(60_000, |host| host.get(1, 0) == 10_000 && host.get(8, 0) == 1);
}
