//! `gradus run`

use std::io::{self, IsTerminal, Write};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::bail;
use clap::builder::{PathBufValueParser, TypedValueParser};
use gradus_host::{Session, State};
use gradus_tmcl::Instruction;
use gradus_tmcl::catalogue::{MODULES, Module, TMCM_3351};

use crate::output::{Output, plot_file, record_file};
use crate::port::{self, Port};
use crate::program::{Program, Surroundings};
use crate::progress::{interruption, progress};
use crate::recording::{Probe, Recording, Sample};
use crate::signal::Channel;
use crate::view::View;
use crate::{complain, signal, span};

/// Run a program and watch the axes
///
/// Assembles the program, or takes a .bin file as it is, downloads it, reads it back and compares, resets the module's
/// interpreter, runs it, and shows position and speed of the axes, or other signals, until the program stops or the time is
/// up.
///
/// On a virtual module of this process (sim:) time is virtual: an hour of motion takes seconds.
///
/// When the time is up, on Ctrl-C, and when nobody reads the output any more, the program and all motors are stopped. When the
/// program stops by itself, motors that it left running go on.
///
/// Exit status: 0 when the program stopped by itself or the time was up, 1 on errors and on Ctrl-C. An instruction of the program
/// that the module refused is shown as a warning.
#[derive(clap::Args)]
#[command(after_long_help = after_help())]
pub struct Run {
    /// Source file or .bin file
    file: PathBuf,
    #[command(flatten)]
    port: Port,
    /// Module the program is for; the one at the port if left out, a virtual one of that kind where no port is given
    #[arg(long, value_parser = port::module(MODULES), ignore_case = true)]
    module: Option<&'static Module>,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Time to run: 500ms, 60s, 2m, 1h; until the program stops if left out
    #[arg(long = "for", value_name = "DURATION", value_parser = span::parse, allow_hyphen_values = true)]
    time: Option<Duration>,
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

fn after_help() -> String {
    format!(
        "\
Signals:
{}  Every axis parameter is a signal too, by its name or number: measured_speed, 206.

Examples:
  gradus run two-positions.tmc --for 60s
  gradus run two-positions.tmc --for 60s --plot two-positions.svg
  gradus run home.tmc --signals position,deviation,shaft --plot home.csv --record home.mcap
  gradus run main.bin --port /dev/ttyACM0",
        signal::list()
    )
}

/// Why watching ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Stopped,
    TimeUp,
    Interrupted,
}

impl Run {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let interrupted = interruption()?;
        let mut session = self.port.open_for(self.module.unwrap_or(&TMCM_3351))?;
        let module = session.module()?;
        if let Some(wanted) = self.module.filter(|wanted| wanted.name != module.name) {
            bail!("{} is a {}, not a {}", session.port(), module.name, wanted.name);
        }
        let probe = self.probe(&mut session)?;
        let outputs =
            self.plot.iter().chain(&self.record).map(|file| Output::create(file)).collect::<Result<Vec<_>, _>>()?;
        let program = Program::load(&self.file, module, &self.surroundings.options())?;
        load(&mut session, &program.commands)?;
        session.reset()?;
        session.run()?;

        let zones = probe.zones(&mut session);
        let recording = Recording { probe, zones, samples: Vec::new() };
        let mut watch = Watch::new(&session, &self, recording, !outputs.is_empty());
        let end = watch.until_the_end(&mut session, &interrupted, out).inspect_err(|_| {
            // Nobody watches any more. The error in hand tells more than one that follows from it.
            let _ = stop(&mut session);
        });
        for output in outputs {
            output.write(&watch.recording)?;
        }
        let end = end?;
        report(&mut session, &program, end, watch.last, out)?;
        if end == End::Interrupted { bail!("interrupted; program and motors are stopped") } else { Ok(()) }
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

/// Writes a program into the module and reads it back.
fn load(session: &mut Session, commands: &[Instruction]) -> Result<(), gradus_host::Error> {
    session.stop()?;
    let bar = progress("download", commands.len());
    session.download(commands, |count| bar.set_position(count as u64))?;
    let bar = progress("verify", commands.len());
    session.verify(commands, |count| bar.set_position(count as u64))
}

/// Looks at a running program.
struct Watch {
    start: Duration,
    time: Option<Duration>,
    period: Duration,
    view: View,
    keep: bool,
    /// Holds all samples, if they are kept.
    recording: Recording,
    /// When the last one was taken.
    last: Duration,
}

impl Watch {
    fn new(session: &Session, run: &Run, recording: Recording, keep: bool) -> Self {
        let view = View::new(io::stdout().is_terminal(), run.every);
        let (start, last) = (session.now(), Duration::ZERO);
        Self { start, time: run.time, period: run.sample, view, keep, recording, last }
    }

    fn until_the_end(
        &mut self,
        session: &mut Session,
        interrupted: &AtomicBool,
        out: &mut dyn Write,
    ) -> anyhow::Result<End> {
        loop {
            let state = session.application_status()?.state;
            let sample = self.recording.probe.take(session, self.start)?;
            self.last = sample.time;
            let end = self.end(state, sample.time, interrupted);
            self.show(sample, end, out)?;
            if let Some(end) = end {
                return Ok(end);
            }
            let next = self.time.map_or(self.last + self.period, |limit| limit.min(self.last + self.period));
            session.sleep((self.start + next).saturating_sub(session.now()));
        }
    }

    fn show(&mut self, sample: Sample, end: Option<End>, out: &mut dyn Write) -> io::Result<()> {
        match end {
            None => self.view.show(&self.recording.probe, &sample, out)?,
            Some(_) => self.view.finish(&self.recording.probe, &sample, out)?,
        }
        if self.keep {
            self.recording.samples.push(sample);
        }
        Ok(())
    }

    fn end(&self, state: State, time: Duration, interrupted: &AtomicBool) -> Option<End> {
        if interrupted.load(Ordering::Relaxed) {
            Some(End::Interrupted)
        } else if state != State::Running {
            Some(End::Stopped)
        } else {
            self.time.is_some_and(|limit| time >= limit).then_some(End::TimeUp)
        }
    }
}

/// Stops the program and all motors.
fn stop(session: &mut Session) -> Result<(), gradus_host::Error> {
    session.stop()?;
    session.stop_motors()
}

fn report(
    session: &mut Session,
    program: &Program,
    end: End,
    time: Duration,
    out: &mut dyn Write,
) -> anyhow::Result<()> {
    let at = session.program_counter()?;
    let seconds = time.as_secs_f64();
    if end != End::Stopped {
        stop(session)?;
    }
    match end {
        End::Stopped => {
            let at = program.stopped_at(at);
            writeln!(out, "the program stopped at address {at} after {seconds:.3} s")?;
        }
        End::TimeUp => writeln!(out, "time is up after {seconds:.3} s; the program was at address {at}")?,
        End::Interrupted => {}
    }
    if let Some(error) = session.program_error()? {
        let place = program.place(error.address).map(|place| format!(", {place}")).unwrap_or_default();
        let (address, status) = (error.address, error.status.text());
        complain(format_args!("warning: the module refused the command at address {address}{place}: {status}"));
    }
    Ok(())
}
