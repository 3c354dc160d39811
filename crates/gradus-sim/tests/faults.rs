//! What a bench file can do to a module and its machine at a certain time.

use gradus_sim::{Bench, BenchFile, Eeprom, Link, LinkKind};
use gradus_tmcl::catalogue::{Ap, TMCM_3351};
use gradus_tmcl::{Instruction, Reply, Request};

const SECOND_US: u64 = 1_000_000;

/// A host at the module of a bench file.
struct Host {
    bench: Bench,
    link: Link,
}

impl Host {
    /// A motor that turns, and an event after a second.
    fn with_event(machine: &str, line: &str) -> Self {
        let text = format!("module = 'tmcm-3351'\n{machine}\n[[event]]\nat = 1\ndo = '{line}'");
        let file = BenchFile::parse(&text).unwrap_or_else(|problem| panic!("{problem}"));
        let mut bench = file.build(Eeprom::of(&TMCM_3351));
        let link = bench.attach(LinkKind::Usb, 0);
        Self { bench, link }
    }

    fn ask(&mut self, command: &str) -> Option<i32> {
        let instruction = Instruction::parse(command, &TMCM_3351).unwrap();
        self.bench.send(&mut self.link, &Request { address: 1, instruction }.emit());
        let reply = Reply::parse(&self.bench.take(&mut self.link)?).unwrap();
        assert!(reply.status.is_ok(), "{command}: {reply:?}");
        Some(reply.value)
    }

    /// What a command reads shortly before and half a second after the event.
    fn around(&mut self, command: &str) -> [Option<i32>; 2] {
        self.bench.run_until(SECOND_US - 1);
        let before = self.ask(command);
        self.bench.run_until(SECOND_US * 3 / 2);
        [before, self.ask(command)]
    }
}

#[test]
fn machine_faults_happen_at_their_time() {
    let travel = "axis.0.travel.left.at = -100";
    let cases = [
        (travel, "switch 0 left stuck 1", "GAP 11, 0", [Some(0), Some(1)]),
        ("", "temperature 0 150", "GAP 208, 0", [Some(0x80), Some(0x86)]),
        ("", "supply 9.5", "GIO 8, 1", [Some(240), Some(95)]),
        ("", "supply 7.5", "GIO 8, 1", [Some(240), None]),
        ("", "power off", "GAP 4, 0", [Some(51_200), None]),
        ("", "hang 1", "GAP 4, 0", [Some(51_200), None]),
    ];
    for (machine, line, command, expected) in cases {
        let found = Host::with_event(machine, line).around(command);
        let is_driver_state = command == "GAP 208, 0";
        let wanted = |value: i32| if is_driver_state { value & 0b110 } else { value };
        assert_eq!(found.map(|value| value.map(wanted)), expected.map(|value| value.map(wanted)), "{line}");
    }
}

#[test]
fn broken_encoder_cable_stops_the_counter_and_a_blocked_shaft_both() {
    for (line, shaft_turns) in [("encoder 0 off", true), ("block 0", false)] {
        let mut host = Host::with_event("axis.0 = { encoder = { counts_per_turn = 4096 } }", line);
        host.ask("ROR 0, 20000");
        host.bench.run_until(SECOND_US);
        let turns = |host: &mut Host| host.bench.machine().axes[0].plant.position();
        let (count, position) = (host.ask("GAP 209, 0"), turns(&mut host));
        host.bench.run_until(2 * SECOND_US);
        assert!(count.is_some_and(|count| count > 0), "{line}");
        let moved = (turns(&mut host) - position).abs();
        assert_eq!(moved > 10_000, shaft_turns, "{line}: {moved} microsteps");
        if shaft_turns {
            assert_eq!(host.ask("GAP 209, 0"), count, "{line}");
        }
    }
}

#[test]
fn switch_that_bounces_is_seen_more_than_once() {
    let edges = |bounce: &str| {
        let machine = format!("axis.0 = {{ motor = 'rigid', travel.right = {{ at = 0.05{bounce} }} }}");
        let mut host = Host::with_event(&machine, "in 0 1");
        host.ask("ROR 0, 10000");
        let mut last = Some(0);
        let mut edges = 0;
        for _ in 0..20_000 {
            host.bench.run_for(100);
            let level = host.ask("GAP 10, 0");
            edges += u32::from(level != last);
            last = level;
        }
        edges
    };
    assert_eq!(edges(""), 1);
    assert!(edges(", bounce = 0.005") > 1);
}

#[test]
fn reset_loses_the_ram_and_keeps_the_eeprom() {
    let mut host = Host::with_event("", "reset");
    host.ask("SAP 4, 0, 1000");
    host.ask("SGP 9, 2, 42");
    host.ask("STGP 9, 2");
    host.ask("ROR 0, 1000");
    host.bench.run_until(2 * SECOND_US);
    assert_eq!(host.ask("GAP 4, 0"), Some(51_200));
    assert_eq!((host.ask("GGP 9, 2"), host.ask("GAP 3, 0")), (Some(42), Some(0)));
}

#[test]
fn supply_that_is_too_low_resets_the_module() {
    let mut host = Host::with_event("", "supply 0");
    host.ask("SGP 9, 2, 42");
    host.bench.run_until(2 * SECOND_US);
    assert_eq!(host.ask("GGP 9, 2"), None);
    gradus_sim::console::execute("supply 24", &mut host.bench).unwrap();
    assert_eq!(host.ask("GGP 9, 2"), Some(0), "the RAM is lost");
}

#[test]
fn module_that_hung_goes_on_as_if_no_time_had_passed() {
    let mut host = Host::with_event("axis.0.motor = 'rigid'", "hang 1");
    host.ask("MVP ABS, 0, 102400");
    host.bench.run_until(SECOND_US);
    let position = host.bench.axis_parameter(0, Ap::ActualPosition);
    host.bench.run_until(10 * SECOND_US);
    assert_eq!(host.ask("GAP 1, 0"), None, "it does not answer");
    assert_eq!(host.bench.axis_parameter(0, Ap::ActualPosition), position);
    host.bench.hang(false);
    assert_eq!(host.ask("GAP 1, 0"), position);
    host.bench.run_for(SECOND_US);
    assert!(host.ask("GAP 3, 0").is_some_and(|speed| speed > 0), "it is still on its way");
    host.bench.run_for(SECOND_US * 3 / 2);
    assert_eq!(host.ask("GAP 1, 0"), Some(102_400));
    host.bench.hang(true);
    host.bench.reset();
    assert_eq!(host.ask("GAP 1, 0"), Some(0), "a reset ends it");
}

#[test]
fn power_cut_in_the_middle_of_a_write_leaves_the_old_or_the_new_value() {
    for writes in 0..20 {
        let mut host = Host::with_event("", "power off");
        host.ask("SGP 9, 2, 1");
        host.ask("STGP 9, 2");
        host.ask("SGP 9, 2, 2");
        host.bench.eeprom().cut_power_after(Some(writes));
        host.ask("STGP 9, 2");
        host.bench.run_until(2 * SECOND_US);
        host.bench.eeprom().cut_power_after(None);
        host.bench.power_on();
        let value = host.ask("GGP 9, 2");
        assert!(matches!(value, Some(1 | 2)), "{value:?} after {writes} writes");
    }
}
