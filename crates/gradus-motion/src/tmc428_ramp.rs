//! The ramp generator of the TMC428.
//!
//! The chip works in ticks of its own, `16e6 / (32 * 2^ramp_div)` a second. In each of them the speed, which has 8 fraction
//! bits, may change by `a_max / 256`, and the pulse generator goes on with it meanwhile. Every sum here is exact: a span of 32
//! clocks moves by a whole number of 2^-32 microsteps at every setting.
//!
//! In position mode the chip holds the product `p * (x_target - x_actual)` against the speed it has: against `v^2 / 2048` in
//! ramp mode, against `v` itself in soft mode. A greater product lets it speed up, a smaller one makes it brake. So ramp mode
//! brakes evenly, and with the ideal `p` exactly by `a_max`; the smaller one that the firmware takes makes the approach a little
//! slower. (A real chip may pass its target by a microstep; this one looks a tick ahead and does not.) In soft mode the speed falls exponentially, and the last microsteps have the minimum speed. The data sheet of the chip
//! gives only `p = 2048 / S`, where `S` is the way that braking from speed 2048 takes: at that speed both laws agree.
//!
//! Where the firmware finds no `p` it writes one that fits nothing: large accelerations then creep to their target, and very
//! small ones may pass it and come back.

use crate::course::Course;
use crate::interpolation::Line;
use crate::tmc428::{SPEED_BITS, SPEED_OF_TRAVEL_BITS, Tmc428Gains};

/// Fraction bits of a position.
const POSITION_BITS: u32 = 32;

/// How an axis approaches its target (axis parameter 138).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Approach {
    /// Ramp mode: even braking, a trapezoid.
    #[default]
    Ramp,
    /// Soft mode: the speed falls exponentially.
    Soft,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Position,
    /// Target speed in 1/256 of a unit.
    Velocity(i64),
}

/// An axis of the chip.
///
/// Call [`tick`](Self::tick) at the rate that the [`Tmc428Gains`] were made for; it does the chip's ticks that lie within, 50 at
/// the most at 10 kHz. Positions have 32 bits, as the firmware extends those of the chip, and the way to a target is the short
/// one. A position is that of the nearest microstep; a standing axis is exactly there.
///
/// ```
/// use gradus_motion::{Tmc428Limits, Tmc428Ramp, Tmc428Units};
///
/// let units = Tmc428Units { pulse_div: 3, ramp_div: 7 };
/// let limits = Tmc428Limits { units, min_speed: 1, max_speed: 1000, acceleration: 500 };
/// let mut axis = Tmc428Ramp::new(limits.gains(10_000));
/// axis.move_to(10_000);
/// while !axis.is_idle() {
///     axis.tick();
/// }
/// assert_eq!(axis.position(), 10_000);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Tmc428Ramp {
    gains: Tmc428Gains,
    approach: Approach,
    mode: Mode,
    target: i32,
    /// Microsteps with 32 fraction bits, wrapping.
    position: i64,
    /// In 1/256 of a unit.
    speed: i64,
    /// Spans to the next tick of the ramp generator.
    spans_left: u32,
}

impl Tmc428Ramp {
    /// An axis at rest at position 0, which is also its target.
    pub fn new(gains: Tmc428Gains) -> Self {
        let spans_left = gains.ramp_spans;
        let (approach, mode) = (Approach::Ramp, Mode::Position);
        Self { gains, approach, mode, target: 0, position: 0, speed: 0, spans_left }
    }

    /// Replaces the limits, also while moving.
    pub fn set_gains(&mut self, gains: Tmc428Gains) {
        self.gains = gains;
        self.spans_left = self.spans_left.min(gains.ramp_spans);
    }

    /// How the axis approaches its targets from now on.
    pub fn set_approach(&mut self, approach: Approach) {
        self.approach = approach;
    }

    /// How the axis approaches its targets.
    pub fn approach(&self) -> Approach {
        self.approach
    }

    /// Position mode: go to `target`.
    pub fn move_to(&mut self, target: i32) {
        self.target = target;
        self.mode = Mode::Position;
    }

    /// Velocity mode: change to `speed`, -2047 to 2047, and keep it.
    pub fn rotate(&mut self, speed: i32) {
        self.mode = Mode::Velocity(i64::from(speed) << SPEED_BITS);
        self.settle();
    }

    /// Velocity mode: stand still at once.
    pub fn hard_stop(&mut self) {
        self.speed = 0;
        self.rotate(0);
    }

    /// Overwrites the position counter. A standing axis gets the same target, so that nothing moves; a moving one goes on
    /// towards its unchanged target.
    pub fn set_position(&mut self, position: i32) {
        if self.is_idle() {
            self.target = position;
        }
        self.position = whole(position);
    }

    /// Overwrites the target without a change of mode.
    pub fn set_target(&mut self, target: i32) {
        self.target = target;
    }

    /// Advances by one control tick; does nothing when idle.
    pub fn tick(&mut self) {
        if self.is_idle() {
            return;
        }
        let mut spans = self.gains.tick_spans;
        while spans > 0 {
            let portion = spans.min(self.spans_left);
            self.travel(portion);
            spans -= portion;
            self.spans_left -= portion;
            if self.spans_left == 0 {
                self.spans_left = self.gains.ramp_spans;
                self.speed = self.next_speed();
            }
        }
        self.settle();
    }

    /// Follows a line in place of its own ramp.
    pub(crate) fn follow<const N: usize>(&mut self, line: &Line<N>, axis: usize) {
        let Some(place) = line.place(axis) else { return };
        let travel = place.speed_q48 >> (48 - POSITION_BITS);
        self.speed = travel.wrapping_mul(self.gains.speed_of_travel) >> SPEED_OF_TRAVEL_BITS;
        self.position = whole(self.target).wrapping_add(place.from_target_q32);
        if line.is_done() {
            self.speed = 0;
        }
    }
}

// The chip.
impl Tmc428Ramp {
    /// Moves for so many spans with the present speed. An axis that is slow enough to stop at once stops at its target.
    fn travel(&mut self, spans: u32) {
        let way = self.way(self.speed, spans);
        let slow = self.gains.min_speed.max(2 * self.gains.acceleration);
        if self.mode == Mode::Position && self.speed.abs() <= slow && self.passes_target(way) {
            self.position = whole(self.target);
            self.speed = 0;
        } else {
            self.position = self.position.wrapping_add(way);
        }
    }

    fn way(&self, speed: i64, spans: u32) -> i64 {
        (speed * i64::from(spans)) << self.gains.travel_shift
    }

    fn passes_target(&self, way: i64) -> bool {
        let distance = self.distance();
        way.signum() == distance.signum() && way.unsigned_abs() >= distance.unsigned_abs()
    }

    /// What a tick of the ramp generator makes of the speed.
    fn next_speed(&self) -> i64 {
        let (speed, step) = (self.speed, self.gains.acceleration);
        match (self.mode, self.distance()) {
            (Mode::Velocity(target), _) => nearer(target, speed, step),
            (Mode::Position, 0) => nearer(0, speed, step),
            (Mode::Position, distance) if distance > 0 => self.towards(speed, distance),
            (Mode::Position, distance) => -self.towards(-speed, distance.saturating_neg()),
        }
    }

    /// The next speed on the way to a target ahead.
    fn towards(&self, speed: i64, distance: i64) -> i64 {
        let Tmc428Gains { acceleration, min_speed, max_speed, .. } = self.gains;
        if speed < 0 || speed > max_speed {
            return nearer(max_speed, speed, acceleration);
        }
        let faster = (speed + acceleration).min(max_speed);
        let kept = if self.can_stop_from(faster, distance) {
            faster
        } else if self.can_stop_from(speed, distance) {
            speed
        } else {
            speed - acceleration
        };
        kept.max(min_speed.min(faster))
    }

    /// Whether the distance is long enough for one more tick at a speed: p * distance, with 16 fraction bits, against what the
    /// speed needs.
    fn can_stop_from(&self, speed: i64, distance: i64) -> bool {
        let left = distance.saturating_sub(self.way(speed, self.gains.ramp_spans));
        let reach = (self.gains.p_mul * (left >> (POSITION_BITS - SPEED_BITS))) << 5 >> self.gains.pdiv;
        let needed = match self.approach {
            Approach::Ramp => (speed * speed) >> 11,
            Approach::Soft => speed << SPEED_BITS,
        };
        needed <= reach
    }

    /// Distance to the target by the short way, 32 fraction bits.
    fn distance(&self) -> i64 {
        whole(self.target).wrapping_sub(self.position)
    }

    /// A standing axis is on a whole microstep.
    fn settle(&mut self) {
        if self.is_idle() {
            self.position = whole(self.position());
        }
    }
}

// What can be read.
impl Tmc428Ramp {
    /// Position counter in microsteps. It wraps.
    pub fn position(&self) -> i32 {
        (self.position.wrapping_add(1 << (POSITION_BITS - 1)) >> POSITION_BITS) as i32
    }

    /// Target position in microsteps, as last set; velocity mode leaves it alone.
    pub fn target(&self) -> i32 {
        self.target
    }

    /// Speed in units of the chip, rounded towards zero: an axis of speed 0 may still move.
    pub fn speed(&self) -> i32 {
        (self.speed / (1 << SPEED_BITS)) as i32
    }

    /// The speed that the chip strives for: in position mode the top speed until it brakes, then 0 (axis parameter 2).
    pub fn target_speed(&self) -> i32 {
        let top = self.gains.max_speed;
        let target = match self.mode {
            Mode::Velocity(target) => target,
            Mode::Position if self.is_braking() => 0,
            Mode::Position => top * self.distance().signum(),
        };
        (target >> SPEED_BITS) as i32
    }

    fn is_braking(&self) -> bool {
        let next = self.next_speed();
        next.abs() <= self.speed.abs() && next.abs() != self.gains.max_speed
    }

    /// Acceleration at this moment in units of the chip, 0 at constant speed (axis parameter 135).
    pub fn acceleration(&self) -> i32 {
        let ramps = match self.mode {
            Mode::Velocity(target) => self.speed != target,
            Mode::Position => !self.is_idle() && self.speed.abs() != self.gains.max_speed,
        };
        if ramps { self.gains.acceleration as i32 } else { 0 }
    }

    /// Whether the position equals the target and, in position mode, the axis stands.
    pub fn at_target(&self) -> bool {
        self.position() == self.target && (self.mode != Mode::Position || self.speed == 0)
    }

    /// Whether the axis is in position mode.
    pub fn is_positioning(&self) -> bool {
        self.mode == Mode::Position
    }

    /// Whether the axis stands and has nothing to do: ticks may be left out. Without an acceleration, or in position mode
    /// without a top speed, it cannot start.
    pub fn is_idle(&self) -> bool {
        self.speed == 0
            && (self.gains.acceleration == 0
                || match self.mode {
                    Mode::Velocity(target) => target == 0,
                    Mode::Position => self.distance() == 0 || self.gains.max_speed == 0,
                })
    }

    /// What a line has to know of the axis.
    pub fn course(&self) -> Course<'_> {
        Course { distance: self.target.wrapping_sub(self.position()), gains: &self.gains.path }
    }
}

/// A speed that is nearer to `target` by a step.
fn nearer(target: i64, speed: i64, step: i64) -> i64 {
    target.max(speed - step).min(speed + step)
}

fn whole(position: i32) -> i64 {
    i64::from(position) << POSITION_BITS
}
