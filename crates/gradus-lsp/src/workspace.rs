//! The files around the open texts: which programs include which files.

use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use gradus_asm::{LintOptions, Options, normal};
use gradus_tmcl::catalogue::Module;

use crate::documents::Documents;
use crate::symbols::include;

/// How a program is assembled and linted: what `gradus.toml` says.
#[derive(Clone, Debug)]
pub struct Project {
    /// The module, unless the program names one itself.
    pub module: &'static Module,
    /// Constants and folders of included files.
    pub options: Options,
    /// Which findings are reported, and how.
    pub lint: LintOptions,
}

/// The disk, as the server sees it.
pub trait Files {
    /// Reads a file, as `std::fs::read` does.
    ///
    /// # Errors
    /// When it cannot be read.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Returns the programs (`.tmc`) below a folder, at most so many.
    fn programs(&self, folder: &Path, most: usize) -> Vec<PathBuf>;

    /// Returns how a program is assembled.
    fn project(&self, program: &Path) -> Project;

    /// Returns a module by its name.
    fn module(&self, name: &str) -> Option<&'static Module>;
}

/// Programs of a folder that are looked at.
const PROGRAMS: usize = 2000;

/// Which program includes which files.
#[derive(Debug, Default)]
pub struct Includes {
    /// What each file includes, by path; not followed further.
    direct: HashMap<PathBuf, Vec<PathBuf>>,
    is_read: bool,
}

impl Includes {
    /// Forgets what the disk held.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Looks at a text anew. True if it includes other files than before.
    pub fn note(&mut self, path: &Path, text: &str) -> bool {
        let found = included(path, text);
        let changed = self.direct.get(path) != Some(&found);
        self.direct.insert(path.to_owned(), found);
        changed
    }

    /// Returns the programs that a file belongs to: those that include it, itself if none does.
    pub fn roots(&mut self, path: &Path, files: &dyn Files, folders: &[PathBuf], open: &Documents) -> Vec<PathBuf> {
        if !self.is_read {
            self.read(files, folders, open);
        }
        let mut roots: Vec<PathBuf> = Vec::new();
        let (mut waiting, mut seen) = (vec![path.to_owned()], HashSet::new());
        while let Some(file) = waiting.pop() {
            if !seen.insert(file.clone()) {
                continue;
            }
            let above: Vec<_> = self.including(&file);
            if above.is_empty() {
                roots.push(file);
            } else {
                waiting.extend(above);
            }
        }
        if roots.is_empty() {
            roots.push(path.to_owned()); // files that include each other
        }
        roots.sort();
        roots
    }

    fn including(&self, file: &Path) -> Vec<PathBuf> {
        let includes = self.direct.iter().filter(|(above, below)| *above != file && below.iter().any(|it| it == file));
        includes.map(|(above, _)| above.clone()).collect()
    }

    fn read(&mut self, files: &dyn Files, folders: &[PathBuf], open: &Documents) {
        self.is_read = true;
        let mut waiting: Vec<_> = folders.iter().flat_map(|folder| files.programs(folder, PROGRAMS)).collect();
        waiting.truncate(PROGRAMS);
        waiting.extend(open.paths());
        while let Some(path) = waiting.pop() {
            if self.direct.contains_key(&path) || self.direct.len() > 2 * PROGRAMS {
                continue;
            }
            let text = match open.get(&path) {
                Some(document) => document.text.to_string(),
                None => files
                    .read(&path)
                    .map_or_else(|_| String::new(), |bytes| String::from_utf8_lossy(&bytes).into_owned()),
            };
            self.note(&path, &text);
            waiting.extend(self.direct[&path].iter().cloned());
        }
    }
}

/// The files that a text includes from the folder it stands in.
fn included(path: &Path, text: &str) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let names = text.lines().filter_map(include).map(|(_, name)| name.replace('\\', "/"));
    names.map(|name| normal(&folder.join(name))).collect()
}
