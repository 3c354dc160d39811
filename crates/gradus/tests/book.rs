//! The book tells the truth: its commands print what it says, its links lead somewhere.
//!
//! `TRYCMD=overwrite cargo test -p gradus --test book` renews what commands print and draw.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The commands run in a folder of their own with a copy of the examples and of the book's programs. The pictures that they write there are those of the
/// book.
#[test]
fn commands_print_and_draw_what_the_book_says() {
    let folder = tempfile::tempdir().unwrap();
    for there in ["examples", "mistakes"] {
        copy(&Path::new(ROOT).join(there), &folder.path().join(there));
    }
    copy(&source().join("programs"), &folder.path().join("programs"));
    std::env::set_current_dir(folder.path()).unwrap();
    trycmd::TestCases::new().case(format!("{ROOT}/docs/src/*.md")).run();
    for drawn in files(folder.path(), "svg") {
        renew_or_compare(&source().join("pictures").join(drawn.file_name().unwrap()), &fs::read(&drawn).unwrap());
    }
}

#[test]
fn problems_of_programs_are_explained_by_the_pages_of_explain() {
    let mut page = "# Problems of programs\n\nWhat `gradus check` reports, with its code. `gradus explain CODE` prints one of these.\n".to_owned();
    for code in gradus_asm::Code::ALL {
        let text = code.explanation();
        let text =
            text.lines().map(|line| if line.starts_with('#') { format!("#{line}\n") } else { format!("{line}\n") });
        page += "\n";
        page.extend(text);
    }
    renew_or_compare(&source().join("problems.md"), page.as_bytes());
}

#[test]
fn parameter_references_are_those_of_the_catalogue() {
    for module in gradus_tmcl::catalogue::MODULES {
        let name = module.name.to_lowercase();
        let gradus = Command::new(env!("CARGO_BIN_EXE_gradus"));
        let page = { gradus }.args(["params", "--markdown", "--module", &name]).output().unwrap().stdout;
        renew_or_compare(&source().join(format!("parameters-{name}.md")), &page);
    }
}

/// The page is made from `docs/manuals.csv`, whose files must be there.
#[test]
fn the_manuals_section_by_section() {
    let mut table = csv::Reader::from_path(Path::new(ROOT).join("docs/manuals.csv")).unwrap();
    let rows: Vec<[String; 6]> = table.deserialize().map(Result::unwrap).collect();
    let mut page = include_str!("manuals-head.md").to_owned();
    for module in gradus_tmcl::catalogue::MODULES {
        page += &format!("\n## {}\n\n| section | what | state | code | tests |\n|---|---|---|---|---|\n", module.name);
        for [_, section, title, state, code, tests] in rows.iter().filter(|row| row[0] == module.name) {
            for file in [code, tests].into_iter().filter(|file| !file.is_empty()) {
                assert!(Path::new(ROOT).join(file).exists(), "{title}: there is no {file}");
            }
            assert!(state == "not done" || !tests.is_empty(), "{title} has no test");
            page += &format!("| {section} | {title} | {state} | {} | {} |\n", as_code(code), as_code(tests));
        }
    }
    renew_or_compare(&source().join("manuals.md"), page.as_bytes());
}

fn as_code(file: &str) -> String {
    if file.is_empty() { String::new() } else { format!("`{file}`") }
}

/// A file of the book that is made: with `TRYCMD=overwrite` it is written, else it must be as it would be written.
fn renew_or_compare(file: &Path, made: &[u8]) {
    if std::env::var("TRYCMD").is_ok_and(|value| value == "overwrite") {
        return fs::write(file, made).unwrap();
    }
    let renew = "`TRYCMD=overwrite cargo test -p gradus --test book` renews it";
    assert!(fs::read(file).is_ok_and(|there| there == made), "{} is out of date; {renew}", file.display());
}

#[test]
fn every_command_is_in_the_book() {
    let all = whole_book();
    let help = Command::new(env!("CARGO_BIN_EXE_gradus")).arg("--help").output().unwrap().stdout;
    let help = String::from_utf8(help).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let commands: Vec<&str> = commands.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(commands.len() > 5, "{commands:?}");
    for command in commands {
        assert!(all.contains(&format!("gradus {command}")), "no page speaks of `gradus {command}`");
    }
}

#[test]
fn every_picture_is_shown() {
    let all = whole_book();
    for picture in files(&source().join("pictures"), "svg") {
        let link = format!("(pictures/{})", picture.file_name().unwrap().to_str().unwrap());
        assert!(all.contains(&link), "no page shows {}", picture.display());
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

#[test]
fn every_page_is_in_the_summary() {
    let summary = fs::read_to_string(source().join("SUMMARY.md")).unwrap();
    let listed: Vec<PathBuf> = targets(&summary).map(|target| source().join(target)).collect();
    for page in pages() {
        assert!(page.ends_with("SUMMARY.md") || listed.contains(&page), "{} is not in SUMMARY.md", page.display());
    }
}

#[test]
fn links_pictures_and_included_files_exist() {
    for page in pages().chain(["README.md", "examples/README.md"].map(|page| Path::new(ROOT).join(page))) {
        let text = fs::read_to_string(&page).unwrap();
        for target in targets(&text).filter(|target| !target.contains("://")) {
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let file = if file.is_empty() { page.clone() } else { page.with_file_name(file) };
            assert!(file.exists(), "{}: `{target}` leads nowhere", page.display());
            assert!(anchor.is_empty() || has_heading(&file, anchor), "{}: no heading `{target}`", page.display());
        }
    }
}

fn source() -> PathBuf {
    Path::new(ROOT).join("docs/src")
}

fn whole_book() -> String {
    pages().map(|page| fs::read_to_string(page).unwrap()).collect()
}

fn pages() -> impl Iterator<Item = PathBuf> {
    files(&source(), "md")
}

fn files(folder: &Path, extension: &'static str) -> impl Iterator<Item = PathBuf> + use<> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.filter(move |file| file.extension().is_some_and(|it| it == extension))
}

/// What a page links to, shows and includes.
fn targets(text: &str) -> impl Iterator<Item = &str> {
    let after = |start: &'static str, end: &'static str| {
        text.split(start).skip(1).filter_map(move |rest| rest.split_once(end)).map(|(target, _)| target)
    };
    after("](", ")").chain(after("{{#include ", "}}"))
}

/// True if a page has the heading that mdBook gives this name to.
fn has_heading(page: &Path, anchor: &str) -> bool {
    let text = fs::read_to_string(page).unwrap();
    text.lines().filter(|line| line.starts_with('#')).any(|line| name(line.trim_start_matches('#').trim()) == anchor)
}

fn name(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

#[test]
fn the_keys_of_gradus_toml_are_those_of_the_schema() {
    let page = fs::read_to_string(source().join("command-line.md")).unwrap();
    for gradus_lab::Key { table, name, takes, about, .. } in gradus_lab::KEYS {
        let path = if table.is_empty() { (*name).to_owned() } else { format!("{table}.{name}") };
        let row = format!("| `{path}` | {takes} | {about} |");
        assert!(page.contains(&row), "command-line.md lacks: {row}");
    }
}
