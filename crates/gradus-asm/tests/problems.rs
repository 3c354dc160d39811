//! Problems as they are shown.

use std::io;
use std::path::Path;

use gradus_asm::{Options, Style, assemble, assemble_line, render};
use gradus_tmcl::catalogue::{Module, TMCM_351, TMCM_1617, TMCM_3351};

fn shown(text: &str, files: &[(&str, &str)], module: &'static Module) -> String {
    let load = |path: &Path| match files.iter().find(|(name, _)| Path::new(name) == path) {
        Some((_, "forbidden")) => Err(io::ErrorKind::PermissionDenied.into()),
        Some((_, text)) => Ok(text.as_bytes().to_vec()),
        None => Err(io::ErrorKind::NotFound.into()),
    };
    let assembly = assemble("main.tmc", text.as_bytes(), module, &Options::default(), &load);
    let problems = assembly.problems.iter().map(|problem| render(problem, &assembly.sources, Style::Plain));
    problems.collect::<Vec<_>>().join("\n")
}

/// The problems of a program, one a line: place, severity and code, message, hint.
fn problems(text: &str) -> String {
    problems_for(text, &TMCM_3351)
}

fn problems_for(text: &str, module: &'static Module) -> String {
    let load = |_: &Path| Err(io::ErrorKind::NotFound.into());
    let assembly = assemble("main.tmc", text.as_bytes(), module, &Options::default(), &load);
    let line = |problem: &gradus_asm::Problem| {
        let source = &assembly.sources[problem.span.source];
        let (line, column) = source.position(problem.span.start);
        let severity = if problem.is_error() { "error" } else { "warning" };
        let help = problem.help.iter().map(|help| format!(" ({help})")).collect::<String>();
        format!(
            "{line}:{column}-{} {severity} {}: {}{help}",
            column + source.slice(problem.span).chars().count(),
            problem.code.text(),
            problem.message
        )
    };
    assembly.problems.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_problem_is_shown_with_file_line_column_source_line_caret_and_hint() {
    insta::assert_snapshot!(shown("// größer\n    MVP ABS, 0, 100\n    MPV ABS, 0, 0 // zurück\n", &[], &TMCM_3351), @"
    error[unknown-command]: no command named `MPV`
     --> main.tmc:3:5
      |
    3 |     MPV ABS, 0, 0 // zurück
      |     ^^^
      |
      = help: did you mean `MVP`?
    ");
}

#[test]
fn all_problems_are_reported_in_one_run_and_addresses_stay_right() {
    let text = "Start: MOVE 1\n SAP 4, 0\n MVP ABS, 0, Far\n GAP 1, 5\n JA Strat\n JA Start";
    insta::assert_snapshot!(problems(text), @"
    1:8-12 error unknown-command: no command named `MOVE` (did you mean `MVP` (move to position)?)
    2:2-10 error operand-count: `SAP` takes 3 operands, not 2 (it is written `SAP <parameter>, <axis>, <value>`)
    3:14-17 error unknown-name: no label or constant named `Far`
    4:9-10 error not-on-module: the TMCM-3351 has no axis 5 (its axes are 0...2)
    5:5-10 error unknown-name: no label or constant named `Strat` (did you mean `Start`?)
    ");
    let assembly = assemble("main.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &|path| std::fs::read(path));
    assert_eq!(assembly.program.len(), 7);
    assert!(assembly.has_errors());
}

#[test]
fn malformed_lines() {
    insta::assert_snapshot!(problems("
1: MST 0
MVP ABS 0, 100
MVP ABS, , 100
MVP ABS, 0,
MST 0x
SAP 4, 0, (1 + 2
= 5
Speed =
MST 0;
#define X 1
#inclde a
#include
#include \"a.inc
 #  include // nothing
#data 1, 2, 3
#data 256, 0, 0, 0
SAP 4 0 5
MST *
MST 0 ?"), @r#"
    2:1-2 error syntax: `1` cannot stand here (a line is a command, `NAME = value`, `label:` or `#include file`)
    3:9-10 error syntax: `0` cannot stand here (operands are separated by commas)
    4:10-11 error syntax: a number or name is missing here
    5:11-12 error syntax: a number or name is missing here
    6:5-7 error syntax: `0x` is not a number (numbers are written as 42, 2.5, $2A, 0x2A, %101010 or 0b101010)
    7:11-12 error syntax: this bracket is not closed
    8:1-2 error syntax: `=` cannot stand here (a line is a command, `NAME = value`, `label:` or `#include file`)
    9:7-8 error syntax: a number or name is missing here
    10:6-7 error syntax: `;` cannot stand here (comments begin with //)
    11:1-8 error syntax: no directive named `#define`
    12:1-8 error syntax: no directive named `#inclde` (did you mean `#include`?)
    13:1-9 error syntax: the name of a file is missing here (write #include TMCLParam.tmc or #include "my file.tmc")
    14:1-9 error syntax: the name of a file is missing here (write #include TMCLParam.tmc or #include "my file.tmc")
    15:2-12 error syntax: the name of a file is missing here (write #include TMCLParam.tmc or #include "my file.tmc")
    16:1-6 error operand-count: `#data` takes 4 operands, not 3 (it is written `#data <opcode>, <type>, <motor>, <value>`)
    17:7-10 error out-of-range: the opcode is 256, its field takes 0...255
    18:7-8 error syntax: `0` cannot stand here (operands are separated by commas)
    19:5-6 error syntax: `*` cannot stand here
    20:7-8 error syntax: `?` cannot stand here
    "#);
}

#[test]
fn commands_that_no_module_or_only_others_have() {
    insta::assert_snapshot!(problems("WIAT POS, 0, 0\nFOO\nSTAP 4, 0\nSAC 0, 1, 5\nADD = 1\nADD 5"), @"
    1:1-5 error unknown-command: no command named `WIAT` (did you mean `WAIT`?)
    2:1-4 error unknown-command: no command named `FOO`
    3:1-5 error command-not-available: the TMCM-3351 has no command `STAP` (it is a command of the TMCM-1617 and TMCM-351)
    4:1-4 error command-not-available: the TMCM-3351 has no command `SAC` (it is a command of the TMCM-351)
    6:1-4 error unknown-command: no command named `ADD`
    ");
    insta::assert_snapshot!(problems_for("VECT 0, 0\nRFS START, 0\nSAPX 4, 5\nSAC 0, 1, 5", &TMCM_1617), @"
    1:1-5 error command-not-available: the TMCM-1617 has no command `VECT` (it is a command of the TMCM-3351 and TMCM-351)
    2:1-4 error command-not-available: the TMCM-1617 has no command `RFS` (it is a command of the TMCM-3351 and TMCM-351)
    3:1-5 error command-not-available: the TMCM-1617 has no command `SAPX` (it is a command of the TMCM-3351)
    4:1-4 error command-not-available: the TMCM-1617 has no command `SAC` (it is a command of the TMCM-351)
    ");
}

#[test]
fn mnemonics_of_other_dialects_lead_to_ours() {
    insta::assert_snapshot!(problems("RET\nreturn\nGOSUB 0\nGoto 0\nJMP 0\nMOV 1, 2\nCMP 5\nHALT"), @"
    1:1-4 error unknown-command: no command named `RET` (did you mean `RSUB` (return from subroutine) or `RETI` (return from interrupt)?)
    2:1-7 error unknown-command: no command named `return` (did you mean `RSUB` (return from subroutine) or `RETI` (return from interrupt)?)
    3:1-6 error unknown-command: no command named `GOSUB` (did you mean `CSUB` (call subroutine)?)
    4:1-5 error unknown-command: no command named `Goto` (did you mean `JA` (jump always)?)
    5:1-4 error unknown-command: no command named `JMP` (did you mean `JA` (jump always)?)
    6:1-4 error unknown-command: no command named `MOV` (did you mean `MVP` (move to position)?)
    7:1-4 error unknown-command: no command named `CMP` (did you mean `COMP` (compare)?)
    8:1-5 error unknown-command: no command named `HALT` (did you mean `STOP` (stop program execution)?)
    ");
}

#[test]
fn a_call_without_a_condition_leads_to_csub() {
    insta::assert_snapshot!(problems("CALL Sub\nCALL Nowhere\nCALL\nSub: RSUB"), @"
    1:1-9 error operand-count: `CALL` takes 2 operands, not 1 (it is written `CALL <condition>, <label>`; without a condition it is `CSUB <label>`)
    2:1-13 error operand-count: `CALL` takes 2 operands, not 1 (it is written `CALL <condition>, <label>`; without a condition it is `CSUB <label>`)
    3:1-5 error operand-count: `CALL` takes 2 operands, not 0 (it is written `CALL <condition>, <label>`)
    ");
}

#[test]
fn comments_of_other_languages_are_one_problem_each_and_the_command_stays() {
    let text = "; it's a, b\n'a\n/* MST 0 */\n*/\nMST 0 ; a, b\nMST 1'c\nX = 2 /* (\nMST X // ; '";
    insta::assert_snapshot!(problems(text), @"
    1:1-2 error syntax: `;` cannot stand here (comments begin with //)
    2:1-2 error syntax: `'` cannot stand here (comments begin with //)
    3:1-3 error syntax: `/*` cannot stand here (comments begin with //)
    4:1-3 error syntax: `*/` cannot stand here (comments begin with //)
    5:7-8 error syntax: `;` cannot stand here (comments begin with //)
    6:6-7 error syntax: `'` cannot stand here (comments begin with //)
    7:7-9 error syntax: `/*` cannot stand here (comments begin with //)
    ");
    let assembly = assemble("main.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &|path| std::fs::read(path));
    assert_eq!(assembly.program.iter().map(|command| command.motor).collect::<Vec<_>>(), [0, 1, 2, 0]);
}

#[test]
fn wrong_numbers_of_operands() {
    insta::assert_snapshot!(problems("MST\nMST 0, 1\nGAP 1\nGAP 1, 0, 0, 0\nSTOP 1\nSAP 4, 0, 1, 2\nUF0 1, 2, 3, 4\nRSUB 0\ndata 1,2\nSAP 4, Nowhere"), @"
    1:1-4 error operand-count: `MST` takes 1 operand, not 0 (it is written `MST <axis>`)
    2:1-9 error operand-count: `MST` takes 1 operand, not 2 (it is written `MST <axis>`)
    3:1-6 error operand-count: `GAP` takes 2 to 3 operands, not 1 (it is written `GAP <parameter>, <axis>, [0]`)
    4:1-15 error operand-count: `GAP` takes 2 to 3 operands, not 4 (it is written `GAP <parameter>, <axis>, [0]`)
    5:1-7 error operand-count: `STOP` takes no operands, not 1 (it is written `STOP`)
    6:1-15 error operand-count: `SAP` takes 3 operands, not 4 (it is written `SAP <parameter>, <axis>, <value>`)
    7:1-15 error operand-count: `UF0` takes 0 to 3 operands, not 4 (it is written `UF0 [type], [motor], [value]`)
    8:1-7 error operand-count: `RSUB` takes no operands, not 1 (it is written `RSUB`)
    9:1-5 error operand-count: `data` takes 4 operands, not 2 (it is written `data <opcode>, <type>, <motor>, <value>`)
    10:1-15 error operand-count: `SAP` takes 3 operands, not 2 (it is written `SAP <parameter>, <axis>, <value>`)
    ");
}

#[test]
fn keywords() {
    insta::assert_snapshot!(problems("MVP ABC, 0, 1\nMVP 3, 0, 0\nWAIT TICK, 0, 5\nCALC SWAP, 1\nCALCV SWAP, 1, 1\nJC GT\nRFS GO, 0"), @"
    1:5-8 error unknown-name: `MVP` has no kind `ABC` (did you mean `ABS`?)
    2:5-6 error keyword-not-available: `MVP` of the TMCM-3351 has no kind 3 (it has ABS, REL and COORD)
    3:6-10 error unknown-name: `WAIT` has no event `TICK` (did you mean `TICKS`?)
    4:6-10 error unknown-name: `CALC` has no operation `SWAP` (it takes ADD, SUB, MUL, DIV, MOD, AND, OR, XOR, NOT, LOAD)
    5:7-11 error unknown-name: `CALCV` has no operation `SWAP` (it takes ADD, SUB, MUL, DIV, MOD, AND, OR, XOR, NOT, LOAD, COMP)
    6:1-6 error operand-count: `JC` takes 2 operands, not 1 (it is written `JC <condition>, <label>`)
    7:5-7 error unknown-name: `RFS` has no action `GO` (it takes START, STOP, STATUS)
    ");
    insta::assert_snapshot!(problems_for("MVP COORD, 0, 1\nWAIT RFS, 0, 0\nMVP 2, 0, 0\nJC ESD, 0", &TMCM_1617), @"
    1:5-10 error keyword-not-available: `MVP` of the TMCM-1617 has no kind COORD (it has ABS and REL)
    2:6-9 error keyword-not-available: `WAIT` of the TMCM-1617 has no event RFS (it has TICKS, POS, REFSW and LIMSW)
    3:5-6 error keyword-not-available: `MVP` of the TMCM-1617 has no kind COORD (it has ABS and REL)
    ");
}

#[test]
fn unknown_names() {
    insta::assert_snapshot!(problems("Speed = 5\nLoop: ROL 0, Sped\nJA Loob\nJA Nowhere\nSAP APMaxCurrent, 0, 5\nCOMP SIN\nCOMP SINE(4)
GAP APRampDivisor, 0\nEI TI_TIMER0\nX = Y + 1\nCOMP X"), @"
    2:14-18 error unknown-name: no label or constant named `Sped` (did you mean `Speed`?)
    3:4-8 error unknown-name: no label or constant named `Loob` (did you mean `Loop`?)
    4:4-11 error unknown-name: no label or constant named `Nowhere`
    5:5-17 error unknown-name: no label or constant named `APMaxCurrent` (write #include TMCLParam.tmc first)
    6:6-9 error unknown-name: no label or constant named `SIN` (the function is written `SIN(...)`)
    7:6-10 error unknown-name: no function named `SINE` (did you mean `SIN`?)
    8:5-18 error unknown-name: no label or constant named `APRampDivisor` (the TMCM-351 has it, the TMCM-3351 does not)
    9:4-13 error unknown-name: no label or constant named `TI_TIMER0` (write #include Interrupts.inc first)
    10:5-6 error unknown-name: no label or constant named `Y`
    ");
}

#[test]
fn values_out_of_range() {
    insta::assert_snapshot!(problems("MST 256\nMST -1\nCOMP 4294967296\nCOMP -2147483649\nGAP 1, 0, 1\nSAP 4, 0, -5\nSAP 4, 0, 16777216
SAP 12, 0, 2\nSGP 77, 0, 7\nSIO 0, 2, 2\nROL 0, 20000000\nMVP ABS, 0, 3000000000\nMVP COORD, 0, 21\nSCO 21, 0, 0\nWAIT POS, 0, -2
CALCVV ADD, 1, 256\nDJNZ 300, 0\nSGP 0, 3, -1\nSAP 4, 0, 1 / 0.000001 ^ 2"), @"
    1:5-8 error out-of-range: the axis is 256, its field takes 0...255
    2:5-7 error out-of-range: the axis is -1, its field takes 0...255
    3:6-16 error out-of-range: the value is 4294967296, its field takes -2147483648...4294967295
    4:6-17 error out-of-range: the value is -2147483649, its field takes -2147483648...4294967295
    5:11-12 error out-of-range: this operand is not used and must be 0
    6:11-13 error out-of-range: maximum positioning speed cannot be -5 (it can be 0...16777215)
    7:11-19 error out-of-range: maximum positioning speed cannot be 16777216 (it can be 0...16777215)
    8:12-13 error out-of-range: right limit switch enable/polarity cannot be 2 (it can be 0, 1, 3)
    9:12-13 error out-of-range: auto start mode cannot be 7 (it can be 0...1)
    10:11-12 error out-of-range: output cannot be 2 (it can be 0...1)
    11:8-16 error out-of-range: velocity cannot be 20000000 (it can be -16777215...16777215)
    12:13-23 error out-of-range: position cannot be 3000000000 (it can be -2147483648...2147483647)
    13:15-17 error out-of-range: coordinate cannot be 21 (it can be 0...20)
    14:5-7 error out-of-range: coordinate cannot be 21 (it can be 0...20)
    15:14-16 error out-of-range: time cannot be -2 (it can be -1...2147483647)
    16:16-19 error out-of-range: user variable cannot be 256 (it can be 0...255)
    17:6-9 error out-of-range: the variable is 300, its field takes 0...255
    18:11-13 error out-of-range: timer 0 period cannot be -1 (it can be 0...4294967295)
    19:11-27 error out-of-range: the value is 1000000000000, its field takes -2147483648...4294967295
    ");
}

#[test]
fn values_at_the_ends_of_their_ranges_are_right() {
    let text =
        "SAP 4, 0, 16777215\nSAP 12, 0, 3\nSIO 255, 2, -1\nSGP 0, 3, 4294967295\nWAIT POS, 2, -1\nROL 2, -16777215
MVP ABS, 0, -2147483648\nMVP COORD, 0, 20\nCALCVV ADD, 255, 255\nCALC AND, $FFFF0000";
    assert_eq!(problems(text), "");
    assert_eq!(problems_for("SGP 73, 0, 1234\nSGP 73, 0, 4321\nSIO 0, 0, 255\nSIO 8, 0, 1", &TMCM_351), "");
}

#[test]
fn what_the_module_lacks() {
    insta::assert_snapshot!(problems("MST 3\nGAP 99, 0\nSAP 99, 3, 1\nGGP 1, 0\nGGP 1, 1\nSGP 10, 3, 1\nGIO 9, 0\nGIO 0, 5\nEI 9
MVP COORD, $48, 1\nMVP ABS, $41, 1\nGCO 1, 3"), @"
    1:5-6 error not-on-module: the TMCM-3351 has no axis 3 (its axes are 0...2)
    2:5-7 error not-on-module: the TMCM-3351 has no axis parameter 99
    3:5-7 error not-on-module: the TMCM-3351 has no axis parameter 99
    3:9-10 error not-on-module: the TMCM-3351 has no axis 3 (its axes are 0...2)
    4:5-6 error not-on-module: the TMCM-3351 has no global parameter 1 in bank 0
    5:8-9 error not-on-module: the TMCM-3351 has no bank 1 of global parameters
    6:5-7 error not-on-module: the TMCM-3351 has no global parameter 10 in bank 3
    7:5-6 error not-on-module: the TMCM-3351 has no port 9 in bank 0
    8:8-9 error not-on-module: the TMCM-3351 has no bank 5 of ports
    9:4-5 error not-on-module: the TMCM-3351 has no interrupt 9
    10:12-15 error not-on-module: the TMCM-3351 has no axis 3 (its axes are 0...2)
    11:10-13 error not-on-module: the TMCM-3351 has no axis 65 (its axes are 0...2)
    12:8-9 error not-on-module: the TMCM-3351 has no axis 3 (its axes are 0...2)
    ");
    insta::assert_snapshot!(problems_for("MST 1\nGGP 0, 3\nGAP 99, 0", &TMCM_1617), @"
    1:5-6 error not-on-module: the TMCM-1617 has no axis 1 (its only axis is 0)
    2:8-9 error not-on-module: the TMCM-1617 has no bank 3 of global parameters
    3:5-7 error not-on-module: the TMCM-1617 has no axis parameter 99
    ");
}

#[test]
fn writing_what_can_only_be_read_and_storing_what_is_not_stored_is_a_warning() {
    insta::assert_snapshot!(problems("SAP 3, 0, 1\nAAP 8, 0\nSAPX 3, 1\nAAPX 3\nSGP 128, 0, 0\nSIO 0, 0, 1\nSTGP 56, 2\nGAP 3, 0"), @"
    1:5-6 warning read-only: actual speed can only be read (the module will refuse this command)
    2:5-6 warning read-only: position reached flag can only be read (the module will refuse this command)
    3:6-7 warning read-only: actual speed can only be read (the module will refuse this command)
    4:6-7 warning read-only: actual speed can only be read (the module will refuse this command)
    5:5-8 warning read-only: TMCL application status can only be read (the module will refuse this command)
    6:5-6 warning read-only: port 0 in bank 0 (IN0) is an input (the module will refuse this command)
    7:6-8 warning not-stored: user variable has no place in the EEPROM (the module will refuse this command)
    ");
    insta::assert_snapshot!(problems_for("STAP 50, 0\nSTAP 11, 0\nSAP 4, 0, 50000", &TMCM_1617), @"
    1:6-8 warning not-stored: target position has no place in the EEPROM (the module will refuse this command)
    3:5-6 warning read-only: adc_I2 can only be read (the module will refuse this command)
    ");
}

#[test]
fn arithmetic() {
    insta::assert_snapshot!(problems("Zero = 1 - 1\nA = 4 / Zero\nCOMP A\nCOMP LOG(Zero)\nCOMP 10 ^ 999\nCOMP 1 / (2 - 2) + 5"), @"
    2:5-13 error arithmetic: division by zero
    4:6-15 error arithmetic: this has no finite value
    5:6-14 error arithmetic: this has no finite value
    6:6-17 error arithmetic: division by zero
    ");
}

#[test]
fn constants_in_a_circle_are_reported_once() {
    insta::assert_snapshot!(problems("A = A\nB = C + 1\nC = D\nD = 2 * B\nCOMP B\nE = B"), @"
    1:1-2 error constant-cycle: constant `A` is defined by itself (A -> A)
    2:1-2 error constant-cycle: constant `B` is defined by itself (B -> C -> D -> B)
    ");
}

#[test]
fn jumps_out_of_the_program_or_out_of_memory() {
    insta::assert_snapshot!(problems("JA 2\nJA 1\nCSUB 6143\nRST 6144\nJA -1\nSTOP"), @"
    3:6-10 warning jump-target: address 6143 is behind the end of this program (its last address is 5)
    4:5-9 error jump-target: there is no address 6144 in program memory (it has 0...6143)
    5:4-6 error jump-target: there is no address -1 in program memory (it has 0...6143)
    ");
}

#[test]
fn the_end_of_memory() {
    let commands = |count: usize| "MST 0\n".repeat(count);
    assert_eq!(problems(&commands(6143)), "");
    insta::assert_snapshot!(problems(&commands(6144)), @"6144:1-4 error program-too-long: the program has 6145 commands, the TMCM-3351 holds 6144");
    insta::assert_snapshot!(problems_for(&commands(1026), &TMCM_1617), @"1025:1-4 error program-too-long: the program has 1027 commands, the TMCM-1617 holds 1024");
}

#[test]
fn names_defined_twice() {
    insta::assert_snapshot!(shown("Speed = 5\nSpeed = 6\nLoop:\n MST 0\nLOOP: JA Loop\nSpeed: STOP", &[], &TMCM_3351), @"
    error[duplicate]: `Speed` is already a constant
     --> main.tmc:2:1
      |
    1 | Speed = 5
      | ----- the first one
    2 | Speed = 6
      | ^^^^^
    error[duplicate]: `LOOP` is already a label
     --> main.tmc:5:1
      |
    3 | Loop:
      | ---- the first one
    4 |  MST 0
    5 | LOOP: JA Loop
      | ^^^^
    error[duplicate]: `Speed` is already a constant
     --> main.tmc:6:1
      |
    1 | Speed = 5
      | ----- the first one
    ...
    6 | Speed: STOP
      | ^^^^^
    ");
    let files = [("a.inc", "Speed = 5")];
    insta::assert_snapshot!(shown("#include a.inc\nSpeed = 4\nSpeed = 5", &files, &TMCM_3351), @"
    error[duplicate]: `Speed` is already a constant
     --> main.tmc:2:1
      |
    2 | Speed = 4
      | ^^^^^
      |
      = note: the first one is at a.inc:1
    ");
}

#[test]
fn included_files() {
    let files = [("a.inc", "MST 0\n#include ./b.inc"), ("b.inc", "MST 5\n#include a.inc"), ("c.inc", "forbidden")];
    insta::assert_snapshot!(
        shown("#include a.inc\n#include TMCLParams.tmc\n#include c.inc\n#include main.tmc\n#include x.inc", &files, &TMCM_3351),
        @"
    error[include]: no file named `TMCLParams.tmc`
     --> main.tmc:2:10
      |
    2 | #include TMCLParams.tmc
      |          ^^^^^^^^^^^^^^
      |
      = help: did you mean `TMCLParam.tmc`?
    error[include]: `c.inc` cannot be read
     --> main.tmc:3:10
      |
    3 | #include c.inc
      |          ^^^^^
      |
      = help: c.inc: permission denied
    error[include]: no file named `main.tmc`
     --> main.tmc:4:10
      |
    4 | #include main.tmc
      |          ^^^^^^^^
      |
      = help: looked in `.`
    error[include]: no file named `x.inc`
     --> main.tmc:5:10
      |
    5 | #include x.inc
      |          ^^^^^
      |
      = help: looked in `.`
    error[not-on-module]: the TMCM-3351 has no axis 5
     --> b.inc:1:5
      |
    1 | MST 5
      |     ^
      |
      = help: its axes are 0...2
    error[include-cycle]: `a.inc` includes itself
     --> b.inc:2:10
      |
    2 | #include a.inc
      |          ^^^^^
      |
      = help: a.inc -> b.inc -> a.inc
    "
    );
}

#[test]
fn a_file_that_is_nowhere_is_named_with_the_folders_that_were_searched() {
    let help = |text: &str, dirs: &[&str]| {
        let options = Options { include_dirs: dirs.iter().map(Into::into).collect(), ..Options::default() };
        let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
        assemble("dir/main.tmc", text.as_bytes(), &TMCM_3351, &options, &nothing).problems[0].help.clone().unwrap()
    };
    assert_eq!(help("#include x.inc", &[]), "looked in `dir`");
    assert_eq!(help("#include x.inc", &["a", "/b/c"]), "looked in `dir`, `a` and `/b/c`");
    assert_eq!(help("#include sub/x.inc", &["a"]), "looked in `dir/sub` and `a/sub`");
    assert_eq!(help("#include ../x.inc", &["dir/a"]), "looked in `.` and `dir`");
    assert_eq!(help("#include /x.inc", &["a", "b"]), "looked in `/`");
}

#[test]
fn a_utf16_file_is_one_problem() {
    let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let load = |_: &Path| Ok(utf16("\u{feff}MST 0\r\nMST 1\r\n"));
    let big_endian: Vec<u8> = "\u{feff}MST 0\n".encode_utf16().flat_map(u16::to_be_bytes).collect();
    for (text, expected) in [(&b"#include a.inc"[..], "a.inc"), (&big_endian, "main.tmc")] {
        let assembly = assemble("main.tmc", text, &TMCM_3351, &Options::default(), &load);
        let [problem] = assembly.problems.as_slice() else { panic!("{:?}", assembly.problems) };
        assert_eq!(
            render(problem, &assembly.sources, Style::Plain),
            format!(
                "\
error[encoding]: `{expected}` is UTF-16
 --> {expected}:1:1
  |
1 |
  | ^
  |
  = help: save it as UTF-8"
            )
        );
    }
}

#[test]
fn includes_without_end_are_cut() {
    let load = |_: &Path| Ok(b"#include x/x".to_vec());
    let assembly = assemble("main.tmc", b"#include x", &TMCM_3351, &Options::default(), &load);
    assert_eq!(assembly.problems.len(), 1);
    assert_eq!(assembly.problems[0].message, "the program includes too many files");
}

#[test]
fn a_line_for_direct_mode() {
    let message = |text: &str| assemble_line(text, &TMCM_3351).unwrap_err()[0].message.clone();
    insta::assert_snapshot!(["", "GAP", "Loop: GAP 1, 0", "A = 1", "GAP 1 0", "GAP 300, 0", "JA Loop", "#include x"]
        .map(message).join("\n"), @"
    one command is expected here
    `GAP` takes 2 to 3 operands, not 0
    one command is expected here
    one command is expected here
    `0` cannot stand here
    the parameter is 300, its field takes 0...255
    no label or constant named `Loop`
    one command is expected here
    ");
}
