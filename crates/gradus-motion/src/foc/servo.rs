//! The servo: cascade of regulators around one motor.

use super::commutation::Sensors;
use super::current_loop::{CurrentLoop, MotorKind};
use super::encoder_init::{EncoderInit, InitState};
use super::filter::Pt1;
use super::modulation::Duties;
use super::pi::VelocityPi;
use super::ramp::ServoRamp;
use super::settings::{Commutation, ServoGains};
use super::vector::Dq;
use super::within;

/// What is measured in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Feedback {
    /// Currents into the motor at phases A and B, in mA.
    pub phases_ma: [i32; 2],
    /// Hall sensors, three bits.
    pub hall_bits: u8,
    /// Counter of the encoder; may wrap.
    pub encoder_count: i32,
}

/// What is regulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Torque and flux current.
    #[default]
    Current,
    /// Velocity.
    Velocity,
    /// Position.
    Position,
}

/// A motor with its sensors under field-oriented control.
///
/// [`cycle`](Self::cycle) runs once a PWM period while the bridge is on, [`idle`](Self::idle) while it is off. Modes
/// change while the motor runs, without a jump of the torque:
/// - in current mode the ramp follows the measured velocity and position, and the velocity regulator starts with the
///   torque that flows;
/// - in velocity mode the ramp follows the measured position;
/// - a position ramp starts where the rotor is, with the velocity that it was to have.
///
/// In position mode the ramp's velocity is fed forward: the position regulator adds to it what the deviation needs, so that a
/// motor that follows its ramp has no deviation. Without a ramp there is nothing to feed.
///
/// With [`Commutation::Encoder`] the rotor's angle is found first, as [`InitState`] tells, then the motor does what was
/// asked of it. A direct-current motor needs no angle.
#[derive(Clone, Debug)]
pub struct Servo {
    gains: ServoGains,
    mode: Mode,
    target_current_ma: Dq,
    target_velocity_rpm: i32,
    target_position: i32,
    sensors: Sensors,
    /// Position of the sensor that is position 0.
    position_offset: i32,
    init: EncoderInit,
    current: CurrentLoop,
    velocity: VelocityPi,
    ramp: ServoRamp,
    /// Parts of a millisecond that have passed, `pwm_hz` a millisecond.
    millisecond: u32,
    position: i32,
    velocity_q16: i64,
    command_q16: i64,
    position_error: i32,
    mean_velocity: Pt1,
    mean_torque: Pt1,
    mean_flux: Pt1,
}

impl Servo {
    /// A servo at rest at position 0, in current mode with no current.
    pub fn new(gains: ServoGains) -> Self {
        Self {
            gains,
            mode: Mode::Current,
            target_current_ma: Dq::default(),
            target_velocity_rpm: 0,
            target_position: 0,
            sensors: Sensors::default(),
            position_offset: 0,
            init: EncoderInit::Needed,
            current: CurrentLoop::default(),
            velocity: VelocityPi::default(),
            ramp: ServoRamp::default(),
            millisecond: 0,
            position: 0,
            velocity_q16: 0,
            command_q16: 0,
            position_error: 0,
            mean_velocity: Pt1::new(3),
            mean_torque: Pt1::new(4),
            mean_flux: Pt1::new(2),
        }
    }

    /// Changes the settings. The position goes on where it is, whatever sensor now counts it; another encoder or number
    /// of pole pairs must be initialised again.
    pub fn set_gains(&mut self, gains: ServoGains) {
        let same_encoder = gains.encoder.scale == self.gains.encoder.scale
            && gains.encoder.inverted == self.gains.encoder.inverted
            && gains.pole_pairs == self.gains.pole_pairs;
        if !same_encoder {
            self.init = EncoderInit::Needed;
        }
        self.gains = gains;
        self.position_offset = self.sensor_position().wrapping_sub(self.position);
    }

    /// One PWM period: what is measured at its beginning, and the duties for it. `None`: the bridge stays open, because
    /// there is no motor or nothing commutates.
    #[inline]
    pub fn cycle(&mut self, feedback: &Feedback) -> Option<Duties> {
        self.measure(feedback);
        if self.gains.motor == MotorKind::None || self.gains.commutation == Commutation::Disabled {
            self.rest();
            return None;
        }
        if let Some(duties) = self.initialise(feedback) {
            return Some(duties);
        }
        if self.encoder_init_failed() {
            self.rest();
            return None;
        }
        self.tick_millisecond(self.mode);
        self.command_q16 = self.velocity_command();
        let target_ma = match self.gains.commutation {
            Commutation::OpenLoop => self.drag(),
            _ => Dq { d: self.target_flux(), q: self.torque_command() * self.gains.direction },
        };
        let angle = self.commutation_angle();
        Some(self.current.cycle(&self.gains.current, angle, feedback.phases_ma, target_ma))
    }

    /// A PWM period with the bridge off: sensors are read, regulators forget, the ramp follows the motor.
    pub fn idle(&mut self, feedback: &Feedback) {
        self.measure(feedback);
        self.rest();
    }

    fn rest(&mut self) {
        self.current = CurrentLoop::default();
        self.velocity = VelocityPi::default();
        self.tick_millisecond(Mode::Current);
    }

    #[inline]
    fn measure(&mut self, feedback: &Feedback) {
        self.sensors.update(&self.gains, feedback.hall_bits, feedback.encoder_count);
        self.position = self.sensor_position().wrapping_sub(self.position_offset);
        // No shaft turns once in a cycle: a counter that jumps must not overflow what follows.
        let step_q32 = within(self.sensors.velocity_q32(&self.gains), 1 << 32);
        let rpm_q16 = (step_q32 * self.gains.rpm_per_step) >> 16;
        self.velocity_q16 = rpm_q16 * i64::from(self.gains.direction);
    }

    #[inline]
    fn sensor_position(&self) -> i32 {
        ((self.sensors.position_q32(&self.gains) >> 16) as i32).wrapping_mul(self.gains.direction)
    }

    /// The hall's angle while the encoder's is not known yet.
    #[inline]
    fn commutation_angle(&self) -> i16 {
        match self.init {
            EncoderInit::Turning(_) => self.sensors.hall.angle_q16(&self.gains.hall),
            _ => self.sensors.angle_q16(&self.gains).unwrap_or(0),
        }
    }
}

/// The cascade.
impl Servo {
    /// What happens once a millisecond, if one has passed.
    #[inline]
    fn tick_millisecond(&mut self, mode: Mode) {
        self.millisecond += 1_000;
        if self.millisecond < self.gains.pwm_hz {
            return;
        }
        self.millisecond -= self.gains.pwm_hz;
        match mode {
            Mode::Current => self.follow_motor(),
            Mode::Velocity => self.approach_velocity(),
            Mode::Position => self.approach_position(),
        }
        self.mean_velocity.step(self.velocity_rpm());
        self.mean_torque.step(self.torque_ma());
        self.mean_flux.step(self.current.actual_ma().d);
    }

    fn follow_motor(&mut self) {
        self.ramp.set_velocity_q16(self.velocity_q16);
        self.ramp.set_position(self.position);
    }

    fn approach_velocity(&mut self) {
        match &self.gains.ramp {
            Some(gains) => self.ramp.tick_velocity(gains, self.target_velocity_rpm),
            None => self.ramp.set_velocity_q16(self.within_max_velocity(i64::from(self.target_velocity_rpm) << 16)),
        }
        self.ramp.set_position(self.position);
    }

    fn approach_position(&mut self) {
        match &self.gains.ramp {
            Some(gains) => self.ramp.tick_position(gains, self.target_position),
            None => self.ramp.stand_at(self.target_position),
        }
    }

    #[inline]
    fn velocity_command(&mut self) -> i64 {
        match self.mode {
            Mode::Current => 0,
            Mode::Velocity => self.ramp.velocity_q16(),
            Mode::Position => {
                self.position_error = self.ramp.position().wrapping_sub(self.position);
                let correction_q16 = i64::from(self.position_error) * self.gains.position_p_q16;
                self.within_max_velocity(self.ramp.velocity_q16() + correction_q16)
            }
        }
    }

    #[inline]
    fn within_max_velocity(&self, rpm_q16: i64) -> i64 {
        within(rpm_q16, self.gains.max_velocity_q16)
    }

    #[inline]
    fn torque_command(&mut self) -> i32 {
        if self.mode == Mode::Current {
            return self.within_max_current(self.target_current_ma.q);
        }
        let error = self.command_q16 - self.velocity_q16;
        self.velocity.cycle(&self.gains.velocity, error, self.gains.max_current_ma)
    }

    #[inline]
    fn target_flux(&self) -> i32 {
        self.within_max_current(self.target_current_ma.d)
    }

    #[inline]
    fn within_max_current(&self, current_ma: i32) -> i32 {
        within(current_ma.into(), self.gains.max_current_ma.into()) as i32
    }

    /// Open loop: turns the field on; all current goes along it.
    #[inline]
    fn drag(&mut self) -> Dq {
        self.sensors.open_loop.advance(&self.gains, self.command_q16 * i64::from(self.gains.direction));
        Dq { d: self.gains.open_loop_current_ma, q: 0 }
    }
}

/// Initialisation of the encoder.
impl Servo {
    fn needs_angle(&self) -> bool {
        self.gains.commutation == Commutation::Encoder && self.gains.motor == MotorKind::ThreePhase
    }

    /// The duties of an alignment, `None` when it is over.
    #[inline]
    fn initialise(&mut self, feedback: &Feedback) -> Option<Duties> {
        if !self.needs_angle() || self.init.is_done() {
            return None;
        }
        let duties = self.init.cycle(&self.gains, &mut self.sensors, &mut self.current, feedback.phases_ma)?;
        self.tick_millisecond(Mode::Current);
        Some(duties)
    }

    /// Finds the encoder's offset again, from the next cycle on.
    pub fn initialise_encoder(&mut self) {
        self.init = EncoderInit::Needed;
    }

    /// State of the initialisation (103).
    pub fn init_state(&self) -> InitState {
        self.init.state()
    }

    /// True when the encoder commutates and its initialisation has failed: the bridge stays open until it is begun again.
    pub fn encoder_init_failed(&self) -> bool {
        self.needs_angle() && self.init.has_failed()
    }

    /// True when the encoder's offset is known.
    pub fn encoder_is_initialised(&self) -> bool {
        self.init.is_done()
    }
}

/// Targets.
impl Servo {
    /// Regulates torque and flux current (30, 32), in mA. The flux target stays when the mode changes.
    pub fn regulate_current(&mut self, target_ma: Dq) {
        self.mode = Mode::Current;
        self.target_current_ma = target_ma;
    }

    /// Regulates the velocity (40), in rpm.
    pub fn turn(&mut self, rpm: i32) {
        self.target_velocity_rpm = rpm;
        if self.mode != Mode::Velocity {
            let rpm_q16 = self.velocity_without_jump();
            self.ramp.set_velocity_q16(rpm_q16);
            self.mode = Mode::Velocity;
        }
    }

    /// Regulates velocity 0 at once, without the ramp.
    pub fn brake(&mut self) {
        self.turn(0);
        self.ramp.set_velocity_q16(0);
    }

    /// Regulates the position (50), 65536 a turn.
    pub fn move_to(&mut self, position: i32) {
        self.target_position = position;
        if self.mode != Mode::Position {
            let rpm_q16 = self.velocity_without_jump();
            self.ramp.set_velocity_q16(rpm_q16);
            self.ramp.set_position(self.position);
            // A ramp that goes on by steps of a millisecond is half a step ahead of the rotor, then half a step behind.
            self.millisecond = self.gains.pwm_hz / 2;
            self.mode = Mode::Position;
        }
    }

    /// Velocity that the regulator is to ask for now. After current mode the regulator starts with the torque that is
    /// wanted.
    fn velocity_without_jump(&mut self) -> i64 {
        if self.mode == Mode::Current {
            self.velocity.preset(self.within_max_current(self.target_current_ma.q));
            self.velocity_q16
        } else {
            self.command_q16
        }
    }

    /// Calls this position of the rotor `position` (52), and makes it target and position of the ramp: what stands, stays.
    pub fn set_position(&mut self, position: i32) {
        self.count_from(position);
        self.ramp.set_position(position);
        self.target_position = position;
    }

    /// Calls this position of the rotor `position`, and the ramp's as much more or less. A target keeps its number, so that
    /// the motor ends elsewhere.
    pub fn count_from(&mut self, position: i32) {
        let shift = position.wrapping_sub(self.position);
        self.position_offset = self.position_offset.wrapping_sub(shift);
        self.ramp.set_position(self.ramp.position().wrapping_add(shift));
        self.position = position;
    }

    /// Sets the commutation offset of the encoder (106), 65536 an electrical turn.
    pub fn set_encoder_offset(&mut self, offset_q16: u16) {
        self.sensors.encoder_offset_q16 = offset_q16 as i16;
    }
}

/// What is, once a cycle has been.
impl Servo {
    /// What is regulated.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Targets of torque and flux (30, 32), in mA.
    pub fn target_current_ma(&self) -> Dq {
        self.target_current_ma
    }

    /// Target of the velocity (40).
    pub fn target_velocity_rpm(&self) -> i32 {
        self.target_velocity_rpm
    }

    /// Target of the position (50); in other modes the position.
    pub fn target_position(&self) -> i32 {
        if self.mode == Mode::Position { self.target_position } else { self.position }
    }

    /// Position (52), 65536 a turn.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Velocity as the regulator sees it, to the nearest rpm.
    pub fn velocity_rpm(&self) -> i32 {
        ((self.velocity_q16 + (1 << 15)) >> 16) as i32
    }

    /// Velocity (42), low-pass filtered with a time constant of 8 ms.
    pub fn mean_velocity_rpm(&self) -> i32 {
        self.mean_velocity.output()
    }

    /// Torque current in the motor's direction, in mA.
    pub fn torque_ma(&self) -> i32 {
        self.current.actual_ma().q * self.gains.direction
    }

    /// Torque current (31), low-pass filtered with a time constant of 16 ms.
    pub fn mean_torque_ma(&self) -> i32 {
        self.mean_torque.output()
    }

    /// Flux current (33), low-pass filtered with a time constant of 4 ms.
    pub fn mean_flux_ma(&self) -> i32 {
        self.mean_flux.output()
    }

    /// Velocity of the ramp (41).
    pub fn ramp_velocity_rpm(&self) -> i32 {
        self.ramp.velocity_rpm()
    }

    /// Position of the ramp (51).
    pub fn ramp_position(&self) -> i32 {
        self.ramp.position()
    }

    /// Regulators of flux and torque, with currents and voltage of the last cycle (75, 76, 78, 79).
    pub fn current_loop(&self) -> &CurrentLoop {
        &self.current
    }

    /// Regulator of the velocity (77, 80).
    pub fn velocity_loop(&self) -> &VelocityPi {
        &self.velocity
    }

    /// Error of the position regulator (81).
    pub fn position_error(&self) -> i32 {
        self.position_error
    }

    /// Angle of the open loop (16).
    pub fn open_loop_angle_q16(&self) -> i16 {
        self.sensors.open_loop.angle_q16(self.gains.pole_pairs)
    }

    /// Angle of the encoder (17).
    pub fn encoder_angle_q16(&self) -> i16 {
        self.sensors.encoder_angle_q16(self.gains.pole_pairs)
    }

    /// Angle of the hall sensors (18).
    pub fn hall_angle_q16(&self) -> i16 {
        self.sensors.hall.angle_q16(&self.gains.hall)
    }

    /// Commutation offset of the encoder (106), 65536 an electrical turn.
    pub fn encoder_offset(&self) -> u16 {
        self.sensors.encoder_offset_q16 as u16
    }

    /// True while the hall sensors show a code that does not exist.
    pub fn hall_is_faulty(&self) -> bool {
        self.sensors.hall.is_faulty()
    }
}
