//! Bench files: a module and its machine as TOML.
//!
//! ```toml
//! module = "tmcm-3351"
//!
//! [axis.0]
//! full_steps = 200                         # of a turn; this is the default
//! travel_per_turn = 5.0                    # lead of the screw in mm, so that all lengths are in mm; 1 if left out: turns
//! start = 42.0                             # where the carriage stands when the bench is built; 0 if left out
//! encoder = { counts_per_turn = 4096, index = 0 }   # without an index there is no null channel
//!
//! [axis.0.travel]
//! left = { at = 0.0 }                      # closed here and further left
//! right = { at = 100.0 }                   # closed here and further right
//! home = { at = 60.0, width = 2.0 }        # closed from 59.0 to 61.0
//!
//! [io]
//! enable = true                            # the default
//! inputs = { 3 = true }                    # the others are low
//! analog = { 0 = 512 }                     # ADC value in the range after power-on; the others are 0
//!
//! [[event]]
//! at = 2.5                                 # seconds of virtual time
//! do = "switch 0 home 1"                   # a line of the console
//! ```
//!
//! Only `module` must be there. What a file does not name does not exist: an axis without `travel` has no switches, one
//! without `encoder` no encoder. A key that is not known is an error, so that a misspelt one is not taken for a default.
//!
//! The first current pulls a rotor at most two full steps from its `start` to where the coils point.
//!
//! There is room for more. A motor, a load, friction and end stops are keys of an axis; the bounce of a switch is a key
//! beside `at`; faults are events. Several modules are `[[board]]` tables, each with the keys that stand at the top of
//! the file today, and `[[bus]]` tables that name them; a file without boards remains one.
//!
//! Not here: what the machine does, see `gradus-plant`; what a line of the console does, see [`console`](crate::console).

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use gradus_plant::{Encoder, Home, StepperAxis, Travel};
use gradus_tmcl::catalogue::Module;
use serde::Deserialize;
use toml::Spanned;

use crate::console::Change;
use crate::problem::{Misfit, Problem};
use crate::quantity::{adc_value, counts, full_steps, microseconds, place, travel_per_turn, virtual_module, width};
use crate::{Bench, Eeprom, Machine, MachineAxis, MachineIo};

/// What a bench file says.
#[derive(Clone, Debug)]
pub struct BenchFile {
    /// The module.
    pub module: &'static Module,
    /// The machine as it is when the module is switched on.
    pub machine: Machine,
    /// What changes later, with its virtual time in microseconds.
    pub events: Vec<(u64, Change)>,
}

/// Why a bench file cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum BenchFileError {
    #[error("cannot read {}", file.display())]
    Read { file: PathBuf, source: io::Error },
    #[error("{}:{problem}", file.display())]
    Wrong { file: PathBuf, problem: Problem },
}

impl BenchFile {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read or something is wrong with it.
    pub fn read(file: &Path) -> Result<Self, BenchFileError> {
        let text = fs::read_to_string(file).map_err(|source| BenchFileError::Read { file: file.into(), source })?;
        Self::parse(&text).map_err(|problem| BenchFileError::Wrong { file: file.into(), problem })
    }

    /// Understands the text of a bench file.
    ///
    /// # Errors
    /// What is wrong with it first.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let document = toml::from_str(text).map_err(|error| Misfit::new(error.span(), error.message()));
        document.and_then(Document::build).map_err(|misfit| misfit.locate(text))
    }

    /// Builds the bench and switches the module on.
    pub fn build(self, eeprom: Eeprom) -> Bench {
        let mut bench = Bench::new(self.module, self.machine, eeprom);
        for (at_us, change) in self.events {
            bench.schedule(at_us, change);
        }
        bench
    }
}

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(deserialize_with = "virtual_module")]
    module: &'static Module,
    #[serde(default)]
    axis: BTreeMap<Spanned<String>, AxisTable>,
    #[serde(default)]
    io: IoTable,
    #[serde(default)]
    event: Vec<EventTable>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with the keys of an axis")]
struct AxisTable {
    #[serde(deserialize_with = "full_steps")]
    full_steps: u32,
    #[serde(deserialize_with = "travel_per_turn")]
    travel_per_turn: f64,
    #[serde(deserialize_with = "place")]
    start: f64,
    travel: TravelTable,
    encoder: Option<EncoderTable>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields, expecting = "a table with left, right and home")]
struct TravelTable {
    left: Option<EndTable>,
    right: Option<EndTable>,
    home: Option<HomeTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { at = 0.0 }")]
struct EndTable {
    #[serde(deserialize_with = "place")]
    at: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { at = 60.0, width = 2.0 }")]
struct HomeTable {
    #[serde(deserialize_with = "place")]
    at: f64,
    #[serde(deserialize_with = "width")]
    width: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { counts_per_turn = 4096 }")]
struct EncoderTable {
    #[serde(deserialize_with = "counts")]
    counts_per_turn: u32,
    /// Without one there is no null channel.
    index: Option<u32>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with enable, inputs and analog")]
struct IoTable {
    enable: bool,
    inputs: BTreeMap<Spanned<String>, bool>,
    analog: BTreeMap<Spanned<String>, AdcValue>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(transparent)]
struct AdcValue(#[serde(deserialize_with = "adc_value")] i32);

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with at and do")]
struct EventTable {
    #[serde(deserialize_with = "microseconds")]
    at: u64,
    #[serde(rename = "do")]
    line: Spanned<String>,
}

impl Default for AxisTable {
    fn default() -> Self {
        Self { full_steps: 200, travel_per_turn: 1.0, start: 0.0, travel: TravelTable::default(), encoder: None }
    }
}

impl Default for IoTable {
    fn default() -> Self {
        Self { enable: true, inputs: BTreeMap::new(), analog: BTreeMap::new() }
    }
}

// From the text to the machine.

impl Document {
    fn build(self) -> Result<BenchFile, Misfit> {
        let count = self.module.axes;
        let mut axes = vec![AxisTable::default().build(); count.into()];
        for (number, table) in self.axis {
            let index = choose(&number, 0..count, "an axis")?;
            axes[usize::from(index)] = table.build();
        }
        let events = self.event.iter().map(|event| event.build(self.module)).collect::<Result<_, _>>()?;
        Ok(BenchFile { module: self.module, machine: Machine { axes, io: self.io.build()? }, events })
    }
}

impl AxisTable {
    fn build(&self) -> MachineAxis {
        let mut plant = StepperAxis::rigid(self.full_steps);
        let microsteps = |length: f64| plant.microsteps(length / self.travel_per_turn);
        let start = microsteps(self.start);
        let home =
            |home: &HomeTable| Home { middle: microsteps(home.at), width: microsteps(home.width).unsigned_abs() };
        plant.travel = Travel {
            left: self.travel.left.as_ref().map(|end| microsteps(end.at)),
            right: self.travel.right.as_ref().map(|end| microsteps(end.at)),
            home: self.travel.home.as_ref().map(home),
            ..Travel::default()
        };
        plant.encoder = self.encoder.as_ref().map(EncoderTable::build);
        plant.place(start);
        MachineAxis { plant }
    }
}

impl EncoderTable {
    fn build(&self) -> Encoder {
        Encoder { counts_per_turn: self.counts_per_turn, index: self.index, ..Encoder::default() }
    }
}

impl IoTable {
    fn build(self) -> Result<MachineIo, Misfit> {
        let mut io = MachineIo::default();
        io.set_enable(self.enable);
        for (port, level) in self.inputs {
            io.set_input(choose(&port, 0..8, "an input")?, level);
        }
        for (port, AdcValue(value)) in self.analog {
            io.set_analog(choose(&port, MachineIo::ANALOG_PINS.into_iter(), "an analogue input")?, value);
        }
        Ok(io)
    }
}

impl EventTable {
    fn build(&self, module: &Module) -> Result<(u64, Change), Misfit> {
        let misfit = |error| {
            let message = format!("expected a line of the console that changes the machine; {error}");
            Misfit::new(Some(self.line.span()), message)
        };
        let change = Change::parse(self.line.as_ref(), module).map_err(misfit)?;
        Ok((self.at, change))
    }
}

/// A key that is one of these numbers.
fn choose(key: &Spanned<String>, mut numbers: impl Iterator<Item = u8> + Clone, what: &str) -> Result<u8, Misfit> {
    let all = numbers.clone().map(|number| number.to_string()).collect::<Vec<_>>().join(", ");
    let chosen = numbers.find(|number| number.to_string() == *key.as_ref());
    chosen.ok_or_else(|| Misfit::new(Some(key.span()), format!("expected {what}: {all}")))
}

#[cfg(test)]
mod tests {
    use gradus_firmware::Io;
    use gradus_plant::Switch;
    use gradus_tmcl::catalogue::{Ap, TMCM_3351};

    use super::*;

    fn parsed(text: &str) -> BenchFile {
        BenchFile::parse(text).unwrap_or_else(|problem| panic!("{problem}"))
    }

    fn axis(text: &str) -> StepperAxis {
        parsed(&format!("module = \"tmcm-3351\"\n{text}")).machine.axes[0].plant.clone()
    }

    #[test]
    fn example_of_the_module_text_is_a_bench_file() {
        let lines = include_str!("bench_file.rs").lines().map_while(|line| line.strip_prefix("//!"));
        let example = lines.skip_while(|line| *line != " ```toml").skip(1).take_while(|line| *line != " ```");
        let file = parsed(&example.collect::<Vec<_>>().join("\n"));
        assert_eq!((file.machine.axes[0].plant.position(), file.events.len()), (430_080, 1));
    }

    #[test]
    fn what_is_not_named_does_not_exist() {
        let file = parsed("module = \"TMCM-3351\"");
        assert_eq!((file.module.name, file.events.len(), file.machine.axes.len()), ("TMCM-3351", 0, 3));
        let mut bare = StepperAxis::rigid(200);
        bare.encoder = None;
        assert!(file.machine.axes.iter().all(|axis| axis.plant == bare));
        assert_eq!(file.machine.io, MachineIo::default());
    }

    #[test]
    fn lengths_are_in_the_unit_of_the_axis() {
        let cases = [
            ("", 51_200, 102_400, -51_200),
            ("full_steps = 400", 102_400, 204_800, -102_400),
            ("travel_per_turn = 5", 10_240, 20_480, -10_240),
            ("travel_per_turn = 0.9\nfull_steps = 200", 56_889, 113_778, -56_889),
        ];
        for (keys, home, right, left) in cases {
            let switches =
                "start = 2\ntravel = { left = { at = -1 }, right = { at = 2.0 }, home = { at = 1, width = 2 } }";
            let axis = axis(&format!("[axis.0]\n{keys}\n{switches}"));
            let Travel { left: left_end, right: right_end, home: Some(vane), .. } = axis.travel else {
                panic!("{keys}")
            };
            assert_eq!((left_end, right_end), (Some(left), Some(right)), "{keys}");
            assert_eq!((vane, axis.position()), (Home { middle: home, width: right as u64 }, right), "{keys}");
        }
    }

    #[test]
    fn carriage_may_stand_on_a_switch() {
        let axis = axis("[axis.0]\nstart = -0.1\ntravel.left.at = 0\ntravel.home = { at = 0, width = 0.1 }");
        assert_eq!(Switch::ALL.map(|switch| axis.switch(switch)), [true, false, false]);
    }

    #[test]
    fn encoder_counts_what_the_file_says() {
        let mut axis = axis("[axis.0]\nencoder = { counts_per_turn = 10_000 }");
        axis.place(25_600);
        assert_eq!(axis.encoder_count(), 5000);
    }

    #[test]
    fn encoder_has_a_null_channel_if_the_file_names_its_count() {
        let index = |text: &str| axis(text).encoder.and_then(|encoder| encoder.index);
        assert_eq!(index("[axis.0]\nencoder = { counts_per_turn = 4096, index = 7 }"), Some(7));
        assert_eq!(index("[axis.0]\nencoder = { counts_per_turn = 4096 }"), None);
    }

    #[test]
    fn inputs_have_their_levels_when_the_module_starts() {
        let file =
            parsed("module = \"tmcm-3351\"\n[io]\nenable = false\ninputs = { 3 = true, 4 = false }\nanalog.0 = 512");
        let mut io = file.machine.io;
        assert_eq!((io.enable(), io.inputs(), io.analog(0)), (false, 1 << 3, 512));
    }

    #[test]
    fn events_happen_at_their_time() {
        let text = "module = \"tmcm-3351\"\n\
            [[event]]\nat = 2.5\ndo = \"switch 0 home 0\"\n[[event]]\nat = 1\ndo = \"switch 0 home 1\"";
        let mut bench = parsed(text).build(Eeprom::of(&TMCM_3351));
        let levels = [999_999, 1_000_000, 2_499_999, 2_500_000].map(|time_us| {
            bench.run_until(time_us);
            bench.axis_parameter(0, Ap::HomeSwitch)
        });
        assert_eq!(levels, [Some(0), Some(1), Some(1), Some(0)]);
    }

    #[test]
    fn problems_name_line_and_key_and_say_what_is_expected() {
        let cases = [
            ("module = 3351", "1: module: invalid type: integer `3351`, expected a string"),
            ("module = 'tmcm-351'", "1: module: expected a module that runs, tmcm-3351, not `tmcm-351`"),
            ("axes = 3", "2: axes: unknown field `axes`, expected one of `module`, `axis`, `io`, `event`"),
            ("\n[axis.3]", "3: axis.3: expected an axis: 0, 1, 2"),
            ("[axis.00]", "2: axis.00: expected an axis: 0, 1, 2"),
            (
                "[axis.0]\nfull_step = 200",
                "3: axis.0.full_step: unknown field `full_step`, expected one of `full_steps`, `travel_per_turn`, `start`, \
                 `travel`, `encoder`",
            ),
            (
                "[axis.1]\nfull_steps = 0",
                "3: axis.1.full_steps: invalid value: integer `0`, expected a whole number from 1 to 10000",
            ),
            (
                "[axis.1]\nfull_steps = 1.5",
                "3: axis.1.full_steps: invalid value: floating point `1.5`, expected a whole number from 1 to 10000",
            ),
            (
                "[axis.0]\ntravel_per_turn = 0",
                "3: axis.0.travel_per_turn: invalid value: integer `0`, expected a length from 0.001 to 1000000",
            ),
            (
                "[axis.0]\nstart = 'left'",
                "3: axis.0.start: invalid type: string \"left\", expected a length from -1000000 to 1000000",
            ),
            (
                "[axis.0]\nstart = nan",
                "3: axis.0.start: invalid value: floating point `NaN`, expected a length from -1000000 to 1000000",
            ),
            (
                "[axis.0.travel]\nhome = 5",
                "3: axis.0.travel.home: invalid type: integer `5`, expected a table such as { at = 60.0, width = 2.0 }",
            ),
            ("[axis.0.travel]\nhome = { at = 5 }", "3: axis.0.travel.home: missing field `width`"),
            ("[axis.0]\n[axis.1]\n[axis.0.travel.home]\nat = 5", "4: axis.0.travel.home: missing field `width`"),
            (
                "[axis.0.travel.home]\nat = 5\nwidth = -1",
                "4: axis.0.travel.home.width: invalid value: integer `-1`, expected a length from 0 to 1000000",
            ),
            (
                "[axis.0]\nencoder = true",
                "3: axis.0.encoder: invalid type: boolean `true`, expected a table such as { counts_per_turn = 4096 }",
            ),
            ("[io]\ninputs = { 3 = 1 }", "3: io.inputs.3: invalid type: integer `1`, expected a boolean"),
            ("[io]\ninputs = { 8 = true }", "3: io.inputs.8: expected an input: 0, 1, 2, 3, 4, 5, 6, 7"),
            ("[io]\nanalog.4 = 1", "3: io.analog.4: expected an analogue input: 0, 1, 2, 3, 6, 7"),
            (
                "[io]\nanalog.0 = 1024",
                "3: io.analog.0: invalid value: integer `1024`, expected a whole number from 0 to 1023",
            ),
            (
                "[[event]]\nat = 1\ndo = 'in 1 1'\n[[event]]\nat = -1\ndo = 'in 1 1'",
                "6: event.at: invalid value: integer `-1`, expected seconds from 0 to 1000000000",
            ),
            ("[[event]]\nat = 1\ndo = 'in 1 1'\n[[event]]\nat = 1", "5: event: missing field `do`"),
            (
                "[[event]]\nat = 1\ndo = 'show'",
                "4: event.do: expected a line of the console that changes the machine; `show` changes nothing",
            ),
            (
                "[[event]]\nat = 1\ndo = 'switch 3 home 1'",
                "4: event.do: expected a line of the console that changes the machine; `3` is no AXIS; usage: switch AXIS \
                 left|right|home 0|1|auto",
            ),
            ("[axis.0]\nstart = 1\nstart = 2", "4: duplicate key"),
            ("[axis.0", "2: unclosed table, expected `]`"),
        ];
        for (text, message) in cases {
            let whole = if text.starts_with("module") { text.into() } else { format!("module = 'tmcm-3351'\n{text}") };
            assert_eq!(BenchFile::parse(&whole).unwrap_err().to_string(), message, "{text}");
        }
        assert_eq!(BenchFile::parse("").unwrap_err().to_string(), "1: missing field `module`");
    }

    #[test]
    fn text_of_any_kind_gets_a_problem_within_it() {
        let text = include_str!("../../../examples/benches/rotary-table.toml");
        for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
            if let Err(problem) = BenchFile::parse(&text[..end]) {
                assert!((1..=text[..end].lines().count().max(1) + 1).contains(&problem.line), "{end}: {problem}");
            }
        }
    }
}
