//! Reads a program: its file and, line by line, the files that it includes.

use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use gradus_tmcl::catalogue::Module;

use crate::built_in;
use crate::builtin::BUILT_IN;
use crate::builtin::list;
use crate::code::Code;
use crate::names::Names;
use crate::nearest;
use crate::parser::{self, Body, Command, Name};
use crate::problem::{Problem, Span};
use crate::source::Source;

/// Gives the bytes of a file, as `std::fs::read` does.
pub type Load<'a> = dyn Fn(&Path) -> io::Result<Vec<u8>> + 'a;

/// How many files a program may consist of. The limit ends includes that would go on for ever.
const MAX_SOURCES: usize = 256;

/// A command with its whole line.
pub(crate) struct Placed {
    pub command: Command,
    pub line: Span,
}

/// Everything that was read.
pub(crate) struct Text {
    pub sources: Vec<Source>,
    pub commands: Vec<Placed>,
    pub names: Names,
    pub comments: Vec<Span>,
    /// A label stands behind the last command.
    pub label_at_end: bool,
}

pub(crate) struct Reader<'a> {
    module: &'static Module,
    include_dirs: &'a [PathBuf],
    load: &'a Load<'a>,
    text: Text,
    /// The files between the program and the one that is being read.
    open: Vec<usize>,
    problems: &'a mut Vec<Problem>,
}

impl<'a> Reader<'a> {
    pub fn new(
        module: &'static Module,
        include_dirs: &'a [PathBuf],
        load: &'a Load<'a>,
        problems: &'a mut Vec<Problem>,
    ) -> Self {
        let names = Names::new(module);
        let text = Text { sources: Vec::new(), commands: Vec::new(), names, comments: Vec::new(), label_at_end: false };
        Self { module, include_dirs, load, text, open: Vec::new(), problems }
    }

    /// Reads a program with all that it includes, and then the constants that come from outside.
    pub fn read(mut self, mut program: Source, outside: Option<Source>) -> Text {
        program.path = normal(&program.path);
        self.file(program);
        if let Some(outside) = outside {
            self.file(outside);
        }
        self.text
    }

    fn file(&mut self, mut source: Source) {
        let index = self.text.sources.len();
        if source.is_binary() {
            self.problems.push(no_text(&source, index));
            source = source.emptied(); // its bytes are no letters to show
        }
        let text = Arc::clone(&source.text);
        let built_in = source.built_in;
        self.text.sources.push(source);
        self.open.push(index);
        let mut start = 0;
        for line in text.split('\n') {
            let end = start + line.len();
            self.line(line, Span { source: index, start, end });
            let comment = parser::comment(line).filter(|_| !built_in);
            self.text.comments.extend(comment.map(|at| Span {
                source: index,
                start: start + at,
                end: start + line.trim_end().len(),
            }));
            start = end + 1;
        }
        self.open.pop();
    }

    fn line(&mut self, line: &str, span: Span) {
        let line = parser::line(line, span, self.problems);
        for label in line.labels {
            self.text.label_at_end = true;
            self.text.names.add_label(label, self.text.commands.len());
        }
        match line.body {
            Some(Body::Constant(name, expression)) => self.text.names.add_constant(name, expression),
            Some(Body::Include(name)) => self.include(&name),
            Some(Body::Command(command)) => {
                self.text.label_at_end = false;
                self.text.commands.push(Placed { command, line: span });
            }
            None => {}
        }
    }

    fn include(&mut self, name: &Name) {
        match self.find(name).and_then(|source| self.fresh(source, name)) {
            Ok(source) => self.file(source),
            Err(problem) => self.problems.push(problem),
        }
    }

    /// Looks beside the including file, along the include path and among the built-in files.
    fn find(&self, name: &Name) -> Result<Source, Problem> {
        let file = name.text.replace('\\', "/");
        let (mut failure, mut searched) = (None, Vec::new());
        for dir in self.beside().into_iter().chain(self.include_dirs.iter().map(PathBuf::as_path)) {
            let path = normal(&dir.join(&file));
            match (self.load)(&path) {
                Ok(bytes) => return Ok(Source::new(path, &bytes)),
                Err(error) if error.kind() == io::ErrorKind::NotFound => searched.extend(folder(&path)),
                Err(error) => failure = Some(format!("{}: {error}", path.display())),
            }
        }
        match built_in(&file, self.module) {
            Some(text) => Ok(Source::built_in(file, &text)),
            None => Err(not_found(name, failure, searched)),
        }
    }

    /// The folder of the file that is being read.
    fn beside(&self) -> Option<&Path> {
        self.text.sources[*self.open.last()?].path.parent()
    }

    /// Refuses a file that is being read already.
    fn fresh(&self, source: Source, name: &Name) -> Result<Source, Problem> {
        if self.text.sources.len() >= MAX_SOURCES {
            return Err(Problem::error(Code::Include, name.span, "the program includes too many files"));
        }
        let path = |index: &usize| &self.text.sources[*index].path;
        match self.open.iter().position(|index| *path(index) == source.path && !source.built_in) {
            None => Ok(source),
            Some(first) => {
                let around = self.open[first..].iter().map(path).chain([&source.path]);
                let around: Vec<_> = around.map(|path| path.display().to_string()).collect();
                let message = format!("`{}` includes itself", source.path.display());
                Err(Problem::error(Code::IncludeCycle, name.span, message).help(around.join(" -> ")))
            }
        }
    }
}

fn not_found(name: &Name, failure: Option<String>, mut searched: Vec<String>) -> Problem {
    searched.dedup();
    let searched = list(searched.iter().map(String::as_str)).map(|folders| format!("looked in {folders}"));
    match failure {
        Some(failure) => {
            Problem::error(Code::Include, name.span, format!("`{}` cannot be read", name.text)).help(failure)
        }
        None => Problem::error(Code::Include, name.span, format!("no file named `{}`", name.text))
            .maybe_help(nearest::hint(&name.text, BUILT_IN).or(searched)),
    }
}

/// The folder of a file, as a hint shows it.
fn folder(file: &Path) -> Option<String> {
    let folder = file.parent()?;
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    Some(format!("`{}`", folder.display()))
}

/// The problem of a file that is no text.
fn no_text(source: &Source, index: usize) -> Problem {
    let start = Span { source: index, start: 0, end: 0 };
    let (what, help) = match source.is_utf16() {
        true => ("is UTF-16", "save it as UTF-8"),
        false => ("is no text", "a program in bytes is shown as text by `gradus disasm`"),
    };
    Problem::error(Code::Encoding, start, format!("`{}` {what}", source.path.display())).help(help)
}

/// The path without `.` and `dir/..`, so that one file has one path: the path of a [`Source`].
pub fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match (component, normal.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                normal.pop();
            }
            _ => normal.push(component),
        }
    }
    normal
}
