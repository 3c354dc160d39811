//! Reference search, modes 1 to 3. Places of the machine are in 1/256 full steps, of which four are a microstep.

use gradus_plant::{Travel, Vane};

use crate::support::Host;

const LEFT: i64 = 0;
const HOME: i64 = 60_000;
const RIGHT: i64 = 200_000;

/// Half a millimetre of vane.
const VANE: i64 = 8_000;

/// A module after a search from a place, with a speed that finds an edge to a microstep, and where the shaft really was.
fn searched(mode: i32, start: i64, settings: &str) -> (Host, i64) {
    let mut host = Host::new();
    let plant = &mut host.bench.machine().axes[0].plant;
    let home = (mode == 3).then_some(Vane::between(HOME - VANE / 2, HOME + VANE / 2));
    plant.travel = Travel { left: Some(Vane::below(LEFT)), right: Some(Vane::above(RIGHT)), home, ..Travel::default() };
    plant.place(start);
    // The current pulls the rotor to a full step.
    host.ask("SAP 7, 0, 33");
    let start = host.shaft(0);
    host.all("SAP 194, 0, 1500; SAP 195, 0, 40");
    host.all(&format!("SAP 193, 0, {mode}; {settings}; RFS START, 0"));
    assert_ne!(host.ask("RFS STATUS, 0"), 0);
    host.until(60_000, |host| host.ask("RFS STATUS, 0") == 0);
    (host, start)
}

fn assert_near(value: i64, expected: i64, what: &str) {
    assert!((value - expected).abs() <= 2, "{what}: {value}, not {expected}");
}

/// Zero of the position counter, as a place of the machine.
fn zero(host: &mut Host) -> i64 {
    host.shaft(0) - 4 * i64::from(host.get(1, 0))
}

#[test]
fn each_mode_finds_its_switch_from_everywhere() {
    let edge_of_home = HOME + VANE / 2;
    for (mode, place, distance) in
        [(1, LEFT, None), (2, LEFT, Some(RIGHT - LEFT)), (3, edge_of_home, Some(RIGHT - edge_of_home))]
    {
        for start in [100_000, 150_000, -2_000, 202_000] {
            let what = format!("mode {mode} from {start}");
            let (mut host, start) = searched(mode, start, "");
            assert_near(zero(&mut host) / 4, place / 4, &what);
            assert_eq!((host.get(0, 0), host.get(1, 0), host.get(8, 0)), (0, 0, 1), "{what}");
            assert_near(i64::from(host.get(196, 0)), distance.unwrap_or(0) / 4, &format!("{what}, distance"));
            assert_near(i64::from(host.get(197, 0)), (place - start) / 4, &format!("{what}, last position"));
        }
    }
}

#[test]
fn disabled_and_enabled_stop_switches_make_no_difference() {
    for disabled in [0, 1] {
        let (mut host, _) = searched(2, 100_000, &format!("SAP 12, 0, {disabled}; SAP 13, 0, {disabled}"));
        assert_near(zero(&mut host) / 4, LEFT / 4, &format!("disabled {disabled}"));
    }
}

#[test]
fn soft_stop_brakes_at_the_switch_with_the_ramp() {
    let (mut host, _) = searched(1, 100_000, "SAP 149, 0, 1; SAP 5, 0, 100");
    assert_near(zero(&mut host) / 4, LEFT / 4, "soft stop");
}

#[test]
fn speed_is_that_of_parameter_194_then_195() {
    let mut host = Host::new();
    host.bench.machine().axes[0].plant.travel = Travel { left: Some(Vane::below(-20_000)), ..Travel::default() };
    host.all("SAP 194, 0, 800; SAP 195, 0, 40; SAP 149, 0, 1; SAP 5, 0, 50; RFS START, 0");
    let mut speeds = vec![];
    host.until(20_000, |host| {
        let speed = host.get(3, 0);
        if host.get(135, 0) == 0 && speed != 0 && speeds.last() != Some(&speed) {
            speeds.push(speed);
        }
        host.ask("RFS STATUS, 0") == 0
    });
    assert_eq!(speeds[..2], [-800, 40]);
}

#[test]
fn waiting_program_goes_on_when_zero_is_found() {
    let mut host = Host::new();
    host.bench.machine().axes[1].plant.travel = Travel { left: Some(Vane::below(-20_000)), ..Travel::default() };
    host.start(&["RFS START, 1", "WAIT RFS, 1, 0", "SIO 0, 2, 1", "STOP"]);
    host.run_ms(100);
    assert_eq!(host.bench.machine().io.outputs(), 0);
    host.until(20_000, |host| host.bench.machine().io.outputs() == 1);
    assert_eq!((host.get(1, 1), host.ask("RFS STATUS, 1")), (0, 0));
}

#[test]
fn stopped_search_zeroes_nothing() {
    let mut host = Host::new();
    host.all("SAP 1, 0, 5000; RFS START, 0");
    host.run_ms(50);
    host.ask("RFS STOP, 0");
    host.run_ms(500);
    assert_eq!((host.ask("RFS STATUS, 0"), host.get(3, 0), host.get(207, 0)), (0, 0, 0));
    assert!((1..5000).contains(&host.get(1, 0)), "{}", host.get(1, 0));
}

#[test]
fn search_that_cannot_move_is_no_success() {
    for setting in ["SAP 194, 0, 0", "SAP 195, 0, 0"] {
        let (mut host, _) = searched(1, 100_000, setting);
        assert_eq!((host.get(207, 0), host.get(197, 0)), (4, 0), "{setting}");
        host.ask("MVP ABS, 0, 0");
        assert_eq!(host.get(207, 0), 0, "{setting}");
    }
}

#[test]
fn search_without_a_switch_ends_after_a_thousand_turns() {
    for (resolution, turn) in [(6, 12_800), (2, 800)] {
        let mut host = Host::new();
        host.all(&format!("SAP 140, 0, {resolution}; SAP 153, 0, 3; SAP 154, 0, 1; SAP 5, 0, 1000; SAP 194, 0, 2047"));
        host.ask("RFS START, 0");
        host.until(120_000, |host| host.ask("RFS STATUS, 0") == 0);
        assert_eq!(host.get(207, 0), 4);
        let way = host.get(1, 0).abs();
        assert!((1_000 * turn..1_000 * turn + 100).contains(&way), "{way} microsteps of {turn} a turn");
    }
}
