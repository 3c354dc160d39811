//! A configuration as a TMCL program, for modules that cannot store it.

use std::fmt::Write;

use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::{Access, Command, Mode};

use super::{Config, Setting};
use crate::Named;

impl Config {
    /// The source of a program that sets, after a power-up, what the module does not keep by itself: values that it cannot store
    /// and that are not the default, and values that it stores only on command. The program ends with STOP; with auto start
    /// mode (global parameter 77) on, it runs by itself.
    pub fn to_program(&self) -> String {
        let mut source =
            format!("// Initialisation of a {}: settings that it does not keep by itself.\n", self.module.name);
        source.push_str("#include TMCLParam.tmc\n\n");
        for (setting, value) in self.in_order().into_iter().filter(|(setting, value)| setting.is_lost(*value)) {
            let _ = writeln!(
                source,
                "    {} // {}",
                setting.line(value),
                setting.remark(value, self.is_internal(setting.axis))
            );
        }
        source.push_str("    STOP\n");
        source
    }

    /// True if the module can store its axis parameters (STAP).
    pub fn is_storable(&self) -> bool {
        let mode = Command::of(Opcode::STAP).map(|command| command.modes.of(self.module.model));
        mode.is_some_and(|mode| mode != Mode::None)
    }
}

impl Setting {
    /// True if a module that has the value now may have another one after a power-up.
    fn is_lost(&self, value: i64) -> bool {
        match self.named.access() {
            Access::Rwa | Access::R => false,
            Access::Rwe => true,
            Access::Rw => self.named.default() != Some(value),
        }
    }

    fn line(&self, value: i64) -> String {
        match self.named {
            Named::Axis(row) => format!("SAP {}, {}, {value}", row.symbol, self.axis),
            Named::Global { row, number } => format!("SGP {number}, {}, {value}", row.bank),
        }
    }

    fn remark(&self, value: i64, internal: bool) -> String {
        let meaning = self.named.meaning(value).map(|text| format!("; {text}")).unwrap_or_default();
        format!("{} {}", self.named.name(), self.unit(internal)).trim_end().to_owned() + &meaning
    }
}
