//! The texts that the editor has open: they count, not the files on the disk.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::text::{Encoding, Lines, Place};

/// A text that the editor has open.
#[derive(Clone, Debug)]
pub struct Document {
    /// Its name in the protocol.
    pub uri: String,
    /// The editor's number of this state of the text.
    pub version: i32,
    /// The text.
    pub text: Arc<str>,
    /// Its lines.
    pub lines: Lines,
}

/// A change of a text: a piece that takes the place of another, or the whole text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Change {
    /// What is replaced; `None` for everything.
    pub range: Option<(Place, Place)>,
    /// What takes its place.
    pub text: String,
}

/// All open texts by path.
#[derive(Clone, Debug, Default)]
pub struct Documents {
    open: HashMap<PathBuf, Document>,
}

impl Documents {
    /// Opens a text, or takes a new one for an open path.
    pub fn open(&mut self, path: PathBuf, uri: String, version: i32, text: &str) {
        self.open.insert(path, Document { uri, version, text: text.into(), lines: Lines::of(text) });
    }

    /// Applies changes one after the other; false if the text is not open.
    pub fn change(&mut self, path: &Path, version: i32, changes: &[Change], encoding: Encoding) -> bool {
        let Some(document) = self.open.get_mut(path) else { return false };
        for change in changes {
            document.apply(change, encoding);
        }
        document.version = version;
        true
    }

    /// Closes a text: the file on the disk counts again.
    pub fn close(&mut self, path: &Path) -> Option<Document> {
        self.open.remove(path)
    }

    /// Returns an open text.
    pub fn get(&self, path: &Path) -> Option<&Document> {
        self.open.get(path)
    }

    /// Returns the paths of the open texts, in order.
    pub fn paths(&self) -> Vec<PathBuf> {
        let mut paths: Vec<_> = self.open.keys().cloned().collect();
        paths.sort();
        paths
    }
}

impl Document {
    fn apply(&mut self, change: &Change, encoding: Encoding) {
        let text = match change.range {
            None => change.text.clone(),
            Some((start, end)) => {
                let start = self.lines.offset(&self.text, start, encoding);
                let end = self.lines.offset(&self.text, end, encoding).max(start);
                [&self.text[..start], &change.text, &self.text[end..]].concat()
            }
        };
        self.lines = Lines::of(&text);
        self.text = text.into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(line: u32, character: u32) -> Place {
        Place { line, character }
    }

    fn changed(changes: &[Change]) -> String {
        let mut documents = Documents::default();
        let path = PathBuf::from("a.tmc");
        documents.open(path.clone(), "file:///a.tmc".into(), 1, "ROR 0, 1\nSTOP\n");
        assert!(documents.change(&path, 2, changes, Encoding::Utf16));
        assert_eq!(documents.get(&path).unwrap().version, 2);
        documents.get(&path).unwrap().text.to_string()
    }

    fn piece(start: Place, end: Place, text: &str) -> Change {
        Change { range: Some((start, end)), text: text.into() }
    }

    #[test]
    fn changes_are_applied_one_after_the_other() {
        let typed = [piece(place(0, 8), place(0, 8), "0"), piece(place(0, 9), place(0, 9), "0")];
        assert_eq!(changed(&typed), "ROR 0, 100\nSTOP\n");
        assert_eq!(changed(&[piece(place(0, 8), place(1, 4), "")]), "ROR 0, 1\n");
        assert_eq!(changed(&[Change { range: None, text: "STOP".into() }]), "STOP");
    }

    #[test]
    fn ranges_that_are_nowhere_do_no_harm() {
        assert_eq!(changed(&[piece(place(9, 9), place(0, 0), "x")]), "ROR 0, 1\nSTOP\nx");
    }

    #[test]
    fn text_that_is_not_open_is_not_changed() {
        assert!(!Documents::default().change(Path::new("a.tmc"), 2, &[], Encoding::Utf8));
    }
}
