//! `gradus run`

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, bail};
use gradus_host::{RestartWatch, Session, State};
use gradus_tmcl::catalogue::Module;
use serde_json::{Value, json};

use super::load::load;
use crate::axes::{Axes, Moving};
use crate::ending::{End, Refusals, stop_at, stopped, underway};
use crate::exit::{Exit, REFUSED, TIME_UP};
use crate::interruption::{interrupted, interruption};
use crate::json::Json;
use crate::port::{Conversation, Port};
use crate::program::{Program, ProgramFile, Surroundings};
use crate::watch::{Showing, Watch};
use crate::{complain, signal, span};

/// Run a program and watch the axes
///
/// Assembles the program, or takes a .bin file as it is, downloads it, reads it back and compares, resets the module's
/// interpreter, runs it, and shows position and speed of the axes, or other signals, until the program stops or the time is
/// up. Then it says how and where the program ended, which commands the module refused, and which motors still move.
///
/// On a virtual module of this process (sim:) time is virtual: an hour of motion takes seconds.
///
/// When the time is up, on Ctrl-C, and when nobody reads the output any more, the program and all motors are stopped. When the
/// program stops by itself, motors that it left running go on.
#[derive(clap::Args)]
#[command(after_long_help = after_help())]
pub struct Run {
    /// Source file or .bin file; - is the standard input
    file: PathBuf,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Time to run: 500ms, 60s, 2m, 1h; until the program stops if left out
    #[arg(long = "for", value_name = "DURATION", value_parser = span::parse, allow_hyphen_values = true)]
    time: Option<Duration>,
    /// Watch on behind the program's end until the axes stand [default: on a virtual module]
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    follow: Option<bool>,
    /// Exit with status 4 if the program has not stopped when the time is up
    #[arg(long, requires = "time")]
    must_stop: bool,
    #[command(flatten)]
    showing: Showing,
    #[command(flatten)]
    json: Json,
    /// Do not ask whether to run on a real module that GRADUS_PORT or gradus.toml names
    #[arg(long)]
    yes: bool,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
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
  gradus run main.bin --port /dev/ttyACM0

Exit status:
  0    the program stopped by itself, or the time of --for was up, and the module refused nothing
  1    something failed: a wrong program, a port that does not open, a module that restarts
  2    the command line was wrong
  3    the module refused a command of the program, or the program had a fault
  4    the time was up and --must-stop was given
  130  Ctrl-C",
        signal::list()
    )
}

impl Run {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let interruption = interruption();
        let file = ProgramFile::read(&self.file)?;
        let given = self.surroundings.module.filter(|module| !module.is_any());
        let wanted = given.map_or_else(|| file.module(), |module| Ok(Some(module)))?;
        let mut session = self.port.open_to_act(wanted, self.yes, &format!("run {}", self.file.display()))?;
        let module = session.module()?;
        if let Some(wanted) = wanted.filter(|wanted| wanted.name != module.name) {
            bail!("{} is a {}, not a {}", session.port(), module.name, wanted.name);
        }
        let mut watch = self.showing.prepare(&mut session)?;
        let program = file.program(module, session.firmware()?, &self.surroundings)?;
        load(&mut session, &program.commands)?;
        session.reset()?;
        let mut observer = self.observer(&mut session, &program)?;
        session.run()?;
        watch.start(&mut session);
        let seen = observer.watch(&mut session, &mut watch, &interruption, &mut self.lines(out));
        let seen = seen.map_err(|error| give_up(&mut session, error));
        watch.write()?;
        self.report(&mut session, &observer, &Ended { program, module, time: watch.latest().time, end: seen? }, out)
    }

    fn observer(&self, session: &mut Conversation, program: &Program) -> Result<Observer, gradus_host::Error> {
        let blind = program.commands.iter().any(|command| RestartWatch::is_blinded_by(*command));
        let restarts = if blind { None } else { Some(RestartWatch::new(session)?) };
        let follow = self.follow.unwrap_or_else(|| session.bench().is_some());
        Ok(Observer { limit: self.time, follow, restarts, ..Observer::default() })
    }

    /// Where lines for people go: nowhere if the output is for JSON alone.
    fn lines<'a>(&self, out: &'a mut dyn Write) -> Box<dyn Write + 'a> {
        if self.json.is_alone() { Box::new(std::io::sink()) } else { Box::new(out) }
    }

    /// Says how it ended; stops what still runs.
    fn report(
        &self,
        session: &mut Session,
        observer: &Observer,
        ended: &Ended,
        out: &mut dyn Write,
    ) -> anyhow::Result<()> {
        if ended.end != End::Stopped {
            session.halt().context("program and motors may still move")?;
        }
        let still: &[Moving] = if ended.end == End::Stopped { &observer.axes.moving } else { &[] };
        let how = ended.how(observer);
        let mut lines = self.lines(out);
        if ended.end != End::Interrupted {
            writeln!(lines, "after {:.3} s {how}", observer.at.time.as_secs_f64())?;
        }
        still.iter().try_for_each(|moving| writeln!(lines, "{moving}"))?;
        drop(lines);
        for line in observer.refusals.lines(&ended.program, ended.module) {
            complain(format_args!("{line}"));
        }
        self.json.write(&ended.json(observer, &how, still), out)?;
        self.verdict(observer, ended.end)
    }

    /// The exit status.
    fn verdict(&self, observer: &Observer, end: End) -> anyhow::Result<()> {
        match end {
            End::Interrupted => Err(interrupted("interrupted; program and motors are stopped")),
            End::Restarted => bail!("the module restarted while the program ran; check its supply"),
            _ if !observer.refusals.is_empty() => Err(Exit::with(REFUSED, "")),
            End::TimeUp if self.must_stop => {
                Err(Exit::with(TIME_UP, "the time is up, and the program has not stopped"))
            }
            End::Stopped | End::TimeUp => Ok(()),
        }
    }
}

/// A run that ends on an error leaves nothing in motion if it can help it; says which.
fn give_up(session: &mut Session, error: anyhow::Error) -> anyhow::Error {
    let stopped = session.halt().is_ok();
    error.context(if stopped { "program and motors are stopped" } else { "program and motors may still move" })
}

/// Where the program was at the end.
#[derive(Clone, Copy, Default)]
struct At {
    time: Duration,
    counter: usize,
    waits: bool,
}

/// Looks at a running program.
#[derive(Default)]
struct Observer {
    limit: Option<Duration>,
    /// Looks on behind the end of the program until the axes stand.
    follow: bool,
    restarts: Option<RestartWatch>,
    refusals: Refusals,
    axes: Axes,
    at: At,
}

impl Observer {
    fn watch(
        &mut self,
        session: &mut Session,
        watch: &mut Watch,
        interruption: &AtomicBool,
        out: &mut dyn Write,
    ) -> anyhow::Result<End> {
        let mut stopped = false;
        loop {
            let time = watch.look(session)?;
            if !stopped {
                stopped = self.look_at_program(session, time)?;
            }
            if stopped {
                self.axes.look(session)?;
            }
            let end = self.end(session, stopped, time, interruption)?;
            watch.show(end.is_some(), out)?;
            match end {
                Some(end) => return Ok(end),
                None => watch.wait(session, self.limit),
            }
        }
    }

    /// True when the program no longer runs.
    fn look_at_program(&mut self, session: &mut Session, time: Duration) -> Result<bool, gradus_host::Error> {
        let status = session.application_status()?;
        let counter = usize::try_from(session.program_counter()?).unwrap_or_default();
        self.refusals.look(session)?;
        self.at = At { time, counter, waits: status.waiting };
        Ok(status.state != State::Running)
    }

    fn end(
        &mut self,
        session: &mut Session,
        stopped: bool,
        time: Duration,
        interruption: &AtomicBool,
    ) -> Result<Option<End>, gradus_host::Error> {
        let restarted = self.restarts.as_mut().map(|watch| watch.look(session)).transpose()?.unwrap_or_default();
        let is_up = self.limit.is_some_and(|limit| time >= limit);
        let settled = !self.follow || self.axes.is_steady || is_up;
        Ok(if interruption.load(Ordering::Relaxed) {
            Some(End::Interrupted)
        } else if restarted {
            Some(End::Restarted)
        } else if stopped {
            settled.then_some(End::Stopped)
        } else {
            is_up.then_some(End::TimeUp)
        })
    }
}

/// A run that is over.
struct Ended {
    program: Program,
    module: &'static Module,
    /// Of the last sample.
    time: Duration,
    end: End,
}

impl Ended {
    fn how(&self, observer: &Observer) -> String {
        let (program, module) = (&self.program, self.module);
        match self.end {
            End::Stopped => format!("the program {}", stopped(observer.at.counter, program, module)),
            End::TimeUp => {
                format!("time is up; {}", underway(observer.at.counter, observer.at.waits, program, module))
            }
            End::Interrupted => "interrupted".into(),
            End::Restarted => "the module restarted".into(),
        }
    }

    fn json(&self, observer: &Observer, how: &str, still: &[Moving]) -> Vec<(&'static str, Value)> {
        let (at, program) = (observer.at, &self.program);
        let stop = if self.end == End::Stopped { stop_at(at.counter, program) } else { None };
        let address = stop.unwrap_or(at.counter);
        let moving = |it: &Moving| json!({ "axis": it.axis, "target": it.target, "speed": it.speed });
        vec![
            ("module", json!(self.module.name)),
            ("end", json!(self.end.name())),
            ("how", json!(how)),
            ("seconds", json!(at.time.as_secs_f64())),
            ("watched_seconds", json!(self.time.as_secs_f64())),
            ("address", json!(address)),
            ("place", json!(program.place(address))),
            ("refused", observer.refusals.json(program, self.module)),
            ("moving", still.iter().map(moving).collect()),
        ]
    }
}
