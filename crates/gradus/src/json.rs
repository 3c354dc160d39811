//! Results for programs: JSON on the standard output in place of the words for people, or in a file beside them.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::{Map, Value, json};

use crate::program::STANDARD;

/// Version of the form of all results.
const VERSION: u32 = 1;

/// Whether a result is wanted, and where.
#[derive(clap::Args)]
pub struct Json {
    /// Print the result as JSON in place of words, or write it to a file besides
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = STANDARD)]
    json: Option<PathBuf>,
}

impl Json {
    /// True if the standard output is for JSON alone.
    pub fn is_alone(&self) -> bool {
        self.json.as_deref() == Some(Path::new(STANDARD))
    }

    /// True if a result is wanted anywhere.
    pub fn is_wanted(&self) -> bool {
        self.json.is_some()
    }

    /// Writes a result, if one is wanted: an object with the version and these members.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, members: &[(&str, Value)], out: &mut dyn Write) -> anyhow::Result<()> {
        let Some(file) = &self.json else { return Ok(()) };
        let members = members.iter().map(|(name, value)| ((*name).to_owned(), value.clone()));
        let object: Map<String, Value> = [("version".to_owned(), json!(VERSION))].into_iter().chain(members).collect();
        let text = serde_json::to_string_pretty(&object)? + "\n";
        if self.is_alone() {
            return Ok(out.write_all(text.as_bytes())?);
        }
        fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))
    }
}
