//! Instructions as text, and what is not one.

use gradus_tmcl::catalogue::{EncodeError, Module, TMCM_351, TMCM_1617, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode, ParseError};

fn parse(text: &str) -> Result<Instruction, ParseError> {
    Instruction::parse(text, &TMCM_3351)
}

/// The canonical form of a line.
fn canonical(text: &str, module: &Module) -> String {
    Instruction::parse(text, module).unwrap().display(module).to_string()
}

#[test]
fn operands_are_keywords_or_numbers_of_any_base() {
    let same = [
        "MVP ABS, 0, 51200",
        "mvp abs,0,51200",
        "  MVP\tABS ,0 , 51200  ",
        "MVP 0, 0, $C800",
        "MVP 0, 0, 0xc800",
        "MVP 0, 0, +51200",
        "MVP %0, 0b0, %1100100000000000",
    ];
    for text in same {
        assert_eq!(canonical(text, &TMCM_3351), "MVP ABS, 0, 51200", "{text}");
    }
}

#[test]
fn values_may_be_signed_or_unsigned() {
    for text in ["COMP -1", "COMP - 1", "COMP 4294967295", "COMP $FFFFFFFF", "COMP -$1"] {
        assert_eq!(canonical(text, &TMCM_3351), "COMP -1", "{text}");
    }
}

#[test]
fn value_that_would_wrap_is_no_value() {
    for text in
        ["MVP ABS, 0", "MVP REL, 0", "ROR 0", "ROL 0", "SCO 1, 0", "SAP 0, 0", "SAPX 0", "SGP 7, 2", "SIO 255, 2"]
    {
        assert!(parse(&format!("{text}, 2147483647")).is_ok(), "{text}");
        for value in ["2147483648", "$80000000", "4294967295", "4294967296", "-2147483649", "99999999999999999999"] {
            assert!(parse(&format!("{text}, {value}")).is_err(), "{text}, {value}");
        }
    }
    assert_eq!(
        parse("MVP ABS, 0, 2147483648").unwrap_err().to_string(),
        "value 2147483648 out of range -2147483648..=2147483647"
    );
    // The periods of timers are unsigned.
    assert_eq!(parse("SGP 0, 3, 4294967295").unwrap().value, -1);
    assert!(parse("SGP 0, 3, 4294967296").is_err());
}

#[test]
fn third_operand_of_get_is_accepted_and_must_be_0() {
    for text in ["GAP 1, 0, 0", "GGP 66, 0, 0", "GIO 0, 1, 0", "GCO 0, 255, 0"] {
        assert_eq!(canonical(text, &TMCM_3351), text.strip_suffix(", 0").unwrap());
    }
    let error = EncodeError::Range { name: "0", value: 1, min: 0, max: 0 };
    assert_eq!(parse("GAP 1, 0, 1"), Err(error.into()));
}

#[test]
fn user_functions_take_up_to_three_numbers() {
    for text in ["UF0", "UF1 5", "UF2 0, 1", "UF7 1, 2, -3"] {
        assert_eq!(canonical(text, &TMCM_351), text);
    }
    assert_eq!(canonical("UF0 0, 0, 0", &TMCM_351), "UF0");
}

#[test]
fn masks_are_hexadecimal_and_axes_decimal() {
    assert_eq!(canonical("MVP COORD, 135, 5", &TMCM_351), "MVP COORD, $87, 5");
    assert_eq!(canonical("MVP COORD, 2, 5", &TMCM_351), "MVP COORD, 2, 5");
}

#[test]
fn number_without_a_keyword_stays_a_number() {
    assert_eq!(canonical("MVP 9, 0, 1", &TMCM_3351), "MVP 9, 0, 1");
    assert_eq!(canonical("MVP 2, 0, 1", &TMCM_1617), "MVP 2, 0, 1"); // COORD, which the module does not have
    assert_eq!(canonical("JC 12, 7", &TMCM_3351), "JC 12, 7"); // ESD of the TMCM-351
    assert_eq!(canonical("JC 12, 7", &TMCM_351), "JC ESD, 7");
}

#[test]
fn what_no_command_stands_for_is_data() {
    let unknown = Instruction::new(Opcode(99), 1, 2, -3);
    assert_eq!(unknown.display(&TMCM_3351).to_string(), "DATA 99, 1, 2, -3");
    let control = Instruction::new(Opcode::RUN_APPLICATION, 1, 0, 50);
    assert_eq!(control.display(&TMCM_3351).to_string(), "DATA 129, 1, 0, 50");
    let absent = Instruction::new(Opcode::DJNZ, 1, 0, 7);
    assert_eq!(absent.display(&TMCM_1617).to_string(), "DATA 49, 1, 0, 7");
    let unused_field = Instruction::new(Opcode::RETI, 255, 0, 0);
    assert_eq!(unused_field.display(&TMCM_3351).to_string(), "DATA 38, 255, 0, 0");
    for instruction in [unknown, control, absent, unused_field] {
        let text = instruction.display(&TMCM_1617).to_string();
        assert_eq!(Instruction::parse(&text, &TMCM_1617), Ok(instruction));
    }
}

#[test]
fn command_of_another_module_is_unknown() {
    for (text, module) in [("STAP 4, 0", &TMCM_3351), ("RFS START, 0", &TMCM_1617), ("SIV 3", &TMCM_351)] {
        assert_eq!(Instruction::parse(text, module), Err(ParseError::Command), "{text}");
    }
}

#[test]
fn wrong_operand_is_named() {
    let unknown = ["MVP FOO, 0, 1", "MVP ADD, 0, 1"].map(parse);
    assert_eq!(unknown, [Err(ParseError::Operand(1)); 2]);
    let not_numbers = ["SAP 4,, 1", "SAP 4, --1, 0", "SAP 4, $-1, 0", "SAP 4, 0x, 0", "SAP 4, 1.5, 0"].map(parse);
    assert_eq!(not_numbers, [Err(ParseError::Operand(2)); 5]);
    assert_eq!(parse("SAP 4, 256, 1").unwrap_err().to_string(), "axis 256 out of range 0..=255");
    assert_eq!(
        parse("COMP 4294967296").unwrap_err().to_string(),
        "value 4294967296 out of range -2147483648..=4294967295"
    );
    assert_eq!(parse("DATA 256, 0, 0, 0").unwrap_err().to_string(), "opcode 256 out of range 0..=255");
}

#[test]
fn wrong_number_of_operands_is_told() {
    let count = |got, want| Err(EncodeError::Count { got, want }.into());
    assert_eq!(parse("MVP ABS, 0"), count(2, 3));
    assert_eq!(parse("STOP 0"), count(1, 0));
    assert_eq!(parse("MST 0, 1, 2, 3, 4, 5"), count(6, 1));
    assert_eq!(parse("DATA 1, 2, 3"), count(3, 4));
    assert_eq!(parse("DATA 1, 2, 3, 4, 5"), count(5, 4));
}

#[test]
fn control_commands_and_nothing_have_no_mnemonic() {
    for text in ["", " ", "RUN", "128"] {
        assert_eq!(parse(text), Err(ParseError::Command), "{text:?}");
    }
}
