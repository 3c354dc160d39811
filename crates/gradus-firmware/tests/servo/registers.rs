//! Registers of the controller and of the gate driver (commands 146 and 148).

use gradus_tmcl::{Instruction, Opcode};

use crate::support::Bench;

fn write(bench: &mut Bench, chip: u8, address: u8, value: i32) -> u8 {
    bench.obey(Instruction::new(Opcode::WRITE_REGISTER, address, chip, value)).0
}

fn read(bench: &mut Bench, chip: u8, address: u8) -> (u8, i32) {
    bench.obey(Instruction::new(Opcode::READ_REGISTER, address, chip, 0))
}

#[test]
fn chips_say_who_they_are() {
    let mut bench = Bench::new();
    for (selected, value) in [(0, i32::from_be_bytes(*b"4671")), (1, 0x0001_0003), (2, 0)] {
        assert_eq!(write(&mut bench, 0, 0x01, selected), 100);
        assert_eq!(read(&mut bench, 0, 0x01), (100, selected));
        assert_eq!(read(&mut bench, 0, 0x00), (100, value));
    }
    assert_eq!(read(&mut bench, 1, 0x04).1 >> 24, 0x10);
}

#[test]
fn targets_and_limits_are_those_of_the_axis_parameters() {
    // Register, what is written, the axis parameter, what it reads.
    let cases = [
        (0x5E, 3000, 11, 3000),
        (0x5F, 4000, 44, 4000),
        (0x60, 2500, 43, 2500),
        (0x64, 700 << 16 | 300, 30, 700),
        (0x64, 700 << 16 | (-300 & 0xFFFF), 32, -300),
        (0x66, -400, 40, -400),
        (0x68, 65_536, 50, 3600),
        (0x6B, -65_536, 52, -3600),
    ];
    for (address, value, parameter, expected) in cases {
        let mut bench = Bench::set_up("SAP 56, 0, 3600; SAP 15, 0, 3; SAP 102, 0, 2");
        assert_eq!(write(&mut bench, 0, address, value), 100, "{address:#x}");
        assert_eq!(bench.get(parameter), expected, "{address:#x}");
        assert_eq!(read(&mut bench, 0, address), (100, value), "{address:#x}");
    }
}

#[test]
fn measured_values_are_read() {
    let mut bench = Bench::set_up("SAP 10, 0, 7; SAP 25, 0, 1; SAP 26, 0, 1");
    bench.drive().shunts = [33_000, 32_500];
    assert_eq!(read(&mut bench, 0, 0x02), (100, 32_500 << 16 | 33_000));
    assert_eq!(read(&mut bench, 0, 0x1B), (100, 3 << 16 | 7));
    bench.drive().encoder = 1024;
    bench.advance_ms(1);
    assert_eq!(read(&mut bench, 0, 0x6B), (100, 16_384));
    bench.drive().gate_fault = true;
    assert_eq!(read(&mut bench, 1, 0x01), (100, 4));
}

#[test]
fn gate_driver_keeps_its_configuration() {
    let mut bench = Bench::new();
    for (address, value) in [(0x00, 1), (0x09, 0x1234_5678), (0x0A, -1)] {
        assert_eq!(write(&mut bench, 1, address, value), 100);
        assert_eq!(read(&mut bench, 1, address), (100, value));
    }
}

#[test]
fn other_registers_and_chips_are_invalid_values() {
    let mut bench = Bench::new();
    for (chip, address) in [(0, 0x04), (0, 0x7F), (0, 0xFF), (1, 0x02), (1, 0xFF), (2, 0x00), (255, 0x00)] {
        assert_eq!(read(&mut bench, chip, address).0, 4, "chip {chip}, {address:#x}");
        assert_eq!(write(&mut bench, chip, address, 0), 4, "chip {chip}, {address:#x}");
    }
    // What can only be read, and values out of range.
    for (chip, address, value) in [
        (0, 0x00, 0),
        (0, 0x02, 0),
        (0, 0x69, 0),
        (0, 0x6A, 0),
        (1, 0x01, 0),
        (1, 0x04, 0),
        (0, 0x01, 256),
        (0, 0x5E, 18_001),
        (0, 0x60, -1),
        (0, 0x64, i32::MAX),
    ] {
        assert_eq!(write(&mut bench, chip, address, value), 4, "chip {chip}, {address:#x}");
    }
}
