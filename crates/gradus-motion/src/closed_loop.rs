//! Closed loop of a stepper motor with an encoder: load angle, current, field weakening, catching up, and the two PID modes
//! (TMCM-3351 manual §6.3, axis parameters 108 to 126).
//!
//! In each control tick [`State::angle`] says how far the field shall be ahead of the encoder. While the error (ramp minus
//! encoder) is small, the field is where the ramp is, as in open loop. The field never goes farther from the encoder than the
//! largest load angle, so that no step is lost: an overpowered motor drags the field along, and pulls with all it has.
//! [`State::current`] makes the current follow the error, with one slowness up and another one down.
//!
//! When the load is gone, the motor catches up with the ramp. The field may then come nearer to the ramp only with the speed of
//! a PI regulator of the error, which makes the motor arrive without overshoot.
//!
//! Facts are those of the TMC4361A, which does this every few clocks. Here the tick is the interval, in which the motor goes on:
//! the limits of the angle are around the place where the rotor will be in the middle of the tick.
//!
//! Where the facts are silent:
//! - The angle of field weakening adds to the largest load angle in the direction of motion only. A motor that brakes would
//!   lose torque by it.
//! - The speed of catching up limits the field only on its way towards the ramp; it never holds it beyond the largest angle.
//! - The PID modes turn the field by P (115), I (116, 117) and D (124 over an interval of 118 times 8 us, at least a tick) of
//!   the error, all by 1/256, no faster than 119; an error within 125 counts as none.
//!
//! Not here: when it is on, and how it finds out where the rotor is. That is the firmware's.

/// Clocks of the motion controller in a second; the regulator's are 128 of them long.
const CLOCK_HZ: u64 = 16_000_000;
const REGULATOR_HZ: u64 = CLOCK_HZ / 128;

/// Fraction bits of an angle and of a current scale.
const BITS: u32 = 16;

/// Fraction bits of a regulator's gain per tick.
const GAIN_BITS: u32 = 48;

/// Fraction bits of the sum of errors, which is clipped at a multiple of 2^16.
const SUM_BITS: u32 = 8;

/// Largest angle between field and encoder in 1/256 full steps: 180 degrees are 512.
const LARGEST_ANGLE: i64 = 511;

/// What the user sets. Angles and errors are in microsteps, 256 in a full step; a load angle of 90 degrees is 256 of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Largest load angle (axis parameter 111).
    pub beta: u16,
    /// Largest angle that is added at high speed (110).
    pub gamma: u8,
    /// Speed in pps from which an angle is added (108).
    pub gamma_start_pps: u32,
    /// Speed above it, in pps, at which it is complete (109).
    pub gamma_add_pps: u32,
    /// Load angle for an error outside the tolerance, in 1/65536 (124).
    pub position_p: u32,
    /// Error that the field follows one to one (125).
    pub tolerance: u8,
    /// Current scale without load (113).
    pub current_min: u8,
    /// Current scale at the largest load angle (114).
    pub current_max: u8,
    /// Error up to which the current stays at its minimum (126).
    pub start_up: u8,
    /// Clocks of 16 MHz in which the scale rises by one (120).
    pub upscale_clocks: u32,
    /// Clocks in which it falls by one (121).
    pub downscale_clocks: u32,
    /// Speed of catching up: pps for each 256 microsteps of error (115).
    pub speed_p: u32,
    /// Its integral gain: pps for each 2^16 of the sum of errors (116), which grows 125 000 times a second.
    pub speed_i: u32,
    /// Largest sum of errors in 2^16 (117).
    pub speed_i_clip: u16,
    /// Interval of the differential part in regulator clocks of 8 us (118).
    pub speed_d_clock: u16,
    /// Largest speed of catching up in pps (119).
    pub speed_clip_pps: u32,
}

impl Settings {
    /// What a control tick at `tick_hz` needs of these settings.
    pub fn gains(&self, tick_hz: u32) -> Gains {
        let hz = u64::from(tick_hz.max(1));
        let beta = i64::from(self.beta).min(LARGEST_ANGLE);
        let rise = i64::from(self.current_max) - i64::from(self.current_min);
        Gains {
            beta,
            gamma: i64::from(self.gamma),
            gamma_start_pps: self.gamma_start_pps,
            gamma_slope: share(u64::from(self.gamma) << 32, self.gamma_add_pps),
            position_p: self.position_p.into(),
            tolerance: self.tolerance.into(),
            current_min: i64::from(self.current_min) << BITS,
            current_max: i64::from(self.current_max) << BITS,
            start_up: self.start_up.into(),
            current_slope: (rise << BITS).checked_div((beta - i64::from(self.start_up)).max(1)).unwrap_or(0),
            up: share((CLOCK_HZ << BITS) / hz, self.upscale_clocks),
            down: share((CLOCK_HZ << BITS) / hz, self.downscale_clocks),
            p: per_tick(self.speed_p, 8, hz),
            i: per_tick(self.speed_i, 16, hz),
            d: per_tick(self.position_p, 8, hz),
            d_ticks: (u64::from(self.speed_d_clock) * hz).div_ceil(REGULATOR_HZ).clamp(1, u64::from(u32::MAX)) as u32,
            sums: ((REGULATOR_HZ << SUM_BITS) / hz) as i64,
            sum_clip: i64::from(self.speed_i_clip) << (16 + SUM_BITS),
            speed_clip: ((u64::from(self.speed_clip_pps) << BITS) / hz) as i64,
        }
    }
}

/// The quotient; the largest number there is in place of a division by zero.
fn share(dividend: u64, divisor: u32) -> i64 {
    dividend.checked_div(divisor.into()).unwrap_or(u64::from(u32::MAX)) as i64
}

/// A gain in 2^-`bits` pps as microsteps a tick.
fn per_tick(gain: u32, bits: u32, hz: u64) -> i64 {
    let gain = (u128::from(gain) << (GAIN_BITS - bits)).div_ceil(u128::from(hz.max(1)));
    gain.min(i64::MAX as u128) as i64
}

/// Settings per control tick: see [`Settings::gains`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gains {
    beta: i64,
    gamma: i64,
    gamma_start_pps: u32,
    /// Angle for each pps, 32 fraction bits.
    gamma_slope: i64,
    position_p: i64,
    tolerance: i64,
    /// Scales, 16 fraction bits; the slope is for each microstep of error.
    current_min: i64,
    current_max: i64,
    current_slope: i64,
    start_up: i64,
    /// Largest change of the scale in a tick, 16 fraction bits.
    up: i64,
    down: i64,
    /// Microsteps a tick for each microstep of error, or of their sum, 48 fraction bits.
    p: i64,
    i: i64,
    d: i64,
    d_ticks: u32,
    /// How often a tick adds the error to the sum, 8 fraction bits; and where the sum ends.
    sums: i64,
    sum_clip: i64,
    /// Largest speed of catching up in microsteps a tick, 16 fraction bits.
    speed_clip: i64,
}

impl Gains {
    /// Current scale that belongs to an error, 16 fraction bits.
    fn current(&self, error: i64) -> i64 {
        let error = error.abs();
        if error <= self.start_up {
            self.current_min
        } else if error >= self.beta {
            self.current_max
        } else {
            self.current_min + (error - self.start_up) * self.current_slope
        }
    }

    /// The angle that the error alone asks for.
    fn wanted_angle(&self, error: i64) -> i64 {
        if error.abs() <= self.tolerance { error } else { error.saturating_mul(self.position_p) >> 16 }
    }

    /// The largest load angle for an angle of field weakening in the same direction.
    fn largest_angle(&self, gamma: i64) -> i64 {
        (self.beta + gamma.max(0)).min(LARGEST_ANGLE)
    }
}

/// What the loop is to do with an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// Catch up with the ramp, no faster beside the ramp's own speed than the regulator allows.
    Position,
    /// Go after the ramp with all the motor has.
    Speed,
    /// Turn as the error's sign says, no faster than the regulator allows. The ramp stays as far ahead as it is.
    Torque,
}

/// What a tick sees, in microsteps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sight {
    /// Ramp minus encoder.
    pub error: i32,
    /// How far the encoder has gone since the tick before.
    pub moved: i32,
}

/// What moves.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// How far the field lags behind the ramp, 16 fraction bits.
    lag: i64,
    /// Angle that the speed adds, with its sign.
    gamma: i64,
    /// Current scale, 16 fraction bits.
    scale: i64,
    sum: i64,
    /// The differential part: error at its latest sample, change since the one before, ticks to the next.
    error: i64,
    change: i64,
    wait: u32,
    /// The part of a microstep that a PID mode has not yet gone, 16 fraction bits.
    rest: i64,
}

impl State {
    /// A motor that stands without load, with this current scale.
    pub fn new(scale: u8) -> Self {
        Self { scale: i64::from(scale) << BITS, ..Self::default() }
    }

    /// Looks at the averaged speed of the encoder, in pps, for field weakening. It need not be done in every tick.
    pub fn see_speed(&mut self, gains: &Gains, speed_pps: i32) {
        let above = i64::from(speed_pps.unsigned_abs().saturating_sub(gains.gamma_start_pps));
        let gamma = (above.saturating_mul(gains.gamma_slope).saturating_add(1 << 31) >> 32).min(gains.gamma);
        self.gamma = if speed_pps < 0 { -gamma } else { gamma };
    }

    /// How far the field shall be ahead of the encoder in this tick, in microsteps.
    pub fn angle(&mut self, gains: &Gains, sight: Sight, demand: Demand) -> i32 {
        let error = i64::from(sight.error) << BITS;
        let moved = i64::from(sight.moved) << BITS;
        let lowest = moved / 2 - (gains.largest_angle(-self.gamma) << BITS);
        let highest = moved / 2 + (gains.largest_angle(self.gamma) << BITS);
        let wanted = (gains.wanted_angle(sight.error.into()) << BITS).max(lowest).min(highest);
        let lag = match demand {
            Demand::Position => self.nearest_lag(error - wanted, gains, sight.error),
            Demand::Torque => {
                self.lag += moved; // the ramp has gone along with the encoder
                self.nearest_lag(error - wanted, gains, sight.error)
            }
            Demand::Speed => {
                self.sum = 0;
                error - wanted
            }
        };
        let angle = (error - lag).max(lowest).min(highest);
        self.lag = error - angle;
        rounded(angle) as i32
    }

    /// The lag that is wanted, or as near to it as the speed of catching up lets it come in a tick.
    fn nearest_lag(&mut self, wanted: i64, gains: &Gains, error: i32) -> i64 {
        let speed = self.regulate(gains, error.into());
        if error > 0 { wanted.max(self.lag - speed.max(0)) } else { wanted.min(self.lag - speed.min(0)) }
    }

    /// Current scale of this tick, 0 to 255, for an error in microsteps.
    pub fn current(&mut self, gains: &Gains, error: i32) -> u8 {
        self.scale_to(gains, gains.current(error.into()))
    }

    /// Current scale of this tick, 0 to 255, on its way to `scale`, as a torque asks for.
    pub fn current_to(&mut self, gains: &Gains, scale: u8) -> u8 {
        self.scale_to(gains, i64::from(scale) << BITS)
    }

    fn scale_to(&mut self, gains: &Gains, scale: i64) -> u8 {
        self.scale = scale.max(self.scale - gains.down).min(self.scale + gains.up);
        self.scale()
    }

    /// Current scale of the latest tick, 0 to 255.
    pub fn scale(&self) -> u8 {
        rounded(self.scale).clamp(0, 255) as u8
    }

    /// By how many microsteps a PID mode turns the field in this tick, besides what the ramp does.
    pub fn correction(&mut self, gains: &Gains, error: i32) -> i32 {
        let error = if i64::from(error).abs() <= gains.tolerance { 0 } else { i64::from(error) };
        self.differentiate(gains, error);
        let speed = self.regulate(gains, error) + product(gains.d, self.change);
        self.rest += limited(speed, gains.speed_clip);
        let whole = self.rest / (1 << BITS);
        self.rest -= whole << BITS;
        whole as i32
    }

    fn differentiate(&mut self, gains: &Gains, error: i64) {
        self.wait = self.wait.saturating_sub(1);
        if self.wait == 0 {
            self.change = error - self.error;
            self.error = error;
            self.wait = gains.d_ticks;
        }
    }

    /// Speed of catching up, microsteps a tick, 16 fraction bits.
    fn regulate(&mut self, gains: &Gains, error: i64) -> i64 {
        self.sum = limited(self.sum + error * gains.sums, gains.sum_clip);
        let speed = product(gains.p, error) + (product(gains.i, self.sum) >> SUM_BITS);
        limited(speed, gains.speed_clip)
    }
}

/// A gain times an error, 16 fraction bits; cut off where no speed can be.
fn product(gain: i64, error: i64) -> i64 {
    const MOST: i128 = 1 << 60;
    ((i128::from(gain) * i128::from(error)) >> (GAIN_BITS - BITS)).clamp(-MOST, MOST) as i64
}

/// `clamp` without its panic.
fn limited(value: i64, limit: i64) -> i64 {
    value.max(-limit).min(limit)
}

fn rounded(value: i64) -> i64 {
    (value + (1 << (BITS - 1))) >> BITS
}
