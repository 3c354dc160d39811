//! Axes on the screen while they move: a table that refreshes in a terminal, a line a time elsewhere.

use std::io::{self, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::recording::Sample;

/// Width of a column of numbers: the longest is -2147483648.
const WIDTH: usize = 12;

/// Shows samples as they come.
pub enum View {
    /// Redrawn at the rate of people's eyes.
    Table(ProgressBar),
    /// One line every so often.
    Lines {
        /// Time between two lines.
        every: Duration,
        /// When the latest one was shown.
        last: Option<Duration>,
    },
}

impl View {
    /// A table if somebody watches, else lines, one `every` so often.
    pub fn new(watched: bool, every: Duration) -> Self {
        if !watched {
            return Self::Lines { every, last: None };
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
        bar.set_style(ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self::Table(bar)
    }

    /// Shows a sample if it is time for it.
    ///
    /// # Errors
    /// When the output has gone.
    pub fn show(&mut self, sample: &Sample, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Table(bar) => bar.set_message(as_table(sample)),
            Self::Lines { every, last } if last.is_some_and(|last| sample.time < last + *every) => {}
            Self::Lines { last, .. } => show_line(sample, last, out)?,
        }
        Ok(())
    }

    /// Shows the last sample, whatever the time.
    ///
    /// # Errors
    /// When the output has gone.
    pub fn finish(&mut self, sample: &Sample, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Table(bar) => bar.finish_with_message(as_table(sample)),
            Self::Lines { last, .. } if *last == Some(sample.time) => {} // shown already
            Self::Lines { last, .. } => show_line(sample, last, out)?,
        }
        Ok(())
    }
}

/// Writes a line, and the heading above the first one.
fn show_line(sample: &Sample, last: &mut Option<Duration>, out: &mut dyn Write) -> io::Result<()> {
    if last.replace(sample.time).is_none() {
        writeln!(out, "{}", heading(sample))?;
    }
    writeln!(out, "{}", as_line(sample))
}

fn as_table(sample: &Sample) -> String {
    let mut text = format!("time {:.3} s\naxis{:>WIDTH$}{:>WIDTH$}", sample.time.as_secs_f64(), "position", "speed");
    for (axis, motion) in sample.axes.iter().enumerate() {
        text += &format!("\n{axis:>4}{:>WIDTH$}{:>WIDTH$}", motion.position, motion.speed);
    }
    text
}

fn heading(sample: &Sample) -> String {
    let column = |axis| format!("{:>WIDTH$}{:>WIDTH$}", format!("position {axis}"), format!("speed {axis}"));
    format!("{:>10}", "time") + &(0..sample.axes.len()).map(column).collect::<String>()
}

fn as_line(sample: &Sample) -> String {
    let motion = |motion: &crate::recording::Motion| format!("{:>WIDTH$}{:>WIDTH$}", motion.position, motion.speed);
    format!("{:>10.3}", sample.time.as_secs_f64()) + &sample.axes.iter().map(motion).collect::<String>()
}
