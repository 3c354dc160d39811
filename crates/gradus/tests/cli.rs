//! What the command line prints, case by case: see the files in `cmd`.

#[test]
fn console_cases() {
    trycmd::TestCases::new().case("tests/cmd/*.md");
}
