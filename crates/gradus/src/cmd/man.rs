//! `gradus man`

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::CommandFactory;
use clap_mangen::Man as Page;

/// Print the manual page, or write one for each subcommand
///
/// `gradus man | man -l -` shows the page; `gradus man DIR` writes gradus.1, gradus-run.1 and so on.
#[derive(clap::Args)]
pub struct Man {
    /// Folder to write all pages into
    dir: Option<PathBuf>,
}

impl Man {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let Some(dir) = self.dir else { return Ok(Page::new(crate::Cli::command()).render(&mut &mut *out)?) };
        let context = || format!("cannot write manual pages into {}", dir.display());
        fs::create_dir_all(&dir).with_context(context)?;
        clap_mangen::generate_to(crate::Cli::command(), &dir).with_context(context)
    }
}
