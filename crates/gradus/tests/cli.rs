//! What the command line prints, case by case: see the files in `cmd`.

#[test]
fn console_cases() {
    trycmd::TestCases::new().case("tests/cmd/*.md");
}

#[test]
fn of_many_problems_fifty_are_printed_errors_first() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.tmc");
    std::fs::write(&file, "SAP 1, 0\n".repeat(70) + &"SAP 3, 0, 1 // read-only\n".repeat(20)).unwrap();
    let asm = std::process::Command::new(env!("CARGO_BIN_EXE_gradus")).arg("asm").arg(&file).output().unwrap();
    let printed = String::from_utf8(asm.stderr).unwrap();
    assert_eq!(asm.status.code(), Some(1), "{printed}");
    assert_eq!(printed.matches("error[").count(), 50, "{printed}");
    assert_eq!(printed.matches("warning[").count(), 0, "{printed}");
    assert!(printed.contains("\nand 40 more\n"), "{printed}");
    assert!(printed.ends_with("has 70 errors\n"), "{printed}");
}

/// No example has an error or a warning; its hints are in a snapshot of the crate `gradus-asm`.
#[test]
fn examples_have_no_warning() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let gradus = std::process::Command::new(env!("CARGO_BIN_EXE_gradus"))
        .current_dir(root)
        .args(["check", "examples", "--deny", "warnings", "--format", "json"])
        .output()
        .unwrap();
    let found: serde_json::Value = serde_json::from_slice(&gradus.stdout).unwrap();
    let problems = found["problems"].as_array().unwrap();
    assert!(gradus.status.success() && !problems.is_empty(), "{found:#}");
    assert!(problems.iter().all(|problem| problem["severity"] == "hint"), "{found:#}");
}
