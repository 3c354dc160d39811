//! What holds for every text: the fuzzers' promises over random programs and seeds, and time that grows with the text.

use std::time::{Duration, Instant};

use gradus_asm::{LintOptions, Options, assemble, format, fuzz_check, fuzz_format, lint};
use gradus_tmcl::catalogue::{ANY, Module, TMCM_3351};
use proptest::prelude::*;

/// Lines that make programs with calls, loops, interrupts, motion and mistakes.
const LINES: &[&str] = &[
    "A:",
    "B:",
    "C: ",
    "D: E:",
    "JA A",
    "JC EQ, B",
    "JC NE, C",
    "JC ETO, D",
    "CSUB B",
    "CALL GT, C",
    "RSUB",
    "RETI",
    "STOP",
    "DJNZ 1, A",
    "RST A",
    "VECT 0, C",
    "VECT 27, A",
    "EI 0",
    "EI 255",
    "DI 0",
    "GAP 3, 0",
    "GAP 1, 1",
    "GGP 5, 2",
    "GGP Count, 2",
    "COMP 0",
    "COMP 7",
    "CALC MUL, 3",
    "CALC LOAD, 0",
    "CALCX SWAP",
    "CALCAV LOAD, 5",
    "AAP 5, 0",
    "AAP 1, 0",
    "AGP 10, 2",
    "SAP 1, 0, 0",
    "SAP 12, 0, 0",
    "SAP 13, 0, 0",
    "STGP 5, 2",
    "STGP Count, 2",
    "SGP Count, 2, 1",
    "SGP 10, 2, 0",
    "MVP ABS, 0, 5",
    "MVP REL, 1, 5",
    "ROR 0, 9",
    "MST 0",
    "RFS START, 0",
    "WAIT RFS, 0, 0",
    "WAIT POS, 0, 0",
    "WAIT POS, 0, 50",
    "WAIT TICKS, 0, 50 // 50 ms",
    "Count = 5",
    "count = 5",
    "Speed = 100",
    "x = COUNT",
    "#data 1, 2, 3, 4",
    "MVP ABS 0",
    "= 5",
    "§",
    "",
    "// gradus: entry",
    "// gradus: allow(unreachable)",
    "// gradus: allow-file(unused-label, nothing)",
    "// gradus: firmware 1.08",
    "DJNZ 1, 9999",
    "JA 3",
    "CSUB 0",
    "WAIT TICKS, 0, -1",
];

fn program() -> impl Strategy<Value = String> {
    prop::collection::vec(prop::sample::select(LINES), 0..40).prop_map(|lines| lines.join("\n"))
}

proptest! {
    #[test]
    fn programs_keep_the_promises_of_linter_and_formatter(text in program(), end in prop_oneof![Just(""), Just("\n")]) {
        let text = text + end;
        fuzz_check(text.as_bytes());
        fuzz_format(text.as_bytes());
    }

    #[test]
    fn any_bytes_keep_them(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        fuzz_check(&bytes);
        fuzz_format(&bytes);
    }
}

#[test]
fn seeds_keep_the_promises() {
    for seed in [
        &b"#include \"a//b\" // c"[..],
        b"A:B:C:",
        b"A: // gradus: entry",
        b"ROR 0, 1\r\n\r\nX = 5 // \xfc\r\n",
        b"loop: ja loop",
        b"\xef\xbb\xbfSTOP",
        b"VECT 0, 0\nRETI",
        b"CSUB 0",
        b"RST 0",
    ] {
        fuzz_check(seed);
        fuzz_format(seed);
    }
}

/// Time to assemble, check and format a text.
fn time(text: &str, module: &'static Module) -> Duration {
    let start = Instant::now();
    let load = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let assembly = assemble("main.tmc", text.as_bytes(), module, &Options::default(), &load);
    lint(&assembly, &LintOptions::default());
    let _ = format(text.as_bytes());
    start.elapsed()
}

#[test]
fn time_grows_with_the_text() {
    // A fifth of a megabyte: five times what a release build may take, and ten times that for this build without optimization.
    let bar = Duration::from_secs(10);
    for (name, line) in [
        ("routines", "CSUB 1\n"),
        ("handlers", "VECT 0, 5\nRETI\n"),
        ("stores", "STGP 1, 2\nJC EQ, 0\n"),
        ("loops", "GAP 3, 0\nJC NZ, 7\n"),
        ("labels", "_a: JA _b\n_b: MVP ABS, 0, 1\n"),
        ("garbage", "MVP ABS 0 § = ( //x\n"),
        ("comments", "// gradus: allow(unreachable)\n"),
        ("calls", "CALL EQ, 3\nRSUB\n"),
    ] {
        for module in [&TMCM_3351, &ANY] {
            let text = line.repeat(200_000 / line.len());
            let time = time(&text, module);
            assert!(time < bar, "{name} for {}: {time:?}", module.name);
        }
    }
}
