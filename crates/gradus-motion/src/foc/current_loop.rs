//! One cycle of field-oriented control.

use super::angle::sin_cos;
use super::modulation::{Duties, FULL_VOLTAGE, limit_to_circle};
use super::pi::{Pi, PiGains, PiSettings};
use super::vector::{AlphaBeta, Dq};

/// What hangs on the bridge (TMCM-1617 manual, axis parameter 14).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotorKind {
    /// Nothing: the bridge stays open.
    None,
    /// A direct-current motor between phases A and B.
    SinglePhase,
    /// A three-phase motor.
    #[default]
    ThreePhase,
}

/// What a cycle of the current loop needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurrentGains {
    /// Of flux and torque alike.
    pub pi: PiGains,
    /// Kind of motor.
    pub motor: MotorKind,
}

impl CurrentGains {
    /// Gains of regulators that run at `pwm_hz`.
    pub fn new(settings: PiSettings, motor: MotorKind, pwm_hz: u32) -> Self {
        Self { pi: PiGains::current(settings, pwm_hz), motor }
    }
}

/// The regulators of flux and torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentLoop {
    /// Regulator of the flux.
    pub flux: Pi,
    /// Regulator of the torque.
    pub torque: Pi,
    actual_ma: Dq,
    voltage: Dq,
}

impl CurrentLoop {
    /// From the rotor's electrical angle, the currents of phases A and B (-32767 to 32767 mA) and the wanted currents
    /// to the duties that bring them about. With a direct-current motor the angle does not count: the torque current
    /// flows from A to B.
    #[inline]
    pub fn cycle(&mut self, gains: &CurrentGains, angle_q16: i16, phases_ma: [i32; 2], target_ma: Dq) -> Duties {
        match gains.motor {
            MotorKind::ThreePhase => self.three_phase(gains, angle_q16, phases_ma, target_ma),
            MotorKind::SinglePhase => self.single_phase(gains, phases_ma, target_ma.q),
            MotorKind::None => Duties::ZERO,
        }
    }

    #[inline]
    fn three_phase(&mut self, gains: &CurrentGains, angle_q16: i16, phases_ma: [i32; 2], target_ma: Dq) -> Duties {
        let angle = sin_cos(angle_q16);
        let actual = AlphaBeta::from_phases(phases_ma.map(in_range)).to_rotor(angle);
        let wanted = Dq {
            d: self.flux.output(&gains.pi, i64::from(target_ma.d) - i64::from(actual.d), FULL_VOLTAGE),
            q: self.torque.output(&gains.pi, i64::from(target_ma.q) - i64::from(actual.q), FULL_VOLTAGE),
        };
        let (voltage, shortened) = limit_to_circle(wanted);
        let limited = |output: i32| shortened || output.abs() >= FULL_VOLTAGE;
        self.flux.integrate(&gains.pi, wanted.d, limited(wanted.d), FULL_VOLTAGE);
        self.torque.integrate(&gains.pi, wanted.q, limited(wanted.q), FULL_VOLTAGE);
        (self.actual_ma, self.voltage) = (actual, voltage);
        Duties::three_phase(voltage.to_stator(angle))
    }

    #[inline]
    fn single_phase(&mut self, gains: &CurrentGains, [current_ma, _]: [i32; 2], target_ma: i32) -> Duties {
        let actual = in_range(current_ma);
        let error = i64::from(target_ma) - i64::from(actual);
        let voltage = self.torque.cycle(&gains.pi, error, FULL_VOLTAGE);
        (self.actual_ma, self.voltage) = (Dq { d: 0, q: actual }, Dq { d: 0, q: voltage });
        Duties::single_phase(voltage)
    }

    /// Regulates a current along an angle and puts no voltage across it: the field pulls the rotor there, and a rotor that
    /// swings about it is braked by the current that it induces.
    #[inline]
    pub fn pull(&mut self, gains: &CurrentGains, angle_q16: i16, phases_ma: [i32; 2], current_ma: i32) -> Duties {
        let angle = sin_cos(angle_q16);
        self.actual_ma = AlphaBeta::from_phases(phases_ma.map(in_range)).to_rotor(angle);
        let error = i64::from(current_ma) - i64::from(self.actual_ma.d);
        self.voltage = Dq { d: self.flux.cycle(&gains.pi, error, FULL_VOLTAGE), q: 0 };
        Duties::three_phase(self.voltage.to_stator(angle))
    }

    /// Flux and torque current of the last cycle, in mA.
    pub fn actual_ma(&self) -> Dq {
        self.actual_ma
    }

    /// Voltage of the last cycle; [`FULL_VOLTAGE`] is the longest vector.
    pub fn voltage(&self) -> Dq {
        self.voltage
    }
}

#[inline]
fn in_range(current_ma: i32) -> i32 {
    current_ma.clamp(-32_767, 32_767)
}
