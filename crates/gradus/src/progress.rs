//! Progress bars of long commands.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};

use crate::terminal;

/// A bar on the standard error output, which vanishes when it is dropped; nothing where that is no terminal.
pub fn progress(what: &'static str, len: usize) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}").unwrap_or_else(|_| ProgressStyle::default_bar());
    let target = if terminal::has_bars() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    ProgressBar::with_draw_target(Some(len as u64), target)
        .with_style(style)
        .with_message(what)
        .with_finish(ProgressFinish::AndClear)
}
