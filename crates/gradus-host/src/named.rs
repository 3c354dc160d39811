//! A parameter of a module, whichever table it stands in.

use std::fmt;

use gradus_tmcl::catalogue::{Access, AxisParameter, Choice, GlobalParameter, Unit, Values};
use gradus_tmcl::{Instruction, Opcode};

use crate::name::normalise;

/// A parameter with the commands that read and write it; [`find`](crate::find) gives one for a name or number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Named {
    /// One of each axis.
    Axis(&'static AxisParameter),
    /// One of the module.
    Global {
        /// Its row, which may describe a run of parameters.
        row: &'static GlobalParameter,
        /// Its number in the bank.
        number: u8,
    },
}

impl Named {
    /// Its name, normalised: `actual_position`, `user_variable_3`.
    pub fn name(&self) -> String {
        match self {
            Self::Axis(row) => normalise(row.name),
            Self::Global { row, .. } if row.first == row.last => normalise(row.name),
            Self::Global { row, number } => format!("{}_{number}", normalise(row.name)),
        }
    }

    /// Number in its table or bank.
    pub fn number(&self) -> u8 {
        match self {
            Self::Axis(row) => row.number,
            Self::Global { number, .. } => *number,
        }
    }

    /// Unit of its value.
    pub fn unit(&self) -> Unit {
        match self {
            Self::Axis(row) => row.unit,
            Self::Global { .. } => Unit::Plain,
        }
    }

    /// Who may do what with it.
    pub fn access(&self) -> Access {
        match self {
            Self::Axis(row) => row.access,
            Self::Global { row, .. } => row.access,
        }
    }

    /// Its value after a restore of factory settings; `None` for values of run time.
    pub fn default(&self) -> Option<i64> {
        match self {
            Self::Axis(row) => row.default,
            Self::Global { row, .. } => row.default,
        }
    }

    /// True if it may be written with what a datagram carries.
    pub fn accepts(&self, value: i32) -> bool {
        match self {
            Self::Axis(row) => row.accepts(value),
            Self::Global { row, .. } => row.accepts(value),
        }
    }

    /// What its values mean.
    pub fn values(&self) -> Values {
        match self {
            Self::Axis(row) => row.values,
            Self::Global { row, .. } => row.values,
        }
    }

    /// Its smallest and its largest value.
    pub fn limits(&self) -> (i64, i64) {
        match self {
            Self::Axis(row) => (row.min, row.max),
            Self::Global { row, .. } => (row.min, row.max),
        }
    }

    /// What it takes, in words: `0 to 255`, `0 (off), 1 (on)`.
    pub fn range(&self) -> String {
        let (min, max) = self.limits();
        match self.values() {
            Values::Only(list) => list.iter().map(choice).collect::<Vec<_>>().join(", "),
            _ => format!("{min} to {max} {}", self.unit().text()).trim_end().into(),
        }
    }

    /// What a value means, where the catalogue knows it: `do not start`, the names of the bits that are set.
    pub fn meaning(&self, value: i64) -> Option<String> {
        let choices = self.values().choices();
        if let Values::Bits(_) = self.values() {
            let set = choices.iter().filter(|bit| (bit.first..=bit.last).any(|bit| value >> bit & 1 == 1));
            let texts: Vec<&str> = set.map(|bit| bit.text).collect();
            return (!texts.is_empty()).then(|| texts.join(", "));
        }
        choices.iter().find(|choice| (choice.first..=choice.last).contains(&value)).map(|choice| choice.text.into())
    }

    /// Its name with its axis: `actual_position of axis 0`, `serial_address`.
    pub fn of(&self, axis: u8) -> String {
        match self {
            Self::Axis(_) => format!("{} of axis {axis}", self.name()),
            Self::Global { .. } => self.name(),
        }
    }

    /// With a value, its unit and meaning: `ramp_type of axis 0 = 1 (s-shaped)`.
    pub fn shown(&self, axis: u8, value: i64) -> String {
        let meaning = self.meaning(value).map(|text| format!("({text})")).unwrap_or_default();
        let words = [&self.of(axis), "=", &value.to_string(), self.unit().text(), &meaning];
        words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// The number that a datagram carries for `value`. Parameters whose range passes 2^31 are unsigned; outside of 32 bits: `None`.
    pub fn encode(&self, value: i64) -> Option<i32> {
        i32::try_from(value)
            .ok()
            .or_else(|| u32::try_from(value).ok().filter(|_| self.unsigned()).map(|value| value as i32))
    }

    /// The value that a datagram's number stands for.
    pub fn decode(&self, value: i32) -> i64 {
        if self.unsigned() { i64::from(value as u32) } else { i64::from(value) }
    }

    fn unsigned(&self) -> bool {
        let max = match self {
            Self::Axis(row) => row.max,
            Self::Global { row, .. } => row.max,
        };
        max > i64::from(i32::MAX)
    }

    /// The command that reads it; `axis` matters only to an axis parameter.
    pub fn read(&self, axis: u8) -> Instruction {
        match self {
            Self::Axis(row) => Instruction::new(Opcode::GAP, row.number, axis, 0),
            Self::Global { row, number } => Instruction::new(Opcode::GGP, *number, row.bank, 0),
        }
    }

    /// The command that writes it; `axis` matters only to an axis parameter.
    pub fn write(&self, axis: u8, value: i32) -> Instruction {
        match self {
            Self::Axis(row) => Instruction::new(Opcode::SAP, row.number, axis, value),
            Self::Global { row, number } => Instruction::new(Opcode::SGP, *number, row.bank, value),
        }
    }
}

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Axis(row) => write!(f, "{} (axis parameter {})", self.name(), row.number),
            Self::Global { row, number } => write!(f, "{} (global parameter {number}, bank {})", self.name(), row.bank),
        }
    }
}

fn choice(choice: &Choice) -> String {
    if choice.first == choice.last {
        format!("{} ({})", choice.first, choice.text)
    } else {
        format!("{} to {} ({})", choice.first, choice.last, choice.text)
    }
}

#[cfg(test)]
mod tests {
    use crate::find;
    use gradus_tmcl::catalogue::TMCM_3351;

    #[test]
    fn unsigned_parameters_reach_past_the_signed_range() {
        let period = find(&TMCM_3351, "timer_0_period").unwrap();
        assert_eq!(period.encode(4_294_967_295), Some(-1));
        assert_eq!(period.decode(-1), 4_294_967_295);
        let speed = find(&TMCM_3351, "target_speed").unwrap();
        assert_eq!(speed.encode(4_294_967_295), None);
        assert_eq!(speed.decode(-1), -1);
    }

    #[test]
    fn listed_values_have_meanings_and_quantities_have_none() {
        let mode = find(&TMCM_3351, "auto_start_mode").unwrap();
        assert_eq!(mode.meaning(1).as_deref(), Some(mode.values().choices()[1].text));
        assert_eq!(mode.meaning(7), None);
        assert_eq!(find(&TMCM_3351, "actual_position").unwrap().meaning(5), None);
    }
}
