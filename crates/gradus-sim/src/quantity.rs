//! Values of a bench file: numbers with their ranges, and the module.
//!
//! A wrong value and a value of a wrong type get the same message, which says what is expected. The ranges keep all lengths
//! far inside the 64 bits of the plant's microsteps.

use std::fmt;

use gradus_tmcl::catalogue::Module;
use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};

use crate::{is_virtual, virtual_names};

/// What a number must be.
struct Number {
    what: &'static str,
    whole: bool,
    min: f64,
    max: f64,
}

/// Longest length, in the unit of the axis.
const LONGEST: f64 = 1e6;

const FULL_STEPS: Number = Number::whole(1.0, 10_000.0);
const COUNTS: Number = Number::whole(1.0, 1e6);
const POLE_PAIRS: Number = Number::whole(1.0, 255.0);
const BOUNCE: Number = Number::any("seconds", 0.0, 10.0);
const SECONDS: Number = Number::any("seconds", 0.0, 1e9);

impl Number {
    const fn whole(min: f64, max: f64) -> Self {
        Self { what: "a whole number", whole: true, min, max }
    }

    const fn any(what: &'static str, min: f64, max: f64) -> Self {
        Self { what, whole: false, min, max }
    }

    fn accepts(&self, value: f64) -> bool {
        (self.min..=self.max).contains(&value) && (!self.whole || value.fract() == 0.0)
    }
}

impl Visitor<'_> for Number {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} from {} to {}", self.what, self.min, self.max)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<f64, E> {
        if self.accepts(value) { Ok(value) } else { Err(E::invalid_value(Unexpected::Float(value), &self)) }
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<f64, E> {
        let number = value as f64;
        if self.accepts(number) { Ok(number) } else { Err(E::invalid_value(Unexpected::Signed(value), &self)) }
    }
}

/// Full steps in a turn of a motor, if they are named.
pub(crate) fn full_steps<'de, D: Deserializer<'de>>(value: D) -> Result<Option<u32>, D::Error> {
    value.deserialize_any(FULL_STEPS).map(|number| Some(number as u32))
}

/// Width of a vane, if it is named.
pub(crate) fn vane_width<'de, D: Deserializer<'de>>(value: D) -> Result<Option<f64>, D::Error> {
    width(value).map(Some)
}

/// Counts in a turn of an encoder.
pub(crate) fn counts<'de, D: Deserializer<'de>>(value: D) -> Result<u32, D::Error> {
    value.deserialize_any(COUNTS).map(|number| number as u32)
}

/// Pole pairs of a motor.
pub(crate) fn pole_pairs<'de, D: Deserializer<'de>>(value: D) -> Result<u32, D::Error> {
    value.deserialize_any(POLE_PAIRS).map(|number| number as u32)
}

/// How long a contact bounces: seconds as microseconds.
pub(crate) fn bounce<'de, D: Deserializer<'de>>(value: D) -> Result<u32, D::Error> {
    value.deserialize_any(BOUNCE).map(|seconds| (seconds * 1e6).round() as u32)
}

/// Functions for quantities that are taken as they are.
macro_rules! quantities {
    ($($(#[$text:meta])* $name:ident: $number:expr;)*) => {$(
        $(#[$text])*
        pub(crate) fn $name<'de, D: Deserializer<'de>>(value: D) -> Result<f64, D::Error> {
            value.deserialize_any($number)
        }
    )*};
}

quantities! {
    /// Length that a turn of the shaft moves.
    travel_per_turn: Number::any("a length", 0.001, LONGEST);
    /// A place along the travel.
    place: Number::any("a length", -LONGEST, LONGEST);
    /// Length of a vane.
    width: Number::any("a length", 0.0, LONGEST);
    /// Friction, or what a motor gives.
    torque: Number::any("a torque in Nm", 0.0, 1e3);
    /// A torque in either direction.
    load: Number::any("a torque in Nm", -1e3, 1e3);
    /// Inertia at a shaft.
    inertia: Number::any("an inertia in gcm^2", 0.01, 1e8);
    /// Resistance of a winding.
    resistance: Number::any("ohms", 1e-3, 1e3);
    /// Inductance of a winding.
    inductance: Number::any("millihenries", 1e-3, 1e4);
    /// Rated current.
    amperes: Number::any("amperes", 1e-3, 1e3);
    /// How far a coupling has slipped.
    slip: Number::any("degrees", -36_000.0, 36_000.0);
    /// An angle.
    degrees: Number::any("degrees", -36_000.0, 36_000.0);
    /// Torque of a motor's current.
    torque_constant: Number::any("Nm/A", 1e-4, 1e3);
    /// Noise of a StallGuard2 reading.
    counts_of_noise: Number::any("counts", 0.0, 1e3);
    /// Capacitor of a supply.
    millifarads: Number::any("millifarads", 1e-2, 1e3);
    /// What a board takes.
    milliamperes: Number::any("milliamperes", 0.0, 1e4);
    /// Noise of a converter.
    steps: Number::any("steps", 0.0, 1e3);
    /// An angle of axis parameter 93.
    hall_offset: Number::whole(-32_768.0, 32_767.0);
    /// An axis parameter that is on or off.
    flag: Number::whole(0.0, 1.0);
    /// Supply of a module.
    supply: Number::any("volts", 0.0, 60.0);
    /// A part of a whole.
    share: Number::any("a share", 0.0, 1.0);
    /// Temperature.
    celsius: Number::any("degrees Celsius", -55.0, 200.0);
}

/// Seconds as microseconds, rounded.
pub(crate) fn microseconds<'de, D: Deserializer<'de>>(value: D) -> Result<u64, D::Error> {
    value.deserialize_any(SECONDS).map(|seconds| (seconds * 1e6).round() as u64)
}

/// A module that runs, by its name.
pub(crate) fn virtual_module<'de, D: Deserializer<'de>>(value: D) -> Result<&'static Module, D::Error> {
    let name = String::deserialize(value)?;
    let module = Module::named(&name).filter(|module| is_virtual(module));
    module.ok_or_else(|| D::Error::custom(format!("expected a module that runs, {}, not `{name}`", virtual_names())))
}
