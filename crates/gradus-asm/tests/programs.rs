//! The programs of `examples/`; those of the manuals against `manual-programs.csv`, which has their commands as bytes: number, type,
//! motor, value.

#[path = "support/mod.rs"]
mod support;

use std::fs;
use std::path::Path;

use gradus_asm::{Assembly, Options, assemble, assemble_line, disassemble, from_bin, to_bin};
use gradus_tmcl::catalogue::{MODULES, Module};
use gradus_tmcl::{Instruction, Request};
use support::{EXAMPLES, assembled, examples};

const VECTORS: &str = include_str!("../../gradus-tmcl/tests/vectors.csv");

#[test]
fn every_program_assembles_for_its_module() {
    let mut count = 0;
    for (path, assembly) in examples() {
        let module = assembly.module;
        assert!(!assembly.has_errors(), "{}: {:#?}", path.display(), assembly.problems);
        // The programs of the TMCM-1617 manual use numbers of stepper modules, which can only be read there.
        assert!(assembly.problems.is_empty() || module.name == "TMCM-1617", "{:#?}", assembly.problems);
        assert_eq!(from_bin(&to_bin(&assembly.program)).as_ref(), Ok(&assembly.program));
        count += 1;
    }
    assert!(count >= 33, "{count} programs");
}

#[test]
fn examples_that_a_manual_prints_are_its_programs() {
    let mut count = 0;
    for row in include_str!("manual-programs.csv").lines().skip(1) {
        let [module, section, example, program] = row.split(',').collect::<Vec<_>>().try_into().unwrap();
        let ours = assembled(&Path::new(EXAMPLES).join(example), Module::named(module).unwrap()).program;
        let ours: Vec<String> = ours.iter().map(hexadecimal).collect();
        assert_eq!(ours.join(" "), program, "{example} is section {section} of the manual of the {module}");
        count += 1;
    }
    assert_eq!(count, 33);
}

fn hexadecimal(instruction: &Instruction) -> String {
    let Instruction { opcode, kind, motor, value } = instruction;
    format!("{:02X}{kind:02X}{motor:02X}{value:08X}", opcode.0)
}

#[test]
fn every_program_is_disassembled_into_the_same_program() {
    for (path, Assembly { program, module, .. }) in examples() {
        let text = disassemble(&program, module);
        let again = assemble("again.tmc", text.as_bytes(), module, &Options::default(), &|path| fs::read(path));
        assert_eq!(again.program, program, "{}:\n{text}", path.display());
        assert!(!text.contains("#data"), "{text}");
    }
}

#[test]
fn every_command_of_the_vectors_is_assembled_to_its_bytes() {
    let mut count = 0;
    for row in VECTORS.lines().skip(1) {
        let Some((module, mnemonic, bytes)) = command(row) else { continue };
        let datagram: Vec<_> = bytes.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let wanted = Request::parse(&datagram.try_into().unwrap()).unwrap().instruction;
        assert_eq!(assemble_line(mnemonic, module), Ok(wanted), "{mnemonic}");
        in_a_program(mnemonic, module, wanted);
        count += 1;
    }
    assert!(count > 90, "{count} commands");
}

fn in_a_program(mnemonic: &str, module: &'static Module, wanted: Instruction) {
    let assembly = assemble("vector.tmc", mnemonic.as_bytes(), module, &Options::default(), &|path| fs::read(path));
    assert_eq!(assembly.program[0], wanted);
    assert!(!assembly.has_errors(), "{mnemonic}: {:?}", assembly.problems);
}

/// Module, mnemonic and bytes of a row that is a command with a mnemonic.
fn command(row: &str) -> Option<(&'static Module, &str, &str)> {
    let (module, rest) = row.split_once(",command,")?;
    let (mnemonic, rest) = match rest.strip_prefix('"') {
        Some(quoted) => quoted.split_once("\",")?,
        None => rest.split_once(',')?,
    };
    let bytes = rest.split(',').next()?;
    let module = MODULES.iter().find(|row| row.name == module)?;
    (!mnemonic.is_empty()).then_some((*module, mnemonic, bytes))
}
