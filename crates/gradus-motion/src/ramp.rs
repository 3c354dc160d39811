//! The ramp generator of one axis: its state, and what a control tick does.

use crate::brake::{Brake, Phase};
use crate::course::Course;
use crate::gains::Gains;
use crate::plan::{FAR, Leg};
use crate::s_ramp::Curve;
use crate::s_shape::{ROUNDING, Shape};
use crate::tick_rate::FRACTION_BITS;

const ONE: i64 = 1 << FRACTION_BITS;
const FRACTION_MASK: i64 = ONE - 1;

/// A ramp generator: an axis that moves to a position or with a speed, within its limits.
///
/// Call [`tick`](Self::tick) at the rate that the [`Gains`] were made for. In position mode the axis ends exactly on
/// its target, by the short way round (distances are differences of wrapping 32-bit counters). A target or limit that
/// changes while the axis moves never makes it exceed a limit: if it cannot stop at the new target in time, it brakes
/// to rest and comes back. A speed above a lowered limit is braked down to it.
///
/// A tick of a trapezoid changes the speed, then moves by it: positions run half a tick ahead of continuous motion. The
/// tick after the last step of a move only brings the speed to zero, so a plain trapezoid takes the time of the
/// textbook (and up to three ticks more, where its phases are no whole ticks). An S-shaped ramp moves as in continuous
/// time, and ends in the tick in which continuous motion does.
///
/// With S-shaped ramps also the jerk keeps its limits, whatever changes, but for lower bows: they hold once the
/// acceleration is zero. An axis that turns round passes through zero speed with the acceleration that it has if bows 2
/// and 4 are equal, and comes to rest first if they are not. A start speed comes with the highest acceleration. A ramp
/// that becomes S-shaped, or ceases to be, while the speed changes begins with no acceleration.
#[derive(Clone, Copy, Debug)]
pub struct Ramp {
    gains: Gains,
    mode: Mode,
    target: i32,
    position: Position,
    /// Microsteps a tick, 48 fraction bits.
    speed: i64,
    phase: Phase,
    /// On the way along an S-shaped ramp; then there is no phase.
    curve: Option<Curve>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Position,
    /// Target speed, microsteps a tick.
    Velocity(i64),
    /// Brakes to rest with a deceleration of its own, per tick.
    Stop(i64),
}

impl Ramp {
    /// An axis at rest at position 0, which is also its target.
    pub fn new(gains: Gains) -> Self {
        Self {
            gains,
            mode: Mode::Position,
            target: 0,
            position: Position::default(),
            speed: 0,
            phase: Phase::REST,
            curve: None,
        }
    }

    /// Replaces the limits. They hold from the next tick on, also while moving.
    pub fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
        self.plan();
    }

    /// Position mode: go to `target`.
    pub fn move_to(&mut self, target: i32) {
        self.target = target;
        self.mode = Mode::Position;
        self.plan();
    }

    /// Velocity mode: change to `speed_pps` microsteps per second and keep it; the sign is the direction.
    /// The top speed of position mode does not limit it.
    pub fn rotate(&mut self, speed_pps: i32) {
        let speed = self.gains.rate.speed_per_tick(speed_pps.unsigned_abs());
        self.mode = Mode::Velocity(if speed_pps < 0 { -speed } else { speed });
        self.plan();
    }

    /// Velocity mode: brake to rest with a deceleration of its own (0: within one tick) in place of the limits',
    /// and without bows (TMCM-3351 axis parameter 21).
    pub fn soft_stop(&mut self, deceleration_pps2: u32) {
        self.mode = Mode::Stop(self.gains.rate.deceleration_per_tick(deceleration_pps2));
        self.plan();
    }

    /// Velocity mode: stand still at once.
    pub fn hard_stop(&mut self) {
        self.speed = 0;
        self.curve = None;
        self.mode = Mode::Velocity(0);
        self.plan();
    }

    /// Overwrites the position counter. A standing axis gets the same target, so that nothing moves; a moving one goes
    /// on towards its unchanged target.
    pub fn set_position(&mut self, position: i32) {
        self.position.whole = position;
        if self.is_idle() {
            self.target = position;
        } else {
            self.plan();
        }
    }

    /// Overwrites the target without a change of mode: in velocity mode nothing moves.
    pub fn set_target(&mut self, target: i32) {
        self.target = target;
        self.plan();
    }

    /// Advances by one control tick. Free of divisions except in a tick in which a phase (of an S-shaped ramp: a stage
    /// of constant jerk) ends; does nothing when idle.
    pub fn tick(&mut self) {
        if self.phase.ticks == 0 {
            return self.tick_curve();
        }
        self.speed += self.phase.acceleration;
        self.position.advance(self.speed);
        self.phase.ticks -= 1;
        if self.phase.ticks == 0 {
            self.plan();
        }
    }

    fn tick_curve(&mut self) {
        let Some(curve) = &mut self.curve else { return };
        self.position.advance(curve.tick());
        self.speed = curve.speed();
        if curve.is_over() {
            self.plan();
        }
    }

    /// Position counter in microsteps. It wraps.
    pub fn position(&self) -> i32 {
        self.position.whole
    }

    /// Target position in microsteps, as last set; velocity mode leaves it alone.
    pub fn target(&self) -> i32 {
        self.target
    }

    /// Speed in microsteps per second, rounded towards zero. At constant speed it is exactly the speed asked for.
    pub fn speed_pps(&self) -> i32 {
        self.gains.rate.pps(self.speed)
    }

    /// Acceleration planned for the coming tick in microsteps per second squared, rounded towards zero; negative when a
    /// positive speed falls.
    pub fn acceleration_pps2(&self) -> i32 {
        self.gains.rate.pps2(self.curve.as_ref().map_or(self.phase.acceleration, Curve::acceleration))
    }

    /// Whether the position equals the target and, in position mode, the axis stands.
    pub fn at_target(&self) -> bool {
        self.position() == self.target && (self.mode != Mode::Position || self.speed == 0)
    }

    /// Whether the axis is in position mode.
    pub fn is_positioning(&self) -> bool {
        self.mode == Mode::Position
    }

    /// Whether the axis stands and has nothing to do: ticks may be left out.
    pub fn is_idle(&self) -> bool {
        self.phase.ticks == 0 && self.curve.is_none()
    }

    /// What a line has to know of the axis.
    pub fn course(&self) -> Course<'_> {
        Course { distance: self.distance(), gains: &self.gains }
    }

    /// Distance to the target by the short way.
    pub(crate) fn distance(&self) -> i32 {
        self.target.wrapping_sub(self.position.whole)
    }

    /// Position with 32 fraction bits relative to that of position 0.
    pub(crate) fn position_q32(&self) -> i64 {
        (i64::from(self.position.whole) << 32) | (self.position.fraction >> (FRACTION_BITS - 32))
    }

    /// Speed in microsteps a tick, 48 fraction bits.
    pub(crate) fn speed(&self) -> i64 {
        self.speed
    }

    /// Acceleration of an S-shaped ramp, 48 fraction bits; 0 for other ramps.
    pub(crate) fn curve_acceleration(&self) -> i64 {
        self.curve.as_ref().map_or(0, Curve::acceleration)
    }

    /// A tick led by something else: moves by `travel` and takes over the speed, and the acceleration if its own ramp
    /// is S-shaped. Left alone afterwards, the axis goes on by itself.
    pub(crate) fn lead(&mut self, travel: i64, speed: i64, acceleration: i64) {
        self.position.advance(travel);
        self.speed = speed;
        self.curve = self.gains.bows.map(|bows| Curve::new(speed, acceleration, bows));
        self.phase = if self.curve.is_some() { Phase::REST } else { Phase { acceleration: 0, ticks: 1 } };
    }

    /// Plans what comes next from the present state.
    pub(crate) fn plan(&mut self) {
        match (self.gains.bows, self.mode) {
            (Some(bows), Mode::Position) => {
                let distance = self.position.distance_to(self.target);
                self.plan_curve(bows, distance as f64 / ONE as f64, self.gains.top_speed);
            }
            (Some(bows), Mode::Velocity(speed)) => {
                let distance = if speed < 0 { f64::NEG_INFINITY } else { f64::INFINITY };
                self.plan_curve(bows, distance, speed.abs());
            }
            _ => self.plan_phase(),
        }
        if self.is_idle() {
            self.position.fraction = 0; // an axis stands on a whole microstep
        }
    }

    /// Plans an S-shaped ramp, unless the axis stands and is where it shall be.
    fn plan_curve(&mut self, bows: [i128; 4], distance: f64, top_speed: i64) {
        let curve = self.curve.unwrap_or_else(|| Curve::new(self.speed, 0, bows));
        let bows = curve.bows(bows);
        self.phase = Phase::REST;
        self.curve = None;
        if curve.stands() && distance.abs() <= ROUNDING {
            self.position = Position { whole: self.target, fraction: 0 };
            return;
        }
        let plan = Shape::new(&self.gains, bows).plan(curve.motion(), distance, top_speed);
        if !plan.is_empty() {
            self.curve = Some(curve.follow(plan, bows));
        }
    }

    /// Plans the next phase of a trapezoidal or six-point ramp.
    fn plan_phase(&mut self) {
        self.curve = None;
        let linear;
        let (brake, distance, top_speed) = match self.mode {
            Mode::Position => (&self.gains.brake, self.position.distance_to(self.target), self.gains.top_speed),
            Mode::Velocity(speed) => (&self.gains.brake, if speed < 0 { -FAR } else { FAR }, speed.abs()),
            Mode::Stop(deceleration) => {
                linear = Brake::linear(deceleration);
                (&linear, FAR, 0)
            }
        };
        self.phase = Leg { gains: &self.gains, brake, distance, top_speed }.next_phase(self.speed);
    }
}

/// A wrapping microstep counter and the fraction of the next microstep.
#[derive(Clone, Copy, Debug, Default)]
struct Position {
    whole: i32,
    /// 0 to 2^48 - 1.
    fraction: i64,
}

impl Position {
    fn advance(&mut self, travel: i64) {
        let sum = self.fraction + travel;
        self.whole = self.whole.wrapping_add((sum >> FRACTION_BITS) as i32);
        self.fraction = sum & FRACTION_MASK;
    }

    /// Distance by the short way, 48 fraction bits.
    fn distance_to(&self, target: i32) -> i128 {
        (i128::from(target.wrapping_sub(self.whole)) << FRACTION_BITS) - i128::from(self.fraction)
    }
}
