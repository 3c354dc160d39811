//! StallGuard2: the load of a motor as its driver chip measures it, a reading at the end of each full step of the coil vector.
//!
//! What the data sheets do not state is chosen here. `s = min(1, 1.6 E/V)` is the share of the range that the back-EMF `E` of
//! the vector's speed at supply `V` opens up, faded out below one turn a second and above `E = 0.8 V`; `d` is the load angle.
//!
//! - The reading is `1000 s (m (1 - |sin d|) + ripple + flutter) + 25 (threshold - 20 s) - warmth + noise`, between 0 and 1023,
//!   with the means over the full step; beyond 90 degrees the bracket is 0. `m` is the share of the full step that the rotor
//!   has followed. So the threshold that makes the reading 0 just at 90 degrees is `20 s`, where `s` does not fade.
//! - The ripple belongs to the four full steps of an electrical period: the coils of a motor are not quite equal. Its sum is 0,
//!   so that the filter, the mean of four full steps, takes it away.
//! - The flutter is what a rotor that does not follow feeds back while it hums: up to 0.15, at random.
//! - The warmth is the voltage that the resistance of a warm winding takes more than at 25 degC, in thousandths of `V`.
//! - The noise has a standard deviation of 10 counts unless told otherwise.
//! - When no step came for 65 ms (2^20 clocks of 16 MHz) the reading is how long the chopper of coil A is on, 1023 for
//!   always, as the chip shows it: a measure of the resistance. That is never a stall.

use crate::field::Field;
use crate::noise::Noise;
use crate::stepper::Stepper;
use crate::trigonometry::sin_cos;

/// Steps without motion of the vector after which the chip stands still.
const STANDSTILL_STEPS: u16 = 655;

/// Standard deviation of a StallGuard2 reading in counts, unless told otherwise.
pub const STALLGUARD_NOISE: f64 = 10.0;

/// Ripple of the four full steps of an electrical period.
const RIPPLE: [f64; 4] = [0.03, -0.02, 0.01, -0.02];

const FLUTTER: f64 = 0.15;

/// What measures.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct StallGuard {
    noise: Noise,
    /// Standard deviation of the noise in counts.
    counts: f64,
    full_step: i32,
    /// Since the full step began: steps, the sum of the reserves, microsteps of the vector, and where the rotor was.
    samples: f64,
    reserve: f64,
    turned: i32,
    rotor: f64,
    /// Readings of the filter and their sum.
    filtered: u8,
    sum: f64,
    /// Steps since the vector has moved.
    idle: u16,
}

/// What the chip is told.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Sensitivity {
    pub(crate) threshold: i8,
    pub(crate) filter: bool,
}

/// What has been found at the end of a full step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Found {
    /// Share of the torque that is left.
    pub(crate) reserve: f64,
    /// The reading, if there is a new one.
    pub(crate) load: Option<u16>,
}

impl Default for StallGuard {
    fn default() -> Self {
        Self {
            noise: Noise::new(1),
            counts: STALLGUARD_NOISE,
            full_step: 0,
            samples: 0.0,
            reserve: 0.0,
            turned: 0,
            rotor: 0.0,
            filtered: 0,
            sum: 0.0,
            idle: 0,
        }
    }
}

impl StallGuard {
    pub(crate) fn set_noise(&mut self, counts: f64, seed: u32) {
        (self.counts, self.noise) = (counts, Noise::new(seed));
    }

    /// True if the vector stands for the chip.
    #[inline]
    pub(crate) fn is_standing(&self) -> bool {
        self.idle >= STANDSTILL_STEPS
    }

    /// Takes a step that has been done. `amps` is the wanted length of the current vector.
    #[inline]
    pub(crate) fn sample(&mut self, field: &Field, motor: &Stepper, told: Sensitivity, amps: f64) -> Option<Found> {
        self.idle = if field.turned == 0 { self.idle.saturating_add(1) } else { 0 };
        if field.speed == 0.0 {
            return None;
        }
        let (sin, cos) = motor.reading.load_angle;
        self.samples += 1.0;
        self.turned = self.turned.saturating_add(field.turned);
        if cos > 0.0 {
            self.reserve += 1.0 - sin.abs();
        }
        let full_step = field.phase >> 8;
        if full_step == self.full_step {
            return None;
        }
        self.full_step = full_step;
        Some(self.measure(field, motor, told, amps))
    }

    /// A full step is over.
    fn measure(&mut self, field: &Field, motor: &Stepper, told: Sensitivity, amps: f64) -> Found {
        let followed = match self.turned {
            0 => 0.0,
            turned => ((motor.position() - self.rotor) / f64::from(turned)).clamp(0.0, 1.0),
        };
        let reserve = self.reserve / self.samples * followed;
        let flutter = FLUTTER * (1.0 - followed) * self.noise.uniform();
        (self.samples, self.reserve, self.turned, self.rotor) = (0.0, 0.0, 0, motor.position());

        let (supply_v, speed) = (field.volts.max(0.1), field.speed.abs());
        let emf = motor.emf_v(speed) / supply_v;
        let range = (1.6 * emf).min(1.0);
        let usable = (2.0 * motor.rps(speed) - 1.0).clamp(0.0, 1.0) * (5.0 * (1.0 - emf)).clamp(0.0, 1.0);
        let ripple = RIPPLE[(self.full_step & 3) as usize];
        let warmth = 1000.0 * (motor.resistance_ohm() - motor.motor.resistance_ohm) * amps / supply_v;
        let reading = 1000.0 * range * usable * (reserve + ripple + flutter)
            + 25.0 * (f64::from(told.threshold) - 20.0 * range)
            - warmth
            + self.counts * self.noise.normal();
        let load = self.filter(reading, told.filter).map(|reading| reading.clamp(0.0, 1023.0) as u16);
        Found { reserve, load }
    }

    /// The mean of four readings, once in four, if the filter is on.
    fn filter(&mut self, reading: f64, on: bool) -> Option<f64> {
        if !on {
            (self.filtered, self.sum) = (0, 0.0);
            return Some(reading);
        }
        self.filtered += 1;
        self.sum += reading;
        let mean = (self.filtered >= 4).then_some(self.sum * 0.25);
        if mean.is_some() {
            (self.filtered, self.sum) = (0, 0.0);
        }
        mean
    }
}

/// The reading at standstill: share of the time that the chopper of coil A is on.
pub(crate) fn on_time(field: &Field, motor: &Stepper) -> u16 {
    let (_, cos) = sin_cos(f64::from(field.phase & 1023) * (1.0 / 1024.0));
    let volts = motor.resistance_ohm() * motor.reading.current_square.sqrt() * cos.abs();
    (1023.0 * volts / field.volts.max(0.1)).min(1023.0) as u16
}
