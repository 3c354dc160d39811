//! What the registers of a servo's chips keep.

/// Registers that select or are kept.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chips {
    pub(crate) chip_info: u8,
    pub(crate) adc_raw: u8,
    /// GCONF, SHORT_CONF and DRV_CONF of the gate driver.
    pub(crate) gate_configuration: [i32; 3],
}
