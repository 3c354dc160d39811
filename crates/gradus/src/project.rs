//! The `gradus.toml` of a folder, as the command line takes it.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;

use gradus_lab::Project;
use gradus_tmcl::catalogue::{ANY, Module};

use crate::complain;

/// Warnings that were printed already: port and program may have the same file.
static WARNED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// What the nearest file from a folder upwards says; an empty path is the current folder. Prints its warnings.
///
/// # Errors
/// When it cannot be read or has mistakes.
pub fn near(folder: &Path) -> anyhow::Result<Project> {
    let project = Project::find(folder)?.unwrap_or_default();
    for warning in &project.warnings {
        if WARNED.lock().is_ok_and(|mut warned| warned.insert(warning.clone())) {
            complain(format_args!("warning: {warning}"));
        }
    }
    Ok(project)
}

/// The module of that name; `any` stands for modules that the catalogue lacks.
pub fn named(name: &str) -> Option<&'static Module> {
    if name.eq_ignore_ascii_case(ANY.name) { Some(&ANY) } else { Module::named(name) }
}

/// The module that a file names; `None` for none, and for any.
pub fn module(project: &Project) -> Option<&'static Module> {
    Module::named(project.module.as_deref()?)
}
