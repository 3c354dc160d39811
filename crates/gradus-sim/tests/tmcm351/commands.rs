//! Commands: what the module has, what it lacks, and the SPI bus.

use gradus_sim::SpiDevice;

use crate::support::Host;

#[test]
fn module_says_what_it_is() {
    let mut host = Host::new();
    assert_eq!(host.ask("DATA 136, 1, 0, 0"), 0x015f_042d);
    assert_eq!(host.ask("DATA 157, 0, 0, 0"), 351);
}

#[test]
fn commands_that_it_lacks() {
    let mut host = Host::new();
    for opcode in (40..=57).chain([80, 16, 17, 18]) {
        assert_eq!(host.exchange(&format!("DATA {opcode}, 0, 0, 0")).0, 2, "command {opcode}");
    }
    assert_eq!(host.exchange("DATA 255, 0, 0, 1234").0, 6);
    assert_eq!(host.exchange("DATA 6, 1, 3, 0").0, 4);
}

#[test]
fn program_memory_holds_2048_commands() {
    let mut host = Host::new();
    host.ask("DATA 132, 0, 0, 2047");
    assert_eq!(host.exchange("STOP").0, 101);
    assert_eq!(host.exchange("STOP").0, 4);
    host.ask("DATA 133, 0, 0, 0");
    assert_eq!(host.exchange("DATA 132, 0, 0, 2048").0, 4);
}

#[test]
fn sac_exchanges_bytes_with_the_device_of_its_bus() {
    let mut host = Host::new();
    host.bench.machine().io.spi = [
        SpiDevice::Loopback,
        SpiDevice::Outputs(0),
        SpiDevice::Script { exchanges: vec!["9F000000: 00C22017".parse().unwrap()], next: 0 },
    ];
    for (line, reply) in [
        ("SAC 0, 1, 258", 2),
        ("SAC 0, 3, $123456", 0x0012_3456),
        ("SAC 0, 4, -2", -2),
        ("SAC 2, 1, $A5", 0),
        ("SAC 2, 2, $0102", 0xa501),
        ("SAC 3, 4, $9F000000", 0x00c2_2017),
        ("SAC 3, 1, 5", 0),
    ] {
        assert_eq!(host.ask(line), reply, "{line}");
    }
    assert_eq!(host.bench.machine().io.spi[1], SpiDevice::Outputs(2));
    for (line, status) in [("SAC 1, 1, 0", 3), ("SAC 4, 1, 0", 3), ("SAC 0, 0, 0", 4), ("SAC 0, 5, 0", 4)] {
        assert_eq!(host.exchange(line).0, status, "{line}");
    }
}

#[test]
fn program_sends_its_accumulator_and_gets_the_answer_in_it() {
    let mut host = Host::new();
    host.bench.machine().io.spi = [SpiDevice::Loopback, SpiDevice::Outputs(0x33), SpiDevice::None];
    host.start(&["CALC LOAD, 300", "SAC 130, 2, 0", "AGP 1, 2", "SAC 0, 1, 7", "AGP 2, 2", "STOP"]);
    host.run_ms(10);
    assert_eq!((host.ask("GGP 1, 2"), host.ask("GGP 2, 2")), (0x3301, 7));
    assert_eq!(host.bench.machine().io.spi[1], SpiDevice::Outputs(300_u16 as u8));
}

#[test]
fn shutdown_pin_does_what_parameter_80_says() {
    for (function, level, runs) in
        [(0, 0, true), (0, 1, true), (1, 0, true), (1, 1, false), (2, 0, false), (2, 1, true)]
    {
        let mut host = Host::new();
        host.console(&format!("enable {level}"));
        host.ask(&format!("SGP 80, 0, {function}"));
        host.run_ms(1);
        assert_eq!(host.exchange("ROR 0, 100").0 == 100, runs, "function {function}, level {level}");
    }
}

#[test]
fn shutdown_stops_the_motors_and_sets_its_flag() {
    let mut host = Host::new();
    host.ask("SGP 80, 0, 2");
    host.start(&["JC ESD, 2", "JA 0", "CLE ESD", "SIO 0, 2, 1", "STOP"]);
    host.ask("ROR 0, 500");
    host.run_ms(200);
    assert_eq!(host.bench.machine().io.outputs(), 0);
    host.console("enable 0");
    host.run_ms(1);
    assert_eq!((host.get(3, 0), host.bench.machine().io.outputs()), (0, 1));
}

#[test]
fn pull_up_resistors_and_the_range_of_the_converters() {
    let mut host = Host::new();
    host.ask("SIO 0, 0, $21");
    assert_eq!((host.ask("GIO 0, 0"), host.ask("GIO 255, 0")), (1, 0x21));
    host.console("in 0 0");
    assert_eq!(host.ask("GIO 255, 0"), 0x20);
    host.console("analog 0 1000");
    host.ask("SIO 8, 0, 1");
    assert_eq!((host.ask("GIO 0, 1"), host.ask("GIO 8, 0")), (330, 1));
    assert_eq!(host.exchange("GIO 10, 0").0, 3);
}

#[test]
fn waiting_for_the_reference_switch_is_waiting_for_the_left_one() {
    let mut host = Host::new();
    host.start(&["WAIT REFSW, 1, 0", "SIO 3, 2, 1", "STOP"]);
    host.run_ms(10);
    host.console("switch 1 right 1");
    host.run_ms(10);
    assert_eq!(host.bench.machine().io.outputs(), 0);
    host.console("switch 1 left 1");
    host.run_ms(10);
    assert_eq!(host.bench.machine().io.outputs(), 8);
    assert_eq!([9, 10, 11].map(|number| host.get(number, 1)), [1, 1, 1]);
}

#[test]
fn interrupts_run_as_on_the_other_module() {
    let mut host = Host::new();
    host.start(&[
        "VECT 0, 7",
        "SGP 0, 3, 10",
        "VECT 3, 9",
        "EI 0",
        "EI 3",
        "EI 255",
        "JA 6",
        "AGP 1, 2",
        "RETI",
        "SIO 5, 2, 1",
        "RETI",
    ]);
    host.ask("MVP ABS, 0, 1000");
    host.run_ms(2000);
    assert_eq!(host.bench.machine().io.outputs(), 1 << 5);
}
