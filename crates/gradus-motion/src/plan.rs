//! The planner of trapezoidal and six-point ramps: from distance, speed and limits to the next phase.
//!
//! A tick first changes the speed, then moves the axis by it. Braking descends a ladder of speeds: the stop speed, then
//! a rung every final deceleration up to the break speed, then a rung every deceleration. The distance needed to rest
//! is the sum of the rungs below the speed, an integer. What is left over when braking begins (the slack) is less than
//! one tick's travel: it becomes one more rung, put in its place in the ladder. So a move ends exactly on its target,
//! no step of the ladder is larger than the deceleration, and nothing is rounded.
//!
//! The planner has no memory. Whatever changes while the axis moves (target, limits, mode), the next phase follows
//! from where the axis is and how fast it goes.

use crate::brake::{Brake, Phase, largest};
use crate::gains::Gains;

/// A distance too far to matter: the planner's target in velocity mode.
pub(crate) const FAR: i128 = 1 << 124;

/// Where a ramp is to go: the planner's question.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg<'a> {
    pub(crate) gains: &'a Gains,
    pub(crate) brake: &'a Brake,
    /// Signed distance to the target.
    pub(crate) distance: i128,
    /// Highest speed on the way, not negative.
    pub(crate) top_speed: i64,
}

impl Leg<'_> {
    /// The next phase for an axis that moves with `speed`; [`Phase::REST`] if it stands and has nowhere to go.
    pub(crate) fn next_phase(&self, speed: i64) -> Phase {
        let backwards = if self.distance == 0 { speed < 0 } else { self.distance < 0 };
        if backwards {
            Leg { distance: -self.distance, ..*self }.forwards(-speed).reversed()
        } else {
            self.forwards(speed)
        }
    }

    /// The next phase towards a target ahead.
    fn forwards(&self, speed: i64) -> Phase {
        if speed < 0 {
            return self.brake.phase(-speed, 0).reversed();
        }
        let slack = self.distance - self.brake.distance(speed);
        if speed > self.top_speed || slack < i128::from(speed) {
            let extra = slack.min(i128::from(self.top_speed)).max(0) as i64;
            return self.brake.phase(speed, extra);
        }
        self.speed_up(speed).unwrap_or_else(|| cruise(speed, slack))
    }

    /// As many ticks of full acceleration as top speed, break speed and distance allow, else a tick of less.
    fn speed_up(&self, speed: i64) -> Option<Phase> {
        let gains = self.gains;
        let below_break = speed < gains.break_speed;
        let step = if below_break { gains.start_acceleration } else { gains.acceleration };
        if step == 0 {
            return None;
        }
        let ceiling = if below_break { gains.break_speed.min(self.top_speed) } else { self.top_speed };
        let reach = ceiling.min(speed + step);
        if speed == 0 && gains.start_speed > reach {
            return self.one_tick_up(speed, gains.start_speed);
        }
        let most = ((ceiling - speed) / step).min(i64::from(u32::MAX));
        match largest(most, |ticks| self.reaches(speed, step, ticks)) {
            0 => self.one_tick_up(speed, reach),
            ticks => Some(Phase::new(step, ticks)),
        }
    }

    /// Whether the axis can still stop at the target after `ticks` more ticks of acceleration.
    fn reaches(&self, speed: i64, step: i64, ticks: i64) -> bool {
        let rest = self.brake.distance(speed + step * ticks);
        let (speed, step, ticks) = (i128::from(speed), i128::from(step), i128::from(ticks));
        speed * ticks + step * (ticks * (ticks + 1) / 2) + rest <= self.distance
    }

    /// One tick to `reach`, or as near to it as top speed and distance allow.
    fn one_tick_up(&self, speed: i64, reach: i64) -> Option<Phase> {
        let faster = self.brake.fastest(reach.min(self.top_speed), self.distance);
        (faster > speed).then(|| Phase::one_tick(speed, faster))
    }
}

/// Ticks of constant speed until braking must begin.
fn cruise(speed: i64, slack: i128) -> Phase {
    if speed == 0 {
        return Phase::REST;
    }
    let ticks = slack / i128::from(speed);
    Phase::new(0, ticks.min(i128::from(u32::MAX)) as i64)
}
