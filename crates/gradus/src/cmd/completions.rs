//! `gradus completions`

use std::io::Write;

use clap::CommandFactory;

/// Print the completion script of a shell
///
/// For bash: `gradus completions bash > ~/.local/share/bash-completion/completions/gradus`.
#[derive(clap::Args)]
pub struct Completions {
    /// The shell
    shell: clap_complete::Shell,
}

impl Completions {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut crate::Cli::command(), "gradus", &mut script);
        Ok(out.write_all(&script)?)
    }
}
