//! What fuzzers of the assembler, the linter and the formatter call.

use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::{ANY, MODULES, Module};

use crate::assembler::{Options, assemble};
use crate::binary::from_bin;
use crate::disassembler::disassemble;
use crate::fix::apply_fixes;
use crate::format::format;
use crate::lint::{LintOptions, lint};
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

/// Takes any bytes as a program and looks for mistakes in it, with and without knowledge of a module. Places of problems must be
/// places of the text, and fixes that call themselves safe must keep the program's bytes.
pub fn fuzz_check(data: &[u8]) {
    let modules = [MODULES, &[&ANY]].concat();
    let module = modules[data.len() % modules.len()];
    let load = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let assembly = assemble("fuzz.tmc", data, module, &Options::default(), &load);
    let problems = lint(&assembly, &LintOptions { pedantic: true, ..LintOptions::default() });
    for problem in &problems {
        let edits = problem.fix.iter().flat_map(|fix| fix.edits.iter().map(|edit| edit.span));
        let spans = edits.chain([problem.span]).chain(problem.note.iter().map(|note| note.span));
        for span in spans {
            let text = &assembly.sources[span.source].text;
            assert!(text.get(span.start..span.end).is_some(), "{problem:?}");
        }
    }
    for changed in apply_fixes(&problems, &assembly.sources, false) {
        let again = assemble("fuzz.tmc", changed.text.as_bytes(), module, &Options::default(), &load);
        assert_eq!(again.program, assembly.program, "{}", changed.text);
    }
}

/// Takes any bytes as a file and formats it. The program must stay the same, and a second time must change nothing.
pub fn fuzz_format(data: &[u8]) {
    let Ok(once) = format(data) else { return };
    assert_eq!(format(once.text.as_bytes()).map(|twice| twice.text).as_ref(), Ok(&once.text));
    let load = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let program = |bytes: &[u8]| assemble("fuzz.tmc", bytes, MODULES[0], &Options::default(), &load).program;
    assert_eq!(program(once.text.as_bytes()), program(data), "{}", once.text);
}

/// A disassembled program gives the same program without an error.
fn same_again(program: &[Instruction], module: &'static Module) {
    let text = disassemble(program, module);
    let load = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let again = assemble("again.tmc", text.as_bytes(), module, &Options::default(), &load);
    assert_eq!(again.program, program);
    assert!(program.len() > module.memory() || !again.has_errors(), "{:?}", again.problems);
}
