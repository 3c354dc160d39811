//! Sessions with the virtual module of this process.

use std::time::Duration;

use gradus_host::{Error, PositionReached, ProgramError, Session, State};
use gradus_tmcl::catalogue::{Ap, Gp, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, Status};

const SECOND: Duration = Duration::from_secs(1);
const MILLISECOND: Duration = Duration::from_millis(1);

fn session() -> Session {
    Session::open(&"sim:tmcm-3351".parse().unwrap()).unwrap()
}

fn program(lines: &[&str]) -> Vec<Instruction> {
    lines.iter().map(|line| Instruction::parse(line, &TMCM_3351).unwrap()).collect()
}

#[test]
fn a_module_tells_what_it_is() {
    let mut session = session();
    assert_eq!(session.module().unwrap().name, "TMCM-3351");
    assert_eq!(session.version_text().unwrap(), "3351V111");
}

#[test]
fn a_minute_of_motion_costs_no_minute() {
    let mut session = session();
    session.set_axis(Ap::TargetSpeed, 0, 1000).unwrap();
    session.sleep(60 * SECOND);
    let position = session.get_axis(Ap::ActualPosition, 0).unwrap();
    assert!((59_980..=60_000).contains(&position), "{position}");
}

#[test]
fn a_program_is_written_compared_and_run_to_its_end() {
    let mut session = session();
    let program = program(&["MVP ABS, 0, 51200", "WAIT POS, 0, 0", "STOP"]);
    let mut written = 0;
    session.download(&program, |count| written = count).unwrap();
    assert_eq!(written, program.len() + 1, "the end mark is written too");
    session.verify(&program, |_| {}).unwrap();
    session.reset().unwrap();
    session.run().unwrap();
    assert_eq!(session.application_status().unwrap().state, State::Running);
    assert!(session.wait_stopped(10 * SECOND, MILLISECOND).unwrap());
    assert_eq!(session.get_axis(Ap::ActualPosition, 0).unwrap(), 51200);
    assert_eq!(session.program_counter().unwrap(), 3);
}

#[test]
fn a_program_that_goes_on_is_stopped_by_hand() {
    let mut session = session();
    session.download(&program(&["ROR 1, 1000", "JA 1"]), |_| {}).unwrap();
    session.run_from(0).unwrap();
    assert!(!session.wait_stopped(SECOND, MILLISECOND).unwrap());
    session.stop().unwrap();
    assert_eq!(session.get_axis(Ap::TargetSpeed, 1).unwrap(), 1000, "motors go on");
    session.stop_motors().unwrap();
    assert_eq!(session.get_axis(Ap::TargetSpeed, 1).unwrap(), 0);
}

#[test]
fn a_program_with_a_control_command_is_not_written() {
    let mut session = session();
    session.download(&program(&["ROR 1, 1000", "STOP"]), |_| {}).unwrap();
    for opcode in [Opcode::STOP_APPLICATION, Opcode::EXIT_DOWNLOAD, Opcode(200), Opcode(255)] {
        let wrong = [program(&["STOP"])[0], Instruction::new(opcode, 0, 0, 0)];
        let message = session.download(&wrong, |_| {}).unwrap_err().to_string();
        assert!(message.starts_with("program address 1: ") && message.contains("control command"), "{message}");
    }
    session.verify(&program(&["ROR 1, 1000", "STOP"]), |_| {}).unwrap();
}

#[test]
fn new_addresses_of_module_and_host_hold_for_the_next_request() {
    for parameter in [Gp::SerialAddress, Gp::HostAddress] {
        let mut session = session();
        session.set_global(parameter, 0, 17).unwrap();
        assert_eq!(session.get_global(parameter, 0).unwrap(), 17);
        assert_eq!(session.version_text().unwrap(), "3351V111");
    }
}

#[test]
fn a_difference_is_named() {
    let mut session = session();
    let wrote = program(&["MVP ABS, 0, 51200", "STOP"]);
    session.download(&wrote, |_| {}).unwrap();
    let message = session.verify(&program(&["MVP ABS, 0, 51200", "RSUB"]), |_| {}).unwrap_err().to_string();
    assert_eq!(message, "program address 1: wrote `RSUB`, read back `STOP`");
}

#[test]
fn protected_memory_is_named() {
    let mut session = session();
    let program = program(&["STOP"]);
    session.download(&program, |_| {}).unwrap();
    session.set_global(Gp::CodeProtection, 0, 3).unwrap();
    let message = session.verify(&program, |_| {}).unwrap_err().to_string();
    assert!(message.contains("protected against reading back (global parameter 81)"), "{message}");
    let message = session.download(&program, |_| {}).unwrap_err().to_string();
    assert!(message.contains("protected against overwriting, see global parameter 81"), "{message}");
}

#[test]
fn too_long_a_program_is_not_begun() {
    let mut session = session();
    let program = vec![Instruction::new(Opcode::STOP, 0, 0, 0); 6145];
    let error = session.download(&program, |_| panic!("nothing is written")).unwrap_err();
    assert!(matches!(error, Error::ProgramTooLong { len: 6145, room: 6144, .. }), "{error}");
}

#[test]
fn a_program_that_fills_the_memory_fits() {
    let mut session = session();
    let program = vec![Instruction::new(Opcode::STOP, 0, 0, 0); 6144];
    session.download(&program, |_| {}).unwrap();
    session.verify(&program, |_| {}).unwrap();
}

#[test]
fn breakpoints_and_steps_hold_a_program() {
    let mut session = session();
    session.download(&program(&["CALC LOAD, 7", "CALC ADD, 1", "CALC MUL, 2", "CALCX LOAD", "STOP"]), |_| {}).unwrap();
    assert_eq!(session.breakpoint_capacity().unwrap(), 10);
    session.add_breakpoint(1).unwrap();
    session.add_breakpoint(2).unwrap();
    session.remove_breakpoint(1).unwrap();
    session.run_from(0).unwrap();
    assert!(session.wait_stopped(SECOND, MILLISECOND).unwrap());
    assert_eq!(session.program_counter().unwrap(), 2);
    assert_eq!(session.accumulator().unwrap(), 8);
    session.step().unwrap();
    session.sleep(MILLISECOND);
    assert_eq!(session.program_counter().unwrap(), 3);
    assert_eq!(session.accumulator().unwrap(), 16);
    session.clear_breakpoints().unwrap();
    session.run().unwrap();
    assert!(session.wait_stopped(SECOND, MILLISECOND).unwrap());
    assert_eq!(session.x_register().unwrap(), 16);
}

#[test]
fn a_refused_command_of_a_program_is_remembered() {
    let mut session = session();
    assert_eq!(session.program_error().unwrap(), None);
    session.download(&program(&["CALC LOAD, 300", "AAP 140, 0", "STOP"]), |_| {}).unwrap();
    session.run_from(0).unwrap();
    assert!(session.wait_stopped(SECOND, MILLISECOND).unwrap());
    let expected = ProgramError { status: Status::INVALID_VALUE, address: 1 };
    assert_eq!(session.program_error().unwrap(), Some(expected));
}

#[test]
fn reaching_a_position_is_an_event() {
    let mut session = session();
    session.command(Instruction::new(Opcode::POSITION_EVENT, 0, 0, 0b101)).unwrap();
    for line in ["MVP ABS, 0, 10000", "MVP ABS, 2, 20000"] {
        session.command(Instruction::parse(line, &TMCM_3351).unwrap()).unwrap();
    }
    let mut polls = 0;
    let event = loop {
        polls += 1;
        session.get_axis(Ap::ActualPosition, 0).unwrap();
        if let Some(event) = session.wait_event(10 * MILLISECOND).unwrap() {
            break event;
        }
    };
    assert_eq!(event, PositionReached { motors: 0b101 });
    assert!(polls > 10, "{polls}");
    assert_eq!(session.get_axis(Ap::ActualPosition, 2).unwrap(), 20000);
}

#[test]
fn the_machine_of_a_virtual_module_can_be_looked_at_and_worked() {
    let mut session = session();
    session.sleep(SECOND);
    let bench = session.bench().unwrap();
    assert_eq!(bench.now(), 1_000_000);
    bench.machine().io.set_input(3, true);
    assert_eq!(session.command(Instruction::new(Opcode::GIO, 3, 0, 0)).unwrap(), 1);
}
