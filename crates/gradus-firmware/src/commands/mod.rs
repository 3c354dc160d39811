//! What commands do: motion, outputs, the SPI bus.

pub(crate) mod motion;
pub(crate) mod outputs;
pub(crate) mod spi;
