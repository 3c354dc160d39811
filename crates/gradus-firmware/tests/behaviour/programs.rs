//! The program interpreter: every instruction, flags, stack, WAIT, errors (BEHAVIOUR 4).

use gradus_firmware::Switches;

use crate::support::{Bench, Machine, Memory, lines, run};

/// Time of an instruction and of a tick of WAIT.
const STEP_US: u64 = 10;
const TICK_US: u64 = 10_000;

/// The conditions that hold in each order, as bits by number: ZE, NZ, EQ, NE, GT, GE, LT, LE.
const NOTHING: u16 = 0;
const EQUAL: u16 = 0b1010_0101;
const GREATER: u16 = 0b0011_1010;
const LESS: u16 = 0b1100_1010;
const ETO: u16 = 1 << 8;

/// A program that runs through, then notes in variables 100 to 112 which of the 13 conditions hold.
fn with_conditions(program: &str) -> String {
    let mut text: Vec<String> = lines(program).map(str::to_owned).collect();
    for condition in 0..13 {
        let address = text.len();
        text.push(format!("DATA 21, {condition}, 0, {}", address + 2));
        text.push(format!("JA {}", address + 3));
        text.push(format!("SGP {}, 2, 1", 100 + condition));
    }
    text.push("STOP".to_owned());
    text.join(";")
}

/// The conditions that a program has noted.
fn conditions(bench: &mut Bench) -> u16 {
    (0..13).filter(|condition| bench.variable(100 + condition) == 1).fold(0, |set, condition| set | 1 << condition)
}

/// Runs programs, each with the accumulator, the X register, the conditions and the variables 1 and 2 that it leaves.
fn check(cases: &[(&str, i32, i32, u16, [i32; 2])]) {
    for (program, accumulator, x, held, variables) in cases {
        let mut bench = run(&with_conditions(program));
        assert_eq!(bench.accumulator(), *accumulator, "accumulator after {program}");
        assert_eq!(bench.x(), *x, "X register after {program}");
        assert_eq!([1, 2].map(|number| bench.variable(number)), *variables, "variables after {program}");
        assert_eq!(conditions(&mut bench), *held, "conditions after {program}");
        assert_eq!(bench.last_error(), (0, 0), "{program}");
    }
}

const MIN: i32 = i32::MIN;
const MAX: i32 = i32::MAX;

// Computing.

#[test]
fn calc() {
    check(&[
        ("CALC LOAD, 7", 7, 0, GREATER, [0; 2]),
        ("CALC LOAD, 0", 0, 0, EQUAL, [0; 2]),
        ("CALC LOAD, -1", -1, 0, LESS, [0; 2]),
        ("CALC LOAD, 7; CALC ADD, 5", 12, 0, GREATER, [0; 2]),
        ("CALC LOAD, 7; CALC SUB, 12", -5, 0, LESS, [0; 2]),
        ("CALC LOAD, 7; CALC MUL, -3", -21, 0, LESS, [0; 2]),
        ("CALC LOAD, -7; CALC DIV, 2", -3, 0, LESS, [0; 2]),
        ("CALC LOAD, -7; CALC MOD, 4", -3, 0, LESS, [0; 2]),
        ("CALC LOAD, 12; CALC AND, 10", 8, 0, GREATER, [0; 2]),
        ("CALC LOAD, 12; CALC OR, 3", 15, 0, GREATER, [0; 2]),
        ("CALC LOAD, 12; CALC XOR, 12", 0, 0, EQUAL, [0; 2]),
        ("CALC LOAD, 12; CALC NOT, 99", -13, 0, LESS, [0; 2]),
    ]);
}

#[test]
fn arithmetic_wraps() {
    check(&[
        ("CALC LOAD, 2147483647; CALC ADD, 1", MIN, 0, LESS, [0; 2]),
        ("CALC LOAD, -2147483648; CALC SUB, 1", MAX, 0, GREATER, [0; 2]),
        ("CALC LOAD, 65536; CALC MUL, 65536", 0, 0, EQUAL, [0; 2]),
        ("CALC LOAD, -2147483648; CALC DIV, -1", MIN, 0, LESS, [0; 2]),
        ("CALC LOAD, -2147483648; CALC MOD, -1", 0, 0, EQUAL, [0; 2]),
        ("SGP 1, 2, -2147483648; CALCV DIV, 1, -1", 0, 0, LESS, [MIN, 0]),
    ]);
}

#[test]
fn comp() {
    check(&[
        ("CALC LOAD, 7; COMP 7", 7, 0, EQUAL, [0; 2]),
        ("CALC LOAD, 7; COMP 6", 7, 0, GREATER, [0; 2]),
        ("CALC LOAD, 7; COMP 8", 7, 0, LESS, [0; 2]),
        ("CALC LOAD, -2147483648; COMP 2147483647", MIN, 0, LESS, [0; 2]),
    ]);
}

#[test]
fn calcx() {
    let set = "CALC LOAD, 5; CALCX LOAD; CALC LOAD, 20";
    let cases = [
        ("", 20, 5, GREATER),
        ("CALCX ADD", 25, 5, GREATER),
        ("CALCX SUB", 15, 5, GREATER),
        ("CALCX MUL", 100, 5, GREATER),
        ("CALCX DIV", 4, 5, GREATER),
        ("CALCX MOD", 0, 5, EQUAL),
        ("CALCX AND", 4, 5, GREATER),
        ("CALCX OR", 21, 5, GREATER),
        ("CALCX XOR", 17, 5, GREATER),
        ("CALCX SWAP", 5, 20, GREATER),
        // These two change X and leave the flags alone.
        ("COMP 30; CALCX NOT", 20, -6, LESS),
        ("COMP 30; CALCX LOAD", 20, 20, LESS),
    ];
    for (operation, accumulator, x, held) in cases {
        check(&[(&format!("{set}; {operation}"), accumulator, x, held, [0; 2])]);
    }
}

/// What every operation makes of 20 and 6, of which the second operand may be changed by SWAP.
const OPERATIONS: [(&str, i32, i32, u16); 12] = [
    ("ADD", 26, 6, GREATER),
    ("SUB", 14, 6, GREATER),
    ("MUL", 120, 6, GREATER),
    ("DIV", 3, 6, GREATER),
    ("MOD", 2, 6, GREATER),
    ("AND", 4, 6, GREATER),
    ("OR", 22, 6, GREATER),
    ("XOR", 18, 6, GREATER),
    ("NOT", -7, 6, LESS),
    ("LOAD", 6, 6, GREATER),
    ("SWAP", 6, 20, GREATER),
    ("COMP", 20, 6, GREATER),
];

#[test]
fn calcvv() {
    for (operation, first, second, held) in OPERATIONS {
        let program = format!("SGP 1, 2, 20; SGP 2, 2, 6; CALCVV {operation}, 1, 2");
        check(&[(&program, 0, 0, held, [first, second])]);
    }
}

#[test]
fn calcva() {
    for (operation, variable, accumulator, held) in OPERATIONS {
        let program = format!("SGP 1, 2, 20; CALC LOAD, 6; CALCVA {operation}, 1");
        check(&[(&program, accumulator, 0, held, [variable, 0])]);
    }
}

#[test]
fn calcav() {
    for (operation, accumulator, variable, held) in OPERATIONS {
        let program = format!("SGP 1, 2, 6; CALC LOAD, 20; CALCAV {operation}, 1");
        check(&[(&program, accumulator, 0, held, [variable, 0])]);
    }
}

#[test]
fn calcvx() {
    for (operation, variable, x, held) in OPERATIONS {
        let program = format!("SGP 1, 2, 20; CALC LOAD, 6; CALCX LOAD; CALCVX {operation}, 1");
        check(&[(&program, 6, x, held, [variable, 0])]);
    }
}

#[test]
fn calcxv() {
    for (operation, x, variable, held) in OPERATIONS {
        let program = format!("SGP 1, 2, 6; CALC LOAD, 20; CALCX LOAD; CALCXV {operation}, 1");
        check(&[(&program, 20, x, held, [variable, 0])]);
    }
}

#[test]
fn calcv() {
    for (operation, variable, _, held) in OPERATIONS.into_iter().filter(|(operation, ..)| *operation != "SWAP") {
        let (variable, held) = if operation == "NOT" { (-21, LESS) } else { (variable, held) };
        let program = format!("SGP 1, 2, 20; CALCV {operation}, 1, 6");
        check(&[(&program, 0, 0, held, [variable, 0])]);
    }
}

#[test]
fn comparisons_of_variables_compare_their_two_operands() {
    check(&[
        ("SGP 1, 2, 5; SGP 2, 2, 5; CALCVV COMP, 1, 2", 0, 0, EQUAL, [5, 5]),
        ("SGP 1, 2, 5; SGP 2, 2, 9; CALCVV COMP, 1, 2", 0, 0, LESS, [5, 9]),
        ("SGP 1, 2, 5; CALCV COMP, 1, 5", 0, 0, EQUAL, [5, 0]),
        ("SGP 1, 2, 5; CALC LOAD, 9; CALCVA COMP, 1", 9, 0, LESS, [5, 0]),
        ("SGP 1, 2, 5; CALC LOAD, 9; CALCAV COMP, 1", 9, 0, GREATER, [5, 0]),
        ("SGP 1, 2, 5; CALC LOAD, 9; CALCX LOAD; CALCVX COMP, 1", 9, 9, LESS, [5, 0]),
        ("SGP 1, 2, 5; CALC LOAD, 9; CALCX LOAD; CALCXV COMP, 1", 9, 9, GREATER, [5, 0]),
    ]);
}

#[test]
fn division_by_zero_keeps_the_result_and_the_flags_and_goes_on() {
    let set = "SGP 1, 2, 5; SGP 2, 2, 0; CALC LOAD, 0; CALCX LOAD; CALC LOAD, 8; COMP 9";
    for division in ["CALC DIV, 0", "CALC MOD, 0", "CALCX DIV", "CALCX MOD", "CALCV DIV, 1, 0", "CALCV MOD, 1, 0"]
        .into_iter()
        .chain(["CALCVV DIV, 1, 2", "CALCVV MOD, 1, 2", "CALCAV DIV, 2", "CALCAV MOD, 2", "CALCVX DIV, 1"])
        .chain(["CALCVX MOD, 1", "CALCXV DIV, 2", "CALCXV MOD, 2"])
    {
        let mut bench = run(&with_conditions(&format!("{set}; {division}")));
        assert_eq!((bench.accumulator(), bench.x(), bench.variable(1)), (8, 0, 5), "{division}");
        assert_eq!(conditions(&mut bench), LESS, "{division}");
        assert_eq!(bench.last_error(), (4, 6), "{division}");
    }
    let mut bench = run("SGP 1, 2, 5; CALC LOAD, 0; CALCVA DIV, 1; CALCVA MOD, 1; STOP");
    assert_eq!((bench.variable(1), bench.last_error()), (5, (4, 3)));
}

// Loading the accumulator.

#[test]
fn reading_loads_the_accumulator_and_sets_the_flags() {
    let mut machine = Machine::default();
    machine.board.inputs = 0b100;
    let cases = [
        ("GAP 4, 0", 51_200, GREATER),
        ("GAP 1, 0", 0, EQUAL),
        ("SAP 1, 1, -5; GAP 1, 1", -5, LESS),
        ("SAP 1, 1, -5; CALC LOAD, 1; CALCX LOAD; GAPX 1", -5, LESS),
        ("GGP 66, 0", 1, GREATER),
        ("SGP 1, 2, -9; GGP 1, 2", -9, LESS),
        ("GIO 2, 0", 1, GREATER),
        ("GIO 1, 0", 0, EQUAL),
        ("GIO 3, 1", 300, GREATER),
        ("SCO 4, 2, -77; GCO 4, 2", -77, LESS),
        ("CALC LOAD, 9; CALCX LOAD; SIV -4; CALC LOAD, 1; GIV", -4, LESS),
    ];
    for (program, accumulator, held) in cases {
        let mut bench = Bench::with(machine.clone(), Memory::blank(0));
        bench.run(&with_conditions(program));
        assert_eq!((bench.accumulator(), conditions(&mut bench)), (accumulator, held), "{program}");
    }
}

#[test]
fn writing_leaves_accumulator_and_flags_alone() {
    let commands = [
        "SAP 4, 0, 5",
        "AAP 4, 0",
        "SGP 3, 2, 5",
        "AGP 3, 2",
        "AGP 132, 0",
        "SIO 0, 2, 1",
        "SCO 1, 0, 5",
        "ACO 1, 0",
        "CCO 1, 0",
        "SIV 5",
        "AIV",
        "SAPX 4, 5",
        "AAPX 4",
        "STGP 0, 2",
        "RSGP 0, 2",
        "MVP ABS, 0, 0",
        "MST 0",
        "CLE ALL",
        "EI 0",
        "DI 0",
        "VECT 0, 5",
        "DJNZ 5, 3",
        "CSUB 3",
        "RSUB",
        "UF0",
        "DATA 0, 0, 0, 0",
        "GCO 1, 255",
    ];
    for command in commands {
        let mut bench = run(&with_conditions(&format!("CALC LOAD, 8; COMP 9; {command}")));
        assert_eq!((bench.accumulator(), conditions(&mut bench)), (8, LESS), "{command}");
        assert_eq!(bench.last_error(), (0, 0), "{command}");
    }
}

#[test]
fn accumulator_is_written_to_parameters_variables_and_coordinates() {
    let mut bench = run("CALC LOAD, 777; AAP 4, 1; AGP 200, 2; AGP 0, 3; ACO 5, 2; STOP");
    assert_eq!((bench.get(4, 1), bench.variable(200), bench.global(0, 3)), (777, 777, 777));
    assert_eq!(bench.ask("GCO 5, 2"), 777);
}

#[test]
fn axis_parameters_by_the_x_register() {
    let mut bench = run("CALC LOAD, 2; CALCX LOAD; SAPX 5, 1111; CALC LOAD, 2222; AAPX 4; GAPX 5; STOP");
    assert_eq!((bench.get(5, 2), bench.get(4, 2), bench.accumulator()), (1111, 2222, 1111));
    assert_eq!([bench.get(4, 0), bench.get(4, 1)], [51_200; 2]);
}

#[test]
fn indexed_variables() {
    let mut bench = run("CALC LOAD, 250; CALCX LOAD; SIV -3; GIV; AGP 1, 2; CALC LOAD, 44; CALCX LOAD; AIV; STOP");
    assert_eq!((bench.variable(250), bench.variable(1), bench.variable(44)), (-3, -3, 44));
}

#[test]
fn indexed_variables_outside_0_to_255_are_ignored() {
    for index in [-1, 256, MAX, MIN] {
        let program = format!("CALC LOAD, {index}; CALCX LOAD; CALC LOAD, 5; COMP 9; SIV 7; AIV; GIV");
        check(&[(&program, 5, index, LESS, [0; 2])]);
    }
}

#[test]
fn moves_by_accumulator_and_x_register() {
    let cases = [
        ("CALC LOAD, 5000; MVPA ABS, 1", 1, 0, 5000),
        ("SAP 1, 1, 100; CALC LOAD, 5000; MVPA REL, 1", 1, 0, 5100),
        ("SCO 3, 1, 700; CALC LOAD, 3; MVPA COORD, 1", 1, 0, 700),
        ("CALC LOAD, 2; CALCX LOAD; CALC LOAD, -800; MVPXA ABS", 2, 0, -800),
        ("CALC LOAD, 1; CALCX LOAD; CALC LOAD, 900; MVPXA REL", 1, 0, 900),
        ("SCO 3, 2, 700; CALC LOAD, 2; CALCX LOAD; CALC LOAD, 3; MVPXA COORD", 2, 0, 700),
        ("CALC LOAD, 1000; RORA 1", 1, 2, 1000),
        ("CALC LOAD, 1000; ROLA 2", 2, 2, -1000),
        ("CALC LOAD, 2; CALCX LOAD; CALC LOAD, 300; RORXA", 2, 2, 300),
        ("CALC LOAD, 2; CALCX LOAD; CALC LOAD, 300; ROLXA", 2, 2, -300),
        ("ROR 1, 500; CALC LOAD, 1; CALCX LOAD; MSTX", 1, 2, 0),
    ];
    for (program, axis, parameter, value) in cases {
        let mut bench = run(&format!("{program}; STOP"));
        assert_eq!(bench.get(parameter, axis), value, "{program}");
        assert_eq!(bench.last_error(), (0, 0), "{program}");
    }
}

#[test]
fn sio_255_takes_the_accumulator() {
    let mut bench = run("CALC LOAD, $1A5; SIO 255, 2, -1; STOP");
    assert_eq!((bench.board().outputs, bench.ask("GIO 255, 2")), (0xa5, 0xa5));
}

// Jumps.

#[test]
fn conditions_hold_by_the_flags() {
    check(&[("COMP 0", 0, 0, EQUAL, [0; 2]), ("COMP -1", 0, 0, GREATER, [0; 2]), ("COMP 1", 0, 0, LESS, [0; 2])]);
    check(&[("DATA 0, 0, 0, 0", 0, 0, NOTHING, [0; 2])]);
}

#[test]
fn call_is_a_conditional_csub() {
    let conditions = ["ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE"];
    for (operand, held) in [(0, EQUAL), (-1, GREATER), (1, LESS)] {
        for (number, condition) in conditions.iter().enumerate() {
            let mut bench = run(&format!("COMP {operand}; CALL {condition}, 4; SGP 2, 2, 1; STOP; SGP 1, 2, 1; RSUB"));
            let called = i32::from(held & 1 << number != 0);
            assert_eq!((bench.variable(1), bench.variable(2)), (called, 1), "COMP {operand}; CALL {condition}");
        }
    }
}

#[test]
fn subroutines_nest_eight_deep() {
    // Subroutine n, at 2 + 3n, calls the next one, then counts.
    let mut program = "CSUB 2; STOP".to_owned();
    for level in 0..8 {
        let next = if level < 7 { 2 + 3 * (level + 1) } else { 2 + 3 * level + 1 };
        let call = if level < 7 { "CSUB" } else { "JA" };
        program += &format!("; {call} {next}; CALCV ADD, 1, 1; RSUB");
    }
    let mut bench = run(&program);
    assert_eq!((bench.variable(1), bench.last_error(), bench.program_counter()), (8, (0, 0), 2));
}

#[test]
fn call_with_a_full_stack_is_ignored() {
    for call in ["CSUB 0", "DATA 80, 0, 0, 0"] {
        // Every entry goes one deeper; the ninth call is ignored and the eight returns follow.
        let mut bench = run(&format!("CALCV ADD, 1, 1; COMP 0; {call}; CALCV ADD, 2, 1; RSUB; STOP"));
        assert_eq!((bench.variable(1), bench.variable(2)), (9, 9), "{call}");
        assert_eq!(bench.last_error(), (0, 0));
    }
}

#[test]
fn rsub_with_an_empty_stack_is_ignored() {
    assert_eq!(run("RSUB; RSUB; SGP 1, 2, 5; STOP").variable(1), 5);
}

#[test]
fn djnz_counts_down_to_zero() {
    assert_eq!(run("SGP 3, 2, 5; CALCV ADD, 1, 1; DJNZ 3, 1; STOP").variable(1), 5);
}

#[test]
fn djnz_wraps_below_zero_and_jumps() {
    let mut bench = run("DJNZ 3, 2; STOP; SGP 1, 2, 1; STOP");
    assert_eq!((bench.variable(3), bench.variable(1)), (-1, 1));
}

#[test]
fn rst_clears_stack_registers_and_flags_and_goes_on_at_its_address() {
    let mut bench = run("CSUB 2; STOP; CALC LOAD, 7; CALCX LOAD; RST 5; JC NZ, 7; JC ZE, 7; RSUB; SGP 1, 2, 1; STOP");
    assert_eq!((bench.accumulator(), bench.x(), bench.variable(1), bench.program_counter()), (0, 0, 1, 10));
}

#[test]
fn jump_past_the_end_of_memory_stops_the_program() {
    for jump in ["JA 6144", "JA 65536", "JA -1", "CSUB 7000", "DJNZ 0, 6144", "RST 6144", "COMP 0; JC ZE, 6144"] {
        let mut bench = Bench::new();
        bench.start(jump);
        bench.advance_ms(1);
        assert_eq!(bench.global(128, 0), 0, "{jump}");
        assert_eq!(bench.module.poll_at(), None, "{jump}");
    }
}

#[test]
fn program_without_stop_ends_at_the_end_of_memory() {
    let mut bench = Bench::new();
    assert_eq!(bench.run("CALC LOAD, 5"), 6144 * STEP_US);
    assert_eq!(bench.accumulator(), 5);
}

// Time.

#[test]
fn instruction_takes_ten_microseconds() {
    for (program, instructions) in [
        ("STOP", 0),
        ("CALC ADD, 1; STOP", 1),
        ("CALC ADD, 1; GAP 1, 0; SIO 0, 2, 1; JA 4; STOP", 4),
        ("SGP 0, 2, 100; DJNZ 0, 1; STOP", 101),
        ("CSUB 2; STOP; RSUB", 2),
        ("DATA 99, 0, 0, 0; CALC DIV, 0; STOP", 2),
        ("RST 1; STOP", 1),
        ("EI 255; VECT 0, 2; STOP", 2),
    ] {
        assert_eq!(Bench::new().run(program), instructions * STEP_US, "{program}");
    }
}

#[test]
fn wait_ticks() {
    for (program, ticks) in [
        ("WAIT TICKS, 0, 1; STOP", 1),
        ("WAIT TICKS, 0, 100; STOP", 100),
        ("WAIT TICKS, 0, 0; STOP", 0),
        ("WAIT TICKS, 99, 2; STOP", 2),
    ] {
        let mut bench = Bench::new();
        assert_eq!(bench.run(program), ticks * TICK_US + STEP_US, "{program}");
        assert_eq!(bench.last_error(), (0, 0));
    }
}

#[test]
fn wait_minus_1_takes_the_accumulator() {
    assert_eq!(Bench::new().run("CALC LOAD, 7; WAIT TICKS, 0, -1; STOP"), 7 * TICK_US + 2 * STEP_US);
    assert_eq!(Bench::new().run("CALC LOAD, 7; WAIT REFSW, 0, -1; STOP"), 7 * TICK_US + 2 * STEP_US);
}

#[test]
fn wait_for_less_than_nothing_is_skipped_and_remembered() {
    for program in ["WAIT TICKS, 0, -2; STOP", "CALC LOAD, -3; WAIT TICKS, 0, -1; STOP"] {
        let mut bench = run(program);
        let address = lines(program).count() as i32 - 2;
        assert_eq!(bench.last_error(), (4, address), "{program}");
    }
}

#[test]
fn wait_does_not_set_the_timeout_flag_for_ticks() {
    let mut bench = run(&with_conditions("WAIT TICKS, 0, 1"));
    assert_eq!(conditions(&mut bench), NOTHING);
}

#[test]
fn wait_pos_ends_when_the_position_is_reached() {
    let mut bench = Bench::new();
    let time = bench.run("MVP ABS, 1, 51200; WAIT POS, 1, 0; GAP 1, 1; STOP");
    assert_eq!(bench.accumulator(), 51_200);
    assert!((2_000_000..2_002_000).contains(&time), "a triangle of 2 s took {time} us");
}

#[test]
fn wait_for_a_switch_ends_at_its_level() {
    let home: fn(&mut Bench) = |bench| bench.stage(1).switches.home = true;
    let left: fn(&mut Bench) = |bench| bench.stage(1).switches.left = true;
    let right: fn(&mut Bench) = |bench| bench.stage(1).switches.right = true;
    for (wait, close, ends) in [
        ("REFSW", home, true),
        ("REFSW", left, false),
        ("REFSW", right, false),
        ("LIMSW", left, true),
        ("LIMSW", right, true),
        ("LIMSW", home, false),
    ] {
        let mut bench = Bench::new();
        bench.start(&format!("WAIT {wait}, 1, 0; SGP 1, 2, 1; STOP"));
        bench.advance_ms(50);
        assert_eq!(bench.program_counter(), 0, "still waiting");
        close(&mut bench);
        bench.advance_us(50);
        bench.advance_us(50);
        assert_eq!(bench.variable(1), i32::from(ends), "WAIT {wait}");
    }
}

#[test]
fn esd_is_set_when_the_drivers_go_off() {
    let enable: fn(&mut Bench) = |bench| bench.board().enable = false;
    let hot: fn(&mut Bench) = |bench| bench.stage(2).driver.flags = 2;
    let short: fn(&mut Bench) = |bench| bench.stage(0).driver.flags = 16;
    let warm: fn(&mut Bench) = |bench| bench.stage(0).driver.flags = 4;
    for (event, sets) in [(enable, true), (hot, true), (short, true), (warm, false)] {
        let mut bench = Bench::new();
        bench.start("DATA 21, 12, 0, 2; JA 0; CLE ESD; SGP 1, 2, 1; DATA 21, 12, 0, 6; JA 4; SGP 2, 2, 1; STOP");
        bench.advance_ms(10);
        assert_eq!(bench.variable(1), 0);
        event(&mut bench);
        bench.advance_ms(10);
        assert_eq!((bench.variable(1), bench.variable(2)), (i32::from(sets), 0), "once an event");
    }
}

#[test]
fn wait_for_a_normally_closed_switch_ends_when_it_opens() {
    let open: [fn(&mut Bench); 3] = [
        |bench| bench.stage(1).switches.left = false,
        |bench| bench.stage(1).switches.right = false,
        |bench| bench.stage(1).switches.home = false,
    ];
    for (wait, settings, opening) in [
        ("LIMSW", "SAP 12, 1, 1; SAP 13, 1, 1", open[0]),
        ("LIMSW", "SAP 12, 1, 1; SAP 13, 1, 1", open[1]),
        ("LIMSW", "SAP 12, 1, 1; SAP 13, 1, 1; SAP 12, 1, 0; SAP 13, 1, 0", open[0]),
        ("LIMSW", "SAP 12, 1, 1; SAP 13, 1, 1; SAP 33, 1, 1", open[1]),
        ("REFSW", "SAP 193, 1, 133", open[2]),
    ] {
        let mut bench = Bench::set_up(settings);
        bench.stage(1).switches = Switches { left: true, right: true, home: true };
        bench.start(&format!("WAIT {wait}, 1, 0; SGP 1, 2, 1; STOP"));
        bench.advance_ms(50);
        assert_eq!(bench.program_counter(), 0, "{wait}, {settings}: still waiting");
        opening(&mut bench);
        bench.advance_us(100);
        assert_eq!(bench.variable(1), 1, "{wait}, {settings}");
    }
}

#[test]
fn wait_for_a_closed_switch_does_not_wait() {
    let mut bench = Bench::new();
    bench.stage(2).switches.left = true;
    assert_eq!(bench.run("WAIT LIMSW, 2, 0; STOP"), STEP_US);
}

#[test]
fn wait_that_times_out_sets_eto_and_goes_on() {
    for wait in ["POS", "REFSW", "LIMSW"] {
        let mut bench = Bench::new();
        let program = format!("MVP ABS, 1, 1000000; WAIT {wait}, 1, 3");
        bench.run(&with_conditions(&program));
        assert_eq!(conditions(&mut bench), ETO, "{wait}");
        let time = Bench::new().run(&format!("{program}; STOP"));
        assert_eq!(time, 3 * TICK_US + 2 * STEP_US, "{wait}");
    }
}

#[test]
fn wait_that_is_satisfied_in_time_leaves_eto_clear() {
    let mut bench = run(&with_conditions("MVP ABS, 1, 100; WAIT POS, 1, 100"));
    assert_eq!(conditions(&mut bench), NOTHING);
}

#[test]
fn jc_eto_does_not_clear_the_flag_and_cle_does() {
    for (clear, held) in [
        ("DATA 0, 0, 0, 0", ETO),
        ("JC ETO, 2; DATA 0, 0, 0, 0", ETO),
        ("CLE ETO", NOTHING),
        ("CLE ALL", NOTHING),
        ("CLE EAL", ETO),
        ("CLE EDV", ETO),
        ("CLE EPO", ETO),
        ("CLE ESD", ETO),
    ] {
        let mut bench = run(&with_conditions(&format!("WAIT REFSW, 0, 1; {clear}")));
        assert_eq!(conditions(&mut bench), held, "{clear}");
    }
}

#[test]
fn comparisons_keep_the_error_flags() {
    let mut bench = run(&with_conditions("WAIT REFSW, 0, 1; CALC LOAD, 5"));
    assert_eq!(conditions(&mut bench), ETO | GREATER);
}

#[test]
fn program_counter_during_a_wait_is_its_address() {
    let mut bench = Bench::new();
    bench.start("CALC LOAD, 1; WAIT TICKS, 0, 10; STOP");
    bench.advance_ms(50);
    assert_eq!((bench.program_counter(), bench.control(135, 1, 0).1 >> 16 & 1), (1, 1));
}

#[test]
fn wait_of_an_unknown_kind_or_axis_is_skipped_and_remembered() {
    for (wait, status) in [("DATA 27, 5, 0, 0", 3), ("DATA 27, 1, 3, 0", 4), ("DATA 27, 2, 9, 0", 4)] {
        assert_eq!(run(&format!("{wait}; STOP")).last_error(), (status, 0), "{wait}");
    }
}

// Errors.

#[test]
fn failing_instruction_is_skipped_and_remembered() {
    for (failing, status) in [
        ("DATA 99, 0, 0, 0", 2),
        ("DATA 7, 0, 0, 0", 2),
        ("DATA 127, 0, 0, 0", 2),
        ("SAP 254, 0, 0", 3),
        ("SAP 3, 0, 0", 3),
        ("SAP 6, 0, 256", 4),
        ("GAP 4, 3", 4),
        ("ROR 0, 20000000", 4),
        ("MVP COORD, 0, 21", 4),
        ("SIO 0, 2, 5", 4),
        ("GIO 9, 0", 3),
        ("DATA 21, 13, 0, 0", 3),
        ("DATA 80, 13, 0, 0", 3),
        ("DATA 19, 12, 0, 0", 3),
        ("CALC DIV, 0", 4),
        ("EI 6", 3),
        ("VECT 0, 6144", 4),
        ("DATA 36, 6, 0, 0", 3),
        ("DATA 40, 0, 0, 256", 4),
    ] {
        let mut bench = run(&format!("CALC LOAD, 1; {failing}; CALC ADD, 1; STOP"));
        assert_eq!((bench.accumulator(), bench.last_error()), (2, (status, 1)), "{failing}");
    }
}

#[test]
fn last_error_is_the_latest_since_the_start() {
    let mut bench = run("DATA 99, 0, 0, 0; GAP 254, 0; STOP");
    assert_eq!(bench.last_error(), (3, 1));
    bench.control(129, 1, 2);
    bench.advance_ms(1);
    assert_eq!(bench.last_error(), (0, 0));
}

#[test]
fn last_error_survives_the_end_of_the_program() {
    assert_eq!(run("CALC DIV, 0; JA 7000").last_error(), (4, 0));
}

// Beside direct mode.

#[test]
fn reading_in_direct_mode_leaves_the_accumulator_alone() {
    let mut bench = Bench::set_up("CALC LOAD, 9; CALCX LOAD; COMP 20");
    for command in ["GAP 4, 0", "GGP 66, 0", "GGP 1, 2", "GIO 0, 0", "GCO 1, 0", "GAPX 4", "GIV"] {
        bench.exchange(command);
        assert_eq!((bench.accumulator(), bench.x()), (9, 9), "{command}");
    }
    bench.run("JC LT, 2; STOP; SGP 1, 2, 1; STOP");
    assert_eq!(bench.variable(1), 0, "131 has cleared the flags");
}

#[test]
fn giv_in_direct_mode_replies_the_variable() {
    let mut bench = Bench::set_up("SGP 9, 2, 77; CALC LOAD, 9; CALCX LOAD");
    assert_eq!(bench.exchange("GIV"), (100, 77));
}

#[test]
fn computing_in_direct_mode_works_on_the_registers_of_the_program() {
    let mut bench = Bench::new();
    bench.download("CALC ADD, 1; JC GT, 3; STOP; SGP 1, 2, 1; STOP");
    bench.all("CALC LOAD, 40; CALCX LOAD; SGP 2, 2, 3; CALCAV MUL, 2; CALCXV SUB, 2");
    assert_eq!((bench.accumulator(), bench.x()), (120, 37));
    bench.control(129, 0, 0);
    bench.advance_ms(1);
    assert_eq!((bench.accumulator(), bench.variable(1)), (121, 1));
}

#[test]
fn comparison_in_direct_mode_sets_the_flags_of_the_program() {
    let mut bench = Bench::new();
    bench.download("JC LT, 2; STOP; SGP 1, 2, 1; STOP");
    bench.all("CALC LOAD, 1; COMP 2");
    bench.control(129, 0, 0);
    bench.advance_ms(1);
    assert_eq!(bench.variable(1), 1);
}

#[test]
fn program_and_direct_commands_run_side_by_side() {
    let program = "SGP 1, 2, 0; CALC LOAD, 0; CALC ADD, 1; AGP 1, 2; COMP 2000; JC LT, 2; STOP";
    let alone = Bench::new().run(program);
    let mut bench = Bench::new();
    bench.start(program);
    let mut asked = 0;
    let start = bench.now;
    while bench.is_running() {
        bench.advance_us(STEP_US / 2);
        bench.exchange("GAP 4, 0");
        bench.exchange("SAP 4, 1, 1000");
        bench.exchange("GIO 0, 0");
        bench.exchange("GGP 66, 0");
        asked += 1;
    }
    assert_eq!((bench.accumulator(), bench.variable(1)), (2000, 2000));
    let late = bench.now - start - alone;
    assert!(late < STEP_US, "{late} us late after {asked} rounds");
}

// Timer and random numbers.

#[test]
fn tick_timer_counts_milliseconds() {
    let mut bench = Bench::new();
    bench.advance_us(1_234_567);
    assert_eq!(bench.global(132, 0), 1234);
    assert_eq!(bench.ask("SGP 132, 0, 100"), 100);
    bench.advance_ms(25);
    assert_eq!(bench.global(132, 0), 125);
    bench.ask("SGP 132, 0, 2147483647");
    bench.advance_ms(1);
    assert_eq!(bench.global(132, 0), MIN, "it wraps as a 32-bit counter");
}

#[test]
fn tick_timer_in_a_program_is_that_of_its_instructions() {
    let mut bench = run("SGP 132, 0, 0; WAIT TICKS, 0, 25; GGP 132, 0; STOP");
    assert_eq!(bench.accumulator(), 250);
}

#[test]
fn random_numbers_follow_from_the_seed() {
    let draw = |seed: i32| {
        let mut bench = Bench::set_up(&format!("SGP 133, 0, {seed}"));
        core::array::from_fn::<i32, 100, _>(|_| bench.global(133, 0))
    };
    assert_eq!(draw(5), draw(5));
    assert_ne!(draw(5), draw(6));
    let numbers = draw(MAX);
    assert!(numbers.iter().all(|number| *number >= 0));
    let different: std::collections::BTreeSet<_> = numbers.iter().collect();
    assert!(different.len() > 95, "{} different numbers of 100", different.len());
    let high = numbers.iter().filter(|number| **number > MAX / 2).count();
    assert!((25..75).contains(&high), "{high} of 100 in the upper half");
}

// Ports.

#[test]
fn digital_and_analogue_ports() {
    let mut bench = Bench::new();
    bench.board().inputs = 0b1010_0110;
    let levels: Vec<i32> = (0..8).map(|port| bench.ask(&format!("GIO {port}, 0"))).collect();
    assert_eq!(levels, [0, 1, 1, 0, 0, 1, 0, 1]);
    assert_eq!(bench.ask("GIO 255, 0"), 0b1010_0110);
    assert_eq!(bench.ask("GIO 10, 0"), 1);
    bench.board().enable = false;
    assert_eq!(bench.ask("GIO 10, 0"), 0);
    for port in 0..10 {
        assert_eq!(bench.ask(&format!("GIO {port}, 1")), 100 * port);
    }
}

#[test]
fn adc_range_is_set_and_read_back() {
    let mut bench = Bench::new();
    for range in [1, 0] {
        bench.ask(&format!("SIO 8, 0, {range}"));
        assert_eq!((bench.ask("GIO 8, 0"), bench.ask("GIO 0, 1")), (range, range));
    }
}

#[test]
fn outputs_are_set_one_by_one_and_together() {
    let mut bench = Bench::new();
    for (command, levels) in [
        ("SIO 0, 2, 1", 1),
        ("SIO 7, 2, 1", 0x81),
        ("SIO 0, 2, 0", 0x80),
        ("SIO 255, 2, 90", 90),
        ("SIO 3, 2, 1", 90),
        ("SIO 255, 2, 255", 255),
        ("SIO 255, 2, 0", 0),
    ] {
        bench.ask(command);
        assert_eq!((bench.board().outputs, bench.ask("GIO 255, 2")), (levels, i32::from(levels)), "{command}");
        let single: i32 = (0..8).map(|port| bench.ask(&format!("GIO {port}, 2")) << port).sum();
        assert_eq!(single, i32::from(levels), "{command}");
    }
}
