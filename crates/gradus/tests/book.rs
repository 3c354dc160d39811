//! The book tells the truth: its commands print what it says, its links lead somewhere.
//!
//! `TRYCMD=overwrite cargo test -p gradus --test book` renews what commands print.

use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The commands run in a folder of their own with a copy of the examples, so that what they write is not left about.
#[test]
fn commands_print_what_the_book_says() {
    let folder = tempfile::tempdir().unwrap();
    copy(&Path::new(ROOT).join("examples"), &folder.path().join("examples"));
    std::env::set_current_dir(folder.path()).unwrap();
    trycmd::TestCases::new().case(format!("{ROOT}/docs/src/*.md")).run();
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
    for page in pages() {
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

fn pages() -> impl Iterator<Item = PathBuf> {
    let files = fs::read_dir(source()).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|file| file.extension().is_some_and(|extension| extension == "md"))
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
