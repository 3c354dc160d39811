//! What the tables promise beside their facts.

use std::collections::BTreeSet;

use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{
    Access, Ap, COMMANDS, Command, Direction, Gp, MODULES, Mode, Module, TMCM_351, TMCM_1617, TMCM_3351,
};

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[test]
fn modules_are_found_by_name_in_any_case() {
    for module in MODULES {
        assert_eq!(Module::named(&module.name.to_lowercase()).map(|found| found.number), Some(module.number));
    }
    assert!(Module::named("TMCM-1234").is_none());
}

#[test]
fn rows_are_found_by_their_numbers() {
    for module in MODULES {
        for row in module.axis_parameters {
            assert_eq!(module.axis_parameter(row.number), Some(row));
        }
        for row in module.global_parameters {
            assert_eq!(module.global_parameter(row.bank, row.first), Some(row));
            assert_eq!(module.global_parameter(row.bank, row.last), Some(row));
        }
        let of_axis = (0..=255).filter_map(|number| module.axis_parameter(number)).count();
        assert_eq!(of_axis, module.axis_parameters.len(), "{}", module.name);
        assert_eq!(module.global_parameter(4, 0), None);
        assert_eq!(module.global_parameter(0, 0), None);
    }
}

#[test]
fn numbers_ascend() {
    for module in MODULES {
        assert!(module.axis_parameters.is_sorted_by(|a, b| a.number < b.number), "{}", module.name);
        assert!(module.global_parameters.is_sorted_by(|a, b| (a.bank, a.last) < (b.bank, b.first)), "{}", module.name);
        assert!(module.interrupts.is_sorted_by(|a, b| a.number < b.number), "{}", module.name);
    }
    assert!(COMMANDS.is_sorted_by(|a, b| a.opcode < b.opcode));
}

#[test]
fn symbols_are_names_and_unique_in_a_module() {
    for module in MODULES {
        let of_axis = module.axis_parameters.iter().map(|row| row.symbol);
        // The two runs of user variables have one name, and numbers behind it.
        let globals = module.global_parameters.iter().filter(|row| row.first != 56).map(|row| row.symbol);
        let interrupts = module.interrupts.iter().map(|row| row.symbol);
        let symbols: Vec<&str> = of_axis.chain(globals).chain(interrupts).collect();
        for symbol in &symbols {
            assert!(is_name(symbol), "{symbol}");
        }
        let unique: BTreeSet<String> = symbols.iter().map(|symbol| symbol.to_lowercase()).collect();
        assert_eq!(unique.len(), symbols.len(), "{}", module.name);
    }
}

#[test]
fn a_meaning_stands_once_in_a_module() {
    for module in MODULES {
        let meanings: BTreeSet<usize> = module.axis_parameters.iter().map(|row| row.id as usize).collect();
        assert_eq!(meanings.len(), module.axis_parameters.len(), "{}", module.name);
        assert!(meanings.iter().all(|meaning| *meaning < Ap::COUNT));
        assert!(module.global_parameters.iter().all(|row| (row.id as usize) < Gp::COUNT));
    }
}

#[test]
fn every_meaning_stands_in_some_module() {
    let of_axis: BTreeSet<usize> =
        MODULES.iter().flat_map(|module| module.axis_parameters).map(|row| row.id as usize).collect();
    assert_eq!(of_axis, (0..Ap::COUNT).collect());
    let global: BTreeSet<usize> =
        MODULES.iter().flat_map(|module| module.global_parameters).map(|row| row.id as usize).collect();
    assert_eq!(global, (0..Gp::COUNT).collect());
}

#[test]
fn defaults_may_be_written() {
    for module in MODULES {
        let of_axis = module.axis_parameters.iter().filter(|row| row.access != Access::R);
        for row in of_axis.filter(|row| row.default.is_some()) {
            assert!(row.accepts(row.default.unwrap() as i32), "{} {}", module.name, row.name);
        }
        // the EEPROM lock is written with keys
        let global = module.global_parameters.iter().filter(|row| row.access != Access::R && row.id != Gp::EepromLock);
        for row in global.filter(|row| row.default.is_some()) {
            assert!(row.accepts(row.default.unwrap() as i32), "{} {}", module.name, row.name);
        }
    }
}

#[test]
fn descriptions_are_sentences_that_end_with_their_source() {
    let check = |description: &str| assert!(description.ends_with(")."), "{description}");
    for module in MODULES {
        module.axis_parameters.iter().for_each(|row| check(row.description));
        module.global_parameters.iter().for_each(|row| check(row.description));
    }
}

/// Which of the candidates a parameter accepts.
fn accepted(accepts: impl Fn(i32) -> bool, candidates: impl IntoIterator<Item = i32>) -> Vec<i32> {
    candidates.into_iter().filter(|value| accepts(*value)).collect()
}

#[test]
fn lists_refuse_what_they_do_not_list() {
    let axis = |module: &Module, number, range: std::ops::Range<i32>| {
        let row = module.axis_parameter(number).unwrap();
        accepted(|value| row.accepts(value), range)
    };
    assert_eq!(axis(&TMCM_3351, 12, -2..6), [0, 1, 3]);
    assert_eq!(axis(&TMCM_3351, 14, -2..6), [0, 1]);
    assert_eq!(axis(&TMCM_3351, 129, -2..6), [0, 1, 2, 3]);
    let searches: Vec<i32> = (1..=8).chain(65..=68).chain(133..=136).collect();
    assert_eq!(axis(&TMCM_3351, 193, -2..300), searches);
    assert_eq!(axis(&TMCM_1617, 14, -2..6), [0, 1, 3]);
    assert_eq!(axis(&TMCM_1617, 102, -2..6), [0, 2]);
}

#[test]
fn ranges_are_closed() {
    let speed = TMCM_3351.axis_parameter(4).unwrap();
    assert_eq!(accepted(|value| speed.accepts(value), [-1, 0, 16_777_215, 16_777_216]), [0, 16_777_215]);
    let position = TMCM_3351.axis_parameter(0).unwrap();
    assert!(position.accepts(i32::MIN) && position.accepts(i32::MAX));
}

#[test]
fn timer_periods_are_unsigned() {
    let period = TMCM_3351.global_parameter(3, 0).unwrap();
    assert!(period.accepts(-1) && period.accepts(i32::MIN) && period.accepts(0));
}

#[test]
fn ascii_mode_has_three_echoes_with_and_without_the_start_bit() {
    let row = TMCM_351.global_parameter(0, 67).unwrap();
    assert_eq!(accepted(|value| row.accepts(value), -1..100), [0, 1, 16, 17, 32, 33]);
}

#[test]
fn eeprom_lock_takes_its_two_keys_only() {
    let row = TMCM_351.global_parameter(0, 73).unwrap();
    assert_eq!(accepted(|value| row.accepts(value), -1..5000), [1234, 4321]);
}

#[test]
fn encoder_prescaler_takes_a_code_and_flags() {
    let row = TMCM_351.axis_parameter(210).unwrap();
    let near_one: Vec<i32> = (512..=512 + 31).collect();
    assert_eq!(accepted(|value| row.accepts(value), 500..560), near_one);
    assert_eq!(accepted(|value| row.accepts(value), [0, 31, 63, 96, 78_432, 78_463, 78_464]), [78_432, 78_463]);
}

#[test]
fn port_0_of_the_tmcm_351_is_an_input_to_gio_and_the_pull_ups_to_sio() {
    let direction = |port: Option<&gradus_tmcl::catalogue::Port>| port.map(|port| port.direction);
    assert_eq!(direction(TMCM_351.port(0, 0)), Some(Direction::In));
    assert_eq!(direction(TMCM_351.output(0, 0)), Some(Direction::Out));
    assert_eq!(direction(TMCM_351.output(0, 1)), None);
    assert_eq!(direction(TMCM_3351.port(2, 7)), Some(Direction::Out));
}

#[test]
fn modes_are_those_of_the_modules_firmware() {
    let cases = [
        (&TMCM_3351, Opcode::STAP, Mode::None),
        (&TMCM_3351, Opcode::JA, Mode::Standalone),
        (&TMCM_3351, Opcode::DJNZ, Mode::Standalone),
        (&TMCM_3351, Opcode::GET_INFO, Mode::Direct),
        (&TMCM_1617, Opcode::RFS, Mode::None),
        (&TMCM_351, Opcode::EI, Mode::Both), // not in manual V1.03
        (&TMCM_351, Opcode(200), Mode::None),
    ];
    for (module, opcode, mode) in cases {
        assert_eq!(module.mode(opcode), mode, "{} {opcode:?}", module.name);
    }
}

#[test]
fn keyword_texts_and_numbers_name_each_other() {
    for module in MODULES {
        for operand in COMMANDS.iter().flat_map(|command| command.operands) {
            for word in operand.kind.keywords().iter().filter(|word| word.models.contains(&module.model)) {
                assert_eq!(operand.keyword(&word.text.to_lowercase(), module), Some(word));
                assert_eq!(operand.keyword_of(word.number, module), Some(word));
            }
        }
    }
}

#[test]
fn syntax_line_shows_operands() {
    let syntax = |opcode| Command::of(opcode).unwrap().to_string();
    assert_eq!(syntax(Opcode::SAP), "SAP <parameter>, <axis>, <value>");
    assert_eq!(syntax(Opcode::GAP), "GAP <parameter>, <axis>, [0]");
    assert_eq!(syntax(Opcode::RSUB), "RSUB");
}
