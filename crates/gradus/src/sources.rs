//! The source files that a command line names: files, and folders with all that is in them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Endings of programs and of what they include.
const PROGRAM: &str = "tmc";
const INCLUDED: &str = "inc";

/// The programs: files as they are named, and in folders those that no other one there includes.
///
/// # Errors
/// When a file or folder cannot be read.
pub fn programs(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut programs = Vec::new();
    for path in paths {
        if !path.is_dir() {
            programs.push(path.clone());
            continue;
        }
        let files: Vec<_> = in_folder(path)?.into_iter().filter(|file| has_ending(file, &[PROGRAM])).collect();
        let included = included(&files)?;
        let is_root = |file: &PathBuf| !fs::canonicalize(file).is_ok_and(|file| included.contains(&file));
        programs.extend(files.into_iter().filter(is_root));
    }
    Ok(programs)
}

/// All files: as they are named, and in folders those of programs and of what they include.
///
/// # Errors
/// When a folder cannot be read.
pub fn all(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(in_folder(path)?.into_iter().filter(|file| has_ending(file, &[PROGRAM, INCLUDED])));
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

fn has_ending(file: &Path, endings: &[&str]) -> bool {
    let ending = file.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| endings.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// The files of a folder and of those in it, in order; hidden ones and links to folders are left out.
fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("cannot read {}", folder.display());
    let mut entries = fs::read_dir(folder).with_context(unreadable)?.collect::<Result<Vec<_>, _>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    let mut files = Vec::new();
    for entry in entries.iter().filter(|entry| !entry.file_name().to_string_lossy().starts_with('.')) {
        if entry.file_type().with_context(unreadable)?.is_dir() {
            files.extend(in_folder(&entry.path())?);
        } else {
            files.push(entry.path());
        }
    }
    Ok(files)
}

/// The files that these include from their own folders.
fn included(files: &[PathBuf]) -> anyhow::Result<BTreeSet<PathBuf>> {
    let mut included = BTreeSet::new();
    for file in files {
        let bytes = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        let folder = file.parent().unwrap_or(Path::new(""));
        let text = String::from_utf8_lossy(&bytes);
        let names = text.lines().filter_map(name);
        included.extend(names.filter_map(|name| fs::canonicalize(folder.join(name.replace('\\', "/"))).ok()));
    }
    Ok(included)
}

/// The name in a line `#include name`.
fn name(line: &str) -> Option<&str> {
    let directive = line.trim_start().strip_prefix('#')?.trim_start();
    let (word, name) = directive.split_at_checked("include".len())?;
    let name = name.split("//").next()?.trim().trim_matches('"');
    (word.eq_ignore_ascii_case("include") && !name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_programs_of_a_folder_are_those_that_no_other_includes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("parts/.hidden")).unwrap();
        for (name, text) in [
            ("main.tmc", "#include parts\\names.tmc // names\n# INCLUDE \"parts/more.inc\"\nSTOP"),
            ("other.TMC", "STOP"),
            ("parts/names.tmc", "X = 1"),
            ("parts/more.inc", "Y = 1"),
            ("parts/.hidden/x.tmc", "STOP"),
            ("readme.md", ""),
        ] {
            fs::write(at(name), text).unwrap();
        }
        let paths = [folder.path().to_path_buf()];
        assert_eq!(programs(&paths).unwrap(), [at("main.tmc"), at("other.TMC")]);
        let all = all(&paths).unwrap();
        assert_eq!(all, [at("main.tmc"), at("other.TMC"), at("parts/more.inc"), at("parts/names.tmc")]);
        assert_eq!(programs(&[at("parts/names.tmc")]).unwrap(), [at("parts/names.tmc")]);
        assert!(programs(&[at("parts/.hidden/x.tmc")]).is_ok() && in_folder(&at("nowhere")).is_err());
    }
}
