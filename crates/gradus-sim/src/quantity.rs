//! Values of a bench file: numbers with their ranges, and the module.
//!
//! A wrong value and a value of a wrong type get the same message, which says what is expected. The ranges keep all lengths
//! far inside the 64 bits of the plant's microsteps.

use std::fmt;

use gradus_tmcl::catalogue::Module;
use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};

use crate::VIRTUAL_MODULES;

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
const ADC_VALUE: Number = Number::whole(0.0, 1023.0);
const TRAVEL_PER_TURN: Number = Number::any("a length", 0.001, LONGEST);
const PLACE: Number = Number::any("a length", -LONGEST, LONGEST);
const WIDTH: Number = Number::any("a length", 0.0, LONGEST);
const SHARE: Number = Number::any("a share", 0.0, 1.0);
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

/// Full steps in a turn of a motor.
pub(crate) fn full_steps<'de, D: Deserializer<'de>>(value: D) -> Result<u32, D::Error> {
    value.deserialize_any(FULL_STEPS).map(|number| number as u32)
}

/// Counts in a turn of an encoder.
pub(crate) fn counts<'de, D: Deserializer<'de>>(value: D) -> Result<u32, D::Error> {
    value.deserialize_any(COUNTS).map(|number| number as u32)
}

/// What a 10-bit converter reads.
pub(crate) fn adc_value<'de, D: Deserializer<'de>>(value: D) -> Result<i32, D::Error> {
    value.deserialize_any(ADC_VALUE).map(|number| number as i32)
}

/// Length that a turn of the shaft moves.
pub(crate) fn travel_per_turn<'de, D: Deserializer<'de>>(value: D) -> Result<f64, D::Error> {
    value.deserialize_any(TRAVEL_PER_TURN)
}

/// A place along the travel.
pub(crate) fn place<'de, D: Deserializer<'de>>(value: D) -> Result<f64, D::Error> {
    value.deserialize_any(PLACE)
}

/// Length of a vane.
pub(crate) fn width<'de, D: Deserializer<'de>>(value: D) -> Result<f64, D::Error> {
    value.deserialize_any(WIDTH)
}

/// A part of a whole.
pub(crate) fn share<'de, D: Deserializer<'de>>(value: D) -> Result<f64, D::Error> {
    value.deserialize_any(SHARE)
}

/// Seconds as microseconds, rounded.
pub(crate) fn microseconds<'de, D: Deserializer<'de>>(value: D) -> Result<u64, D::Error> {
    value.deserialize_any(SECONDS).map(|seconds| (seconds * 1e6).round() as u64)
}

/// A module that runs, by its name.
pub(crate) fn virtual_module<'de, D: Deserializer<'de>>(value: D) -> Result<&'static Module, D::Error> {
    let name = String::deserialize(value)?;
    let module = Module::named(&name).filter(|module| VIRTUAL_MODULES.iter().any(|runs| runs.number == module.number));
    let names = || VIRTUAL_MODULES.iter().map(|module| module.name.to_lowercase()).collect::<Vec<_>>().join(", ");
    module.ok_or_else(|| D::Error::custom(format!("expected a module that runs, {}, not `{name}`", names())))
}
