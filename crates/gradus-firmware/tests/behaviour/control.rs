//! Control commands: program control, download, versions, restart (BEHAVIOUR 2 and 3).

use gradus_firmware::{Link, LinkKind};
use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Instruction, checksum};

use crate::support::{Bench, instruction, lines};

const STOP: u8 = 128;
const RUN: u8 = 129;
const STEP: u8 = 130;
const RESET: u8 = 131;
const ENTER_DOWNLOAD: u8 = 132;
const EXIT_DOWNLOAD: u8 = 133;
const STATUS: u8 = 135;
const VERSION: u8 = 136;
const FACTORY: u8 = 137;
const BREAKPOINT: u8 = 141;
const INFORMATION: u8 = 157;
const RESTART: u8 = 255;

/// Counts in variable 1.
const COUNTER: &str = "CALCV ADD, 1, 1; JA 0";

/// Command 134: what follows the host address.
fn read_memory(bench: &mut Bench, address: i32) -> [u8; 7] {
    let [host, stored @ .., sum] = bench.send(instruction(&format!("DATA 134, 0, 0, {address}"))).unwrap();
    assert_eq!(host, 2);
    assert_eq!(sum, checksum(&stored).wrapping_add(host), "checksum over the eight bytes");
    stored
}

fn stored(bench: &mut Bench, address: i32) -> Instruction {
    Instruction::from_bytes(read_memory(bench, address))
}

// Run, stop, step, reset.

#[test]
fn program_runs_from_its_address_on() {
    let mut bench = Bench::new();
    bench.download_at(0, "SGP 1, 2, 10; STOP; SGP 1, 2, 20; STOP");
    for (kind, value, expected) in [(0, 0, 10), (1, 2, 20), (1, 0, 10)] {
        bench.control(RESET, 0, 0);
        assert_eq!(bench.control(RUN, kind, value), (100, value));
        bench.advance_ms(1);
        assert_eq!(bench.variable(1), expected);
    }
}

#[test]
fn stopped_program_keeps_its_counter_and_goes_on_from_there() {
    let mut bench = Bench::new();
    bench.start("CALC ADD, 1; CALC ADD, 1; CALC ADD, 1; JA 0");
    bench.advance_us(15);
    bench.control(STOP, 0, 0);
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.global(128, 0)), (2, 2, 0));
    bench.advance_ms(10);
    assert_eq!((bench.program_counter(), bench.accumulator()), (2, 2));
    bench.control(RUN, 0, 0);
    bench.advance_us(0);
    assert_eq!((bench.program_counter(), bench.accumulator()), (3, 3));
}

#[test]
fn stop_leaves_the_program_counter_behind_it() {
    let mut bench = Bench::new();
    bench.run("CALC LOAD, 1; STOP; CALC LOAD, 2; STOP; STOP");
    assert_eq!((bench.program_counter(), bench.accumulator()), (2, 1));
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.global(128, 0)), (4, 2, 0));
}

#[test]
fn program_that_moves_and_stops_goes_on_with_each_command_129() {
    let mut bench = Bench::fast();
    bench.start("MVP REL, 0, 100; WAIT POS, 0, 0; STOP; JA 0");
    for position in [100, 200, 300] {
        bench.advance_ms(1_000);
        assert_eq!((bench.get(1, 0), bench.global(128, 0)), (position, 0));
        bench.control(RUN, 0, 0);
    }
}

#[test]
fn command_128_leaves_the_program_counter_where_it_is() {
    let mut bench = Bench::new();
    bench.start("WAIT TICKS, 0, 100; STOP");
    bench.advance_ms(1);
    bench.control(STOP, 0, 0);
    assert_eq!(bench.program_counter(), 0);
    bench.control(RUN, 0, 0);
    bench.advance_ms(999);
    assert_eq!((bench.program_counter(), bench.is_running()), (0, true), "the WAIT begins anew");
}

#[test]
fn stop_in_a_handler_can_be_gone_on_from() {
    let mut bench = Bench::new();
    bench.start("VECT 0, 5; SGP 0, 3, 5; EI 0; EI 255; JA 4; STOP; CALCV ADD, 1, 1; RETI");
    bench.advance_ms(6);
    assert_eq!((bench.program_counter(), bench.variable(1), bench.global(128, 0)), (6, 0, 0));
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.variable(1)), (4, 1));
}

#[test]
fn behind_a_stop_at_the_end_of_memory_is_the_beginning() {
    let mut bench = Bench::new();
    bench.download("CALC ADD, 1; STOP");
    bench.download_at(6143, "STOP");
    bench.control(RUN, 1, 6143);
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.global(128, 0), bench.accumulator()), (0, 0, 0));
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.accumulator()), (2, 1));
}

#[test]
fn step_executes_one_instruction() {
    let mut bench = Bench::new();
    bench.download("CALC ADD, 5; GAP 4, 0; WAIT TICKS, 0, 1; CALC LOAD, 9");
    for (counter, accumulator) in [(1, 5), (2, 51_200)] {
        bench.control(STEP, 0, 0);
        bench.advance_ms(5);
        assert_eq!((bench.program_counter(), bench.accumulator(), bench.global(128, 0)), (counter, accumulator, 2));
    }
    bench.control(STEP, 0, 0);
    bench.advance_us(9_999);
    assert_eq!(bench.program_counter(), 2, "still in the WAIT");
    bench.advance_ms(100);
    assert_eq!((bench.program_counter(), bench.accumulator()), (3, 51_200));
    bench.control(STEP, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.accumulator()), (4, 9));
}

#[test]
fn run_goes_on_after_steps() {
    let mut bench = Bench::new();
    bench.download("CALC ADD, 1; CALC ADD, 1; CALC ADD, 1; STOP");
    bench.control(STEP, 0, 0);
    bench.advance_ms(1);
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!(bench.accumulator(), 3);
}

#[test]
fn reset_clears_counter_registers_flags_and_stack() {
    let mut bench = Bench::new();
    bench.start("CALC LOAD, 7; CALCX LOAD; CSUB 3; WAIT TICKS, 0, 100; RSUB");
    bench.advance_ms(1);
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.x()), (3, 7, 7));
    assert_eq!(bench.control(RESET, 0, 0), (100, 0));
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.x()), (0, 0, 0));
    assert_eq!((bench.global(128, 0), bench.control(STATUS, 0, 0).1 >> 24), (3, 3));
    // An empty stack lets RSUB be ignored, cleared flags hold no condition.
    bench.download("RSUB; JC NZ, 4; SGP 1, 2, 1; STOP; STOP");
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.variable(1), bench.program_counter()), (1, 4));
}

#[test]
fn reset_clears_timers_and_vectors() {
    let mut bench = Bench::new();
    bench.start("VECT 0, 6; SGP 0, 3, 5; EI 0; EI 255; JA 4; STOP; CALCV ADD, 1, 1; RETI");
    bench.advance_ms(11);
    assert_eq!(bench.variable(1), 2);
    bench.control(RESET, 0, 0);
    assert_eq!(bench.global(0, 3), 0);
    bench.control(RUN, 1, 4);
    bench.advance_ms(100);
    assert_eq!(bench.variable(1), 2);
}

#[test]
fn motors_go_on_when_a_program_stops() {
    let mut bench = Bench::new();
    bench.run("ROR 0, 1000; STOP");
    bench.advance_ms(500);
    assert_eq!(bench.get(3, 0), 1000);
}

// Status.

#[test]
fn status_tells_state_wait_flag_and_pointers() {
    let mut bench = Bench::new();
    bench.download_at(300, "CALC LOAD, -5; CALCX LOAD; WAIT TICKS, 0, 10; STOP");
    assert_eq!(bench.control(STATUS, 0, 0), (100, 304), "stopped, memory pointer");
    assert_eq!(bench.control(STATUS, 1, 0), (100, 0), "stopped, program counter");
    bench.control(RUN, 1, 300);
    bench.advance_ms(1);
    assert_eq!(bench.control(STATUS, 0, 0).1, 1 << 24 | 1 << 16 | 304);
    assert_eq!(bench.control(STATUS, 1, 0).1, 1 << 24 | 1 << 16 | 302);
    assert_eq!((bench.control(STATUS, 2, 0).1, bench.control(STATUS, 3, 0).1), (-5, -5));
    bench.advance_ms(200);
    assert_eq!(bench.control(STATUS, 1, 0).1, 304);
}

#[test]
fn global_parameter_128_tells_the_state() {
    let mut bench = Bench::new();
    bench.download(COUNTER);
    for (command, state) in [(RUN, 1), (STEP, 2), (RESET, 3), (RUN, 1), (STOP, 0)] {
        bench.control(command, 0, 0);
        bench.advance_ms(1);
        assert_eq!(bench.global(128, 0), state, "after command {command}");
    }
}

// Download.

#[test]
fn download_mode_stores_commands_and_executes_none() {
    let mut bench = Bench::new();
    assert_eq!(bench.control(ENTER_DOWNLOAD, 0, 100), (100, 100));
    assert_eq!(bench.control(STATUS, 0, 0).1 & 0xffff, 100);
    for (i, line) in lines("ROR 0, 1000; DATA 0, 0, 0, 0; DATA 99, 1, 2, 3; DATA 127, 0, 0, -1").enumerate() {
        assert_eq!(bench.obey(instruction(line)), (101, instruction(line).value), "{line}");
        assert_eq!(bench.control(STATUS, 0, 0).1 & 0xffff, 101 + i as i32);
    }
    bench.control(EXIT_DOWNLOAD, 0, 0);
    assert_eq!(bench.get(2, 0), 0);
    assert_eq!(stored(&mut bench, 100), instruction("ROR 0, 1000"));
    assert_eq!(stored(&mut bench, 102), instruction("DATA 99, 1, 2, 3"));
}

#[test]
fn global_parameter_129_tells_the_mode() {
    let mut bench = Bench::new();
    assert_eq!(bench.global(129, 0), 0);
    bench.run("GGP 129, 0; STOP");
    assert_eq!(bench.accumulator(), 0);
    // In download mode GGP is stored; a running program can still ask.
    bench.control(ENTER_DOWNLOAD, 0, 10);
    bench.control(RESET, 0, 0);
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert_eq!(bench.accumulator(), 1);
}

#[test]
fn control_commands_are_executed_in_download_mode() {
    let mut bench = Bench::new();
    bench.control(ENTER_DOWNLOAD, 0, 0);
    assert_eq!(bench.control(VERSION, 1, 0), (100, 0x0D17_010B));
    assert_eq!(bench.control(INFORMATION, 0, 0), (100, 3351));
    assert_eq!(bench.control(STATUS, 0, 0).1 & 0xffff, 0, "none of them is stored");
}

#[test]
fn program_that_runs_in_download_mode_reads_1_in_parameter_129() {
    let mut bench = Bench::new();
    bench.download("GGP 129, 0; AGP 1, 2; STOP");
    bench.control(ENTER_DOWNLOAD, 0, 100);
    bench.control(RUN, 1, 0);
    bench.advance_ms(1);
    assert_eq!(bench.exchange("GGP 129, 0").0, 101, "of a host it is stored");
    bench.control(EXIT_DOWNLOAD, 0, 0);
    assert_eq!((bench.variable(1), bench.global(129, 0)), (1, 0));
}

#[test]
fn download_mode_holds_for_every_link() {
    let mut bench = Bench::new();
    bench.control(ENTER_DOWNLOAD, 0, 0);
    bench.link = Link::new(2, LinkKind::Rs485, 0);
    assert_eq!(bench.exchange("ROR 0, 500").0, 101);
    bench.link = Link::new(1, LinkKind::Usb, 0);
    bench.control(EXIT_DOWNLOAD, 0, 0);
    assert_eq!((bench.get(2, 0), stored(&mut bench, 0)), (0, instruction("ROR 0, 500")));
}

#[test]
fn download_past_the_end_of_memory_is_refused() {
    let mut bench = Bench::new();
    bench.control(ENTER_DOWNLOAD, 0, 6143);
    assert_eq!(bench.exchange("CALC LOAD, 1"), (101, 1));
    assert_eq!(bench.exchange("CALC LOAD, 2"), (4, 2));
    assert_eq!(bench.exchange("CALC LOAD, 3"), (4, 3));
    bench.control(EXIT_DOWNLOAD, 0, 0);
    assert_eq!(stored(&mut bench, 6143), instruction("CALC LOAD, 1"));
    assert_eq!(stored(&mut bench, 0), Instruction::default());
}

#[test]
fn refused_download_leaves_the_mode_and_the_program_alone() {
    let mut bench = Bench::set_up("SGP 81, 0, 2");
    for (value, status) in [(0, 5), (6143, 5), (6144, 4)] {
        assert_eq!(bench.control(ENTER_DOWNLOAD, 0, value), (status, value));
        assert_eq!(bench.global(129, 0), 0);
    }
}

#[test]
fn running_program_is_stopped_by_a_download() {
    let mut bench = Bench::new();
    bench.start(COUNTER);
    bench.advance_ms(1);
    bench.control(ENTER_DOWNLOAD, 0, 100);
    assert_eq!(bench.control(STATUS, 1, 0).1 >> 24, 0);
    bench.control(EXIT_DOWNLOAD, 0, 0);
    assert_eq!(bench.global(128, 0), 0);
}

#[test]
fn refused_download_does_not_stop_the_program() {
    let mut bench = Bench::new();
    bench.download(COUNTER);
    bench.all("SGP 81, 0, 2");
    bench.control(RUN, 0, 0);
    bench.control(ENTER_DOWNLOAD, 0, 0);
    assert!(bench.is_running());
}

#[test]
fn programs_lie_side_by_side_and_survive_power_off() {
    let mut bench = Bench::new();
    bench.download_at(0, "SGP 1, 2, 11; STOP");
    bench.download_at(1000, "SGP 1, 2, 22; STOP");
    bench.download_at(6142, "SGP 1, 2, 33; STOP");
    let mut bench = bench.power_cycle();
    for (address, value) in [(1000, 22), (0, 11), (6142, 33)] {
        bench.control(RUN, 1, address);
        bench.advance_ms(1);
        assert_eq!(bench.variable(1), value, "program at {address}");
    }
}

#[test]
fn stored_opcode_0_does_nothing() {
    let mut bench = Bench::new();
    assert_eq!(bench.run("CALC LOAD, 3; DATA 0, 0, 0, 0; CALC ADD, 1; STOP"), 30);
    assert_eq!((bench.accumulator(), bench.last_error()), (4, (0, 0)));
}

// Command 134.

#[test]
fn program_memory_can_be_read() {
    let mut bench = Bench::new();
    bench.download("MVP ABS, 1, 51200; DATA 99, 255, 254, -2");
    assert_eq!(read_memory(&mut bench, 0), [4, 0, 1, 0, 0, 200, 0]);
    assert_eq!(read_memory(&mut bench, 1), [99, 255, 254, 255, 255, 255, 254]);
    assert_eq!(read_memory(&mut bench, 2), [0; 7], "never written");
}

#[test]
fn program_memory_past_the_end_reads_as_zeros() {
    let mut bench = Bench::new();
    bench.download_at(6143, "CALC LOAD, 1");
    for address in [6144, 65_536, i32::MAX, -1, i32::MIN] {
        assert_eq!(read_memory(&mut bench, address), [0; 7], "address {address}");
    }
}

#[test]
fn program_memory_is_hidden_by_the_protection_against_disassembling() {
    for (protection, visible) in [(0, true), (1, false), (2, true), (3, false)] {
        let mut bench = Bench::new();
        bench.download("CALC LOAD, 5");
        bench.all(&format!("SGP 81, 0, {protection}"));
        assert_eq!(read_memory(&mut bench, 0) != [0; 7], visible, "protection {protection}");
    }
}

#[test]
fn program_memory_is_read_with_the_host_address() {
    let mut bench = Bench::new();
    bench.download("CALC LOAD, 5");
    bench.all("SGP 76, 0, 77");
    assert_eq!(bench.send(instruction("DATA 134, 0, 0, 0")), Some([77, 19, 9, 0, 0, 0, 0, 5, 77 + 19 + 9 + 5]));
}

// Protection.

#[test]
fn giving_up_the_protection_against_disassembling_erases_the_program() {
    for (from, to, kept) in
        [(0, 1, true), (0, 2, true), (0, 3, true), (1, 0, false), (1, 2, false), (1, 3, true), (2, 0, true)]
            .into_iter()
            .chain([(2, 1, true), (2, 3, true), (3, 0, false), (3, 1, true), (3, 2, false), (1, 1, true)])
    {
        let mut bench = Bench::new();
        bench.download("SGP 1, 2, 5; STOP");
        bench.all(&format!("SGP 81, 0, {from}; SGP 81, 0, {to}"));
        for power in ["before", "after"] {
            bench.control(RESET, 0, 0);
            bench.control(RUN, 0, 0);
            bench.advance_us(15);
            bench.control(STOP, 0, 0);
            let expected = if kept { 5 } else { 0 };
            assert_eq!(bench.variable(1), expected, "{from} to {to}, {power} a power cycle");
            bench = bench.power_cycle();
        }
    }
}

#[test]
fn erasing_stops_the_program() {
    let mut bench = Bench::new();
    bench.download(COUNTER);
    bench.all("SGP 81, 0, 1");
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    bench.all("SGP 81, 0, 0");
    assert_eq!(bench.global(128, 0), 0);
}

// Breakpoints.

#[test]
fn program_stops_before_a_breakpoint_and_goes_on_past_it() {
    let mut bench = Bench::new();
    bench.download("CALC ADD, 1; CALC ADD, 10; JA 0");
    assert_eq!(bench.control(BREAKPOINT, 0, 1), (100, 1));
    bench.control(RUN, 0, 0);
    for accumulator in [1, 12, 23] {
        bench.advance_ms(1);
        assert_eq!((bench.program_counter(), bench.accumulator(), bench.global(128, 0)), (1, accumulator, 0));
        bench.control(RUN, 0, 0);
    }
}

#[test]
fn breakpoints_hold_at_instructions_that_need_the_module() {
    let mut bench = Bench::new();
    bench.download("GAP 4, 0; GAP 5, 0; WAIT TICKS, 0, 1; SIO 0, 2, 1; STOP");
    for address in 1..4 {
        bench.control(BREAKPOINT, 0, address);
    }
    for address in 1..4 {
        bench.control(RUN, 0, 0);
        bench.advance_ms(50);
        assert_eq!((bench.program_counter(), bench.board().outputs), (address, 0));
    }
    bench.control(RUN, 0, 0);
    bench.advance_ms(50);
    assert_eq!((bench.program_counter(), bench.board().outputs), (5, 1));
}

#[test]
fn breakpoints_are_added_and_removed() {
    let mut bench = Bench::new();
    assert_eq!(bench.control(BREAKPOINT, 3, 0), (100, 10));
    for address in 0..10 {
        assert_eq!(bench.control(BREAKPOINT, 0, address).0, 100);
    }
    assert_eq!(bench.control(BREAKPOINT, 0, 10).0, 4, "one too many");
    assert_eq!(bench.control(BREAKPOINT, 0, 9).0, 100, "it is there already");
    assert_eq!(bench.control(BREAKPOINT, 1, 3), (100, 3));
    assert_eq!(bench.control(BREAKPOINT, 0, 10).0, 100);
    assert_eq!(bench.control(BREAKPOINT, 2, 0), (100, 0));
    bench.run("CALC ADD, 1; CALC ADD, 1; STOP");
    assert_eq!(bench.accumulator(), 2);
}

#[test]
fn breakpoints_are_lost_at_a_restart() {
    let mut bench = Bench::new();
    bench.download(COUNTER);
    bench.control(BREAKPOINT, 0, 1);
    bench.control(RESTART, 0, 1234);
    bench.control(RUN, 0, 0);
    bench.advance_ms(1);
    assert!(bench.is_running());
}

// Identity.

#[test]
fn version_as_text_is_nine_bytes_without_checksum() {
    let mut bench = Bench::set_up("SGP 76, 0, 9");
    assert_eq!(bench.send(instruction("DATA 136, 0, 0, 0")).unwrap(), *b"\x093351V111");
}

#[test]
fn version_in_binary() {
    assert_eq!(Bench::new().control(VERSION, 1, 0), (100, 0x0D17_010B));
}

#[test]
fn information() {
    for (kind, value) in [(0, 3351), (1, 1 << 16 | 11), (2, 2), (3, 3), (20, 8), (21, 8), (30, 0)] {
        assert_eq!(Bench::new().control(INFORMATION, kind, 0), (100, value), "type {kind}");
    }
}

// Factory settings and restart.

#[test]
fn factory_settings_are_restored_without_a_reply() {
    let mut bench = Bench::set_up("SGP 68, 0, 500; SGP 7, 2, 70; STGP 7, 2; SGP 84, 0, 1; SCO 3, 1, 99");
    bench.download("SGP 9, 2, 5; STOP");
    assert_eq!(bench.send(instruction("DATA 137, 0, 0, 1234")), None);
    let mut bench = bench.power_cycle();
    assert_eq!((bench.global(68, 0), bench.global(84, 0), bench.variable(7), bench.ask("GCO 3, 1")), (0, 0, 0, 0));
    assert_eq!(stored(&mut bench, 0), instruction("SGP 9, 2, 5"), "the program is not a setting");
}

#[test]
fn factory_settings_do_not_uncover_a_protected_program() {
    for (protection, kept) in [(0, true), (1, false), (2, true), (3, false)] {
        let mut bench = Bench::new();
        bench.download("CALC LOAD, 5");
        bench.all(&format!("SGP 81, 0, {protection}"));
        bench.send(instruction("DATA 137, 0, 0, 1234"));
        let mut bench = bench.power_cycle();
        assert_eq!(bench.global(81, 0), 0);
        assert_eq!(read_memory(&mut bench, 0) != [0; 7], kept, "protection {protection}");
    }
}

#[test]
fn factory_settings_and_restart_need_their_value() {
    for command in [FACTORY, RESTART] {
        let mut bench = Bench::set_up("SGP 68, 0, 500; SGP 7, 2, 70");
        for value in [0, 1, 1233, -1234] {
            assert_eq!(bench.control(command, 0, value), (4, value));
        }
        bench.advance_ms(1);
        assert_eq!((bench.global(68, 0), bench.variable(7)), (500, 70));
        assert_eq!(bench.power_cycle().global(68, 0), 500);
    }
}

#[test]
fn restart_forgets_random_numbers_events_and_heartbeats() {
    let numbers = |bench: &mut Bench| [(); 3].map(|()| bench.global(133, 0));
    let fresh = numbers(&mut Bench::new());
    let mut bench = Bench::set_up("SGP 133, 0, 5; SGP 68, 0, 100; SGP 77, 0, 1");
    assert_ne!(numbers(&mut bench), fresh);
    bench.download("ROR 0, 500; WAIT TICKS, 0, 200; MVP ABS, 0, 0; WAIT POS, 0, 0; STOP");
    assert_eq!(bench.control(138, 1, 1).0, 100);
    bench.control(RESTART, 0, 1234);
    bench.advance_ms(1900);
    assert_eq!(bench.peek(0, Ap::ActualSpeed), 500, "no command has come since, so no heartbeat is missed");
    bench.advance_ms(20_000);
    assert_eq!((bench.peek(0, Ap::ActualPosition), bench.drain().len()), (0, 0), "nobody has asked for the event");
    assert_eq!(numbers(&mut bench), fresh);
}

#[test]
fn restart_is_a_power_cycle() {
    let mut bench = Bench::set_up(
        "SGP 68, 0, 50000; SGP 7, 2, 70; SGP 8, 2, 80; STGP 8, 2; SAP 4, 0, 1000; SCO 1, 0, 5; SIO 255, 2, 255; \
         SIO 8, 0, 1; SGP 0, 3, 10; CALC LOAD, 9; ROR 1, 5000",
    );
    bench.download(COUNTER);
    bench.control(RUN, 0, 0);
    bench.advance_ms(300);
    bench.control(ENTER_DOWNLOAD, 0, 100);
    assert_eq!(bench.control(RESTART, 0, 1234), (100, 1234), "the reply comes first");
    bench.advance_us(0);
    assert_eq!((bench.global(68, 0), bench.variable(8)), (50_000, 80), "EEPROM kept");
    assert_eq!((bench.variable(7), bench.variable(1), bench.accumulator()), (0, 0, 0), "RAM lost");
    assert_eq!((bench.get(4, 0), bench.ask("GCO 1, 0"), bench.global(0, 3)), (51_200, 0, 0), "RAM lost");
    assert_eq!((bench.get(1, 1), bench.get(3, 1), bench.get(2, 1)), (0, 0, 0), "the motor stands");
    assert_eq!((bench.board().outputs, bench.board().ten_volts), (0, false));
    assert_eq!((bench.global(128, 0), bench.global(129, 0), bench.global(130, 0)), (0, 0, 0));
    assert_eq!(bench.global(132, 0), 0, "the tick timer begins again");
    assert_eq!(stored(&mut bench, 0), instruction("CALCV ADD, 1, 1"));
}

#[test]
fn restart_takes_place_at_the_next_poll() {
    let mut bench = Bench::new();
    bench.control(RESTART, 0, 1234);
    assert_eq!(bench.module.poll_at(), Some(bench.now));
}

#[test]
fn restart_does_not_turn_the_motor() {
    let mut bench = Bench::set_up("MVP ABS, 0, 10000");
    bench.arrive(0);
    bench.stage(0).recording = true;
    bench.control(RESTART, 0, 1234);
    bench.advance_us(0);
    let turned = bench.stage(0).vectors.iter().map(|(phase, _)| (phase - 10_000).abs()).max();
    assert!(turned <= Some(512), "at most two full steps, to the electrical angle of the start; {turned:?}");
    assert_eq!(bench.get(1, 0), 0);
}

#[test]
fn program_starts_by_itself_if_global_parameter_77_says_so() {
    for (auto_start, running) in [(0, false), (1, true)] {
        let mut bench = Bench::set_up(&format!("SGP 77, 0, {auto_start}"));
        bench.download(COUNTER);
        let mut bench = bench.power_cycle();
        assert_eq!(bench.is_running(), running);
        bench.control(STOP, 0, 0);
        bench.control(RESTART, 0, 1234);
        bench.advance_ms(1);
        assert_eq!(bench.is_running(), running);
    }
}

#[test]
fn module_begins_with_outputs_low() {
    let mut bench = Bench::new();
    assert_eq!((bench.board().outputs, bench.board().ten_volts), (0, false));
}
