//! The README tells the truth.

#[test]
fn commands_of_the_readme_print_what_it_says() {
    std::env::set_current_dir("../..").unwrap();
    trycmd::TestCases::new().case("README.md");
}
