//! Parameters as they are named and shown on the command line.

use gradus_host::{Error, Named, Session, find, find_axis, find_global};

/// Which axis or bank a parameter belongs to.
#[derive(clap::Args)]
pub struct Place {
    /// Axis of an axis parameter [default: 0]
    #[arg(long, value_name = "N", conflicts_with = "bank", allow_negative_numbers = true)]
    pub axis: Option<u8>,
    /// Bank of a global parameter: 0 settings, 2 user variables, 3 interrupts
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub bank: Option<u8>,
}

impl Place {
    /// The parameter of that name or number, and the axis it is asked for.
    ///
    /// # Errors
    /// When there is none, or several names fit.
    pub fn find(&self, session: &mut Session, text: &str) -> Result<(Named, u8), Error> {
        let module = session.module()?;
        let named = match (self.axis, self.bank) {
            (_, Some(bank)) => find_global(module, bank, text)?,
            (Some(_), None) => find_axis(module, text)?,
            (None, None) => find(module, text)?,
        };
        Ok((named, self.axis.unwrap_or_default()))
    }
}
