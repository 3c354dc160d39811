//! What the user sets, and what a cycle needs of it.

use super::current_loop::{CurrentGains, MotorKind};
use super::encoder::VelocityWindow;
use super::hall::{HallGains, HallSettings};
use super::pi::{PiGains, PiSettings, VelocityGains};
use super::ramp::{FASTEST_RPM, RampGains};
use super::turns::CountScale;

/// Source of the commutation angle (TMCM-1617 manual, axis parameter 15).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Commutation {
    /// None: the bridge stays open.
    #[default]
    Disabled,
    /// A field that turns with the wanted velocity and drags the rotor along.
    OpenLoop,
    /// Digital hall sensors.
    Hall,
    /// ABN encoder, after it has been initialised.
    Encoder,
}

/// Sensor of the position or velocity regulator (axis parameters 25 and 26).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sensor {
    /// The one that commutates.
    #[default]
    Commutation,
    /// The ABN encoder.
    Encoder,
}

/// Unit of velocities (axis parameter 27).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VelocityUnit {
    /// Turns of the shaft in a minute.
    #[default]
    Mechanical,
    /// Electrical turns in a minute.
    Electrical,
}

/// How the encoder's offset to the rotor is found (axis parameter 102).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EncoderInitMode {
    /// A field pulls the rotor to angle zero, where it comes to rest.
    #[default]
    Estimate,
    /// The rotor turns on its hall sensors until one of them changes.
    Hall,
}

/// ABN encoder (axis parameters 100 to 104).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderSettings {
    /// Counts, four a line, in a turn of the shaft: 1 to 16777215.
    pub counts_per_turn: u32,
    /// Counts the other way.
    pub inverted: bool,
    /// How its offset is found.
    pub init_mode: EncoderInitMode,
    /// Time that [`EncoderInitMode::Estimate`] takes, in ms: 0 to 10000. It takes longer where the rotor has not settled.
    pub init_delay_ms: u32,
}

impl Default for EncoderSettings {
    /// 4096 counts, a second.
    fn default() -> Self {
        Self { counts_per_turn: 4_096, inverted: false, init_mode: EncoderInitMode::Estimate, init_delay_ms: 1_000 }
    }
}

/// All settings of a servo: TMCM-1617 axis parameters 10 to 110. [`Default`] is the module's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoSettings {
    /// Kind of motor (14).
    pub motor: MotorKind,
    /// Pole pairs, 1 to 255 (10).
    pub pole_pairs: u32,
    /// Positive velocities and torques turn the other way (13).
    pub inverted: bool,
    /// Largest torque or flux current in mA, 0 to 18000 (11).
    pub max_current_ma: i32,
    /// Current in mA of open-loop commutation and of the encoder's initialisation, 0 to 18000 (12).
    pub open_loop_current_ma: i32,
    /// Source of the commutation angle (15).
    pub commutation: Commutation,
    /// Sensor of the position (25).
    pub position_sensor: Sensor,
    /// Sensor of the velocity (26).
    pub velocity_sensor: Sensor,
    /// Unit of all velocities and of the acceleration (27).
    pub velocity_unit: VelocityUnit,
    /// Regulators of torque and flux (70, 71): `I e / 65536` each 32 us.
    pub torque: PiSettings,
    /// Regulator of the velocity (72, 73): `I e / 65536` each 256 us.
    pub velocity: PiSettings,
    /// Regulator of the position (74): rpm for each turn of deviation.
    pub position_p: u16,
    /// Largest velocity in rpm, 0 to 200000 (43).
    pub max_velocity_rpm: u32,
    /// Acceleration of the ramp in rpm/s, 0 to 100000 (44).
    pub acceleration_rpm_s: u32,
    /// Velocities and positions are approached on a ramp (45).
    pub ramp: bool,
    /// Hall sensors (90 to 93).
    pub hall: HallSettings,
    /// Encoder (100 to 104).
    pub encoder: EncoderSettings,
    /// Cycles in a second, 25000 to 100000 (110).
    pub pwm_hz: u32,
}

impl Default for ServoSettings {
    fn default() -> Self {
        Self {
            motor: MotorKind::ThreePhase,
            pole_pairs: 4,
            inverted: false,
            max_current_ma: 4_000,
            open_loop_current_ma: 1_000,
            commutation: Commutation::Disabled,
            position_sensor: Sensor::Commutation,
            velocity_sensor: Sensor::Commutation,
            velocity_unit: VelocityUnit::Mechanical,
            torque: PiSettings { p: 300, i: 300 },
            velocity: PiSettings { p: 300, i: 100 },
            position_p: 50,
            max_velocity_rpm: 4_000,
            acceleration_rpm_s: 2_000,
            ramp: true,
            hall: HallSettings::default(),
            encoder: EncoderSettings::default(),
            pwm_hz: 25_000,
        }
    }
}

impl ServoSettings {
    /// What a cycle needs of these settings. Values outside their ranges are taken for the nearest end.
    pub fn gains(&self) -> ServoGains {
        let pwm_hz = self.pwm_hz.clamp(25_000, 100_000);
        let pole_pairs = self.pole_pairs.clamp(1, 255);
        let units_per_rpm = match self.velocity_unit {
            VelocityUnit::Mechanical => 1,
            VelocityUnit::Electrical => pole_pairs,
        };
        ServoGains {
            motor: self.motor,
            commutation: self.commutation,
            position_sensor: self.position_sensor,
            velocity_sensor: self.velocity_sensor,
            pole_pairs,
            direction: if self.inverted { -1 } else { 1 },
            max_current_ma: self.max_current_ma.clamp(0, 32_767),
            open_loop_current_ma: self.open_loop_current_ma.clamp(0, 32_767),
            current: CurrentGains::new(self.torque, self.motor, pwm_hz),
            velocity: PiGains::velocity(self.velocity, pwm_hz),
            position_p_q16: i64::from(self.position_p),
            max_velocity_q16: i64::from(self.max_velocity_rpm.min(FASTEST_RPM)) << 16,
            ramp: self.ramp.then(|| RampGains::new(self.max_velocity_rpm, self.acceleration_rpm_s, units_per_rpm)),
            hall: HallGains::new(self.hall, pole_pairs, pwm_hz),
            encoder: EncoderGains::new(&self.encoder, pwm_hz),
            rpm_per_step: i64::from(60 * pwm_hz) * i64::from(units_per_rpm),
            step_q48_per_rpm: (1 << 48) / (60 * i64::from(pwm_hz) * i64::from(units_per_rpm)),
            pwm_hz,
        }
    }
}

/// Settings of a servo as a cycle needs them: see [`ServoSettings::gains`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoGains {
    pub(crate) motor: MotorKind,
    pub(crate) commutation: Commutation,
    pub(crate) position_sensor: Sensor,
    pub(crate) velocity_sensor: Sensor,
    pub(crate) pole_pairs: u32,
    /// 1, or -1 when the motor turns the other way.
    pub(crate) direction: i32,
    pub(crate) max_current_ma: i32,
    pub(crate) open_loop_current_ma: i32,
    pub(crate) current: CurrentGains,
    pub(crate) velocity: VelocityGains,
    pub(crate) position_p_q16: i64,
    pub(crate) max_velocity_q16: i64,
    pub(crate) ramp: Option<RampGains>,
    pub(crate) hall: HallGains,
    pub(crate) encoder: EncoderGains,
    /// Velocity in rpm of a turn in a cycle.
    pub(crate) rpm_per_step: i64,
    /// Way in a cycle at 1 rpm, 2^48 a turn.
    pub(crate) step_q48_per_rpm: i64,
    pub(crate) pwm_hz: u32,
}

/// The same of the encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EncoderGains {
    pub scale: CountScale,
    pub inverted: bool,
    pub window_shift: u32,
    pub init_mode: EncoderInitMode,
    /// An eighth of the initialisation's time, in cycles, at least one.
    pub eighth_cycles: u32,
    /// How much the field turns in a cycle while it goes from a quarter turn to zero.
    pub sweep_q32: u32,
    /// Cycles after which a rotor that has not moved has settled.
    pub still_cycles: u32,
    /// Cycles in which the rotor must have settled everywhere.
    pub longest_cycles: u32,
}

impl EncoderGains {
    fn new(settings: &EncoderSettings, pwm_hz: u32) -> Self {
        let eighth_cycles = (settings.init_delay_ms.min(10_000) * (pwm_hz / 1_000) / 8).max(1);
        Self {
            scale: CountScale::new(settings.counts_per_turn),
            inverted: settings.inverted,
            window_shift: VelocityWindow::shift(pwm_hz),
            init_mode: settings.init_mode,
            eighth_cycles,
            sweep_q32: (1 << 30) / (2 * eighth_cycles),
            still_cycles: (eighth_cycles / 2).max(pwm_hz / 40),
            longest_cycles: 16 * eighth_cycles + 4 * pwm_hz,
        }
    }
}
