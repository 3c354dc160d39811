//! Looking at the axes of a module while something moves them: what is shown, drawn and recorded.

use std::io::{self, Write};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::bail;
use clap::builder::{PathBufValueParser, TypedValueParser};
use gradus_host::Session;

use crate::output::{Output, plot_file, record_file};
use crate::recording::{Probe, Recording, Sample};
use crate::signal::Channel;
use crate::view::View;
use crate::{span, terminal};

/// What to look at, and what becomes of it.
#[derive(clap::Args)]
pub struct Showing {
    /// Time between two lines where the output is no terminal
    #[arg(long, value_name = "DURATION", value_parser = span::parse, default_value = "1s")]
    every: Duration,
    /// Signals to show, draw and record, see below
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', default_value = "position,speed")]
    signals: Vec<String>,
    /// Axes to show, draw and record; all of them if left out
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    axes: Vec<u8>,
    /// Time between two samples; a real module is asked as often as its line allows
    #[arg(long, value_name = "DURATION", value_parser = span::parse_period, default_value = "10ms")]
    sample: Duration,
    /// Draw the signals over time as a picture, or write them as a table; may be given several times
    #[arg(long, value_name = "FILE.svg|FILE.csv", value_parser = PathBufValueParser::new().try_map(plot_file))]
    plot: Vec<PathBuf>,
    /// Record the signals for Foxglove, one topic an axis
    #[arg(long, value_name = "FILE.mcap", value_parser = PathBufValueParser::new().try_map(record_file))]
    record: Option<PathBuf>,
}

/// Looks at the axes, time and again.
pub struct Watch {
    start: Duration,
    period: Duration,
    view: View,
    outputs: Vec<Output>,
    /// Holds all samples, if there are files to fill.
    recording: Recording,
    /// The latest sample.
    sample: Sample,
}

impl Showing {
    /// Opens the files and finds the signals. Nothing has been looked at yet.
    ///
    /// # Errors
    /// When a file cannot be written, or the module has no such axis or signal.
    pub fn prepare(&self, session: &mut Session) -> anyhow::Result<Watch> {
        let probe = self.probe(session)?;
        let outputs = self.plot.iter().chain(&self.record).map(|file| Output::create(file));
        let outputs = outputs.collect::<Result<_, _>>()?;
        let view = View::new(terminal::is_live(), self.every);
        let (start, sample) = (session.now(), Sample { time: Duration::ZERO, values: Vec::new() });
        let zones = probe.zones(session);
        let recording = Recording { probe, zones, samples: Vec::new() };
        Ok(Watch { start, period: self.sample, view, outputs, recording, sample })
    }

    /// What to look at.
    fn probe(&self, session: &mut Session) -> anyhow::Result<Probe> {
        let module = session.module()?;
        let axes = if self.axes.is_empty() { (0..module.axes).collect() } else { self.axes.clone() };
        if let Some(axis) = axes.iter().find(|axis| **axis >= module.axes) {
            bail!("the {} has no axis {axis}, only {}", module.name, names(0..module.axes));
        }
        let channels = self.signals.iter().map(|name| Channel::find(name, session)).collect::<Result<_, _>>()?;
        Ok(Probe { channels, axes })
    }
}

fn names(axes: Range<u8>) -> String {
    axes.map(|axis| axis.to_string()).collect::<Vec<_>>().join(", ")
}

impl Watch {
    /// Time 0 is now.
    pub fn start(&mut self, session: &mut Session) {
        self.start = session.now();
        self.recording.zones = self.recording.probe.zones(session);
    }

    /// Takes a sample, and gives back its time.
    ///
    /// # Errors
    /// When the session fails.
    pub fn look(&mut self, session: &mut Session) -> Result<Duration, gradus_host::Error> {
        self.sample = self.recording.probe.take(session, self.start)?;
        Ok(self.sample.time)
    }

    /// Shows the latest sample if it is time for it; the last one whatever the time.
    ///
    /// # Errors
    /// When the output has gone.
    pub fn show(&mut self, is_last: bool, out: &mut dyn Write) -> io::Result<()> {
        if is_last {
            self.view.finish(&self.recording.probe, &self.sample, out)?;
        } else {
            self.view.show(&self.recording.probe, &self.sample, out)?;
        }
        if !self.outputs.is_empty() {
            self.recording.samples.push(self.sample.clone());
        }
        Ok(())
    }

    /// Waits for the time of the next sample, not beyond `limit`.
    pub fn wait(&self, session: &mut Session, limit: Option<Duration>) {
        let next = self.sample.time + self.period;
        let next = limit.map_or(next, |limit| limit.min(next));
        session.sleep((self.start + next).saturating_sub(session.now()));
    }

    /// The latest sample.
    pub fn latest(&self) -> &Sample {
        &self.sample
    }

    /// Fills the files.
    ///
    /// # Errors
    /// When one cannot be written.
    pub fn write(&mut self) -> anyhow::Result<()> {
        self.outputs.drain(..).try_for_each(|output| output.write(&self.recording))
    }
}
