//! However long and wrong a text is, its problems are found and shown in a time that grows with its length.

use std::time::{Duration, Instant};

use gradus_asm::{Options, Style, assemble, render};
use gradus_tmcl::catalogue::TMCM_3351;

/// For a hundred thousand bytes and their problems, by a program that is not optimized.
const BAR: Duration = Duration::from_millis(300);

/// Assembles a text and draws some hundred of its problems. Returns how many there are.
fn problems_of(text: &str) -> usize {
    let start = Instant::now();
    let assembly = assemble("long.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &|_| Ok(Vec::new()));
    for problem in assembly.problems.iter().step_by(assembly.problems.len().div_ceil(200).max(1)) {
        render(problem, &assembly.sources, Style::Plain);
        assembly.sources[0].position(problem.span.start);
    }
    let (took, bar) = (start.elapsed(), BAR.mul_f64((text.len() as f64 / 1e5).max(1.0)));
    println!("{} bytes, {} problems: {took:?} (bar {bar:?})", text.len(), assembly.problems.len());
    assert!(took < 5 * bar, "{took:?} for {} bytes", text.len());
    assembly.problems.len()
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(|number| line(number) + "\n").collect()
}

const COUNT: usize = 20_000;

#[test]
fn wrong_lines() {
    assert_eq!(problems_of(&lines(COUNT, |_| "MOV 1, 2".into())), COUNT + 1, "and the program is too long");
    assert_eq!(problems_of(&lines(COUNT, |_| "* /".into())), COUNT);
}

#[test]
fn unknown_names_among_many_that_are_known() {
    let text = lines(COUNT, |number| format!("Label{number}: JA Lable{number}"));
    assert!(problems_of(&text) > COUNT);
}

#[test]
fn a_name_that_is_defined_again_and_again() {
    assert_eq!(problems_of(&lines(COUNT, |_| "Again:".into())), COUNT - 1);
}

#[test]
fn constants_that_need_each_other() {
    let text = lines(COUNT, |number| format!("C{number} = C{} + C0", (number + 1) % COUNT));
    assert_eq!(problems_of(&text), COUNT);
}

#[test]
fn one_line() {
    assert_eq!(problems_of(&format!("MOV {}1", "1 2, ".repeat(COUNT))), COUNT + 1);
    assert_eq!(problems_of(&format!("SAP 4, 0, {}1", "x + ".repeat(COUNT))), 1);
}

#[test]
fn problems_of_one_long_line_tell_their_place() {
    let line = format!("Loop: Loop: MST 9 {}", " ".repeat(20_000));
    let assembly = assemble("long.tmc", line.as_bytes(), &TMCM_3351, &Options::default(), &|_| Ok(Vec::new()));
    let shown: Vec<String> =
        assembly.problems.iter().map(|problem| render(problem, &assembly.sources, Style::Plain)).collect();
    insta::assert_snapshot!(shown.join("\n"), @"
    error[duplicate]: `Loop` is already a label
    --> long.tmc:1:7
     = note: the first one is at long.tmc:1
    error[not-on-module]: the TMCM-3351 has no axis 9
    --> long.tmc:1:17
     = help: its axes are 0...2
    ");
}

#[test]
fn the_first_definition_far_away_is_told_by_its_line() {
    let text = format!("Loop: MST 0\n{}Loop: MST 1\n", "// nothing\n".repeat(2_000));
    let assembly = assemble("long.tmc", text.as_bytes(), &TMCM_3351, &Options::default(), &|_| Ok(Vec::new()));
    let [problem] = &assembly.problems[..] else { panic!("{:?}", assembly.problems) };
    insta::assert_snapshot!(render(problem, &assembly.sources, Style::Plain), @"
    error[duplicate]: `Loop` is already a label
        --> long.tmc:2002:1
         |
    2002 | Loop: MST 1
         | ^^^^
         |
         = note: the first one is at long.tmc:1
    ");
}

#[test]
fn a_file_that_is_no_text_is_one_problem() {
    let bytes: Vec<u8> = (0..23_000_000u32).map(|number| (number.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let assembly = assemble("noise.tmc", &bytes, &TMCM_3351, &Options::default(), &|_| Ok(Vec::new()));
    let [problem] = &assembly.problems[..] else { panic!("{} problems", assembly.problems.len()) };
    insta::assert_snapshot!(render(problem, &assembly.sources, Style::Plain), @"
    error[encoding]: `noise.tmc` is no text
     --> noise.tmc:1:1
      |
    1 |
      | ^
      |
      = help: a program in bytes is shown as text by `gradus disasm`
    ");
}
