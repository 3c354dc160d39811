//! What holds for all programs and for all bytes.

use std::io;

use gradus_asm::{Options, assemble, disassemble, from_bin, fuzz_source, to_bin};
use gradus_tmcl::catalogue::{COMMANDS, MODULES};
use gradus_tmcl::{Instruction, Opcode};
use proptest::prelude::*;

/// Mostly small numbers, which the fields of real commands hold.
fn byte() -> impl Strategy<Value = u8> {
    prop_oneof![4 => 0..4u8, 1 => any::<u8>()]
}

fn value() -> impl Strategy<Value = i32> {
    prop_oneof![4 => 0..40i32, 1 => Just(-1), 1 => any::<i32>()]
}

fn opcode() -> impl Strategy<Value = u8> {
    prop_oneof![8 => (0..COMMANDS.len()).prop_map(|row| COMMANDS[row].opcode.0), 1 => any::<u8>()]
}

fn instruction() -> impl Strategy<Value = Instruction> {
    let fields = (opcode(), byte(), byte(), value());
    fields.prop_map(|(opcode, kind, motor, value)| Instruction::new(Opcode(opcode), kind, motor, value))
}

/// Words of the language in any order, so that more than the first line of defence is tested.
fn source() -> impl Strategy<Value = String> {
    #[rustfmt::skip]
    let words = prop::sample::select(vec![
        "\n", "\n", "\n", " ", ",", ":", "=", "(", ")", "+", "-", "*", "/", "^", "//", "#include", "\"", "#data", "fuzz.tmc",
        "TMCLParam.tmc", "A", "B", "Loop", "Motor1", "MVP", "ABS", "SAP", "GAP", "JA", "JC", "WAIT", "STOP", "CALC", "ADD",
        "SIN", "0", "1", "2.5", "$F", "%1", "0x", "99999999999", "ü", "\r",
    ]);
    prop::collection::vec(words, 0..60).prop_map(|words| words.concat())
}

proptest! {
    #[test]
    fn a_disassembled_program_gives_the_same_bytes(program in prop::collection::vec(instruction(), 0..40), module in 0..3usize) {
        let text = disassemble(&program, MODULES[module]);
        let options = Options { no_stop: true, ..Options::default() };
        let load = |_: &_| Err(io::ErrorKind::NotFound.into());
        let again = assemble("again.tmc", text.as_bytes(), MODULES[module], &options, &load);
        prop_assert_eq!(&again.program, &program, "{}", text);
        prop_assert!(!again.has_errors(), "{:?}\n{}", again.problems, text);
    }

    #[test]
    fn a_binary_gives_the_same_program(program in prop::collection::vec(instruction(), 0..40)) {
        prop_assert_eq!(from_bin(&to_bin(&program)), Ok(program));
    }

    #[test]
    fn no_text_makes_the_assembler_panic(text in source()) {
        fuzz_source(text.as_bytes());
    }

    #[test]
    fn no_bytes_make_the_assembler_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        fuzz_source(&bytes);
    }
}

#[test]
fn comments_name_the_parameters() {
    let program = [
        Instruction::new(Opcode::SAP, 4, 0, 51_200),
        Instruction::new(Opcode::GAP, 8, 1, 0),
        Instruction::new(Opcode::SGP, 77, 0, 1),
        Instruction::new(Opcode::SGP, 7, 2, 1),
        Instruction::new(Opcode::SAP, 255, 0, 1),
        Instruction::new(Opcode::STOP, 0, 0, 0),
    ];
    insta::assert_snapshot!(disassemble(&program, MODULES[0]), @r"
    SAP 4, 0, 51200             // AP 4: maximum positioning speed, pps
    GAP 8, 1                    // AP 8: position reached flag
    SGP 77, 0, 1                // GP 77, bank 0: auto start mode
    SGP 7, 2, 1
    SAP 255, 0, 1               // AP 255: unit mode
    STOP
    ");
}

#[test]
fn the_fuzz_corpus_holds() {
    for text in [
        "",
        "#include fuzz.tmc",
        "A = B\nB = A\nCOMP A",
        "Loop: JA Loop\nLoop: JA Loop + 1",
        "MVP ABS, 0, 1e9",
        "COMP ((((((((1",
        "#include \"",
        "#includé",
        "\u{85}\u{2028}: =",
        "JA L\nL:",
        "SGP 0, 3, -1",
    ] {
        fuzz_source(text.as_bytes());
    }
    fuzz_source(b"\xff\xfe\x00//\x80");
    fuzz_source(&[b'('; 3000]);
}
