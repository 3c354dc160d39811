//! The commonest mistakes of real programs, one file each in `mistakes`: each is reported once, in its line, with what to do.

#[path = "support/mod.rs"]
mod support;

use std::path::Path;

use gradus_asm::{LintOptions, Severity, lint};
use gradus_tmcl::catalogue::TMCM_3351;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../mistakes");

/// File, which is named for its code; line; the advice.
#[rustfmt::skip]
const MISTAKES: &[(&str, usize, &str)] = &[
    ("comparison-lost", 9, "compare again right before the condition"),
    ("constant-written", 12, "load the value again before it is written"),
    ("eeprom-in-loop", 14, "store on a command of the host, or only when the value has changed"),
    ("falls-into-routine", 5, "put a STOP or a JA in front of the routine, or call it with CSUB"),
    ("handler-without-reti", 14, "end the handler with RETI on every way"),
    ("jump-out-of-routine", 13, "leave it with RSUB, or start anew with RST"),
    ("position-written-while-moving", 7, "wait until the axis stands"),
    ("read-only", 4, "the module will refuse this command"),
    ("stored-overwritten", 13, "delete one of the two"),
    ("ticks-comment", 5, "a tick is 10 ms: write `WAIT TICKS, 0, 50`, or correct the comment"),
    ("unreachable", 11, "call it, delete it, or write `// gradus: entry` at its label if the host starts it"),
    ("wait-pos-after-velocity", 4, "wait for a time, or until axis parameter 3 is 0"),
];

#[test]
fn each_mistake_is_reported_in_its_line_with_what_to_do() {
    let mut found = Vec::new();
    for (name, _, _) in MISTAKES {
        let assembly = support::assembled(&Path::new(FOLDER).join(format!("{name}.tmc")), &TMCM_3351);
        let problems = lint(&assembly, &LintOptions::default());
        for problem in problems.iter().filter(|problem| problem.severity > Severity::Hint) {
            let (line, _) = assembly.sources[problem.span.source].position(problem.span.start);
            assert_eq!(problem.code.text(), *name, "{name}: {}", problem.message);
            found.push((*name, line, problem.help.clone().unwrap_or_default()));
        }
    }
    let found: Vec<_> = found.iter().map(|(name, line, help)| (*name, *line, help.as_str())).collect();
    assert_eq!(found, MISTAKES);
}

#[test]
fn every_file_of_the_folder_is_looked_at() {
    let names = support::programs(FOLDER);
    let names = names.iter().map(|path| path.file_stem().unwrap().to_str().unwrap());
    let others = names.filter(|name| !MISTAKES.iter().any(|(known, _, _)| known == name)).collect::<Vec<_>>();
    assert!(others.iter().all(|name| *name == "faulty"), "{others:?}");
}
