//! Global parameters: SGP, GGP, STGP, RSGP.

use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Access, GlobalParameter, Gp, Module as Catalogue};

use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::storage::records::{Key, STORED_VARIABLES, stored_at_once};

/// Values of the global parameters of bank 0, by meaning.
#[derive(Clone, Debug)]
pub(crate) struct Globals([i32; Gp::COUNT]);

impl Globals {
    pub(crate) fn factory(catalogue: &Catalogue) -> Self {
        let mut values = [0; Gp::COUNT];
        for row in catalogue.global_parameters.iter().filter(|row| row.bank == 0) {
            values[row.id as usize] = row.default.unwrap_or(0) as i32;
        }
        Self(values)
    }

    #[inline]
    pub(crate) fn get(&self, id: Gp) -> i32 {
        self.0[id as usize]
    }

    pub(crate) fn set(&mut self, id: Gp, value: i32) {
        self.0[id as usize] = value;
    }
}

/// Multiplier and increment of the random number generator, a linear congruence modulo 2^64 (Knuth's MMIX).
const RANDOM: (u64, u64) = (6_364_136_223_846_793_005, 1_442_695_040_888_963_407);

/// What SGP 73 takes.
const LOCK: i32 = 1234;

impl<P: Ports, S: Store> Module<P, S> {
    /// SGP.
    ///
    /// # Errors
    /// As BEHAVIOUR 1 orders them: wrong type, invalid value, EEPROM locked.
    pub(crate) fn set_global(&mut self, number: u8, bank: u8, value: i32) -> Result<(), Status> {
        let row = self.global_row(number, bank)?;
        if !row.access.writable() {
            return Err(Status::WRONG_TYPE);
        }
        if !row.accepts(value) {
            return Err(Status::INVALID_VALUE);
        }
        if stored_at_once(row.access) && row.id != Gp::EepromLock {
            self.unlocked()?;
        }
        match row.id {
            Gp::UserVariable => self.variables[usize::from(number)] = value,
            Gp::TimerPeriod => self.interrupts.set_period(number, value as u32, self.now),
            Gp::StopSwitchEdge | Gp::InputEdge => self.interrupts.set_edge(number, value as u8),
            Gp::TickTimer => self.tick_timer_zero_ms = (self.now / 1000).wrapping_sub(u64::from(value as u32)),
            Gp::RandomNumber => self.random = u64::from(value as u32),
            Gp::EepromLock => self.globals.set(Gp::EepromLock, i32::from(value == LOCK)),
            Gp::CodeProtection => self.protect(value),
            id => self.globals.set(id, value),
        }
        if stored_at_once(row.access) {
            self.store_global(row);
        }
        Ok(())
    }

    /// GGP.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if there is no such parameter.
    pub(crate) fn get_global(&mut self, number: u8, bank: u8) -> Result<i32, Status> {
        let row = self.global_row(number, bank)?;
        Ok(match row.id {
            Gp::UserVariable => self.variables[usize::from(number)],
            Gp::TimerPeriod => self.interrupts.period(number) as i32,
            Gp::StopSwitchEdge | Gp::InputEdge => i32::from(self.interrupts.edge(number)),
            Gp::TickTimer => (self.now / 1000).wrapping_sub(self.tick_timer_zero_ms) as i32,
            Gp::RandomNumber => self.next_random(),
            Gp::ApplicationStatus => self.program.state as i32,
            Gp::DownloadMode => i32::from(self.program.downloading),
            Gp::ProgramCounter => i32::from(self.program.cpu.registers.pc),
            Gp::LastError => self.program.last_error,
            id => self.globals.get(id),
        })
    }

    /// STGP.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if it cannot be stored, [`Status::EEPROM_LOCKED`].
    pub(crate) fn store_variable(&mut self, number: u8, bank: u8) -> Result<(), Status> {
        self.storable(number, bank)?;
        self.unlocked()?;
        let value = self.variables[usize::from(number)];
        self.eeprom.save_value(Key::Variable(number), value);
        Ok(())
    }

    /// RSGP; what was never stored is 0.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if it cannot be stored.
    pub(crate) fn restore_variable(&mut self, number: u8, bank: u8) -> Result<(), Status> {
        self.storable(number, bank)?;
        self.variables[usize::from(number)] = self.eeprom.load_value(Key::Variable(number)).unwrap_or(0);
        Ok(())
    }

    /// Reads everything that was stored, at power-on, the EEPROM lock included. A value that its row does not know (another
    /// firmware has written it) leaves the default.
    pub(crate) fn restore_globals(&mut self) {
        for (index, row) in self.catalogue.global_parameters.iter().enumerate() {
            if stored_at_once(row.access)
                && let Some(value) = self.eeprom.load_value(Key::Global(index))
                && row.shows(value)
            {
                self.globals.set(row.id, value);
            }
        }
        if self.globals.get(Gp::UserVariablesNotRestored) == 0 {
            for number in 0..STORED_VARIABLES {
                self.variables[usize::from(number)] = self.eeprom.load_value(Key::Variable(number)).unwrap_or(0);
            }
        }
    }

    /// Global parameter 64 of the TMCM-351: another value than its default brings the factory settings back.
    pub(crate) fn check_magic(&mut self) {
        let factory = Globals::factory(self.catalogue);
        if self.globals.get(Gp::EepromMagic) != factory.get(Gp::EepromMagic) {
            self.restore_factory_settings();
            self.globals = factory;
            self.variables = [0; 256];
        }
    }

    /// # Errors
    /// [`Status::EEPROM_LOCKED`] while global parameter 73 locks the EEPROM.
    pub(crate) fn unlocked(&self) -> Result<(), Status> {
        if self.globals.get(Gp::EepromLock) == 0 { Ok(()) } else { Err(Status::EEPROM_LOCKED) }
    }

    fn global_row(&self, number: u8, bank: u8) -> Result<&'static GlobalParameter, Status> {
        self.catalogue.global_parameter(bank, number).ok_or(Status::WRONG_TYPE)
    }

    fn storable(&self, number: u8, bank: u8) -> Result<(), Status> {
        let row = self.global_row(number, bank)?;
        if row.id == Gp::UserVariable && row.access == Access::Rwe { Ok(()) } else { Err(Status::WRONG_TYPE) }
    }

    fn store_global(&mut self, row: &'static GlobalParameter) {
        let index = self.catalogue.global_parameters.iter().position(|other| core::ptr::eq(other, row));
        if let Some(index) = index {
            let value = self.globals.get(row.id);
            self.eeprom.save_value(Key::Global(index), value);
        }
    }

    /// Global parameter 81: giving up the protection against disassembling erases the program first.
    fn protect(&mut self, value: i32) {
        if self.globals.get(Gp::CodeProtection) & 1 != 0 && value & 1 == 0 {
            self.erase_program();
        }
        self.globals.set(Gp::CodeProtection, value);
    }

    fn next_random(&mut self) -> i32 {
        self.random = self.random.wrapping_mul(RANDOM.0).wrapping_add(RANDOM.1);
        (self.random >> 33) as i32
    }
}
