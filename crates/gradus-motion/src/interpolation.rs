//! Linear interpolation: several axes that start together, keep their proportions and arrive in the same tick.
//!
//! The axis with the longest way sets the path; a ramp of the path's own leads all axes. Each moves by its share of
//! the path, so the line in space is straight to 2^-31 microsteps. The path counts down to zero, where every share is
//! zero too: nothing is left over at the end.

use crate::course::Course;
use crate::gains::Gains;
use crate::limits::Limits;
use crate::ramp::Ramp;
use crate::tick_rate::FRACTION_BITS;

/// Fraction bits of a share.
const SHARE_BITS: u32 = 62;

/// A straight move of up to `N` axes.
///
/// Set the targets with [`Ramp::move_to`] while the axes stand and make a `Line` of them. Then, in every control tick,
/// call [`tick`](Self::tick) once and [`lead`](Self::lead) for each axis in place of [`Ramp::tick`], until the line
/// [is done](Self::is_done). An axis that is no longer led (stopped, or sent elsewhere) goes on from its present speed
/// by its own limits.
///
/// The longest move keeps its own limits as far as no other axis would exceed its own: the path takes the lowest of
/// all limits, each scaled to the path. Where a shorter move has a break speed, the lower of its two accelerations
/// counts. The path is S-shaped if the ramp of the longest move is; it keeps the bows of the others too, as far as they
/// are S-shaped. Limits set later do not change the line. If one of the axes cannot move at all (a limit of zero), the line
/// is done at once and each goes by itself.
///
/// ```
/// use gradus_motion::{Limits, Line, Ramp};
///
/// let limits = Limits { max_speed_pps: 51_200, acceleration: 51_200, deceleration: 51_200, ..Limits::default() };
/// let mut axes = [Ramp::new(limits.gains(10_000)); 2];
/// axes[0].move_to(51_200);
/// axes[1].move_to(-12_800);
/// let mut line = Line::new(axes.each_ref().map(|axis| Some(axis.course())));
/// while !line.is_done() {
///     line.tick();
///     for (number, axis) in axes.iter_mut().enumerate() {
///         line.lead(number, axis);
///     }
/// }
/// assert!(axes.iter().all(|axis| axis.at_target() && axis.is_idle()));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Line<const N: usize> {
    path: Ramp,
    axes: [Share; N],
}

/// One axis on the line.
#[derive(Clone, Copy, Debug)]
struct Share {
    distance: i32,
    /// Distance as a part of the path's length, 62 fraction bits.
    share: i64,
    /// Position relative to the target, 32 fraction bits; it wraps.
    position: i64,
    /// Way and speed of the last tick, 48 fraction bits.
    travel: i64,
    speed: i64,
    /// On an S-shaped path, 48 fraction bits.
    acceleration: i64,
}

/// Where a line has led an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Position relative to the target, 32 fraction bits; it wraps.
    pub(crate) from_target_q32: i64,
    /// Microsteps a tick, 48 fraction bits.
    pub(crate) speed_q48: i64,
}

impl<const N: usize> Line<N> {
    /// A line for axes that stand, each with its target set; `None` takes no part.
    pub fn new(axes: [Option<Course>; N]) -> Self {
        let mut path = Ramp::new(Limits::default().gains(1));
        let mut length = 0;
        if let Some(farthest) = axes.iter().flatten().max_by_key(|axis| axis.distance.unsigned_abs()) {
            length = farthest.distance.max(-i32::MAX); // the one distance without a positive counterpart is cut short
            path.set_position(-length);
            path.set_gains(path_gains(farthest, &axes));
            path.move_to(0);
        }
        Self { path, axes: axes.map(|axis| Share::new(axis.map_or(0, |axis| axis.distance), length)) }
    }

    /// Advances the path by one control tick.
    pub fn tick(&mut self) {
        self.path.tick();
        for axis in &mut self.axes {
            axis.follow(&self.path);
        }
    }

    /// Moves axis number `axis` as far as the last tick took it. An axis that takes no part is left alone.
    pub fn lead(&self, axis: usize, ramp: &mut Ramp) {
        let Some(share) = self.axes.get(axis).filter(|share| share.distance != 0) else { return };
        ramp.lead(share.travel, share.speed, share.acceleration);
        if self.is_done() {
            ramp.plan();
        }
    }

    /// Where the last tick took axis number `axis`, if it takes part.
    pub(crate) fn place(&self, axis: usize) -> Option<Place> {
        let share = self.axes.get(axis).filter(|share| share.distance != 0)?;
        Some(Place { from_target_q32: share.position, speed_q48: share.speed })
    }

    /// Whether axis number `axis` takes part: it has a way to go.
    pub fn leads(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(|share| share.distance != 0)
    }

    /// Whether the line has come to its end.
    pub fn is_done(&self) -> bool {
        self.path.is_idle()
    }
}

impl Share {
    fn new(distance: i32, length: i32) -> Self {
        let share = (i128::from(distance) << SHARE_BITS).checked_div(i128::from(length)).unwrap_or(0);
        Self {
            distance,
            share: share as i64,
            position: (i64::from(distance) << 32).wrapping_neg(),
            travel: 0,
            speed: 0,
            acceleration: 0,
        }
    }

    fn follow(&mut self, path: &Ramp) {
        let position = self.of(path.position_q32());
        self.travel = position.wrapping_sub(self.position) << (FRACTION_BITS - 32);
        self.position = position;
        self.speed = self.of(path.speed());
        self.acceleration = self.of(path.curve_acceleration());
    }

    fn of(&self, value: i64) -> i64 {
        ((i128::from(value) * i128::from(self.share)) >> SHARE_BITS) as i64
    }
}

/// The limits of the path: those of the axis with the longest way, lowered to what the others allow.
fn path_gains<const N: usize>(farthest: &Course, axes: &[Option<Course>; N]) -> Gains {
    let others = axes.iter().flatten().filter(|axis| !core::ptr::eq(*axis, farthest) && axis.distance != 0);
    let length = farthest.distance.unsigned_abs();
    others.fold(*farthest.gains, |path, axis| path.lowered(axis.gains, length, axis.distance.unsigned_abs()))
}
