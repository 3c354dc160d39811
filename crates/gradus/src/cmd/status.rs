//! `gradus status`

use std::io::Write;

use gradus_host::{ApplicationStatus, Error, LatchRequest, Session, State};
use gradus_tmcl::catalogue::Ap;
use serde_json::{Value, json};

use crate::json::Json;
use crate::listed::table;
use crate::port::Port;

/// Say what a module does: its program, its axes, and whether its line is stopped
///
/// Only reads; nothing is changed.
#[derive(clap::Args)]
#[command(after_long_help = "\
Examples:
  gradus status --port /dev/ttyACM0
  gradus status --port tcp:localhost:4322 --json")]
pub struct Status {
    #[command(flatten)]
    json: Json,
    #[command(flatten, next_help_heading = "Connection")]
    port: Port,
}

/// What a module does.
struct Seen {
    module: &'static str,
    program: ApplicationStatus,
    counter: i32,
    /// The latest command of the program that was refused.
    refused: Option<gradus_host::ProgramError>,
    axes: Vec<Axis>,
    /// Whether the broker of the line holds a stop; `None`: there is no broker.
    stopped: Option<bool>,
}

struct Axis {
    position: i32,
    target: i32,
    speed: i32,
}

impl Status {
    pub fn run(self, out: &mut dyn Write) -> anyhow::Result<()> {
        let mut session = self.port.open()?;
        let seen = Seen::look(&mut session)?;
        if !self.json.is_alone() {
            seen.show(&session, out)?;
        }
        self.json.write(&seen.members(), out)
    }
}

impl Seen {
    fn look(session: &mut Session) -> Result<Self, Error> {
        let module = session.module()?;
        let axes = (0..module.axes).map(|axis| Axis::look(session, axis)).collect::<Result<_, _>>()?;
        Ok(Self {
            module: module.name,
            program: session.application_status()?,
            counter: session.program_counter()?,
            refused: session.program_error()?,
            axes,
            stopped: session.ask_latch(LatchRequest::State)?,
        })
    }

    fn show(&self, session: &Session, out: &mut dyn Write) -> anyhow::Result<()> {
        writeln!(out, "{} at {}", self.module, session.port())?;
        let waits = if self.program.waiting { ", waits" } else { "" };
        writeln!(out, "program: {}{waits}, address {}", word(self.program.state), self.counter)?;
        if let Some(refused) = self.refused {
            writeln!(out, "refused at address {}: {}", refused.address, refused.status.text())?;
        }
        if self.stopped == Some(true) {
            writeln!(out, "the line is stopped; `gradus stop --release` lets pass again what acts")?;
        }
        let mut table = table(["axis#", "position#", "target#", "speed#"]);
        for (axis, Axis { position, target, speed }) in self.axes.iter().enumerate() {
            table.add_row([axis.to_string(), position.to_string(), target.to_string(), speed.to_string()]);
        }
        Ok(writeln!(out, "{}", table.trim_fmt())?)
    }

    fn members(&self) -> Vec<(&'static str, Value)> {
        let axis = |it: &Axis| json!({ "position": it.position, "target": it.target, "speed": it.speed });
        let refused = self.refused.map(|it| json!({ "address": it.address, "status": it.status.0 }));
        vec![
            ("module", json!(self.module)),
            ("program", json!(word(self.program.state))),
            ("waiting", json!(self.program.waiting)),
            ("address", json!(self.counter)),
            ("refused", refused.unwrap_or_default()),
            ("axes", self.axes.iter().map(axis).collect()),
            ("line_stopped", json!(self.stopped)),
        ]
    }
}

impl Axis {
    fn look(session: &mut Session, axis: u8) -> Result<Self, Error> {
        Ok(Self {
            position: session.get_axis(Ap::ActualPosition, axis)?,
            target: session.get_axis(Ap::TargetPosition, axis)?,
            speed: session.get_axis(Ap::ActualSpeed, axis)?,
        })
    }
}

fn word(state: State) -> &'static str {
    match state {
        State::Stopped => "stopped",
        State::Running => "running",
        State::Stepping => "stepping",
        State::Resetting => "resetting",
        State::Unknown(_) => "unknown",
    }
}
