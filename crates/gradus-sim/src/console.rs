//! The console: lines of text that work the machine by hand.
//!
//! One table holds all commands; operands are checked before anything is changed.

use std::fmt::{self, Write as _};

use gradus_plant::{Surroundings, Switch};
use gradus_tmcl::catalogue::{Ap, Module};

use crate::{Bench, MachineIo};

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
    change: fn(&mut Bench, &[usize]),
    operands: Vec<usize>,
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
fn understand(line: &str, catalogue: &Module) -> Result<Option<(Action, Vec<usize>)>, ConsoleError> {
    let mut words = line.split_whitespace();
    let Some(name) = words.next() else {
        return Ok(None);
    };
    let command = COMMANDS.iter().find(|command| command.name == name);
    let command = command.ok_or_else(|| ConsoleError::Unknown(name.to_owned()))?;
    let operands = command.operands(&words.collect::<Vec<_>>(), catalogue)?;
    Ok(Some((command.action, operands)))
}

/// What stands behind the name of a command.
enum Operand {
    /// A number from 0 up to one below the limit.
    Number { name: &'static str, limit: usize },
    /// The number of an axis of the module.
    Axis,
    /// One of these words; its value is its index.
    Word(&'static [&'static str]),
}

impl Operand {
    fn value(&self, text: &str, catalogue: &Module) -> Option<usize> {
        let below = |limit| text.parse().ok().filter(|number: &usize| *number < limit);
        match self {
            Self::Number { limit, .. } => below(*limit),
            Self::Axis => below(catalogue.axes.into()),
            Self::Word(words) => words.iter().position(|word| *word == text),
        }
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Number { name, limit } => write!(f, "{name}(0-{})", limit - 1),
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
    Do(fn(&mut Bench, &[usize])),
    /// Says something.
    Tell(fn(&mut Bench) -> String),
}

impl Command {
    fn operands(&self, words: &[&str], catalogue: &Module) -> Result<Vec<usize>, ConsoleError> {
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

    fn usage(&self) -> String {
        self.operands.iter().fold(self.name.to_owned(), |usage, operand| format!("{usage} {operand}"))
    }
}

const LEVEL: Operand = Operand::Word(&["0", "1"]);

/// Names of [`MachineIo::ANALOG_PINS`].
const ANALOG_PIN: Operand = Operand::Word(&["0", "1", "2", "3", "6", "7"]);

const COMMANDS: &[Command] = &[
    Command {
        name: "in",
        operands: &[Operand::Number { name: "PORT", limit: 8 }, LEVEL],
        help: "level of a digital input",
        action: Action::Do(|bench, value| bench.machine().io.set_input(value[0] as u8, value[1] == 1)),
    },
    Command {
        name: "analog",
        operands: &[ANALOG_PIN, Operand::Number { name: "VALUE", limit: 1024 }],
        help: "ADC value of an analogue input, in the range that the module has selected",
        action: Action::Do(|bench, value| {
            bench.machine().io.set_analog(MachineIo::ANALOG_PINS[value[0]], value[1] as i32);
        }),
    },
    Command {
        name: "enable",
        operands: &[LEVEL],
        help: "level of the ENABLE input",
        action: Action::Do(|bench, value| bench.machine().io.set_enable(value[0] == 1)),
    },
    Command {
        name: "switch",
        operands: &[Operand::Axis, Operand::Word(&["left", "right", "home"]), Operand::Word(&["0", "1", "auto"])],
        help: "level of a switch input; auto gives it back to the travel",
        action: Action::Do(|bench, value| {
            let closed = [Some(false), Some(true), None][value[2]];
            bench.machine().axes[value[0]].plant.force_switch(Switch::ALL[value[1]], closed);
        }),
    },
    Command {
        name: "power",
        operands: &[Operand::Word(&["off", "on"])],
        help: "supply of the module",
        action: Action::Do(|bench, value| if value[0] == 1 { bench.power_on() } else { bench.power_off() }),
    },
    Command { name: "show", operands: &[], help: "state of the machine", action: Action::Tell(show) },
    Command { name: "help", operands: &[], help: "this list", action: Action::Tell(|_| help()) },
];

fn help() -> String {
    let line = |command: &Command| format!("{:<38} {}\n", command.usage(), command.help);
    COMMANDS.iter().map(line).collect()
}

fn show(bench: &mut Bench) -> String {
    let mut text = show_supply(bench);
    for axis in 0..usize::from(bench.catalogue().axes) {
        text += &show_axis(bench, axis);
    }
    text + &show_io(&bench.machine().io)
}

fn show_supply(bench: &mut Bench) -> String {
    let power = if bench.has_power() { "on" } else { "off" };
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
        Some(_) => text + &format!(", encoder {}\n", plant.encoder_count()),
        None => text + ", no encoder\n",
    }
}

fn show_io(io: &MachineIo) -> String {
    let bits = |levels: u8| (0..8).map(|port| format!(" {}", levels >> port & 1)).collect::<String>();
    let analog = MachineIo::ANALOG_PINS.map(|port| format!(" {port}: {}", io.adc_value(port))).join(",");
    format!("inputs 0-7: {}\noutputs 0-7:{}\nanalog{analog}\n", bits(io.levels()), bits(io.outputs()))
}

#[cfg(test)]
mod tests {
    use gradus_firmware::{AxisInputs, Io, Switches};
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;

    fn bench() -> Bench {
        Bench::rigid(&TMCM_3351)
    }

    fn after(lines: &[&str]) -> Bench {
        let mut bench = bench();
        for line in lines {
            assert_eq!(execute(line, &mut bench).as_deref(), Ok(""), "{line}");
        }
        bench
    }

    #[test]
    fn inputs_take_their_level() {
        let mut bench = after(&["in 3 1", "  in\t5 1 ", "in 3 0", "", "in 7 1"]);
        assert_eq!(bench.machine().io.inputs(), 0b1010_0000);
    }

    #[test]
    fn analogue_inputs_take_their_value() {
        let mut bench = after(&["analog 0 512", "analog 7 1023"]);
        assert_eq!([0, 1, 7].map(|port| bench.machine().io.analog(port)), [512, 0, 1023]);
    }

    #[test]
    fn enable_input_takes_its_level() {
        assert!(!after(&["enable 0"]).machine().io.enable());
        assert!(after(&["enable 0", "enable 1"]).machine().io.enable());
    }

    #[test]
    fn switches_are_forced_and_given_back() {
        let mut bench = after(&["switch 0 left 1", "switch 2 home 1", "switch 2 home auto", "switch 2 right 1"]);
        let levels = [0, 1, 2].map(|axis| bench.machine().axes[axis].switches());
        let open = Switches::default();
        assert_eq!(levels, [Switches { left: true, ..open }, open, Switches { right: true, ..open }]);
    }

    #[test]
    fn power_goes_and_comes() {
        assert!(!after(&["power off", "power off"]).has_power());
        assert!(after(&["power off", "power on", "power on"]).has_power());
    }

    #[test]
    fn wrong_lines_get_a_message_and_change_nothing() {
        let cases = [
            ("on", "there is no command `on`; `help` lists them"),
            ("IN 3 1", "there is no command `IN`; `help` lists them"),
            ("in 3", "usage: in PORT(0-7) 0|1"),
            ("in 3 1 1", "usage: in PORT(0-7) 0|1"),
            ("in 8 1", "`8` is no PORT(0-7); usage: in PORT(0-7) 0|1"),
            ("in 3 high", "`high` is no 0|1; usage: in PORT(0-7) 0|1"),
            ("analog 4 1", "`4` is no 0|1|2|3|6|7; usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
            ("analog 0 1024", "`1024` is no VALUE(0-1023); usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
            ("analog 0 -1", "`-1` is no VALUE(0-1023); usage: analog 0|1|2|3|6|7 VALUE(0-1023)"),
            ("switch 3 left 1", "`3` is no AXIS; usage: switch AXIS left|right|home 0|1|auto"),
            ("switch 0 up 1", "`up` is no left|right|home; usage: switch AXIS left|right|home 0|1|auto"),
            ("power", "usage: power off|on"),
        ];
        for (line, message) in cases {
            let mut changed = bench();
            let error = execute(line, &mut changed).unwrap_err();
            assert_eq!(error.to_string(), message, "{line}");
            assert_eq!(changed.machine(), bench().machine(), "{line}");
        }
    }

    #[test]
    fn only_lines_that_change_the_machine_are_changes() {
        let problem = |line| Change::parse(line, &TMCM_3351).err().map(|error| error.to_string());
        assert_eq!(problem("switch 2 home 1"), None);
        assert_eq!(problem(" show "), Some("`show` changes nothing".into()));
        assert_eq!(problem(""), Some("`` changes nothing".into()));
        assert_eq!(problem("in 3"), Some("usage: in PORT(0-7) 0|1".into()));
    }

    #[test]
    fn help_lists_every_command() {
        let text = execute("help", &mut bench()).unwrap();
        assert_eq!(text.lines().count(), COMMANDS.len());
        assert!(text.contains("switch AXIS left|right|home 0|1|auto"), "{text}");
    }

    #[test]
    fn show_tells_the_state_of_the_machine() {
        let mut bench = after(&["in 3 1", "analog 0 512", "switch 1 left 1", "power off"]);
        bench.machine().axes[2].plant.place(25_600);
        bench.machine().axes[1].plant.encoder = None;
        let expected = "\
time 0.000000 s, power off, enable 1, supply 24.0 V, 25 degC
axis 0: shaft 0.0000 turns, left 0, right 0, home 0, encoder 0
axis 1: shaft 0.0000 turns, left 1 (forced), right 0, home 0, no encoder
axis 2: shaft 0.5000 turns, left 0, right 0, home 0, encoder 2048
inputs 0-7:  0 0 0 1 0 0 0 0
outputs 0-7: 0 0 0 0 0 0 0 0
analog 0: 512, 1: 0, 2: 0, 3: 0, 6: 0, 7: 0
";
        assert_eq!(execute("show", &mut bench).as_deref(), Ok(expected));
    }
}
