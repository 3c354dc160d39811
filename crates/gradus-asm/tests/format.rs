//! The formatter.

#[path = "support/mod.rs"]
mod support;

use std::path::Path;

use gradus_asm::{FormatError, LintOptions, Options, assemble, format, lint};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::TMCM_3351;
use proptest::prelude::*;

fn formatted(text: &str) -> String {
    format(text.as_bytes()).unwrap().text
}

/// Program, comments and codes of a text.
fn meaning(text: &str) -> (Vec<Instruction>, Vec<String>, Vec<&'static str>) {
    let load = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
    let assembly = assemble("main.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &load);
    let comments = assembly.comments.iter().map(|span| assembly.sources[span.source].slice(*span));
    let comments = comments.map(|comment| comment.trim_start_matches('/').trim().to_owned()).collect();
    let codes = lint(&assembly, &LintOptions::default()).iter().map(|problem| problem.code.text()).collect();
    (assembly.program, comments, codes)
}

#[test]
fn a_program_gets_its_form() {
    let text = "\n\n//start\n#include \"TMCLParam.tmc\"\nSpeed=2*( 3+-4 )^2 //fast\nMaxAcceleration = sin(0)+ABS( -1 )   // slow\n\n\n\
                loop:mvp abs,motor0,Speed*10//go\n  //MVP ABS, 0, 0\n\twait pos,0 , 0\r\n   ja loop\n\n//----\n//////\n\
                stop        // a very long command it is not\n#DATA 1,2 ,3,$FF\n// end\n\n";
    insta::assert_snapshot!(formatted(text), @r"
    // start
    #include TMCLParam.tmc
    Speed           = 2 * (3 + -4) ^ 2  // fast
    MaxAcceleration = SIN(0) + ABS(-1)  // slow

    loop:
        MVP ABS, motor0, Speed * 10 // go
        // MVP ABS, 0, 0
        WAIT POS, 0, 0
        JA loop

        //----
        //////
        STOP                    // a very long command it is not
        #data 1, 2, 3, $FF
    // end
    ");
}

#[test]
fn a_jump_table_keeps_its_labels_beside_the_commands() {
    insta::assert_snapshot!(formatted("A: JA First\nLonger: ja Second\n\nFirst: STOP\nSecond: Third: STOP // both"), @r"
    A:      JA First
    Longer: JA Second

    First:
        STOP
    Second:
    Third:
        STOP                    // both
    ");
}

#[test]
fn a_line_that_a_pragma_speaks_of_stays_one_line() {
    insta::assert_snapshot!(formatted("// gradus: entry\nA: STOP\n\nB: STOP // gradus: allow(unused-label)\n\nC: STOP"), @r"
    // gradus: entry
    A: STOP

    B: STOP                     // gradus: allow(unused-label)

    C:
        STOP
    ");
}

#[test]
fn a_line_with_a_mistake_stays_as_it_is() {
    let done = format(b"  mvp abs 0,  1 // no comma\nstop").unwrap();
    assert_eq!(done.text, "  mvp abs 0,  1 // no comma\n    STOP\n");
    assert_eq!(done.left, [1]);
}

#[test]
fn windows_1252_becomes_utf8_and_utf16_is_refused() {
    let done = format(b"STOP // Gr\xf6\xdfe").unwrap();
    assert!(done.is_converted && done.text.ends_with("// Größe\n"));
    assert_eq!(format(b"\xff\xfeS\0T\0"), Err(FormatError::Encoding));
    assert_eq!(format(&vec![b' '; (4 << 20) + 1]), Err(FormatError::TooLarge));
    assert_eq!(formatted(""), "");
}

#[test]
fn examples_mean_the_same_when_they_are_formatted() {
    for (path, assembly) in support::examples() {
        let text = &assembly.sources[0].text;
        let new = formatted(text);
        assert_eq!(meaning(&new), meaning(text), "{}", path.display());
        assert_eq!(formatted(&new), new, "{}", path.display());
    }
}

/// Lines of all kinds, with and without mistakes.
fn line() -> impl Strategy<Value = String> {
    let label = prop_oneof![Just(""), Just("A:"), Just(" b : "), Just("C:D:")];
    let body = prop_oneof![
        Just("mvp abs,0,100"),
        Just("WAIT  pos , 0,0"),
        Just("ja a"),
        Just("JC eq, B"),
        Just("x=1+ 2*-3"),
        Just("LongName = sin( x)^2"),
        Just("#include TMCLParam.tmc"),
        Just("#include \"my file.inc\""),
        Just(""),
        Just("#data 1,2,3,4"),
        Just("DATA 1,2,3,4"),
        Just("mvp abs 0"),
        Just("= 5"),
        Just("csub B"),
        Just("rsub"),
        Just("stgp 1,2"),
        Just("wait ticks,0,50"),
        Just("   "),
        Just("§"),
    ];
    let comment = prop_oneof![
        Just(""),
        Just("//comment"),
        Just(" // gradus: allow(unreachable)"),
        Just("// gradus: entry"),
        Just("  //   500 ms "),
        Just("////"),
        Just("//-- \"q\""),
    ];
    (label, body, comment).prop_map(|(label, body, comment)| format!("{label}{body}{comment}"))
}

proptest! {
    #[test]
    fn formatting_keeps_the_meaning_and_is_done_once(lines in prop::collection::vec(line(), 0..30)) {
        let text = lines.join("\n");
        let new = formatted(&text);
        prop_assert_eq!(meaning(&new), meaning(&text), "{}\n--\n{}", text, new);
        prop_assert_eq!(formatted(&new), new);
    }
}
