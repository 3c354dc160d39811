//! The console: lines of text that work the machine by hand.
//!
//! One table holds all commands; operands are checked before anything is changed.

use std::fmt::{self, Write as _};

use gradus_plant::{Coil, CoilFault, Mechanics, Readings, StepperAxis, Surroundings, Switch};
use gradus_tmcl::catalogue::{Ap, Module};

use crate::{Bench, MachineIo, SpiDevice};

mod servo;

/// A line that is no command. Nothing has been changed.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum ConsoleError {
    #[error("there is no command `{0}`; `help` lists them")]
    Unknown(String),
    #[error("`{0}` changes nothing")]
    NoChange(String),
    #[error("usage: {usage}")]
    Count { usage: String },
    #[error("`{found}` is no {operand}; usage: {usage}")]
    Operand { found: String, operand: String, usage: String },
}

impl ConsoleError {
    /// The more telling of two: of the forms of a command, the one that fits in its number of operands.
    fn or(self, other: Self) -> Self {
        match (self, other) {
            (Self::Count { usage }, Self::Count { usage: other }) => {
                Self::Count { usage: format!("{usage}, or {other}") }
            }
            (Self::Unknown(_) | Self::Count { .. }, other) => other,
            (this, _) => this,
        }
    }
}

/// Executes a line and gives back what there is to say, which may be nothing. The module sees the change at once.
///
/// # Errors
/// When the line is no command; nothing has been changed then.
pub fn execute(line: &str, bench: &mut Bench) -> Result<String, ConsoleError> {
    match understand(line, bench.catalogue())? {
        None => Ok(String::new()),
        Some((Action::Tell(tell), _)) => Ok(tell(bench)),
        Some((Action::Do(change), operands)) => {
            change(bench, &operands);
            bench.machine().wake();
            bench.run_for(0);
            Ok(String::new())
        }
    }
}

/// A line that changes the machine, checked beforehand.
#[derive(Clone, Debug)]
pub struct Change {
    change: fn(&mut Bench, &[f64]),
    operands: Vec<f64>,
}

impl Change {
    /// Understands a line for the machine of a module.
    ///
    /// # Errors
    /// When the line is no command, or one that changes nothing.
    pub fn parse(line: &str, catalogue: &Module) -> Result<Self, ConsoleError> {
        match understand(line, catalogue)? {
            Some((Action::Do(change), operands)) => Ok(Self { change, operands }),
            _ => Err(ConsoleError::NoChange(line.trim().to_owned())),
        }
    }

    /// Changes the machine.
    pub(crate) fn apply(&self, bench: &mut Bench) {
        (self.change)(bench, &self.operands);
    }
}

/// What a line means; nothing if it is empty.
fn understand(line: &str, catalogue: &Module) -> Result<Option<(Action, Vec<f64>)>, ConsoleError> {
    let mut words = line.split_whitespace();
    let Some(name) = words.next() else {
        return Ok(None);
    };
    let words: Vec<&str> = words.collect();
    let mut problem = ConsoleError::Unknown(name.to_owned());
    for command in commands(catalogue).filter(|command| command.name == name) {
        match command.operands(&words, catalogue) {
            Ok(operands) => return Ok(Some((command.action, operands))),
            Err(error) => problem = problem.or(error),
        }
    }
    Err(problem)
}

/// What stands behind the name of a command.
enum Operand {
    /// A whole number from 0 up to one below the limit.
    Number { name: &'static str, limit: usize },
    /// Any number of a range.
    Real { name: &'static str, min: f64, max: f64 },
    /// The number of an axis of the module.
    Axis,
    /// One of these words; its value is its index.
    Word(&'static [&'static str]),
}

impl Operand {
    fn value(&self, text: &str, catalogue: &Module) -> Option<f64> {
        let below = |limit| text.parse().ok().filter(|number: &usize| *number < limit);
        let index = match self {
            Self::Real { min, max, .. } => return text.parse().ok().filter(|number| (*min..=*max).contains(number)),
            Self::Number { limit, .. } => below(*limit),
            Self::Axis => below(catalogue.axes.into()),
            Self::Word(words) => words.iter().position(|word| *word == text),
        };
        index.map(|index| index as f64)
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Number { name, limit } => write!(f, "{name}(0-{})", limit - 1),
            Self::Real { name, min, max } => write!(f, "{name}({min}..{max})"),
            Self::Axis => f.write_str("AXIS"),
            Self::Word(words) => f.write_str(&words.join("|")),
        }
    }
}

struct Command {
    name: &'static str,
    operands: &'static [Operand],
    help: &'static str,
    action: Action,
}

#[derive(Clone, Copy)]
enum Action {
    /// Changes the machine.
    Do(fn(&mut Bench, &[f64])),
    /// Says something.
    Tell(fn(&mut Bench) -> String),
}

impl Command {
    fn operands(&self, words: &[&str], catalogue: &Module) -> Result<Vec<f64>, ConsoleError> {
        if words.len() != self.operands.len() {
            return Err(ConsoleError::Count { usage: self.usage() });
        }
        let read = |(operand, word): (&Operand, &&str)| {
            operand.value(word, catalogue).ok_or_else(|| ConsoleError::Operand {
                found: (*word).to_owned(),
                operand: operand.to_string(),
                usage: self.usage(),
            })
        };
        self.operands.iter().zip(words).map(read).collect()
    }

    /// The analogue inputs of a servo module are others.
    fn is_for_steppers(&self) -> bool {
        self.name == "analog" || self.operands.iter().any(|operand| matches!(operand, Operand::Axis))
    }

    fn usage(&self) -> String {
        self.operands.iter().fold(self.name.to_owned(), |usage, operand| format!("{usage} {operand}"))
    }
}

const LEVEL: Operand = Operand::Word(&["0", "1"]);
const SWITCH: Operand = Operand::Word(&["left", "right", "home"]);

/// Names of [`MachineIo::ANALOG_PINS`].
const ANALOG_PIN: Operand = Operand::Word(&["0", "1", "2", "3", "6", "7"]);

const TEMPERATURE: Operand = Operand::Real { name: "DEGC", min: -55.0, max: 200.0 };

/// A command that changes the machine.
const fn change(
    name: &'static str,
    operands: &'static [Operand],
    help: &'static str,
    action: fn(&mut Bench, &[f64]),
) -> Command {
    Command { name, operands, help, action: Action::Do(action) }
}

/// A command has a row for each form of its operands. An axis here is one of steppers; a servo has its own table.
const COMMANDS: &[Command] = &[
    change("in", &[Operand::Number { name: "PORT", limit: 8 }, LEVEL], "level of a digital input", |bench, value| {
        bench.machine().io.set_input(value[0] as u8, value[1] == 1.0);
    }),
    change(
        "analog",
        &[ANALOG_PIN, Operand::Number { name: "VALUE", limit: 1024 }],
        "ADC value of an analogue input, in the range that the module has selected",
        |bench, value| bench.machine().io.set_analog(MachineIo::ANALOG_PINS[value[0] as usize], value[1] as i32),
    ),
    change("enable", &[LEVEL], "level of the ENABLE input", |bench, value| {
        bench.machine().io.set_enable(value[0] == 1.0);
    }),
    change(
        "switch",
        &[Operand::Axis, SWITCH, Operand::Word(&["0", "1", "auto"])],
        "level of a switch input; auto gives it back to the travel",
        |bench, value| {
            let closed = [Some(false), Some(true), None][value[2] as usize];
            plant(bench, value[0]).force_switch(Switch::ALL[value[1] as usize], closed);
        },
    ),
    change(
        "switch",
        &[Operand::Axis, SWITCH, Operand::Word(&["stuck"]), LEVEL],
        "the same: the switch is stuck at a level",
        |bench, value| plant(bench, value[0]).force_switch(Switch::ALL[value[1] as usize], Some(value[3] == 1.0)),
    ),
    change(
        "load",
        &[Operand::Axis, Operand::Real { name: "NM", min: -1000.0, max: 1000.0 }],
        "torque at the shaft against the positive direction, like that of a weight",
        |bench, value| change_mechanics(bench, value[0], |mechanics| mechanics.load_nm = value[1]),
    ),
    change(
        "friction",
        &[Operand::Axis, Operand::Real { name: "NM", min: 0.0, max: 1000.0 }],
        "torque at the shaft that opposes motion",
        |bench, value| change_mechanics(bench, value[0], |mechanics| mechanics.friction_nm = value[1]),
    ),
    change("block", &[Operand::Axis], "something holds the shaft", |bench, value| plant(bench, value[0]).block(true)),
    change("block", &[Operand::Axis, Operand::Word(&["off"])], "nothing holds the shaft", |bench, value| {
        plant(bench, value[0]).block(false);
    }),
    change("unblock", &[Operand::Axis], "the same", |bench, value| plant(bench, value[0]).block(false)),
    change(
        "push",
        &[Operand::Axis, Operand::Real { name: "DEGREES", min: -36000.0, max: 36000.0 }],
        "turns the shaft by hand and lets it go",
        |bench, value| plant(bench, value[0]).push(value[1]),
    ),
    change("encoder", &[Operand::Axis, Operand::Word(&["off", "on"])], "line of the encoder", |bench, value| {
        plant(bench, value[0]).cut_encoder(value[1] == 0.0);
    }),
    change(
        "encoder",
        &[Operand::Axis, Operand::Word(&["slip"]), Operand::Real { name: "DEGREES", min: -36000.0, max: 36000.0 }],
        "the coupling of the encoder slips: the shaft gets ahead of it",
        |bench, value| plant(bench, value[0]).slip_encoder(value[2]),
    ),
    change(
        "coil",
        &[Operand::Axis, Operand::Word(&["a", "b"]), Operand::Word(&["ok", "open", "short"])],
        "state of a coil of the motor",
        |bench, value| {
            let fault = [CoilFault::None, CoilFault::Open, CoilFault::Short][value[2] as usize];
            plant(bench, value[0]).set_coil([Coil::A, Coil::B][value[1] as usize], fault);
        },
    ),
    change("temperature", &[Operand::Axis, TEMPERATURE], "temperature of an axis's driver chip", |bench, value| {
        plant(bench, value[0]).heat(Some(value[1]));
    }),
    change(
        "temperature",
        &[Operand::Axis, Operand::Word(&["auto"])],
        "the chip is as warm as the board",
        |bench, value| {
            plant(bench, value[0]).heat(None);
        },
    ),
    change("temperature", &[Operand::Word(&["board"]), TEMPERATURE], "temperature of the board", |bench, value| {
        bench.machine().io.surroundings.temperature_c = value[1];
    }),
    change(
        "supply",
        &[Operand::Real { name: "VOLTS", min: 0.0, max: 60.0 }],
        "supply of the module and its motors; too little resets it",
        |bench, value| {
            bench.machine().io.surroundings.supply_v = value[0];
        },
    ),
    change("power", &[Operand::Word(&["off", "on"])], "supply of the module", |bench, value| {
        if value[0] == 1.0 { bench.power_on() } else { bench.power_off() }
    }),
    change("hang", &[LEVEL], "1: the module does nothing more, its currents stay", |bench, value| {
        bench.hang(value[0] == 1.0);
    }),
    change("reset", &[], "starts the module anew", |bench, _| bench.reset()),
    change(
        "reset",
        &[Operand::Word(&["factory"])],
        "switches off, and on with the pads for factory settings bridged",
        |bench, _| bench.reset_to_factory(),
    ),
    Command { name: "show", operands: &[], help: "state of the machine", action: Action::Tell(show) },
    Command { name: "help", operands: &[], help: "this list", action: Action::Tell(|bench| help(bench.catalogue())) },
];

/// The rows for a module.
fn commands(catalogue: &Module) -> impl Iterator<Item = &'static Command> {
    let servo = catalogue.is_servo();
    let own: &[Command] = if servo { servo::COMMANDS } else { &[] };
    COMMANDS.iter().filter(move |command| !(servo && command.is_for_steppers())).chain(own)
}

fn plant(bench: &mut Bench, axis: f64) -> &mut StepperAxis {
    &mut bench.machine().axes[axis as usize].plant
}

fn change_mechanics(bench: &mut Bench, axis: f64, change: impl FnOnce(&mut Mechanics)) {
    let plant = plant(bench, axis);
    if let Some(mut mechanics) = plant.mechanics().copied() {
        change(&mut mechanics);
        plant.set_mechanics(mechanics);
    }
}

fn help(catalogue: &Module) -> String {
    let line = |command: &Command| format!("{:<44} {}\n", command.usage(), command.help);
    commands(catalogue).map(line).collect()
}

fn show(bench: &mut Bench) -> String {
    let mut text = show_supply(bench);
    for axis in 0..bench.machine().axes.len() {
        text += &show_axis(bench, axis);
    }
    text += &servo::show(bench);
    text + &show_io(&bench.machine().io)
}

fn show_supply(bench: &mut Bench) -> String {
    let power = match (bench.has_power(), bench.is_switched_on()) {
        (true, _) => "on",
        (false, false) => "off",
        (false, true) => "off as the supply is too low",
    };
    let time_s = bench.now() as f64 * 1e-6;
    let io = &bench.machine().io;
    let Surroundings { supply_v, temperature_c } = io.surroundings;
    let enable = u8::from(io.enabled());
    format!("time {time_s:.6} s, power {power}, enable {enable}, supply {supply_v:.1} V, {temperature_c:.0} degC\n")
}

fn show_axis(bench: &mut Bench, axis: usize) -> String {
    let position = bench.axis_parameter(axis, Ap::ActualPosition);
    let speed = bench.axis_parameter(axis, Ap::ActualSpeed);
    let plant = &bench.machine().axes[axis].plant;
    let turns = plant.position() as f64 / f64::from(plant.microsteps_per_turn());
    let mut text = format!("axis {axis}:");
    if let (Some(position), Some(speed)) = (position, speed) {
        let _ = write!(text, " position {position}, speed {speed} pps,");
    }
    let _ = write!(text, " shaft {turns:.4} turns");
    for (switch, name) in Switch::ALL.into_iter().zip(["left", "right", "home"]) {
        let forced = if plant.forced_switch(switch).is_some() { " (forced)" } else { "" };
        let _ = write!(text, ", {name} {}{forced}", u8::from(plant.switch(switch)));
    }
    match plant.encoder {
        Some(_) => text += &format!(", encoder {}", plant.encoder_count()),
        None => text += ", no encoder",
    }
    let cut = if plant.is_encoder_cut() { " (cut off)" } else { "" };
    text + cut + "\n" + &show_motor(bench, axis)
}

/// What instruments at the motor show; nothing of a rigid axis.
fn show_motor(bench: &mut Bench, axis: usize) -> String {
    let now_us = bench.now();
    let machine = bench.machine();
    let plant = &machine.axes[axis].plant;
    let Some(Mechanics { friction_nm, .. }) = plant.mechanics().copied() else { return String::new() };
    let Readings { load_nm, torque_nm, load_angle_deg, current_a, winding_c, driver_c, stallguard, .. } =
        plant.readings(now_us, &machine.io.surroundings);
    format!(
        "        load {load_nm:.3} Nm, friction {friction_nm:.3} Nm, motor {torque_nm:.3} Nm at {load_angle_deg:.1} deg, \
         {current_a:.2} A, winding {winding_c:.0} degC, driver {driver_c:.0} degC, StallGuard {stallguard}\n"
    )
}

fn bits(levels: u8) -> String {
    (0..8).map(|port| format!(" {}", levels >> port & 1)).collect()
}

/// What an output chip on the SPI bus shows.
fn show_spi((number, device): (usize, &SpiDevice)) -> Option<String> {
    match device {
        SpiDevice::Outputs(shown) => Some(format!("spi {number} outputs 0-7:{}\n", bits(*shown))),
        _ => None,
    }
}

fn show_io(io: &MachineIo) -> String {
    let analog = io.analog_pins().iter().map(|port| format!(" {port}: {}", io.adc_value(*port))).collect::<Vec<_>>();
    let analog = analog.join(",");
    let spi: String = io.spi.iter().enumerate().filter_map(show_spi).collect();
    format!("inputs 0-7: {}\noutputs 0-7:{}\nanalog{analog}\n{spi}", bits(io.levels()), bits(io.outputs()))
}

#[cfg(test)]
mod tests;
