//! What a fuzzer of the assembler calls.

use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::{MODULES, Module};

use crate::assembler::{Options, assemble};
use crate::binary::from_bin;
use crate::disassembler::disassemble;
use crate::listing::listing;
use crate::render::{Style, render};

/// Takes any bytes as a program, a program memory and a `.bin` file, and panics if one of the promises
/// of this crate is broken.
pub fn fuzz_source(data: &[u8]) {
    let module = MODULES[data.len() % MODULES.len()];
    let assembly = assemble("fuzz.tmc", data, module, &Options::default(), &|_| Ok(data.to_vec()));
    for problem in assembly.problems.iter().take(20) {
        render(problem, &assembly.sources, Style::Plain);
    }
    listing(&assembly);
    same_again(&assembly.program, module);
    if let Ok(program) = from_bin(data) {
        same_again(&program, module);
    }
    let memory: Vec<_> = data.as_chunks().0.iter().map(|bytes| Instruction::from_bytes(*bytes)).collect();
    same_again(&memory, module);
}

/// A disassembled program gives the same program without an error.
fn same_again(program: &[Instruction], module: &'static Module) {
    let text = disassemble(program, module);
    let options = Options { no_stop: true, ..Options::default() };
    let again = assemble("again.tmc", text.as_bytes(), module, &options, &|_| Err(std::io::ErrorKind::NotFound.into()));
    assert_eq!(again.program, program);
    assert!(program.len() > module.memory() || !again.has_errors(), "{:?}", again.problems);
}
