//! Finding the rotor's angle with an encoder that only counts.

use super::commutation::Sensors;
use super::current_loop::CurrentLoop;
use super::modulation::Duties;
use super::settings::{EncoderGains, EncoderInitMode, ServoGains};

/// State of the initialisation (TMCM-1617 manual, axis parameter 103; the numbers are those of the parameter).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum InitState {
    /// Nothing to do: not begun, done, or failed.
    #[default]
    Idle = 0,
    /// The field catches the rotor; with hall sensors: has begun.
    Start = 1,
    /// The field turns to zero and the rotor settles there; with hall sensors: waits for one of them to change.
    Wait = 2,
    /// The rotor has settled; the offset is taken at the end.
    Estimate = 3,
}

/// How far the initialisation is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum EncoderInit {
    Needed,
    Aligning(Alignment),
    /// On hall sensors, since this sector.
    Turning(Option<u8>),
    Done,
    Failed,
}

impl EncoderInit {
    /// Goes on by a cycle: the duties of an alignment, `None` when the motor runs, or has failed to.
    #[inline]
    pub(crate) fn cycle(
        &mut self,
        gains: &ServoGains,
        sensors: &mut Sensors,
        current: &mut CurrentLoop,
        phases_ma: [i32; 2],
    ) -> Option<Duties> {
        if matches!(self, Self::Needed) {
            *self = match gains.encoder.init_mode {
                EncoderInitMode::Estimate => Self::Aligning(Alignment::default()),
                EncoderInitMode::Hall => Self::Turning(sensors.hall.sector()),
            };
        }
        match self {
            Self::Needed | Self::Done | Self::Failed => None,
            Self::Turning(since) => {
                let since = *since;
                self.look_for_edge(since, gains, sensors);
                None
            }
            Self::Aligning(alignment) => {
                let step = alignment.step(&gains.encoder, sensors.encoder.position_q32());
                self.align(step, gains, sensors, current, phases_ma)
            }
        }
    }

    #[inline]
    fn align(
        &mut self,
        step: Step,
        gains: &ServoGains,
        sensors: &mut Sensors,
        current: &mut CurrentLoop,
        phases_ma: [i32; 2],
    ) -> Option<Duties> {
        let turned_q32 = match step {
            Step::Pull(angle_q16) => {
                return Some(current.pull(&gains.current, angle_q16, phases_ma, gains.open_loop_current_ma));
            }
            Step::Settled(turned_q32) => turned_q32.saturating_mul(gains.pole_pairs.into()),
            Step::Restless => 0,
        };
        *current = CurrentLoop::default();
        *self = if BACK_Q32.contains(&-turned_q32) { Self::Done } else { Self::Failed };
        sensors.set_encoder_angle(gains.pole_pairs, 0);
        None
    }

    /// Where a hall sensor changes, the rotor's angle is known.
    fn look_for_edge(&mut self, since: Option<u8>, gains: &ServoGains, sensors: &mut Sensors) {
        let now = sensors.hall.sector();
        if since.is_none() {
            *self = Self::Turning(now);
        } else if now != since {
            sensors.set_encoder_angle(gains.pole_pairs, sensors.hall.edge_angle_q16(&gains.hall));
            *self = Self::Done;
        }
    }

    pub(crate) fn state(&self) -> InitState {
        match self {
            Self::Needed | Self::Done | Self::Failed => InitState::Idle,
            Self::Aligning(alignment) => alignment.state(),
            Self::Turning(Some(_)) => InitState::Wait,
            Self::Turning(None) => InitState::Start,
        }
    }

    pub(crate) fn is_done(&self) -> bool {
        matches!(self, Self::Done)
    }

    pub(crate) fn has_failed(&self) -> bool {
        matches!(self, Self::Failed)
    }
}

/// An alignment of the rotor: where the field stands in each cycle.
///
/// The chip maker's procedure puts a voltage at angle zero and waits. A rotor that stands opposite, where the field does
/// not turn it, would stay there; and nothing tells whether the encoder counts what the rotor turns. So here the field
/// 1. stands at half a turn, for an eighth of the time: the rotor comes there, or stays at zero,
/// 2. stands at a quarter turn, for an eighth: wherever the rotor was, it comes there,
/// 3. turns to zero in a quarter of the time, and stands there for a quarter,
/// 4. stands there for a quarter more, and the rotor's angle is taken for zero.
///
/// A place is left, and the angle taken, only when the rotor has settled: when the encoder has not moved for a sixteenth
/// of the time, 25 ms at least. A rotor that goes on swinging after twice the time and four seconds has failed. So has one
/// whose encoder has not counted, from where the rotor had settled at the quarter turn to where it has settled at zero, a
/// quarter turn backwards, roughly: between 15 and 165 degrees, which also an encoder with few lines and a sticky
/// bearing do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Alignment {
    place: Place,
    elapsed: u32,
    /// How far the field has turned from the quarter turn on.
    swept_q32: u32,
    still: Stillness,
    /// Position of the encoder where the rotor had settled at the quarter turn, 2^32 a turn of the shaft.
    quarter_q32: i64,
}

/// Where the field stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Place {
    #[default]
    Half,
    Quarter,
    Zero,
    Rest,
}

/// What an alignment comes to in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// The field stands at this angle.
    Pull(i16),
    /// The rotor has settled at zero and, since it had settled at the quarter turn, has turned so far.
    Settled(i64),
    /// The rotor does not settle.
    Restless,
}

/// A quarter turn.
const QUARTER_Q32: u32 = 1 << 30;

/// Electrical angle backwards by which an encoder shows that it counts the quarter turn: 15 to 165 degrees.
const BACK_Q32: core::ops::Range<i64> = (15 << 32) / 360..(165 << 32) / 360;

impl Alignment {
    #[inline]
    fn step(&mut self, gains: &EncoderGains, position_q32: i64) -> Step {
        self.elapsed = self.elapsed.saturating_add(1);
        self.still.look(position_q32, gains.scale.count_q32());
        if self.elapsed > gains.longest_cycles {
            return Step::Restless;
        }
        if self.elapsed > self.earliest_end(gains) && self.still.cycles >= gains.still_cycles {
            self.still = Stillness { at_q32: position_q32, cycles: 0 };
            match self.place {
                Place::Half => self.place = Place::Quarter,
                Place::Quarter => (self.place, self.quarter_q32) = (Place::Zero, position_q32),
                Place::Zero => self.place = Place::Rest,
                Place::Rest => return Step::Settled(position_q32.wrapping_sub(self.quarter_q32)),
            }
        }
        Step::Pull((self.field_q32(gains) >> 16) as i16)
    }

    /// Cycles since the beginning after which the field may leave its place.
    fn earliest_end(&self, gains: &EncoderGains) -> u32 {
        let eighths = match self.place {
            Place::Half => 1,
            Place::Quarter => 2,
            Place::Zero => 6,
            Place::Rest => 8,
        };
        eighths * gains.eighth_cycles
    }

    fn field_q32(&mut self, gains: &EncoderGains) -> u32 {
        match self.place {
            Place::Half => 2 * QUARTER_Q32,
            Place::Quarter => QUARTER_Q32,
            Place::Zero | Place::Rest => {
                self.swept_q32 = self.swept_q32.saturating_add(gains.sweep_q32).min(QUARTER_Q32);
                QUARTER_Q32 - self.swept_q32
            }
        }
    }

    fn state(&self) -> InitState {
        match self.place {
            Place::Half | Place::Quarter => InitState::Start,
            Place::Zero => InitState::Wait,
            Place::Rest => InitState::Estimate,
        }
    }
}

/// For how long an encoder has stood, give or take a count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Stillness {
    at_q32: i64,
    cycles: u32,
}

impl Stillness {
    #[inline]
    fn look(&mut self, position_q32: i64, count_q32: i64) {
        let moved_q32 = position_q32.wrapping_sub(self.at_q32).unsigned_abs();
        if 2 * moved_q32 > 3 * count_q32.unsigned_abs() {
            *self = Self { at_q32: position_q32, cycles: 0 };
        } else {
            self.cycles = self.cycles.saturating_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ServoSettings;
    use super::*;

    fn gains() -> EncoderGains {
        ServoSettings::default().gains().encoder
    }

    #[test]
    fn field_stands_half_a_turn_and_a_quarter_ahead_then_turns_to_zero() {
        let (gains, mut alignment) = (gains(), Alignment::default());
        let steps: std::vec::Vec<_> = (0..25_001).map(|_| alignment.step(&gains, 0)).collect();
        let places = [(0, i16::MIN), (3_124, i16::MIN), (3_125, 0x4000), (6_249, 0x4000), (9_374, 0x2000), (12_500, 0)];
        for (cycle, angle) in places {
            assert_eq!(steps[cycle], Step::Pull(angle), "in cycle {cycle}");
        }
        assert_eq!(steps[24_999..], [Step::Pull(0), Step::Settled(0)]);
    }

    #[test]
    fn rotor_that_swings_is_waited_for_but_not_for_ever() {
        let gains = gains();
        // The rotor swings by two counts for so many cycles.
        for (swings, end) in [(3_000, Step::Settled(0)), (26_000, Step::Settled(0)), (1_000_000, Step::Restless)] {
            let mut alignment = Alignment::default();
            let mut steps = (1..).map(|cycle| {
                let turned = if cycle < swings { cycle / 100 % 2 * 2 } else { 0 };
                (cycle, alignment.step(&gains, turned * gains.scale.count_q32()))
            });
            let (cycle, last) = steps.find(|(_, step)| !matches!(step, Step::Pull(_))).unwrap();
            assert_eq!(last, end, "{swings}");
            assert!((cycle as u32) <= gains.longest_cycles + 1 && cycle >= swings.min(150_000), "{cycle} of {swings}");
        }
    }
}
