//! The programs of `examples` with their modules.

#![allow(dead_code)] // no test uses all of it

use std::fs;
use std::path::{Path, PathBuf};

use gradus_asm::{Assembly, Options, assemble};
use gradus_tmcl::catalogue::Module;

pub const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");

/// Assembles a file with the constants that its comment names.
pub fn assembled(path: &Path, module: &'static Module) -> Assembly {
    let text = fs::read(path).unwrap();
    let options = Options { constants: constants(&text), ..Options::default() };
    assemble(path, &text, module, &options, &|path| fs::read(path))
}

/// The constants that a program takes from the command line: its comment shows them as `-D NAME=VALUE`.
fn constants(text: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(text);
    text.split("-D ").skip(1).filter_map(|rest| rest.split_whitespace().next()).map(str::to_owned).collect()
}

/// The `.tmc` files of a folder; none if there is no such folder.
pub fn programs(folder: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "tmc"));
    paths.sort();
    paths
}

/// Every example, assembled for its module.
pub fn examples() -> Vec<(PathBuf, Assembly)> {
    let folders = [("", "TMCM-3351"), ("benches", "TMCM-3351"), ("tmcm-351", "TMCM-351"), ("tmcm-1617", "TMCM-1617")];
    let of = |(folder, module): (&str, &str)| {
        let module = Module::named(module).unwrap();
        programs(&format!("{EXAMPLES}/{folder}")).into_iter().map(move |path| (path.clone(), assembled(&path, module)))
    };
    folders.into_iter().flat_map(of).collect()
}
