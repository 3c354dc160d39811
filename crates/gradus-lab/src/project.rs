//! `gradus.toml`: what a folder says once for all programs and commands in it.
//!
//! ```toml
//! port = "/dev/ttyUSB0?baud=115200"
//! module = "tmcm-351"
//! include = ["common"]
//! defines = { Speed = 1000 }
//!
//! [lint]
//! allow = ["unused-label"]
//! ```
//!
//! The nearest one counts, from the folder in question upwards. [`KEYS`] is the schema: reading, the warning about an unknown
//! key and the book's table come from its rows. A key that nobody knows is a warning, so that an older Gradus reads a newer
//! file; a value of the wrong kind is an error.

use std::fs;
use std::io::ErrorKind;
use std::iter;
use std::path::{Path, PathBuf};

use gradus_host::Url;
use gradus_tmcl::catalogue::{MODULES, Module};
use toml_edit::{Document, DocumentMut, Item, Table, Value};

/// Name of the file.
pub const FILE: &str = "gradus.toml";
/// What `module` may say besides the name of a module: the language alone counts, whatever the module.
pub const ANY: &str = "any";

/// What a `gradus.toml` says.
#[derive(Clone, Default, Debug)]
pub struct Project {
    /// Path of the file, relative to the current folder if the search began with a relative one.
    pub file: PathBuf,
    /// Port of the module.
    pub port: Option<Url>,
    /// Name of a module of the catalogue, or [`ANY`].
    pub module: Option<String>,
    /// Folders of included files.
    pub include: Vec<PathBuf>,
    /// Constants for the assembler, as lines: `Speed = 1000`.
    pub defines: Vec<String>,
    /// What the linter is told.
    pub lint: Lint,
    /// What is odd about the file: one line each, `FILE:LINE: what`.
    pub warnings: Vec<String>,
}

/// Codes of problems.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Lint {
    /// Those that are errors.
    pub deny: Vec<String>,
    /// Those that are not reported.
    pub allow: Vec<String>,
}

/// A file that cannot be used: one line a problem, `FILE:LINE: what`.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{}", problems.join("\n"))]
pub struct ProjectError {
    /// The problems, in the order of the file.
    pub problems: Vec<String>,
}

/// A row of the schema.
pub struct Key {
    /// The table it stands in, empty for none.
    pub table: &'static str,
    /// Its name.
    pub name: &'static str,
    /// What it takes, in words.
    pub takes: &'static str,
    /// What it does.
    pub about: &'static str,
    /// Takes the value over; on another kind of value it says what is wrong, or nothing where `takes` says it all.
    read: fn(&mut Project, &Item) -> Result<(), String>,
}

/// The schema.
pub const KEYS: &[Key] = &[
    Key {
        table: "",
        name: "port",
        takes: "a port, as --port does",
        about: "Port for all commands that have --port.",
        read: |project, item| text(item)?.parse().map(|url| project.port = Some(url)).map_err(said),
    },
    Key {
        table: "",
        name: "module",
        takes: "the name of a module, or \"any\"",
        about: "Module that the programs are for.",
        read: |project, item| module(&text(item)?).map(|name| project.module = Some(name)),
    },
    Key {
        table: "",
        name: "include",
        takes: "a list of folders",
        about: "Folders of included files, relative to gradus.toml, after those of -I.",
        read: |project, item| {
            texts(item).map(|folders| project.include = folders.into_iter().map(Into::into).collect())
        },
    },
    Key {
        table: "",
        name: "defines",
        takes: "a table of constants, as { Speed = 1000 }",
        about: "Constants for the assembler, before those of -D.",
        read: |project, item| constants(item).map(|lines| project.defines = lines),
    },
    Key {
        table: "lint",
        name: "deny",
        takes: "a list of problem codes",
        about: "Problems that are errors.",
        read: |project, item| texts(item).map(|codes| project.lint.deny = codes),
    },
    Key {
        table: "lint",
        name: "allow",
        takes: "a list of problem codes",
        about: "Problems that are not reported.",
        read: |project, item| texts(item).map(|codes| project.lint.allow = codes),
    },
];

/// Tables that may stand in the file; those without a key in [`KEYS`] have none yet.
const TABLES: [&str; 3] = ["lint", "format", "test"];

impl Project {
    /// The nearest file from a folder upwards; an empty path is the current folder. `None` if there is none.
    ///
    /// # Errors
    /// When the file cannot be read or has mistakes.
    pub fn find(folder: &Path) -> Result<Option<Self>, ProjectError> {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let Ok(real) = fs::canonicalize(here) else { return Ok(None) };
        let upwards = iter::successors(Some(folder.to_path_buf()), |folder| Some(parent(folder)));
        for (folder, _) in upwards.zip(real.ancestors()) {
            let file = folder.join(FILE);
            match fs::read_to_string(&file) {
                Ok(text) => return Self::parse(&text, &file).map(Some),
                Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {}
                Err(error) => return Err(problem(format!("cannot read {}: {error}", file.display()))),
            }
        }
        Ok(None)
    }

    /// Reads the text of a file; `file` is its name, for problems and as the place that paths are relative to.
    ///
    /// ```
    /// use gradus_lab::Project;
    ///
    /// let project = Project::parse("module = 'tmcm-351'\nprot = '/dev/ttyUSB0'", "gradus.toml".as_ref())?;
    /// assert_eq!(project.module.as_deref(), Some("tmcm-351"));
    /// assert_eq!(project.warnings, ["gradus.toml:2: there is no key `prot`; did you mean `port`?"]);
    /// # Ok::<(), gradus_lab::ProjectError>(())
    /// ```
    ///
    /// # Errors
    /// Lists all mistakes.
    pub fn parse(text: &str, file: &Path) -> Result<Self, ProjectError> {
        let document = Document::parse(text).map_err(|error| {
            let line = line(text, error.span().map_or(0, |span| span.start));
            problem(format!("{}:{line}: {}", file.display(), error.message()))
        })?;
        let mut reading =
            Reading { text, project: Self { file: file.into(), ..Self::default() }, problems: Vec::new() };
        reading.table("", document.as_table());
        let Reading { mut project, problems, .. } = reading;
        let folder = file.parent().unwrap_or(Path::new(""));
        project.include = project.include.iter().map(|include| folder.join(include)).collect();
        if problems.is_empty() { Ok(project) } else { Err(ProjectError { problems }) }
    }
}

/// A text with one key set, `lint.allow` for example; comments, order and all other keys stay.
///
/// ```
/// let text = "# the mill\nname = 'foreign'\n";
/// let text = gradus_lab::with_key(text, "port", "/dev/ttyUSB0")?;
/// assert_eq!(text, "# the mill\nname = 'foreign'\nport = \"/dev/ttyUSB0\"\n");
/// # Ok::<(), gradus_lab::ProjectError>(())
/// ```
///
/// # Errors
/// When the text is no TOML, or something other than a table stands where the key's table would.
pub fn with_key(text: &str, key: &str, value: impl Into<Value>) -> Result<String, ProjectError> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| problem(said(error)))?;
    let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
    let mut place = document.as_table_mut();
    for part in table.split('.').filter(|part| !part.is_empty()) {
        let there = place.entry(part).or_insert_with(|| Item::Table(Table::new()));
        place = there.as_table_mut().ok_or_else(|| problem(format!("`{part}` is no table")))?;
    }
    let mut value = value.into();
    match place.get_mut(name).and_then(Item::as_value_mut) {
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => drop(place.insert(name, Item::Value(value))),
    }
    Ok(document.to_string())
}

/// A text that is being read.
struct Reading<'a> {
    text: &'a str,
    project: Project,
    problems: Vec<String>,
}

impl Reading<'_> {
    /// Reads a table, and those that it contains.
    fn table(&mut self, name: &str, table: &Table) {
        for (key, item) in table {
            let at = table.key(key).and_then(|key| key.span()).map_or(0, |span| span.start);
            let place = format!("{}:{}", self.project.file.display(), line(self.text, at));
            let row = KEYS.iter().find(|row| (row.table, row.name) == (name, key));
            match (row, item) {
                (Some(row), item) => {
                    if let Err(wrong) = (row.read)(&mut self.project, item) {
                        self.problems.push(format!("{place}: `{}`: {}", path(name, key), row.wrong(&wrong)));
                    }
                }
                (None, Item::Table(table)) if name.is_empty() && TABLES.contains(&key) => self.table(key, table),
                (None, _) => self.project.warnings.push(format!("{place}: {}", unknown(name, key))),
            }
        }
    }
}

impl Key {
    fn wrong(&self, problem: &str) -> String {
        if problem.is_empty() { format!("expected is {}", self.takes) } else { problem.into() }
    }
}

/// The folder above; not normalised, so that messages show the way from the current folder.
fn parent(folder: &Path) -> PathBuf {
    match folder.components().next_back() {
        Some(std::path::Component::Normal(_)) => folder.parent().map(Path::to_path_buf).unwrap_or_default(),
        Some(std::path::Component::CurDir) => parent(folder.parent().unwrap_or(Path::new(""))),
        _ => folder.join(".."),
    }
}

fn path(table: &str, name: &str) -> String {
    if table.is_empty() { name.into() } else { format!("{table}.{name}") }
}

/// How much alike two names are that may be meant for each other.
const ALIKE: f64 = 0.8;

fn unknown(table: &str, name: &str) -> String {
    let known = KEYS.iter().filter(|row| row.table == table).map(|row| row.name);
    let known = known.chain(TABLES.into_iter().filter(|_| table.is_empty()));
    let alike = known.map(|known| (strsim::jaro_winkler(known, name), known)).filter(|(likeness, _)| *likeness > ALIKE);
    let nearest = alike.max_by(|a, b| a.0.total_cmp(&b.0));
    let hint = nearest.map(|(_, known)| format!("; did you mean `{}`?", path(table, known))).unwrap_or_default();
    format!("there is no key `{}`{hint}", path(table, name))
}

fn line(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1
}

fn problem(problem: String) -> ProjectError {
    ProjectError { problems: vec![problem] }
}

fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn text(item: &Item) -> Result<String, String> {
    item.as_str().map(Into::into).ok_or_else(String::new)
}

fn texts(item: &Item) -> Result<Vec<String>, String> {
    let list = item.as_array().ok_or_else(String::new)?;
    list.iter().map(|value| value.as_str().map(Into::into).ok_or_else(String::new)).collect()
}

fn module(name: &str) -> Result<String, String> {
    let known = || MODULES.iter().map(|module| module.name.to_lowercase()).collect::<Vec<_>>().join(", ");
    let is_one = name.eq_ignore_ascii_case(ANY) || Module::named(name).is_some();
    if is_one { Ok(name.to_lowercase()) } else { Err(format!("there is no module `{name}`, only {}, {ANY}", known())) }
}

/// Lines that define constants.
fn constants(item: &Item) -> Result<Vec<String>, String> {
    let table = item.as_table_like().ok_or_else(String::new)?;
    let constant = |(name, item): (&str, &Item)| match item.as_value() {
        Some(Value::Integer(number)) => Ok(format!("{name} = {}", number.value())),
        Some(Value::String(text)) => Ok(format!("{name} = {}", text.value())),
        _ => Err(format!("`{name}` is a number, or a text with an expression")),
    };
    table.iter().map(constant).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Project, ProjectError> {
        Project::parse(text, Path::new("../gradus.toml"))
    }

    #[test]
    fn every_key_is_read() {
        let text = "port = 'tcp:localhost:4322'\nmodule = 'TMCM-351'\ninclude = ['a', '/b']\n\
                    defines = { Speed = 1000, Twice = '2 * Speed' }\n[lint]\ndeny = ['x']\nallow = ['y', 'z']\n[format]\n[test]";
        let project = parse(text).unwrap();
        assert_eq!(project.port.unwrap().to_string(), "tcp:localhost:4322");
        assert_eq!(project.module.as_deref(), Some("tmcm-351"));
        assert_eq!(project.include, [Path::new("../a"), Path::new("/b")]);
        assert_eq!(project.defines, ["Speed = 1000", "Twice = 2 * Speed"]);
        assert_eq!(project.lint, Lint { deny: vec!["x".into()], allow: vec!["y".into(), "z".into()] });
        assert_eq!(project.warnings, [""; 0]);
    }

    #[test]
    fn an_unknown_key_is_a_warning_with_its_line() {
        let project = parse("prot = 1\n[lint]\nalow = []\n[format]\nwidth = 3\n[workbench]\nx = 1").unwrap();
        let expected = [
            "../gradus.toml:1: there is no key `prot`; did you mean `port`?",
            "../gradus.toml:3: there is no key `lint.alow`; did you mean `lint.allow`?",
            "../gradus.toml:5: there is no key `format.width`",
            "../gradus.toml:6: there is no key `workbench`",
        ];
        assert_eq!(project.warnings, expected);
    }

    #[test]
    fn a_wrong_value_is_an_error_with_its_line() {
        let cases = [
            ("\nport = 1", "../gradus.toml:2: `port`: expected is a port, as --port does"),
            ("port = 'bus:1'", "../gradus.toml:1: `port`: `bus:1` is no port: there is no kind of port named `bus`"),
            ("module = 'tmcm-1'", "../gradus.toml:1: `module`: there is no module `tmcm-1`, only tmcm-3351, "),
            ("include = 'a'", "../gradus.toml:1: `include`: expected is a list of folders"),
            ("include = [1]", "../gradus.toml:1: `include`: expected is a list of folders"),
            ("defines = { a = [] }", "../gradus.toml:1: `defines`: `a` is a number, or a text with an expression"),
            ("[lint]\n\ndeny = true", "../gradus.toml:3: `lint.deny`: expected is a list of problem codes"),
            ("port =", "../gradus.toml:1: "),
        ];
        for (text, expected) in cases {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }

    #[test]
    fn the_nearest_file_upwards_counts() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("a/b/c");
        fs::create_dir_all(&deep).unwrap();
        let module = |folder: &Path| Project::find(folder).unwrap().and_then(|project| project.module);
        assert_eq!(module(&deep), None);
        fs::write(folder.path().join(FILE), "module = 'any'").unwrap();
        fs::write(folder.path().join("a").join(FILE), "module = 'tmcm-351'").unwrap();
        assert_eq!(module(&deep).as_deref(), Some("tmcm-351"));
        assert_eq!(module(folder.path()).as_deref(), Some("any"));
    }

    #[test]
    fn names_show_the_way_from_the_current_folder() {
        for (folder, above) in [("", ".."), (".", ""), ("a/b", "a"), ("..", "../.."), ("/a", "/")] {
            let way = if folder == "." { parent(Path::new("a")) } else { parent(Path::new(folder)) };
            assert_eq!(way, Path::new(above), "{folder}");
        }
    }

    #[test]
    fn a_key_is_set_among_comments_and_foreign_keys() {
        let text = "# mill\nport = 'a' # front\n\n[other]\nx = 1 # theirs\n\n[lint]\n# why\nallow = []\n";
        let list = Value::from_iter(["unused-label"]);
        let changed = with_key(&with_key(text, "port", "/dev/b").unwrap(), "lint.allow", list).unwrap();
        let expected = text.replace("'a'", "\"/dev/b\"").replace("allow = []", "allow = [\"unused-label\"]");
        assert_eq!(changed, expected);
        assert_eq!(with_key("", "lint.deny", Value::from_iter(["x"])).unwrap(), "[lint]\ndeny = [\"x\"]\n");
        assert!(with_key("lint = 1", "lint.deny", "x").is_err());
    }
}
