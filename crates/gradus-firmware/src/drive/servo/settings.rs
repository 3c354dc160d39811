//! A servo's parameters: what the user has set, and what a tick needs of it.

use gradus_motion::foc::{
    Commutation, EncoderInitMode, EncoderSettings, HallSettings, MotorKind, PiSettings, Sensor, ServoSettings,
    VelocityUnit,
};
use gradus_tmcl::catalogue::Ap;

use crate::drive::stepper::settings::Settings;
use crate::drive::ticks::Period;

/// Clock of the PWM counter in Hz; a period is a whole number of its ticks.
const PWM_CLOCK_HZ: u32 = 100_000_000;
const PWM_CLOCK_NS: u32 = 1_000_000_000 / PWM_CLOCK_HZ;

impl Settings {
    /// Settings of the regulators (axis parameters 10 to 110).
    pub(crate) fn servo(&self) -> ServoSettings {
        let pi = |p, i| PiSettings { p: self.word(p), i: self.word(i) };
        ServoSettings {
            motor: self.motor(),
            pole_pairs: self.unsigned(Ap::PolePairs),
            inverted: self.is_set(Ap::MotorDirection),
            max_current_ma: self.get(Ap::MaxCurrent),
            open_loop_current_ma: self.get(Ap::OpenLoopCurrent),
            commutation: self.commutation(),
            position_sensor: self.sensor(Ap::PositionSensor),
            velocity_sensor: self.sensor(Ap::VelocitySensor),
            velocity_unit: if self.is_set(Ap::VelocityUnit) {
                VelocityUnit::Electrical
            } else {
                VelocityUnit::Mechanical
            },
            torque: pi(Ap::TorqueP, Ap::TorqueI),
            velocity: pi(Ap::VelocityP, Ap::VelocityI),
            position_p: self.word(Ap::PositionP),
            max_velocity_rpm: self.unsigned(Ap::MaxSpeed),
            acceleration_rpm_s: self.unsigned(Ap::MaxAcceleration),
            ramp: self.is_set(Ap::VelocityRampEnable),
            hall: self.hall(),
            encoder: self.encoder(),
            pwm_hz: self.unsigned(Ap::PwmFrequencyHz),
        }
    }

    fn motor(&self) -> MotorKind {
        match self.get(Ap::MotorType) {
            0 => MotorKind::None,
            1 => MotorKind::SinglePhase,
            _ => MotorKind::ThreePhase,
        }
    }

    fn commutation(&self) -> Commutation {
        match self.get(Ap::CommutationMode) {
            1 => Commutation::OpenLoop,
            2 => Commutation::Hall,
            3 => Commutation::Encoder,
            _ => Commutation::Disabled,
        }
    }

    fn sensor(&self, id: Ap) -> Sensor {
        if self.is_set(id) { Sensor::Encoder } else { Sensor::Commutation }
    }

    fn hall(&self) -> HallSettings {
        HallSettings {
            inverted_polarity: self.is_set(Ap::HallPolarity),
            inverted_direction: self.is_set(Ap::HallDirection),
            interpolation: self.is_set(Ap::HallInterpolation),
            offset_q16: self.get(Ap::HallOffset) as i16,
        }
    }

    fn encoder(&self) -> EncoderSettings {
        EncoderSettings {
            counts_per_turn: self.unsigned(Ap::EncoderSteps),
            inverted: self.is_set(Ap::EncoderDirection),
            init_mode: if self.is_set(Ap::EncoderInitMode) { EncoderInitMode::Hall } else { EncoderInitMode::Estimate },
            init_delay_ms: self.unsigned(Ap::EncoderInitDelay),
        }
    }

    /// Period of the PWM (axis parameter 110): the nearest that its counter can make.
    pub(crate) fn pwm_period(&self) -> Period {
        let hz = self.unsigned(Ap::PwmFrequencyHz).max(1);
        Period::from_ns((PWM_CLOCK_HZ + hz / 2) / hz * PWM_CLOCK_NS)
    }

    /// What else a tick needs.
    pub(crate) fn derive_servo(&self) -> ServoDerived {
        let get = |id| self.get(id);
        let pwm_hz = self.unsigned(Ap::PwmFrequencyHz);
        ServoDerived {
            shunt_offsets: [get(Ap::AdcI0Offset), get(Ap::AdcI1Offset)],
            drives: self.motor() != MotorKind::None && self.commutation() != Commutation::Disabled,
            hall_commutates: self.commutation() == Commutation::Hall,
            encoder_commutates: self.commutation() == Commutation::Encoder,
            chopper: self.is_set(Ap::BrakeChopper).then(|| {
                let limit = get(Ap::BrakeChopperLimit);
                (limit, limit - get(Ap::BrakeChopperHysteresis))
            }),
            switch_enable: get(Ap::ReferenceSwitchEnable) as u8,
            switch_polarity: get(Ap::ReferenceSwitchPolarity) as u8,
            quiet_ticks: pwm_hz / 4,
            patience: pwm_hz / 1000,
        }
    }

    fn is_set(&self, id: Ap) -> bool {
        self.get(id) != 0
    }

    fn word(&self, id: Ap) -> u16 {
        self.get(id).clamp(0, i32::from(u16::MAX)) as u16
    }
}

/// What a tick of a servo needs of the settings, besides the gains of its regulators.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ServoDerived {
    /// Readings of the shunts without current (axis parameters 5, 6).
    pub(crate) shunt_offsets: [i32; 2],
    /// There is a motor and something commutates it (axis parameters 14, 15).
    pub(crate) drives: bool,
    pub(crate) hall_commutates: bool,
    pub(crate) encoder_commutates: bool,
    /// Voltages in 0.1 V from which the brake chopper is on and below which it is off again (axis parameters 140 to 142).
    pub(crate) chopper: Option<(i32, i32)>,
    /// Bits of right, left and home (axis parameters 209, 210).
    pub(crate) switch_enable: u8,
    pub(crate) switch_polarity: u8,
    /// Ticks after which a rotor that has not moved is at rest: a quarter of a second.
    pub(crate) quiet_ticks: u32,
    /// Ticks for which hall sensors may be wrong: a millisecond.
    pub(crate) patience: u32,
}
