//! Axis parameters in the EEPROM: STAP and RSAP.
//!
//! What was stored is read at power-on. Where the manuals are silent: RSAP of a parameter that was never stored restores the
//! default of its row.

use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Access, AxisParameter};

use crate::drive::axes::Axes;
use crate::module::Module;
use crate::ports::{Ports, Store};
use crate::storage::records::{Key, stores_axis_parameters};

impl<P: Ports, S: Store> Module<P, S> {
    /// STAP.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for a parameter that cannot be stored,
    /// [`Status::EEPROM_LOCKED`].
    pub(crate) fn store_axis_parameter(&mut self, number: u8, axis: u8) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let row = self.storable_axis_row(number)?;
        self.unlocked()?;
        let value = self.axes.get(index, row.id, self.now, &mut self.ports);
        if let Some(key) = self.axis_key(row, index) {
            self.eeprom.save_value(key, value);
        }
        Ok(())
    }

    /// RSAP.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for a parameter that cannot be stored.
    pub(crate) fn restore_axis_parameter(&mut self, number: u8, axis: u8) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let row = self.storable_axis_row(number)?;
        let stored = self.stored_value(row, index).unwrap_or(row.default.unwrap_or(0) as i32);
        self.axes.set(index, row, stored, &mut self.ports)?;
        self.wake_axes();
        Ok(())
    }

    /// Gives the axes what was stored for them, at power-on.
    pub(crate) fn restore_axis_parameters(&mut self) {
        if !stores_axis_parameters(self.catalogue) {
            return;
        }
        for index in 0..self.axis_count() {
            for row in self.catalogue.axis_parameters {
                if let Some(value) = self.stored_value(row, index) {
                    let _ = self.axes.set(index, row, value, &mut self.ports);
                }
            }
        }
    }

    /// What was stored, if the row accepts it: another firmware may have written it.
    fn stored_value(&mut self, row: &'static AxisParameter, index: usize) -> Option<i32> {
        let key = self.axis_key(row, index).filter(|_| row.access == Access::Rwe)?;
        self.eeprom.load_value(key).filter(|value| row.accepts(*value))
    }

    fn storable_axis_row(&self, number: u8) -> Result<&'static AxisParameter, Status> {
        self.axis_row(number).and_then(|row| if row.access == Access::Rwe { Ok(row) } else { Err(Status::WRONG_TYPE) })
    }

    fn axis_key(&self, row: &'static AxisParameter, index: usize) -> Option<Key> {
        let rows = self.catalogue.axis_parameters;
        rows.iter().position(|other| core::ptr::eq(other, row)).map(|row| Key::Axis(row, index))
    }
}
