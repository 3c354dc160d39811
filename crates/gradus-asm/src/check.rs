//! Whether a module has what a command names.
//!
//! What a module certainly refuses is an error. Writing what can only be read, and storing what has no place in the EEPROM,
//! is a warning: programs in the maker's own manuals do it (TMCM-1617 manual 6.2), and a running program skips such a command.

use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{
    Access, Ap, Choice, Command as Row, Direction, Gp, MODULES, Mode, Module, OperandKind, Values,
};

use crate::builtin::list;
use crate::code::Code;
use crate::encoder::{Encoded, Given};
use crate::problem::{Problem, Span};

/// The type of MVP that takes the number of a coordinate.
const COORD: u8 = 2;
/// The type of WAIT that looks at no axis.
const TICKS: u8 = 0;
/// In place of an axis: the EEPROM.
const EEPROM: i64 = 255;
/// Bits of a motor field that make it a mask of axes.
const MASK: i64 = 0xc0;

/// Looks at a command of a program that is `length` commands long.
pub(crate) fn check(encoded: &Encoded, module: &Module, length: usize) -> Vec<Problem> {
    let Some(row) = encoded.row else { return Vec::new() };
    if module.mode(row.opcode) == Mode::None {
        return vec![not_available(row, encoded.span, module)];
    }
    let check = Check { encoded, row, module, length };
    let mut problems: Vec<_> = encoded.operands.iter().filter_map(|given| check.operand(given).err()).collect();
    if problems.is_empty() {
        problems.extend(check.value().err());
    }
    problems
}

fn not_available(row: &Row, span: Span, module: &Module) -> Problem {
    let others = MODULES.iter().filter(|other| other.mode(row.opcode) != Mode::None).map(|other| other.name);
    let message = format!("the {} has no command `{}`", module.name, row.mnemonic);
    Problem::error(Code::CommandNotAvailable, span, message)
        .maybe_help(list(others).map(|others| format!("it is a command of the {others}")))
}

struct Check<'a> {
    encoded: &'a Encoded,
    row: &'static Row,
    module: &'a Module,
    length: usize,
}

impl Check<'_> {
    /// Looks at one operand.
    fn operand(&self, given: &Given) -> Result<(), Problem> {
        let Given { operand, value, span } = *given;
        match operand.kind {
            OperandKind::Axis if self.row.opcode == Opcode::WAIT && self.encoded.instruction.kind == TICKS => Ok(()),
            OperandKind::AxisOrEeprom if value == EEPROM => Ok(()),
            OperandKind::AxisOrMask if self.coordinated() && value & MASK != 0 => self.mask(value, span),
            OperandKind::Axis | OperandKind::AxisOrMask | OperandKind::AxisOrEeprom => self.axis(value, span),
            OperandKind::AxisParameter => self.axis_parameter(value, span),
            OperandKind::GlobalParameter => self.global_parameter(value, span),
            OperandKind::Port => self.port(value, span),
            OperandKind::Coordinate => self.coordinate(value, span),
            OperandKind::Interrupt => self.interrupt(value, span),
            OperandKind::Variable => self.range("user variable", value, (0, 255), span),
            OperandKind::Address => self.address(value, span),
            OperandKind::Ticks => self.range("time", value, (-1, i32::MAX.into()), span),
            OperandKind::Keyword(_) => self.keyword(given),
            OperandKind::ParameterBank | OperandKind::PortBank | OperandKind::Number | OperandKind::Zero => Ok(()),
        }
    }

    fn coordinated(&self) -> bool {
        matches!(self.row.opcode, Opcode::MVP | Opcode::MVPA) && self.encoded.instruction.kind == COORD
    }

    fn axis(&self, axis: i64, span: Span) -> Result<(), Problem> {
        let last = i64::from(self.module.axes) - 1;
        if axis <= last {
            return Ok(());
        }
        let help = if last == 0 { "its only axis is 0".into() } else { format!("its axes are 0...{last}") };
        Err(self.missing(format!("axis {axis}"), span).help(help))
    }

    fn mask(&self, mask: i64, span: Span) -> Result<(), Problem> {
        let axes = !MASK & mask;
        self.axis(i64::from(63 - axes.leading_zeros().min(63)), span)
    }

    fn axis_parameter(&self, number: i64, span: Span) -> Result<(), Problem> {
        if self.module.is_any() {
            return Ok(());
        }
        let Some(row) = self.module.axis_parameter(number as u8) else {
            return Err(self.missing(format!("axis parameter {number}"), span));
        };
        self.access(row.access, row.name, span)
    }

    fn global_parameter(&self, number: i64, span: Span) -> Result<(), Problem> {
        if self.module.is_any() {
            return Ok(());
        }
        let bank = self.encoded.instruction.motor;
        if !self.module.global_parameters.iter().any(|row| row.bank == bank) {
            return Err(self.missing(format!("bank {bank} of global parameters"), self.second(span)));
        }
        let Some(row) = self.module.global_parameter(bank, number as u8) else {
            return Err(self.missing(format!("global parameter {number} in bank {bank}"), span));
        };
        self.access(row.access, row.name, span)
    }

    /// Whether the command may do with a parameter what it does.
    fn access(&self, access: Access, name: &str, span: Span) -> Result<(), Problem> {
        let stores = matches!(self.row.opcode, Opcode::STAP | Opcode::RSAP | Opcode::STGP | Opcode::RSGP);
        let writes = matches!(
            self.row.opcode,
            Opcode::SAP | Opcode::SAPX | Opcode::AAP | Opcode::AAPX | Opcode::SGP | Opcode::AGP
        );
        if writes && !access.writable() {
            let message = format!("{name} can only be read");
            return Err(Problem::warning(Code::ReadOnly, span, message).help("the module will refuse this command"));
        }
        if stores && matches!(access, Access::R | Access::Rw) {
            let message = format!("{name} has no place in the EEPROM");
            return Err(Problem::warning(Code::NotStored, span, message).help("the module will refuse this command"));
        }
        Ok(())
    }

    fn port(&self, number: i64, span: Span) -> Result<(), Problem> {
        if self.module.is_any() {
            return Ok(());
        }
        let bank = self.encoded.instruction.motor;
        if !self.module.ports.iter().any(|port| port.bank == bank) {
            return Err(self.missing(format!("bank {bank} of ports"), self.second(span)));
        }
        let Some(port) = self.module.port(bank, number as u8) else {
            return Err(self.missing(format!("port {number} in bank {bank}"), span));
        };
        if self.row.opcode == Opcode::SIO && !self.outputs().any(|range| range.is_some()) {
            let message = format!("port {number} in bank {bank} ({}) is an input", port.name);
            return Err(Problem::warning(Code::ReadOnly, span, message).help("the module will refuse this command"));
        }
        Ok(())
    }

    /// Ranges of the outputs that the command names.
    fn outputs(&self) -> impl Iterator<Item = Option<(i32, i32)>> {
        let instruction = &self.encoded.instruction;
        let ports = self.module.ports.iter().filter(|port| port.direction == Direction::Out);
        ports.filter(|port| (port.bank, port.number) == (instruction.motor, instruction.kind)).map(|port| port.range)
    }

    fn coordinate(&self, number: i64, span: Span) -> Result<(), Problem> {
        let last = if self.module.is_any() { 255 } else { i64::from(self.module.coordinates) - 1 };
        self.range("coordinate", number, (0, last), span)
    }

    fn interrupt(&self, number: i64, span: Span) -> Result<(), Problem> {
        let known = self.module.interrupts.iter().any(|row| i64::from(row.number) == number);
        if known || self.module.is_any() { Ok(()) } else { Err(self.missing(format!("interrupt {number}"), span)) }
    }

    /// A program may jump into another one that lies behind it in memory.
    fn address(&self, address: i64, span: Span) -> Result<(), Problem> {
        let memory = self.module.memory() as i64;
        if !(0..memory).contains(&address) {
            let message = format!("there is no address {address} in program memory");
            return Err(Problem::error(Code::JumpTarget, span, message).help(format!("it has 0...{}", memory - 1)));
        }
        if address >= self.length as i64 {
            let message = format!("address {address} is behind the end of this program");
            let help = format!("its last address is {}", self.length.saturating_sub(1));
            return Err(Problem::warning(Code::JumpTarget, span, message).help(help));
        }
        Ok(())
    }

    fn keyword(&self, given: &Given) -> Result<(), Problem> {
        // All modules accept all conditions, also those that their manuals leave out (ERRATA 3: JC ESD).
        let condition = matches!(self.row.opcode, Opcode::JC | Opcode::CALL);
        let words = given.operand.kind.keywords().iter();
        let known = |number: u8| words.clone().any(|word| i64::from(word.number) == i64::from(number));
        let number = given.value as u8;
        if given.operand.keyword_of(number, self.module).is_some() || condition && known(number) {
            return Ok(());
        }
        let word = words.clone().find(|word| word.number == number).map_or(number.to_string(), |word| word.text.into());
        let message =
            format!("`{}` of the {} has no {} {word}", self.row.mnemonic, self.module.name, given.operand.name);
        let has = words.filter(|word| word.is_on(self.module)).map(|word| word.text);
        let help = list(has).map(|has| format!("it has {has}"));
        Err(Problem::error(Code::KeywordNotAvailable, given.span, message).maybe_help(help))
    }

    /// Looks at the value, which depends on the other operands; they are right.
    fn value(&self) -> Result<(), Problem> {
        let Some(Given { value, span, .. }) = self.encoded.operands.last().copied() else { return Ok(()) };
        if let Some((name, range, values)) = self.setting() {
            return self.range(name, value, range, span).and_then(|()| listed(name, value, values, span));
        }
        match self.row.opcode {
            Opcode::ROR | Opcode::ROL => {
                let row = self.module.axis_parameters.iter().find(|row| row.id == Ap::TargetSpeed);
                row.map_or(Ok(()), |row| self.range("velocity", value, (row.min, row.max), span))
            }
            Opcode::MVP if self.coordinated() => self.coordinate(value, span),
            Opcode::MVP | Opcode::SCO => self.range("position", value, (i32::MIN.into(), i32::MAX.into()), span),
            Opcode::SIO => match self.outputs().flatten().next() {
                Some((min, max)) => self.range("output", value, (min.into(), max.into()), span),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// Name, range and list of the parameter that the command sets.
    fn setting(&self) -> Option<(&'static str, (i64, i64), Values)> {
        let instruction = &self.encoded.instruction;
        match self.row.opcode {
            Opcode::SAP | Opcode::SAPX => {
                let row = self.module.axis_parameter(instruction.kind)?;
                Some((row.name, (row.min, row.max), row.values))
            }
            Opcode::SGP => {
                let row = self.module.global_parameter(instruction.motor, instruction.kind)?;
                // The range of the lock is that of what is read; it is written with two keys (BEHAVIOUR 6).
                (row.id != Gp::EepromLock).then_some((row.name, (row.min, row.max), row.values))
            }
            _ => None,
        }
    }

    fn range(&self, name: &str, value: i64, (min, max): (i64, i64), span: Span) -> Result<(), Problem> {
        if (min..=max).contains(&value) {
            return Ok(());
        }
        let message = format!("{name} cannot be {value}");
        Err(Problem::error(Code::OutOfRange, span, message).help(format!("it can be {min}...{max}")))
    }

    /// The place of the second operand.
    fn second(&self, first: Span) -> Span {
        self.encoded.operands.get(1).map_or(first, |given| given.span)
    }

    fn missing(&self, what: String, span: Span) -> Problem {
        Problem::error(Code::NotOnModule, span, format!("the {} has no {what}", self.module.name))
    }
}

/// The numbers of a list, three and more in a row as `1-8`.
fn numbers(list: &[Choice]) -> String {
    let mut spans: Vec<(i64, i64)> = Vec::new();
    for choice in list {
        match spans.last_mut() {
            Some((_, last)) if *last + 1 == choice.first => *last = choice.last,
            _ => spans.push((choice.first, choice.last)),
        }
    }
    let text = |(first, last): (i64, i64)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first}-{last}"),
    };
    spans.into_iter().map(text).collect::<Vec<_>>().join(", ")
}

/// Whether a value is in the list of a parameter that takes no other.
fn listed(name: &str, value: i64, values: Values, span: Span) -> Result<(), Problem> {
    match values {
        Values::Only(list) if !list.iter().any(|choice| (choice.first..=choice.last).contains(&value)) => {
            let problem = Problem::error(Code::OutOfRange, span, format!("{name} cannot be {value}"));
            Err(problem.help(format!("it can be {}", numbers(list))))
        }
        _ => Ok(()),
    }
}
