//! The linter on the programs of the manuals and of `examples`.

#[path = "support/mod.rs"]
mod support;

use std::fmt::Write;

use gradus_asm::{LintOptions, Severity, lint};

#[test]
fn examples_have_no_warnings_and_these_hints() {
    let mut text = String::new();
    for (path, assembly) in support::examples() {
        for problem in lint(&assembly, &LintOptions::default()) {
            assert_eq!(problem.severity, Severity::Hint, "{}: {problem:?}", path.display());
            let (line, _) = assembly.sources[problem.span.source].position(problem.span.start);
            let path = path.components().skip_while(|part| part.as_os_str() != "examples").skip(1);
            let path = path.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
            writeln!(text, "{path}:{line}: {}: {}", problem.code.text(), problem.message).unwrap();
        }
    }
    insta::assert_snapshot!(text);
}
