use gradus_firmware::{AxisInputs, Io, LinkKind, Switches};
use gradus_tmcl::catalogue::{TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::{Instruction, Reply, Request};

use super::*;

fn bench() -> Bench {
    Bench::rigid(&TMCM_3351)
}

fn after(lines: &[&str]) -> Bench {
    let mut bench = bench();
    for line in lines {
        assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
    }
    bench
}

#[test]
fn inputs_take_their_level() {
    let mut bench = after(&["in 3 1", "  in\t5 1 ", "in 3 0", "", "in 7 1"]);
    assert_eq!(bench.machine().io.inputs(), 0b1010_0000);
}

#[test]
fn analogue_inputs_take_their_value() {
    let mut bench = after(&["analog 0 512", "analog 7 1023"]);
    assert_eq!([0, 1, 7].map(|port| bench.machine().io.analog(port)), [512, 0, 1023]);
}

#[test]
fn enable_input_takes_its_level() {
    assert!(!after(&["enable 0"]).machine().io.enable());
    assert!(after(&["enable 0", "enable 1"]).machine().io.enable());
}

#[test]
fn switches_are_forced_and_given_back() {
    let mut bench = after(&["switch 0 left 1", "switch 2 home 1", "switch 2 home auto", "switch 2 right 1"]);
    let levels = [0, 1, 2].map(|axis| bench.machine().axes[axis].switches());
    let open = Switches::default();
    assert_eq!(levels, [Switches { left: true, ..open }, open, Switches { right: true, ..open }]);
}

#[test]
fn machine_is_worked_by_hand() {
    let mut bench = Bench::with_defaults(&TMCM_3351);
    let lines = [
        "load 0 0.1",
        "friction 1 0.05",
        "push 2 7.2",
        "switch 0 home stuck 1",
        "supply 19.5",
        "temperature 0 120",
        "temperature 1 160",
        "temperature board 40",
        "coil 2 b open",
        "encoder 1 off",
    ];
    for line in lines {
        assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
    }
    bench.run_for(1_000_000);
    insta::assert_snapshot!(execute("show", &mut bench).unwrap(), @r"
    time 1.000000 s, power on, enable 1, supply 19.5 V, 40 degC
    axis 0: position 0, speed 0 pps, shaft -0.0013 turns, left 0, right 0, home 1 (forced), encoder -6
            load 0.100 Nm, friction 0.010 Nm, motor 0.107 Nm at 22.8 deg, 0.52 A, winding 25 degC, driver 120 degC, StallGuard 31
    axis 1: position 0, speed 0 pps, shaft 0.0000 turns, left 0, right 0, home 0, encoder 0 (cut off)
            load 0.000 Nm, friction 0.050 Nm, motor 0.000 Nm at 0.0 deg, 0.00 A, winding 25 degC, driver 160 degC, StallGuard 0
    axis 2: position 0, speed 0 pps, shaft 0.0200 turns, left 0, right 0, home 0, encoder 81
            load 0.000 Nm, friction 0.010 Nm, motor 0.000 Nm at 0.0 deg, 0.52 A, winding 25 degC, driver 40 degC, StallGuard 31
    inputs 0-7:  0 0 0 0 0 0 0 0
    outputs 0-7: 0 0 0 0 0 0 0 0
    analog 0: 0, 1: 0, 2: 0, 3: 0, 6: 0, 7: 0
    ");
}

#[test]
fn shaft_is_blocked_and_let_go() {
    let mut bench = Bench::with_defaults(&TMCM_3351);
    let turned = ["block 0", "load 0 2", "unblock 0", "block 0", "block 0 off"].map(|line| {
        let before = bench.machine().axes[0].plant.position();
        assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
        bench.run_for(1_000_000);
        bench.machine().axes[0].plant.position() != before
    });
    assert_eq!(turned, [false, false, true, false, true]);
}

#[test]
fn counts_are_lost_while_the_encoder_is_cut_off() {
    let mut bench = Bench::rigid(&TMCM_3351);
    let counts =
        ["push 0 90", "encoder 0 off", "push 0 90", "encoder 0 on", "push 0 90", "encoder 0 slip 90"].map(|line| {
            assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
            bench.machine().axes[0].plant.encoder_count()
        });
    assert_eq!(counts, [1024, 1024, 1024, 1024, 2048, 1024]);
}

#[test]
fn power_goes_and_comes() {
    assert!(!after(&["power off", "power off"]).has_power());
    assert!(after(&["power off", "power on", "power on"]).has_power());
}

#[test]
fn supply_below_the_least_of_the_module_resets_it() {
    for (module, least) in [(&TMCM_3351, 9), (&TMCM_351, 6), (&TMCM_1617, 6)] {
        let mut bench = Bench::with_defaults(module);
        let mut powers = |line: &str| {
            assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
            bench.run_for(1_000);
            bench.has_power()
        };
        let low = format!("supply {}.9", least - 1);
        let lines = [&format!("supply {least}"), &*low, "power on", "power off", "supply 24", "power on"];
        assert_eq!(lines.map(&mut powers), [true, false, false, false, false, true], "{}", module.name);
        assert!(!powers(&low), "{}", module.name);
        let shown = execute("show", &mut bench).unwrap();
        assert!(shown.contains("power off as the supply is too low"), "{shown}");
    }
    let mut bench = after(&["supply 3"]);
    bench.run_for(1_000_000);
    assert_eq!(execute("supply 24", &mut bench).as_deref(), Ok(""));
    assert!(bench.has_power(), "it comes back by itself");
}

#[test]
fn wrong_lines_get_a_message_and_change_nothing() {
    let cases = [
        ("on", "there is no command `on`; `help` lists them"),
        ("IN 3 1", "there is no command `IN`; `help` lists them"),
        ("in 3", "usage: in PORT(0-7) 0|1"),
        ("in 3 1 1", "usage: in PORT(0-7) 0|1"),
        ("in 8 1", "`8` is no PORT(0-7); usage: in PORT(0-7) 0|1"),
        ("in 3 high", "`high` is no 0|1; usage: in PORT(0-7) 0|1"),
        ("analog 4 1", "`4` is no 0|1|2|3|6|7; usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
        ("analog 0 1024", "`1024` is no VALUE(0-1023); usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
        ("analog 0 -1", "`-1` is no VALUE(0-1023); usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
        ("switch 3 left 1", "`3` is no AXIS; usage: switch AXIS left|right|home 0|1|auto"),
        ("switch 0 up 1", "`up` is no left|right|home; usage: switch AXIS left|right|home 0|1|auto"),
        ("power", "usage: power off|on"),
        ("switch 0", "usage: switch AXIS left|right|home 0|1|auto, or switch AXIS left|right|home stuck 0|1"),
        ("switch 0 home stuck 2", "`2` is no 0|1; usage: switch AXIS left|right|home stuck 0|1"),
        ("load 0 heavy", "`heavy` is no NM(-1000..1000); usage: load AXIS NM(-1000..1000)"),
        ("load 0 nan", "`nan` is no NM(-1000..1000); usage: load AXIS NM(-1000..1000)"),
        ("block 3", "`3` is no AXIS; usage: block AXIS"),
        ("block 0 on", "`on` is no off; usage: block AXIS off"),
        ("temperature 0 hot", "`hot` is no DEGC(-55..200); usage: temperature AXIS DEGC(-55..200)"),
        ("supply 61", "`61` is no VOLTS(0..60); usage: supply VOLTS(0..60)"),
    ];
    for (line, message) in cases {
        let mut changed = bench();
        let error = execute(line, &mut changed).unwrap_err();
        assert_eq!(error.to_string(), message, "{line}");
        assert_eq!(changed.machine(), bench().machine(), "{line}");
    }
}

#[test]
fn only_lines_that_change_the_machine_are_changes() {
    let problem = |line| Change::parse(line, &TMCM_3351).err().map(|error| error.to_string());
    assert_eq!(problem("switch 2 home 1"), None);
    assert_eq!(problem(" show "), Some("`show` changes nothing".into()));
    assert_eq!(problem(""), Some("`` changes nothing".into()));
    assert_eq!(problem("in 3"), Some("usage: in PORT(0-7) 0|1".into()));
}

#[test]
fn help_lists_every_command() {
    let text = execute("help", &mut bench()).unwrap();
    assert_eq!(text.lines().count(), COMMANDS.len());
    assert!(text.contains("switch AXIS left|right|home 0|1|auto"), "{text}");
}

#[test]
fn show_tells_the_state_of_the_machine() {
    let mut bench = after(&["in 3 1", "analog 0 512", "switch 1 left 1", "power off"]);
    bench.machine().axes[2].plant.place(25_600);
    bench.machine().axes[1].plant.encoder = None;
    let expected = "\
time 0.000000 s, power off, enable 1, supply 24.0 V, 25 degC
axis 0: shaft 0.0000 turns, left 0, right 0, home 0, encoder 0
axis 1: shaft 0.0000 turns, left 1 (forced), right 0, home 0, no encoder
axis 2: shaft 0.5000 turns, left 0, right 0, home 0, encoder 2048
inputs 0-7:  0 0 0 1 0 0 0 0
outputs 0-7: 0 0 0 0 0 0 0 0
analog 0: 512, 1: 0, 2: 0, 3: 0, 6: 0, 7: 0
";
    assert_eq!(execute("show", &mut bench).as_deref(), Ok(expected));
}

/// Status and value of the answer on an RS-485 line, if the module with this address answers.
fn ask(bench: &mut Bench, address: u8, line: &str) -> Option<(u8, i32)> {
    let mut link = bench.attach(LinkKind::Rs485, 0);
    let instruction = Instruction::parse(line, bench.catalogue()).unwrap();
    bench.send(&mut link, &Request { address, instruction }.emit());
    let reply = Reply::parse(&bench.take(&mut link)?).unwrap();
    Some((reply.status.0, reply.value))
}

#[test]
fn module_that_cannot_be_reached_any_more_is_reset_by_its_hardware() {
    for catalogue in [&TMCM_3351, &TMCM_351, &TMCM_1617] {
        let mut bench = Bench::rigid(catalogue);
        ask(&mut bench, 1, "SGP 7, 2, 70");
        ask(&mut bench, 1, "STGP 7, 2");
        ask(&mut bench, 1, "SGP 66, 0, 77");
        for line in ["reset", "hang 1"] {
            execute(line, &mut bench).unwrap();
            assert_eq!(ask(&mut bench, 1, "GGP 66, 0"), None, "{}: {line} does not help", catalogue.name);
        }
        execute("reset factory", &mut bench).unwrap();
        assert_eq!(ask(&mut bench, 1, "GGP 66, 0"), Some((100, 1)), "{}", catalogue.name);
        assert_eq!(ask(&mut bench, 1, "GGP 7, 2"), Some((100, 0)), "{}", catalogue.name);
        execute("power off", &mut bench).unwrap();
        execute("reset factory", &mut bench).unwrap();
        assert_eq!(ask(&mut bench, 1, "GGP 66, 0"), Some((100, 1)), "{}: it ends with the power on", catalogue.name);
    }
}

#[test]
fn reset_by_hardware_starts_no_program_and_shows_no_protected_one() {
    for (protection, kept) in [(0, true), (1, false)] {
        let mut bench = bench();
        ask(&mut bench, 1, "DATA 132, 0, 0, 0");
        for line in ["SIO 0, 2, 1", "JA 0", "DATA 133, 0, 0, 0", "SGP 77, 0, 1"] {
            ask(&mut bench, 1, line);
        }
        ask(&mut bench, 1, &format!("SGP 81, 0, {protection}"));
        execute("reset", &mut bench).unwrap();
        bench.run_for(1000);
        assert_eq!(ask(&mut bench, 1, "GGP 128, 0"), Some((100, 1)), "it starts by itself");
        execute("reset factory", &mut bench).unwrap();
        bench.run_for(1000);
        assert_eq!(ask(&mut bench, 1, "GGP 128, 0"), Some((100, 0)));
        ask(&mut bench, 1, "DATA 129, 1, 0, 0");
        bench.run_for(1000);
        assert_eq!(bench.machine().io.outputs() & 1 != 0, kept, "protection {protection}");
    }
}

#[test]
fn reset_by_hardware_is_an_event_of_a_bench() {
    let mut bench = bench();
    ask(&mut bench, 1, "SGP 66, 0, 77");
    bench.schedule(5_000, Change::parse("reset factory", &TMCM_3351).unwrap());
    bench.run_until(4_999);
    assert_eq!(ask(&mut bench, 1, "GGP 66, 0"), None);
    bench.run_until(5_000);
    assert_eq!(ask(&mut bench, 1, "GGP 66, 0"), Some((100, 1)));
}
