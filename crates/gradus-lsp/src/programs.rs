//! The programs that open texts belong to: analysed anew where something has changed, and their diagnostics.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

use gradus_asm::{Code, Problem, assemble, lint, module_of, normal};
use lsp_server::{Message, Notification};
use serde_json::Value;

use crate::analysis::Analysis;
use crate::convert::read::Client;
use crate::convert::view::{self, View};
use crate::documents::{Change, Documents};
use crate::symbols::is_file;
use crate::uri;
use crate::workspace::{Files, Includes};

/// Open texts, and the programs around them.
pub(crate) struct Programs {
    files: Box<dyn Files>,
    /// What the client can do and wants.
    pub client: Client,
    documents: Documents,
    includes: Includes,
    /// By the program's own file.
    analyses: HashMap<PathBuf, Analysis>,
    /// Files whose programs are to be analysed anew.
    changed: HashSet<PathBuf>,
    /// Files that have changed since diagnostics were sent.
    unpublished: HashSet<PathBuf>,
    /// Files for which the client has diagnostics.
    published: HashSet<PathBuf>,
    /// How many analyses there were.
    pub runs: u64,
}

// Texts.
impl Programs {
    pub fn new(files: Box<dyn Files>) -> Self {
        Self {
            files,
            client: Client::default(),
            documents: Documents::default(),
            includes: Includes::default(),
            analyses: HashMap::new(),
            changed: HashSet::new(),
            unpublished: HashSet::new(),
            published: HashSet::new(),
            runs: 0,
        }
    }

    pub fn open(&mut self, uri: String, version: i32, text: &str) {
        let path = normal(&uri::to_path(&uri));
        self.includes.note(&path, text);
        self.documents.open(path.clone(), uri, version, text);
        self.changed.insert(path);
    }

    pub fn edit(&mut self, uri: &str, version: i32, changes: &[Change]) {
        let path = normal(&uri::to_path(uri));
        if self.documents.change(&path, version, changes, self.client.encoding) {
            self.changed.insert(path);
        }
    }

    pub fn close(&mut self, uri: &str) {
        let path = normal(&uri::to_path(uri));
        if self.documents.close(&path).is_some() {
            self.changed.insert(path);
        }
    }

    /// Files on the disk have changed, perhaps among them a `gradus.toml`.
    pub fn disk_changed(&mut self, uris: &[String]) {
        let is_settings = |path: &PathBuf| path.file_name().is_some_and(|name| name == "gradus.toml");
        let paths: Vec<_> = uris.iter().map(|uri| normal(&uri::to_path(uri))).collect();
        self.includes.forget();
        if paths.iter().any(is_settings) {
            self.changed.extend(self.documents.paths());
        }
        self.changed.extend(paths);
    }
}

// Analysis.
impl Programs {
    /// Analyses what has changed since the last call and returns the diagnostics.
    pub fn settle(&mut self) -> Vec<Message> {
        self.refresh();
        if self.unpublished.is_empty() { Vec::new() } else { self.publish() }
    }

    /// Brings the analyses up to date: every program that an open text belongs to.
    fn refresh(&mut self) {
        let changed = std::mem::take(&mut self.changed);
        if changed.is_empty() {
            return;
        }
        for path in &changed {
            if let Some(document) = self.documents.get(path) {
                self.includes.note(path, &document.text);
            }
        }
        let open = self.documents.paths();
        let roots: HashSet<PathBuf> = open.iter().flat_map(|path| self.roots(path)).collect();
        self.analyses.retain(|root, _| roots.contains(root));
        for root in roots {
            if self.is_stale(&root, &changed) {
                let analysis = self.analyse(&root);
                self.analyses.insert(root, analysis);
                self.runs += 1;
            }
        }
        self.unpublished.extend(changed);
    }

    /// Returns the programs that a file belongs to.
    fn roots(&mut self, path: &Path) -> Vec<PathBuf> {
        self.includes.roots(path, &*self.files, &self.client.folders, &self.documents)
    }

    /// True for a program that was not analysed yet, or one of whose files has changed.
    fn is_stale(&self, root: &Path, changed: &HashSet<PathBuf>) -> bool {
        let Some(analysis) = self.analyses.get(root) else { return true };
        changed.contains(root) || analysis.assembly.sources.iter().any(|source| changed.contains(&source.path))
    }

    fn analyse(&self, root: &Path) -> Analysis {
        let load = |path: &Path| match self.documents.get(path) {
            Some(document) => Ok(document.text.as_bytes().to_vec()),
            None => self.files.read(path),
        };
        let bytes = load(root).unwrap_or_default();
        let project = self.files.project(root);
        let named = String::from_utf8_lossy(&bytes);
        let module = module_of(&named).and_then(|name| self.files.module(name)).unwrap_or(project.module);
        let assembly = assemble(root, &bytes, module, &project.options, &load);
        let mut problems = lint(&assembly, &project.lint);
        if root.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("tmc")) {
            problems.retain(|problem| problem.code != Code::UnknownName); // its names may come from the program around it
        }
        Analysis::new(assembly, problems)
    }

    /// Returns the first program that a file belongs to, with the file's number in it.
    pub fn analysis_of(&mut self, path: &Path) -> Option<(&Analysis, usize)> {
        self.refresh();
        let roots = self.roots(path);
        let analysis = roots.iter().find_map(|root| self.analyses.get(root))?;
        Some((analysis, analysis.source_at(path)?))
    }

    /// Returns all programs that are analysed, in the order of their paths.
    pub fn all(&mut self) -> Vec<&Analysis> {
        self.refresh();
        let mut programs: Vec<_> = self.analyses.iter().collect();
        programs.sort_by_key(|(root, _)| *root);
        programs.into_iter().map(|(_, analysis)| analysis).collect()
    }
}

/// Diagnostics of a file that are sent; nobody reads more.
const MOST: usize = 500;

/// Every file of a program, once without a problem and once with each of its problems.
fn problems(analysis: &Analysis) -> impl Iterator<Item = (&Path, Option<&Problem>)> {
    let files = analysis.assembly.sources.iter().filter(|source| is_file(source)).map(|source| (&*source.path, None));
    let problems = analysis.problems.iter().map(|problem| (analysis.source(problem.span), problem));
    let problems =
        problems.filter(|(source, _)| is_file(source)).map(|(source, problem)| (&*source.path, Some(problem)));
    files.chain(problems)
}

// Diagnostics.
impl Programs {
    /// The diagnostics of every file of the programs, and none for files that belong to no program any more.
    fn publish(&mut self) -> Vec<Message> {
        self.unpublished.clear();
        let mut found: BTreeMap<PathBuf, Vec<Value>> = BTreeMap::new();
        for analysis in self.analyses.values() {
            let view = View { analysis, encoding: self.client.encoding };
            for (path, problem) in problems(analysis) {
                let diagnostics = found.entry(path.to_owned()).or_default();
                let diagnostic = problem.filter(|_| diagnostics.len() < MOST).map(|problem| view.diagnostic(problem));
                // A file of several programs has its problem once.
                diagnostics.extend(diagnostic.filter(|new| !diagnostics.contains(new)));
            }
        }
        for path in self.published.drain() {
            found.entry(path).or_default();
        }
        let messages = found.into_iter().map(|(path, diagnostics)| self.publication(path, diagnostics));
        messages.collect()
    }

    fn publication(&mut self, path: PathBuf, diagnostics: Vec<Value>) -> Message {
        let document = self.documents.get(&path);
        let uri = document.map_or_else(|| uri::from_path(&path), |document| document.uri.clone());
        let params = view::publication(uri, document.map(|document| document.version), diagnostics);
        self.published.insert(path);
        Notification { method: "textDocument/publishDiagnostics".to_owned(), params }.into()
    }
}
