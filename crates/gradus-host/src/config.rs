//! A module's configuration as text.
//!
//! A [`Setting`] is a parameter that is set up once and then stays: it may be written and has a default. What commands and the
//! motion change (positions, target speeds, torques, timers) is no setting, nor are the user variables, which belong to the program.
//!
//! [`Config::apply`] writes only what differs and reads every value back. The order is safe: first the unit mode, which says what
//! other values mean, and the key of a locked EEPROM; then everything else; then what lets a motor move (closed loop, driver on);
//! at last addresses, identifiers and bit rates, by which the module is reached. Two things it refuses before it writes
//! anything: values that a locked EEPROM cannot take, and giving up the program's read protection, which erases the program.

mod file;
mod program;

use std::fmt;

use gradus_tmcl::catalogue::{Access, Ap, Gp, Module, Unit};
use gradus_tmcl::{Instruction, Opcode};

use crate::names::{axis_parameters, global_parameters};
use crate::{Error, Named, Session};

pub use file::ConfigFileError;

/// A parameter that a configuration sets, with its axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Setting {
    /// The parameter.
    pub named: Named,
    /// The axis of an axis parameter, 0 for a global one.
    pub axis: u8,
}

/// When a setting is written.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Turn {
    Unlock,
    Units,
    Plain,
    Motion,
    Reach,
    Lock,
}

/// A setting that is not as wanted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Difference {
    /// The setting.
    pub setting: Setting,
    /// Its value in the file, or its default.
    pub wanted: i64,
    /// Its value in the module.
    pub found: i64,
}

/// Values for some or all settings of a kind of module.
#[derive(Clone, Debug)]
pub struct Config {
    /// The kind of module.
    pub module: &'static Module,
    /// The settings, each once.
    pub values: Vec<(Setting, i64)>,
}

/// Why a configuration was not applied.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file is for another kind of module.
    #[error("the configuration is for a {file}, but {port} is a {module}; nothing was written")]
    OtherModule {
        /// Name in the file.
        file: &'static str,
        /// The port.
        port: String,
        /// What is there.
        module: &'static str,
    },
    /// The EEPROM is locked.
    #[error(
        "the EEPROM is locked, and {setting} cannot be stored; nothing was written. To unlock it, write \
         `configuration_eeprom_lock_flag = 0` into [global], or `gradus set configuration_eeprom_lock_flag 4321`"
    )]
    Locked {
        /// The first setting that needs it.
        setting: Setting,
    },
    /// The program would be erased.
    #[error(
        "{setting} = {wanted} gives up the read protection, which erases the program in the module; nothing was written. \
         `gradus set {} {wanted}` does it", setting.named.name()
    )]
    ErasesProgram {
        /// The setting.
        setting: Setting,
        /// Its value in the file.
        wanted: i64,
    },
    /// The module took a value and kept another one.
    #[error("{setting}: wrote {wrote}, read back {read}")]
    NotKept {
        /// The setting.
        setting: Setting,
        /// What was written.
        wrote: i64,
        /// What was read back.
        read: i64,
    },
    /// The session failed.
    #[error(transparent)]
    Session(#[from] Error),
}

/// Every setting of a module: the global ones, then those of each axis.
pub fn settings(module: &'static Module) -> impl Iterator<Item = Setting> {
    let global = global_parameters(module).map(|named| Setting { named, axis: 0 });
    let axes = (0..module.axes).flat_map(move |axis| axis_parameters(module).map(move |named| Setting { named, axis }));
    global.chain(axes).filter(Setting::is_setting)
}

impl Setting {
    /// False for what commands and the motion change, and for what is no part of the configuration.
    fn is_setting(&self) -> bool {
        let kept = match self.named {
            Named::Axis(row) => !matches!(
                row.id,
                Ap::TargetPosition
                    | Ap::ActualPosition
                    | Ap::EncoderPosition
                    | Ap::TargetSpeed
                    | Ap::ActualSpeed
                    | Ap::TorqueMode
                    | Ap::TargetCurrent
                    | Ap::TargetFlux
                    | Ap::RampMode
            ),
            Named::Global { row, .. } => !matches!(
                row.id,
                Gp::EepromMagic | Gp::TickTimer | Gp::RandomNumber | Gp::SuppressReply | Gp::UserVariable
            ),
        };
        kept && self.named.access().writable() && self.named.default().is_some()
    }

    /// True for a parameter of an axis.
    pub fn is_axis(&self) -> bool {
        matches!(self.named, Named::Axis(_))
    }

    fn turn(&self, wanted: i64) -> Turn {
        match self.named {
            Named::Axis(row) => match row.id {
                Ap::UnitMode => Turn::Units,
                Ap::ClosedLoop | Ap::EnableDriver => Turn::Motion,
                _ => Turn::Plain,
            },
            Named::Global { row, .. } => match row.id {
                Gp::EepromLock if wanted == 0 => Turn::Unlock,
                Gp::EepromLock => Turn::Lock,
                Gp::SerialBaudRate
                | Gp::SerialAddress
                | Gp::SerialSecondaryAddress
                | Gp::HostAddress
                | Gp::CanBitRate
                | Gp::CanReplyId
                | Gp::CanId
                | Gp::CanSecondaryId => Turn::Reach,
                _ => Turn::Plain,
            },
        }
    }

    fn is(&self, id: Gp) -> bool {
        matches!(self.named, Named::Global { row, .. } if row.id == id)
    }

    fn read(&self, session: &mut Session) -> Result<i64, Error> {
        session.command(self.named.read(self.axis)).map(|value| self.named.decode(value))
    }

    /// The command that makes it so. The lock of the EEPROM is worked by keys.
    fn write(&self, value: i64) -> Instruction {
        let value = match value {
            0 if self.is(Gp::EepromLock) => UNLOCK,
            _ if self.is(Gp::EepromLock) => LOCK,
            value => self.named.encode(value).unwrap_or_default(), // a parsed or read value fits
        };
        self.named.write(self.axis, value)
    }

    /// What a person should know about a value: unit, meaning, default. In internal units the default, in pps, says nothing.
    fn note(&self, value: i64, internal: bool) -> String {
        let default = self.named.default().unwrap_or_default();
        let default = match value == default {
            _ if internal && self.is_in_pps() => String::new(),
            true => "default".into(),
            false => format!("default {default}"),
        };
        let meaning = self.named.meaning(value).unwrap_or_default();
        let words = [self.unit(internal), &meaning, &default];
        words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join("; ")
    }

    /// Unit of the value; `internal`: the unit mode of its axis is that of the ramp generator.
    fn unit(&self, internal: bool) -> &'static str {
        if internal && self.is_in_pps() { "internal units" } else { self.named.unit().text() }
    }

    fn is_in_pps(&self) -> bool {
        matches!(self.named.unit(), Unit::Pps | Unit::PpsPerSecond | Unit::PpsPerSecond2)
    }
}

const LOCK: i32 = 1234;
const UNLOCK: i32 = 4321;

impl fmt::Display for Setting {
    /// `maximum_current of axis 0`, `serial_address`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.named.of(self.axis))
    }
}

impl Config {
    /// The defaults of a module.
    pub fn defaults(module: &'static Module) -> Self {
        let default = |setting: Setting| setting.named.default().map(|value| (setting, value));
        Self { module, values: settings(module).filter_map(default).collect() }
    }

    /// Reads all settings. One that the module does not give, as real ones do not give some of their own parameters, is left
    /// out. `progress` is told how many are read.
    ///
    /// # Errors
    /// When the line is broken or the module is unknown.
    pub fn read(session: &mut Session, mut progress: impl FnMut(usize)) -> Result<Self, Error> {
        let module = session.module()?;
        let mut values = Vec::new();
        let job = session.line().job();
        for (index, setting) in settings(module).enumerate() {
            session.line().go_on(job)?;
            match setting.read(session) {
                Ok(value) => values.push((setting, value)),
                Err(Error::Refused { .. }) => {}
                Err(error) => return Err(error),
            }
            progress(index + 1);
        }
        Ok(Self { module, values })
    }

    /// Compares the module with this configuration; what it does not name does not matter. `progress` is told how many settings are
    /// compared.
    ///
    /// # Errors
    /// When the module is of another kind, does not give a setting, or the line is broken.
    pub fn differences(
        &self,
        session: &mut Session,
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<Difference>, ConfigError> {
        self.check_module(session)?;
        let mut differences = Vec::new();
        let job = session.line().job();
        for (index, (setting, wanted)) in self.values.iter().enumerate() {
            session.line().go_on(job)?;
            differences.extend(difference(session, *setting, *wanted)?);
            progress(index + 1);
        }
        Ok(differences)
    }

    /// Writes what differs, reads each value back, and gives back what was changed. `progress` is told how many settings
    /// are done.
    ///
    /// # Errors
    /// When the module is of another kind, would not keep a value or lose its program, or the line is broken. In the cases that
    /// can be seen before, nothing is written.
    pub fn apply(
        &self,
        session: &mut Session,
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<Difference>, ConfigError> {
        self.check_module(session)?;
        self.check_lock(session)?;
        self.check_protection(session)?;
        let mut written = Vec::new();
        let job = session.line().job();
        for (index, (setting, wanted)) in self.in_order().into_iter().enumerate() {
            session.line().go_on(job)?;
            if let Some(difference) = difference(session, setting, wanted)? {
                session.command(setting.write(wanted))?;
                let read = setting.read(session)?;
                if read != wanted {
                    return Err(ConfigError::NotKept { setting, wrote: wanted, read });
                }
                written.push(difference);
            }
            progress(index + 1);
        }
        Ok(written)
    }

    /// Lets the module keep, over a power-off, the settings that it can store on command (STAP, STGP); gives back how many.
    ///
    /// # Errors
    /// When the line is broken or the module refuses.
    pub fn store(&self, session: &mut Session) -> Result<usize, Error> {
        let stored = self.values.iter().filter(|(setting, _)| setting.named.access() == Access::Rwe);
        let mut count = 0;
        for (setting, _) in stored {
            let write = setting.named.write(setting.axis, 0);
            let opcode = if write.opcode == Opcode::SAP { Opcode::STAP } else { Opcode::STGP };
            session.command(Instruction { opcode, ..write })?;
            count += 1;
        }
        Ok(count)
    }

    /// In the order in which the settings are written.
    fn in_order(&self) -> Vec<(Setting, i64)> {
        let mut values = self.values.clone();
        values.sort_by_key(|(setting, wanted)| setting.turn(*wanted));
        values
    }

    /// True if speeds and accelerations of an axis are in the units of the ramp generator.
    fn is_internal(&self, axis: u8) -> bool {
        let is_mode = |setting: &Setting| {
            setting.axis == axis && matches!(setting.named, Named::Axis(row) if row.id == Ap::UnitMode)
        };
        self.values.iter().any(|(setting, value)| is_mode(setting) && *value == 0)
    }

    fn value(&self, id: Gp) -> Option<(Setting, i64)> {
        self.values.iter().find(|(setting, _)| setting.is(id)).copied()
    }

    fn check_module(&self, session: &mut Session) -> Result<(), ConfigError> {
        let module = session.module()?;
        if module.model == self.module.model {
            return Ok(());
        }
        let port = session.port().into();
        Err(ConfigError::OtherModule { file: self.module.name, port, module: module.name })
    }

    fn check_lock(&self, session: &mut Session) -> Result<(), ConfigError> {
        let lock = settings(self.module).find(|setting| setting.is(Gp::EepromLock));
        let Some(lock) = lock.filter(|_| self.value(Gp::EepromLock).is_none_or(|(_, wanted)| wanted != 0)) else {
            return Ok(());
        };
        if lock.read(session)? == 0 {
            return Ok(());
        }
        for (setting, wanted) in self.values.iter().filter(|(setting, _)| setting.named.access() == Access::Rwa) {
            if difference(session, *setting, *wanted)?.is_some() {
                return Err(ConfigError::Locked { setting: *setting });
            }
        }
        Ok(())
    }

    fn check_protection(&self, session: &mut Session) -> Result<(), ConfigError> {
        const AGAINST_READING: i64 = 1;
        let Some((setting, wanted)) = self.value(Gp::CodeProtection) else { return Ok(()) };
        if wanted & AGAINST_READING == 0 && setting.read(session)? & AGAINST_READING != 0 {
            return Err(ConfigError::ErasesProgram { setting, wanted });
        }
        Ok(())
    }
}

fn difference(session: &mut Session, setting: Setting, wanted: i64) -> Result<Option<Difference>, Error> {
    let found = setting.read(session)?;
    Ok((found != wanted).then_some(Difference { setting, wanted, found }))
}
