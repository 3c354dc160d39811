//! Progress bars.

use indicatif::{ProgressBar, ProgressFinish, ProgressStyle};

/// A bar on the standard error output, which vanishes when it is dropped; nothing where that is no terminal.
pub fn progress(what: &'static str, len: usize) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(len as u64).with_style(style).with_message(what).with_finish(ProgressFinish::AndClear)
}
