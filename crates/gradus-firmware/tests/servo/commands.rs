//! What the module has of the language, and what it lacks.

use gradus_tmcl::catalogue::{COMMANDS, Mode, TMCM_1617};
use gradus_tmcl::{Instruction, Opcode};

use crate::support::Bench;

#[test]
fn commands_that_the_module_lacks_are_refused() {
    for command in COMMANDS.iter().filter(|command| TMCM_1617.mode(command.opcode) == Mode::None) {
        let status = if command.opcode.0 < 128 { 2 } else { 6 };
        let answer = Bench::new().obey(Instruction::new(command.opcode, 0, 0, 7));
        assert_eq!(answer, (status, 7), "{}", command.name);
    }
}

#[test]
fn stepper_commands_and_banks_do_not_exist() {
    let cases = [
        (Opcode::RFS, 0, 0, 2),
        (Opcode::SCO, 1, 0, 2),
        (Opcode::GCO, 1, 0, 2),
        (Opcode::EI, 0, 0, 2),
        (Opcode::CALCVV, 1, 0, 2),
        (Opcode::SAPX, 4, 0, 2),
        (Opcode(80), 0, 0, 2),
        (Opcode::POSITION_EVENT, 0, 0, 6),
        (Opcode::MVP, 2, 0, 3),
        (Opcode::MVP, 0, 1, 4),
        (Opcode::GGP, 0, 3, 3),
        (Opcode::GGP, 133, 0, 3),
        (Opcode::SIO, 2, 0, 3),
        (Opcode::SIO, 4, 2, 3),
        (Opcode::GIO, 3, 1, 3),
        (Opcode::SAP, 4, 0, 3),
        (Opcode::GAP, 6, 1, 4),
        (Opcode::GAP, 7, 0, 3),
    ];
    for (opcode, kind, motor, status) in cases {
        let answer = Bench::new().obey(Instruction::new(opcode, kind, motor, 0));
        assert_eq!(answer.0, status, "{opcode:?} {kind} {motor}");
    }
}

#[test]
fn identity_is_that_of_the_module() {
    let mut bench = Bench::new();
    assert_eq!(bench.obey(Instruction::new(Opcode::FIRMWARE_VERSION, 1, 0, 0)), (100, 0x0651_0108));
    assert_eq!(bench.obey(Instruction::new(Opcode::GET_INFO, 0, 0, 0)), (100, 1617));
}

#[test]
fn ports_are_five_inputs_three_analogue_inputs_and_four_outputs() {
    let mut bench = Bench::new();
    bench.board().inputs = 0b1_0110;
    assert_eq!([0, 1, 2, 3, 4].map(|port| bench.ask(&format!("GIO {port}, 0"))), [0, 1, 1, 0, 1]);
    assert_eq!([0, 1, 2].map(|port| bench.ask(&format!("GIO {port}, 1"))), [0, 1000, 2000]);
    bench.all("SIO 1, 2, 1; SIO 3, 2, 1");
    assert_eq!([0, 1, 2, 3].map(|port| bench.ask(&format!("GIO {port}, 2"))), [0, 1, 0, 1]);
    assert_eq!(bench.board().outputs, 0b1010);
}

#[test]
fn program_memory_holds_1024_commands() {
    let mut bench = Bench::new();
    assert_eq!(bench.control(Opcode::ENTER_DOWNLOAD, 1022), (100, 1022));
    let stored = [1, 2, 3].map(|_| bench.exchange("CALC ADD, 1").0);
    assert_eq!(stored, [101, 101, 4]);
}

/// Stores a program, its commands between semicolons, and runs it.
fn run(bench: &mut Bench, program: &str) {
    bench.control(Opcode::ENTER_DOWNLOAD, 0);
    for command in program.split(';').map(str::trim) {
        assert_eq!(bench.exchange(command).0, 101, "{command}");
    }
    bench.control(Opcode::EXIT_DOWNLOAD, 0);
    bench.control(Opcode::RESET_APPLICATION, 0);
    bench.control(Opcode::RUN_APPLICATION, 0);
}

#[test]
fn programs_wait_for_the_position_and_for_switches() {
    let mut bench = Bench::set_up("SAP 209, 0, 7; SAP 210, 0, 7; SAP 15, 0, 3; SAP 102, 0, 2");
    run(
        &mut bench,
        "MVP ABS, 0, 1000; WAIT POS, 0, 0; SGP 0, 2, 1; WAIT REFSW, 0, 0; SGP 0, 2, 2; WAIT LIMSW, 0, 0; STOP",
    );
    bench.advance_ms(100);
    assert_eq!(bench.ask("GGP 0, 2"), 0, "on its way");
    bench.drive().encoder += 63;
    bench.advance_ms(300);
    assert_eq!(bench.ask("GGP 0, 2"), 1, "63 of 4096 counts are 1008 of 65536 steps");
    bench.board().inputs = 1 << 4;
    bench.advance_ms(1);
    assert_eq!((bench.ask("GGP 0, 2"), bench.ask("GGP 128, 0")), (2, 1));
    bench.board().inputs = 1 << 3;
    bench.advance_ms(1);
    assert_eq!(bench.ask("GGP 128, 0"), 0, "the program is at its end");
}

#[test]
fn programs_do_not_wait_for_a_reference_search() {
    let mut bench = Bench::new();
    bench.control(Opcode::ENTER_DOWNLOAD, 0);
    assert_eq!(bench.obey(Instruction::new(Opcode::WAIT, 4, 0, 0)).0, 101);
    assert_eq!(bench.exchange("STOP").0, 101);
    bench.control(Opcode::EXIT_DOWNLOAD, 0);
    bench.control(Opcode::RUN_APPLICATION, 0);
    bench.advance_ms(1);
    assert_eq!((bench.ask("GGP 128, 0"), bench.ask("GGP 131, 0")), (0, 3 << 16), "an error, and no endless wait");
}
