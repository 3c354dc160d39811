//! Units and limits of the TMC428 (and TMC429), the motion chip of the TMCM-351.
//!
//! The chip counts speeds from 0 to 2047 and accelerations from 0 to 2047; two exponents, the pulse divisor and the ramp
//! divisor, give them their size. Its clock of 16 MHz makes
//! - a speed `v` into `v * 16e6 / (2^pulse_div * 2048 * 32)` microsteps per second,
//! - an acceleration `a` into `a * 16e6^2 / 2^(pulse_div + ramp_div + 29)` microsteps per second squared.
//!
//! The TMCM-351 manual prints the first one with `* 2^PD`; data sheet and all host software divide.
//!
//! In position mode the chip must know how far it takes to brake. It does not divide for that: its firmware gives it a factor
//! `p = p_mul / p_div` whenever an acceleration or a divisor changes, see [`Factor`].

use crate::gains::Gains;
use crate::limits::Limits;

/// Clock of the chip.
pub(crate) const CLOCK_HZ: u32 = 16_000_000;

/// Clocks in which nothing changes: the pre-divider of both generators.
pub(crate) const CLOCKS: u32 = 32;

/// Largest pulse and ramp divisor.
const MAX_DIVISOR: u8 = 13;

/// Fraction bits of a speed inside the chip.
pub(crate) const SPEED_BITS: u32 = 8;

/// Largest speed and acceleration.
const MAX_VALUE: u16 = 2047;

/// The divisors, which are the unit system of an axis. Divisors above 13 count as 13.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tmc428Units {
    /// Exponent of the unit of speed (axis parameter 154).
    pub pulse_div: u8,
    /// Exponent of the unit of acceleration (axis parameter 153).
    pub ramp_div: u8,
}

impl Tmc428Units {
    /// A speed of the chip in microsteps per second: 2047 is 499 756 with pulse divisor 0, and 61.0 with 13.
    pub fn pps(self, speed: f64) -> f64 {
        speed * self.pps_per_unit()
    }

    /// The speed of the chip for microsteps per second; a register takes it rounded, and up to 2047.
    pub fn speed(self, pps: f64) -> f64 {
        pps / self.pps_per_unit()
    }

    /// An acceleration of the chip in microsteps per second squared: the unit is 476 837 with both divisors 0.
    pub fn pps2(self, acceleration: f64) -> f64 {
        acceleration * self.pps2_per_unit()
    }

    /// The acceleration of the chip for microsteps per second squared; a register takes it rounded, and up to 2047.
    pub fn acceleration(self, pps2: f64) -> f64 {
        pps2 / self.pps2_per_unit()
    }

    fn pps_per_unit(self) -> f64 {
        f64::from(CLOCK_HZ) / f64::from(2048 * CLOCKS) / power_of_two(self.pulse())
    }

    fn pps2_per_unit(self) -> f64 {
        let clock = f64::from(CLOCK_HZ);
        clock * clock / power_of_two(29) / power_of_two(self.pulse() + self.ramp())
    }

    pub(crate) fn pulse(self) -> u32 {
        u32::from(self.pulse_div.min(MAX_DIVISOR))
    }

    pub(crate) fn ramp(self) -> u32 {
        u32::from(self.ramp_div.min(MAX_DIVISOR))
    }
}

fn power_of_two(exponent: u32) -> f64 {
    (1u64 << exponent) as f64
}

/// The factor of position mode: `p = (128 + pmul) / 2^(3 + pdiv)`.
///
/// The ideal one is `p = a_max / (128 * 2^(ramp_div - pulse_div))`. A larger one brakes too late and overshoots, a smaller
/// one brakes with less than `a_max`; so the next one below the ideal factor is taken, reduced a little.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factor {
    /// 0 to 127.
    pub pmul: u8,
    /// 0 to 13.
    pub pdiv: u8,
}

impl Factor {
    /// What the firmware leaves of the ideal factor, in thousandths. (The chip's data sheet calculates with 950.)
    pub const FIRMWARE_PER_MILLE: u16 = 988;

    /// What the firmware writes where it finds no factor: -1 into both registers, of which they hold 7 and 4 bits.
    const NONE: Self = Self { pmul: 127, pdiv: 15 };

    /// The factor for an acceleration (0 to 2047), `None` if there is none: for accelerations outside of
    /// about `2^(ramp_div - pulse_div - 1)` to `2^(ramp_div - pulse_div + 12)`.
    pub fn of(acceleration: u16, units: Tmc428Units, per_mille: u16) -> Option<Self> {
        (0..=MAX_DIVISOR).rev().find_map(|pdiv| {
            let scaled = u64::from(acceleration.min(MAX_VALUE)) * u64::from(per_mille.min(1000));
            let p_mul = ((scaled << (u32::from(pdiv) + units.pulse())) / 16_000) >> units.ramp();
            let pmul = u8::try_from(p_mul.checked_sub(128)?).ok().filter(|pmul| *pmul < 128)?;
            Some(Self { pmul, pdiv })
        })
    }
}

/// Limits of an axis as the user sets them, in units of the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tmc428Limits {
    /// What the other values are counted in.
    pub units: Tmc428Units,
    /// Speed below which an approach does not get, and from which it may end at once (axis parameter 130); should be 1.
    pub min_speed: u16,
    /// Top speed of position mode (axis parameter 4).
    pub max_speed: u16,
    /// Acceleration in both directions (axis parameter 5).
    pub acceleration: u16,
}

impl Tmc428Limits {
    /// What a control tick at `tick_hz` needs of these limits; above 500 kHz it counts as that. Values above 2047 count as
    /// 2047.
    pub fn gains(&self, tick_hz: u32) -> Tmc428Gains {
        let speed = |value: u16| i64::from(value.min(MAX_VALUE)) << SPEED_BITS;
        let factor = Factor::of(self.acceleration, self.units, Factor::FIRMWARE_PER_MILLE).unwrap_or(Factor::NONE);
        let spans = (CLOCK_HZ / CLOCKS / tick_hz.max(1)).max(1);
        let travel_shift = u32::from(MAX_DIVISOR) - self.units.pulse();
        Tmc428Gains {
            acceleration: i64::from(self.acceleration.min(MAX_VALUE)),
            min_speed: speed(self.min_speed.min(self.max_speed)),
            max_speed: speed(self.max_speed),
            p_mul: 128 + i64::from(factor.pmul),
            pdiv: u32::from(factor.pdiv),
            ramp_spans: 1 << self.units.ramp(),
            tick_spans: spans,
            travel_shift,
            speed_of_travel: (1 << (SPEED_OF_TRAVEL_BITS - travel_shift)) / i64::from(spans),
            path: self.path(tick_hz),
        }
    }

    /// The same limits for a straight line of several axes, as a trapezoid.
    fn path(&self, tick_hz: u32) -> Gains {
        let value = |value: u16| f64::from(value.min(MAX_VALUE));
        let acceleration = self.units.pps2(value(self.acceleration)) as u32;
        let max_speed_pps = self.units.pps(value(self.max_speed)) as u32;
        Limits { max_speed_pps, acceleration, deceleration: acceleration, ..Limits::default() }.gains(tick_hz)
    }
}

/// Fraction bits of what makes a speed of the travel in a control tick.
pub(crate) const SPEED_OF_TRAVEL_BITS: u32 = 40;

/// Limits per tick; [`Tmc428Limits::gains`] makes them. A span is 32 clocks, 2 us.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tmc428Gains {
    /// Change of speed in a tick of the ramp generator, in 1/256 of a unit. So are the speeds.
    pub(crate) acceleration: i64,
    pub(crate) min_speed: i64,
    pub(crate) max_speed: i64,
    pub(crate) p_mul: i64,
    pub(crate) pdiv: u32,
    /// Spans in a tick of the ramp generator.
    pub(crate) ramp_spans: u32,
    /// Spans in a control tick.
    pub(crate) tick_spans: u32,
    /// A speed shifted by this is the travel in a span, with 32 fraction bits.
    pub(crate) travel_shift: u32,
    pub(crate) speed_of_travel: i64,
    /// For straight lines.
    pub(crate) path: Gains,
}
