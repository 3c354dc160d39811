//! The console of a rig: lines for its modules and its buses.
//!
//! `x-axis: switch 0 left 1` is a line of the [`console`] for the module of that name, `segment: cut 1` one for a
//! bus. The name may be left out where there is only one module, or one bus.

use crate::console::{self, ConsoleError};
use crate::{BusChange, Profile, Rig};

/// What a line that changes a bus looks like.
const USAGE: &[(&str, &str)] = &[
    ("cut 0|1", "cable of a bus: 1 breaks it"),
    ("babble 0|1", "a node that talks all the time on a bus"),
    ("faults PROFILE|off", "faults of a bus from now on"),
    ("rate 115200", "bits a second of the hosts of a bus; the modules stay as they are"),
];

/// A line that a rig cannot use. Nothing has been changed.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages say it
pub enum RigConsoleError {
    #[error(transparent)]
    Module(#[from] ConsoleError),
    #[error("usage: {0}")]
    Bus(String),
    #[error(transparent)]
    Profile(#[from] crate::ProfileError),
    #[error("there is no module or bus `{name}`; there are {known}")]
    Name { name: String, known: String },
    #[error("say which, as in `{known}: {line}`")]
    Which { known: String, line: String },
}

/// Executes a line and gives back what there is to say, which may be nothing.
///
/// # Errors
/// When the line is no command; nothing has been changed then.
pub fn execute(line: &str, rig: &mut Rig) -> Result<String, RigConsoleError> {
    let (name, line) = line.split_once(':').map_or((None, line), |(name, line)| (Some(name.trim()), line));
    if line.trim() == "help" {
        return Ok(help(rig));
    }
    match BusChange::parse(line) {
        Ok(Some(change)) => {
            let bus = one_of(name, rig.bus_names(), line)?;
            rig.change(bus, change);
            Ok(String::new())
        }
        Ok(None) if line.trim().is_empty() => Ok(String::new()),
        Ok(None) => {
            let module = one_of(name, rig.module_names().iter().map(String::as_str), line)?;
            Ok(rig.with_bench(module, |bench| console::execute(line, bench))?)
        }
        Err(error) => Err(error),
    }
}

/// The number of what is named, or of the only one.
fn one_of<'a>(
    name: Option<&str>,
    names: impl Iterator<Item = &'a str> + Clone,
    line: &str,
) -> Result<usize, RigConsoleError> {
    let known = || names.clone().collect::<Vec<_>>().join(", ");
    match name {
        Some(name) => names
            .clone()
            .position(|known| known == name)
            .ok_or_else(|| RigConsoleError::Name { name: name.into(), known: known() }),
        None if names.clone().count() == 1 => Ok(0),
        None => Err(RigConsoleError::Which {
            known: names.clone().next().unwrap_or_default().into(),
            line: line.trim().into(),
        }),
    }
}

fn help(rig: &mut Rig) -> String {
    let mut text = rig.benches().first_mut().and_then(|bench| console::execute("help", bench).ok()).unwrap_or_default();
    for (usage, help) in USAGE {
        text += &format!("{usage:<44} {help}\n");
    }
    text
}

impl BusChange {
    /// Understands a line that changes a bus; `None` if it is about something else.
    ///
    /// # Errors
    /// When it is about a bus, but wrong.
    pub fn parse(line: &str) -> Result<Option<Self>, RigConsoleError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(usage) =
            words.first().and_then(|word| USAGE.iter().find(|(usage, _)| usage.split(' ').next() == Some(*word)))
        else {
            return Ok(None);
        };
        Ok(Some(match words.as_slice() {
            ["cut", level @ ("0" | "1")] => Self::Cut(*level == "1"),
            ["babble", level @ ("0" | "1")] => Self::Babble(*level == "1"),
            ["faults", "off"] => Self::Faults(Profile::default(), 0),
            ["faults", name] => Self::Faults(name.parse()?, 0),
            ["rate", rate] if rate.parse().is_ok_and(|rate: u32| rate > 0) => Self::Rate(rate.parse().unwrap_or(1)),
            _ => return Err(RigConsoleError::Bus(usage.0.to_owned())),
        }))
    }
}

#[cfg(test)]
mod tests {
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;
    use crate::{Bench, BusKind, Serial};

    fn rig() -> Rig {
        let mut rig = Rig::default();
        for name in ["left", "right"] {
            let module = rig.add_module(name, Bench::with_defaults(&TMCM_3351));
            let bus = rig.add_bus(&format!("usb-{name}"), BusKind::Serial(Serial::USB));
            rig.connect(module, bus);
        }
        rig
    }

    #[test]
    fn line_is_for_the_module_or_bus_that_it_names() {
        let mut rig = rig();
        assert_eq!(execute("right: in 3 1", &mut rig).as_deref(), Ok(""));
        assert_eq!(execute("usb-left: cut 1", &mut rig).as_deref(), Ok(""));
        let inputs: Vec<u8> = rig.benches().iter_mut().map(|bench| bench.machine().io.levels()).collect();
        assert_eq!(inputs, [0, 1 << 3]);
    }

    #[test]
    fn the_only_module_and_bus_need_no_name() {
        let mut rig = Rig::from(Bench::with_defaults(&TMCM_3351));
        for line in ["in 3 1", "faults noisy-line", "faults off", "", "module: enable 0", "usb: babble 0"] {
            assert_eq!(execute(line, &mut rig).as_deref(), Ok(""), "{line}");
        }
        assert!(execute("help", &mut rig).unwrap().contains("faults PROFILE|off"));
    }

    #[test]
    fn wrong_lines_are_told_what_is_right() {
        let cases = [
            ("in 3 1", "say which, as in `left: in 3 1`"),
            ("up: in 3 1", "there is no module or bus `up`; there are left, right"),
            ("left: cut 1", "there is no module or bus `left`; there are usb-left, usb-right"),
            ("usb-left: cut", "usage: cut 0|1"),
            ("left: on", "there is no command `on`; `help` lists them"),
            ("faults none", "there is no profile `none`, only noisy-line, bad-usb-cable, late-replies"),
        ];
        for (line, message) in cases {
            assert_eq!(execute(line, &mut rig()).unwrap_err().to_string(), message, "{line}");
        }
    }
}
