//! The README tells the truth.

#[test]
fn commands_of_the_readme_print_what_it_says() {
    std::env::set_current_dir("../..").unwrap();
    trycmd::TestCases::new().case("README.md");
}

#[test]
fn bench_file_of_the_readme_is_the_example() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let read = |file: &str| std::fs::read_to_string(format!("{root}/{file}")).unwrap();
    assert!(read("README.md").contains(&read("examples/benches/linear-stage.toml")));
}
