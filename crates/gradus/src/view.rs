//! Axes on the screen while they move: a table that refreshes in a terminal, a line a time elsewhere.

use std::io::{self, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::recording::{Probe, Sample};
use crate::signal::Channel;
use crate::terminal;

/// Narrowest column of numbers: the longest is -2147483648.
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
    pub fn show(&mut self, probe: &Probe, sample: &Sample, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Table(bar) => bar.set_message(fitted(&as_table(probe, sample), terminal::width())),
            Self::Lines { every, last } if last.is_some_and(|last| sample.time < last + *every) => {}
            Self::Lines { last, .. } => show_line(probe, sample, last, out)?,
        }
        Ok(())
    }

    /// Shows the last sample, whatever the time.
    ///
    /// # Errors
    /// When the output has gone.
    pub fn finish(&mut self, probe: &Probe, sample: &Sample, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Table(bar) => bar.finish_with_message(fitted(&as_table(probe, sample), terminal::width())),
            Self::Lines { last, .. } if *last == Some(sample.time) => {} // shown already
            Self::Lines { last, .. } => show_line(probe, sample, last, out)?,
        }
        Ok(())
    }
}

/// Writes a line, and the heading above the first one.
fn show_line(probe: &Probe, sample: &Sample, last: &mut Option<Duration>, out: &mut dyn Write) -> io::Result<()> {
    if last.replace(sample.time).is_none() {
        writeln!(out, "{}", heading(probe))?;
    }
    writeln!(out, "{}", as_line(probe, sample))
}

fn as_table(probe: &Probe, sample: &Sample) -> String {
    let cell = |text: &str, channel: &Channel| format!("{text:>0$}", WIDTH.max(channel.name.len() + 2));
    let heading: String = probe.channels.iter().map(|channel| cell(&channel.name, channel)).collect();
    let mut table = format!("time {:.3} s\naxis{heading}", sample.time.as_secs_f64());
    for (axis, values) in probe.axes.iter().zip(sample.axes(probe)) {
        let cells = probe.channels.iter().zip(values).map(|(channel, value)| cell(&text(channel, *value), channel));
        table += &format!("\n{axis:>4}{}", cells.collect::<String>());
    }
    table
}

/// Lines that a narrow terminal shows as they are: one that it would break in two is cut, so that drawing over them works.
fn fitted(table: &str, width: Option<usize>) -> String {
    let line = |line: &str| line.chars().take(width.unwrap_or(usize::MAX)).collect::<String>();
    table.lines().map(line).collect::<Vec<_>>().join("\n")
}

fn heading(probe: &Probe) -> String {
    let column = |(axis, channel): (u8, &Channel)| format!("{:>1$}", title(axis, channel), width(axis, channel));
    format!("{:>10}", "time") + &probe.columns().map(column).collect::<String>()
}

fn as_line(probe: &Probe, sample: &Sample) -> String {
    let column = |((axis, channel), value): ((u8, &Channel), &f64)| {
        format!("{:>1$}", text(channel, *value), width(axis, channel))
    };
    format!("{:>10.3}", sample.time.as_secs_f64())
        + &probe.columns().zip(&sample.values).map(column).collect::<String>()
}

fn title(axis: u8, channel: &Channel) -> String {
    format!("{} {axis}", channel.name)
}

fn width(axis: u8, channel: &Channel) -> usize {
    WIDTH.max(title(axis, channel).len() + 2)
}

/// A value as people read it; a dash where there is none.
fn text(channel: &Channel, value: f64) -> String {
    if value.is_nan() { "-".into() } else { format!("{value:.0$}", channel.decimals()) }
}

#[cfg(test)]
mod tests {
    use super::fitted;

    #[test]
    fn a_line_is_cut_at_the_width_of_the_terminal() {
        assert_eq!(fitted("axis  speed\n   0     12", Some(6)), "axis  \n   0  ");
        assert_eq!(fitted("axis\n0", None), "axis\n0");
    }
}
