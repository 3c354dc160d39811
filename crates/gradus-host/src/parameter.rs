//! Parameters by what they mean.

use gradus_tmcl::catalogue::{Ap, Gp};

use crate::{Error, NameError, Named, Session};

impl Session {
    /// Reads an axis parameter.
    ///
    /// # Errors
    /// When the module does not have it, or refuses.
    pub fn get_axis(&mut self, id: Ap, axis: u8) -> Result<i32, Error> {
        let parameter = self.axis_parameter(id)?;
        self.command(parameter.read(axis))
    }

    /// Writes an axis parameter.
    ///
    /// # Errors
    /// When the module does not have it, or refuses.
    pub fn set_axis(&mut self, id: Ap, axis: u8, value: i32) -> Result<(), Error> {
        let parameter = self.axis_parameter(id)?;
        self.command(parameter.write(axis, value)).map(drop)
    }

    /// Reads a global parameter; of a run of them, user variables for example, the one at `index`.
    ///
    /// # Errors
    /// When the module does not have it, or refuses.
    pub fn get_global(&mut self, id: Gp, index: u8) -> Result<i32, Error> {
        let parameter = self.global_parameter(id, index)?;
        self.command(parameter.read(0))
    }

    /// Writes a global parameter; of a run of them, user variables for example, the one at `index`.
    ///
    /// # Errors
    /// When the module does not have it, or refuses.
    pub fn set_global(&mut self, id: Gp, index: u8, value: i32) -> Result<(), Error> {
        let parameter = self.global_parameter(id, index)?;
        self.command(parameter.write(0, value)).map(drop)
    }

    pub(crate) fn axis_parameter(&mut self, id: Ap) -> Result<Named, Error> {
        let module = self.module()?;
        let row = module.axis_parameters.iter().find(|row| row.id == id);
        row.map(Named::Axis).ok_or_else(|| missing(module.name, format!("{id:?}")))
    }

    fn global_parameter(&mut self, id: Gp, index: u8) -> Result<Named, Error> {
        let module = self.module()?;
        let mut run = crate::names::global_parameters(module)
            .filter(|named| matches!(named, Named::Global { row, .. } if row.id == id));
        run.nth(usize::from(index)).ok_or_else(|| missing(module.name, format!("{id:?}")))
    }
}

fn missing(module: &'static str, text: String) -> Error {
    NameError::Unknown { module, text, suggestions: Vec::new() }.into()
}
