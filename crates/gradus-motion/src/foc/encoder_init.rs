//! Finding the rotor's angle with an encoder that only counts.

use super::commutation::Sensors;
use super::current_loop::CurrentLoop;
use super::modulation::Duties;
use super::settings::{EncoderGains, EncoderInitMode, ServoGains};
use super::vector::Dq;

/// State of the initialisation (TMCM-1617 manual, axis parameter 103; the numbers are those of the parameter).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum InitState {
    /// Nothing to do: not begun, or done.
    #[default]
    Idle = 0,
    /// The current for the alignment is being built up; with hall sensors: has begun.
    Start = 1,
    /// The rotor settles; with hall sensors: waits for one of them to change.
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
}

impl EncoderInit {
    /// Goes on by a cycle: the duties of an alignment, `None` when the motor runs.
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
                EncoderInitMode::Estimate => Self::Aligning(Alignment::new()),
                EncoderInitMode::Hall => Self::Turning(sensors.hall.sector()),
            };
        }
        match self {
            Self::Needed | Self::Done => None,
            Self::Turning(since) => {
                let since = *since;
                self.look_for_edge(since, gains, sensors);
                None
            }
            Self::Aligning(alignment) => {
                let duties = alignment.duties(gains, current, phases_ma);
                if duties.is_none() {
                    sensors.set_encoder_angle(gains.pole_pairs, 0);
                    *current = CurrentLoop::default();
                    *self = Self::Done;
                }
                duties
            }
        }
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

    pub(crate) fn state(&self, gains: &EncoderGains) -> InitState {
        match self {
            Self::Needed | Self::Done => InitState::Idle,
            Self::Aligning(alignment) => alignment.state(gains),
            Self::Turning(Some(_)) => InitState::Wait,
            Self::Turning(None) => InitState::Start,
        }
    }

    pub(crate) fn is_done(&self) -> bool {
        matches!(self, Self::Done)
    }
}

/// An alignment of the rotor: what the field does in each cycle.
///
/// The chip maker's procedure puts a voltage at angle zero and waits. A rotor that stands opposite, where the field
/// does not turn it, would stay there; and nothing says what voltage it is. So here, in quarters of the time:
/// 1. the flux regulator brings the open-loop current to flow a quarter turn ahead; the rotor may swing,
/// 2. the mean of the voltage that it has found is held (a constant voltage brakes a swinging rotor, a constant current
///    does not), and the field turns to zero,
/// 3. the rotor settles,
/// 4. stands, and at the end of that its angle is taken for zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Alignment {
    elapsed: u32,
    angle_q32: u32,
    /// Sum of the voltages in the second half of the first quarter, and how many there were.
    voltages: i64,
    heard: i64,
    /// Their mean.
    voltage: i32,
}

/// What an alignment wants in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pull {
    /// Regulates the current along this angle.
    Current(i16),
    /// Holds a voltage along this angle.
    Voltage(i16, i32),
    /// The rotor is at zero.
    Done,
}

/// A quarter turn.
const AHEAD_Q32: u32 = 1 << 30;

impl Alignment {
    fn new() -> Self {
        Self { elapsed: 0, angle_q32: AHEAD_Q32, voltages: 0, heard: 0, voltage: 0 }
    }

    /// The duties of a cycle, `None` when the rotor is at zero.
    fn duties(&mut self, gains: &ServoGains, current: &mut CurrentLoop, phases_ma: [i32; 2]) -> Option<Duties> {
        match self.cycle(&gains.encoder) {
            Pull::Current(angle) => {
                let target_ma = Dq { d: gains.open_loop_current_ma, q: 0 };
                let duties = current.cycle(&gains.current, angle, phases_ma, target_ma);
                self.hear(&gains.encoder, current.voltage().d);
                Some(duties)
            }
            Pull::Voltage(angle, voltage) => Some(current.apply(angle, phases_ma, Dq { d: voltage, q: 0 })),
            Pull::Done => None,
        }
    }

    #[inline]
    fn cycle(&mut self, gains: &EncoderGains) -> Pull {
        self.elapsed += 1;
        if self.builds_up(gains) {
            return Pull::Current((self.angle_q32 >> 16) as i16);
        }
        if self.elapsed > 4 * gains.quarter_cycles {
            return Pull::Done;
        }
        if self.elapsed == gains.quarter_cycles + 1 {
            self.voltage = self.voltages.checked_div(self.heard).unwrap_or(0) as i32;
        }
        let turns = self.elapsed <= 2 * gains.quarter_cycles;
        self.angle_q32 = if turns { self.angle_q32.saturating_sub(gains.sweep_q32) } else { 0 };
        Pull::Voltage((self.angle_q32 >> 16) as i16, self.voltage)
    }

    /// Hears the voltage that the current of this cycle needs.
    #[inline]
    fn hear(&mut self, gains: &EncoderGains, voltage: i32) {
        if self.elapsed > gains.quarter_cycles / 2 {
            self.voltages += i64::from(voltage);
            self.heard += 1;
        }
    }

    fn state(&self, gains: &EncoderGains) -> InitState {
        match self.elapsed {
            _ if self.builds_up(gains) => InitState::Start,
            elapsed if elapsed <= 3 * gains.quarter_cycles => InitState::Wait,
            _ => InitState::Estimate,
        }
    }

    /// True while the field still stands a quarter turn ahead.
    fn builds_up(&self, gains: &EncoderGains) -> bool {
        self.elapsed <= gains.quarter_cycles
    }
}

#[cfg(test)]
mod tests {
    use super::super::ServoSettings;
    use super::*;

    #[test]
    fn field_stands_then_turns_to_zero_then_waits() {
        let gains = ServoSettings::default().gains().encoder;
        let mut alignment = Alignment::new();
        let pulls: std::vec::Vec<_> = (0..25_000)
            .map(|cycle| {
                let pull = alignment.cycle(&gains);
                if matches!(pull, Pull::Current(_)) {
                    alignment.hear(&gains, if cycle < 3_125 { 9_999 } else { 500 + cycle % 2 * 100 });
                }
                pull
            })
            .collect();
        assert_eq!((pulls[0], pulls[6_249]), (Pull::Current(0x4000), Pull::Current(0x4000)));
        assert_eq!(pulls[9_374], Pull::Voltage(0x2000, 550));
        assert_eq!((pulls[12_500], pulls[24_999]), (Pull::Voltage(0, 550), Pull::Voltage(0, 550)));
        assert_eq!((alignment.state(&gains), alignment.cycle(&gains)), (InitState::Estimate, Pull::Done));
    }
}
