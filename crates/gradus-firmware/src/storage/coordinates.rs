//! Coordinates: SCO, GCO, CCO, ACO.

use gradus_tmcl::Status;
use gradus_tmcl::catalogue::Gp;

use crate::drive::axes::Axes;
use crate::module::{MAX_AXES, Module};
use crate::ports::{Ports, Store};
use crate::storage::records::Key;

/// Coordinates of an axis on the largest module.
const COORDINATES: usize = 21;

/// Axis number that stands for a copy between RAM and EEPROM.
pub(crate) const EEPROM: u8 = 255;

/// Positions that MVP COORD moves to, by axis and number.
pub(crate) type Coordinates = [[i32; COORDINATES]; MAX_AXES];

pub(crate) const NO_COORDINATES: Coordinates = [[0; COORDINATES]; MAX_AXES];

impl<P: Ports, S: Store> Module<P, S> {
    /// SCO, CCO and ACO.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis the module lacks, [`Status::WRONG_TYPE`] for a coordinate it lacks,
    /// [`Status::EEPROM_LOCKED`] if it would be stored.
    pub(crate) fn set_coordinate(&mut self, number: u8, axis: u8, position: i32) -> Result<(), Status> {
        let axis = self.axis_index(axis)?;
        self.coordinate_mut(number, axis)?;
        let stores = number != 0 && self.globals.get(Gp::CoordinateStorage) != 0;
        if stores {
            self.unlocked()?;
        }
        *self.coordinate_mut(number, axis)? = position;
        if stores {
            self.store_coordinate(number, axis);
        }
        Ok(())
    }

    /// SCO with axis 255: copies to the EEPROM, coordinate `number`, or all for number 0.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for a coordinate the module lacks, [`Status::EEPROM_LOCKED`].
    pub(crate) fn store_coordinates(&mut self, number: u8) -> Result<(), Status> {
        self.has_coordinate(number)?;
        self.unlocked()?;
        self.copy_coordinates(number, Self::store_coordinate)
    }

    /// GCO with axis 255: copies from the EEPROM, as SCO does to it.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for a coordinate the module lacks.
    pub(crate) fn recall_coordinates(&mut self, number: u8) -> Result<(), Status> {
        self.copy_coordinates(number, Self::load_coordinate)
    }

    /// GCO.
    ///
    /// # Errors
    /// As SCO.
    pub(crate) fn get_coordinate(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        let axis = self.axis_index(axis)?;
        self.coordinate_mut(number, axis).copied()
    }

    /// Reads the stored coordinates at power-on if global parameter 84 says that they are stored (TMCM-3351 §3.6.22); else
    /// GCO with axis 255 does.
    pub(crate) fn restore_coordinates(&mut self) {
        if self.globals.get(Gp::CoordinateStorage) != 0 && self.catalogue.coordinates > 0 {
            let _ = self.copy_coordinates(0, Self::load_coordinate);
        }
    }

    fn copy_coordinates(&mut self, number: u8, copy: fn(&mut Self, u8, usize)) -> Result<(), Status> {
        self.has_coordinate(number)?;
        let numbers = if number == 0 { 1..self.catalogue.coordinates } else { number..number + 1 };
        for number in numbers {
            for axis in 0..self.axis_count() {
                copy(self, number, axis);
            }
        }
        Ok(())
    }

    /// Coordinate 0 is never stored.
    fn store_coordinate(&mut self, number: u8, axis: usize) {
        if number != 0
            && let Ok(position) = self.coordinate_mut(number, axis).copied()
        {
            self.eeprom.save_value(Key::Coordinate(number, axis), position);
        }
    }

    fn load_coordinate(&mut self, number: u8, axis: usize) {
        let stored = self.eeprom.load_value(Key::Coordinate(number, axis));
        if let (Some(position), Ok(cell)) = (stored, self.coordinate_mut(number, axis)) {
            *cell = position;
        }
    }

    fn has_coordinate(&self, number: u8) -> Result<(), Status> {
        if number < self.catalogue.coordinates { Ok(()) } else { Err(Status::WRONG_TYPE) }
    }

    fn coordinate_mut(&mut self, number: u8, axis: usize) -> Result<&mut i32, Status> {
        self.has_coordinate(number)?;
        self.axes.coordinate_mut(number, axis).ok_or(Status::WRONG_TYPE)
    }
}
