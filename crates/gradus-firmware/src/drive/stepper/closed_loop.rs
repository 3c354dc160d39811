//! Closed loop of a stepper axis: start-up, position, speed and torque (TMCM-3351 manual §6.3, axis parameters 50, 108 to 134).
//!
//! Axis parameter 129 starts it: the motor brakes, turns the field to the nearest full step, lets the rotor settle there for a
//! second with the run current, and for another second while the offset to the encoder is taken (112). Then 133 is 1, and
//! every control tick the arithmetic of [`gradus_motion::closed_loop`] says where the field shall be and how strong, from the
//! ramp's position and the encoder's. The ramp itself is that of open loop. In position mode the motor makes a deviation good;
//! in velocity mode the ramp never gets farther away from the encoder than three full steps; in torque mode it goes along
//! with the encoder.
//!
//! Where the manual is silent:
//! - Motion commands but stops are not available until 133 is 1. Axis parameter 129 itself is not while the drivers are off,
//!   and not without 256 microsteps (140), full steps (202) and counts (210) of a turn. Those three and 251 cannot be changed
//!   while it is on.
//! - Position and encoder have one origin: writing 1 or 209, or a reference search, moves both. A null event does not clear the
//!   encoder.
//! - Writing 112 corrects the load angle, as current and limits see it, by the difference to what was measured: a load may have
//!   turned the rotor while it was.
//! - The current is that of axis parameter 6, and the coil vector is scaled by 123; there is no boost and no standby current.
//! - A stop switch, a virtual stop, a deviation or ENABLE low end torque mode. ENABLE low ends a start-up as well; a running
//!   loop holds the motor where it is when ENABLE comes back.
//! - Torque mode is in the closed loop only (129 = 1); 115 to 119 limit its speed. Its torque is the current scale of 50.
//! - The PID modes (129 = 2, 3) need no start-up but that the motor stands; the encoder gets the motor's position. The field
//!   turns with the ramp (2), or not (3), and by the correction. Currents are those of open loop.
//! - Switched off, the motor brakes with the ramp from where the field is.

use gradus_motion::Generator;
use gradus_motion::closed_loop::{self, Demand, Gains, Sight};
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::Ap;

use crate::drive::stepper::axis::Axis;
use crate::drive::stepper::settings::Settings;
use crate::ports::{AxisInputs, StepperStage};

/// Values of axis parameter 129.
const CLOSED_LOOP: i32 = 1;
const PID_ON_RAMP: i32 = 2;

/// The microstep resolution that the loop needs: 256 in a full step.
const RESOLUTION: i32 = 8;

/// Half of a full step, where both coils carry the same current, in 1/256 full steps.
const FULL_STEP: i32 = 256;
const BETWEEN_COILS: i32 = FULL_STEP / 2;

/// How far the ramp is ahead of the encoder at most in velocity mode, in microsteps.
const SPEED_LEAD: i32 = 3 * FULL_STEP;

/// The error of torque mode: beyond any load angle.
const TORQUE_LEAD: i32 = 100_000;

/// What a loop is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The motor comes to rest.
    Braking,
    /// The field turns to a full step.
    Aligning,
    /// The rotor comes to rest; ticks left.
    Settling(u32),
    /// The encoder has the motor's position; ticks left.
    Calibrating(u32),
    /// Closed loop.
    Regulating,
    /// A PID mode, turning with the ramp or not.
    Correcting { with_ramp: bool },
}

/// A loop that is on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosedLoop {
    stage: Stage,
    gains: Gains,
    state: closed_loop::State,
    /// Where the field is, in microsteps of the ramp.
    field: i32,
    /// The encoder at the latest tick, and how far the ramp was ahead of it.
    encoder: i32,
    error: i32,
    /// Axis parameter 112 as it was measured, and how far it has been moved since.
    measured_offset: i32,
    offset: i32,
    /// Axis parameter 134.
    window: u32,
    torque: Option<i32>,
}

impl ClosedLoop {
    /// True once the motor may move.
    fn is_ready(&self) -> bool {
        matches!(self.stage, Stage::Regulating | Stage::Correcting { .. })
    }

    /// Where the field is to be in this tick, for the encoder's position as the field sees it.
    fn regulate(&mut self, ramp: &mut Generator, encoder: i32) -> i32 {
        let moved = encoder.wrapping_sub(self.encoder);
        self.encoder = encoder;
        let (demand, error) = match self.torque {
            Some(torque) => {
                ramp.set_position(encoder);
                (Demand::Torque, torque.signum() * TORQUE_LEAD)
            }
            None if ramp.is_positioning() => (Demand::Position, ramp.position().wrapping_sub(encoder)),
            None => (Demand::Speed, keep_near(ramp, encoder)),
        };
        self.error = ramp.position().wrapping_sub(encoder);
        let angle = self.state.angle(&self.gains, Sight { error, moved }, demand);
        match self.torque {
            Some(torque) => self.state.current_to(&self.gains, torque.unsigned_abs().min(255) as u8),
            None => self.state.current(&self.gains, error),
        };
        encoder.wrapping_add(angle)
    }

    fn turn_to(&mut self, field: i32) -> i32 {
        field.wrapping_sub(core::mem::replace(&mut self.field, field))
    }
}

/// Takes the ramp along with the encoder when it is too far away; gives back how far it is ahead.
fn keep_near(ramp: &mut Generator, encoder: i32) -> i32 {
    let error = ramp.position().wrapping_sub(encoder);
    let near = error.clamp(-SPEED_LEAD, SPEED_LEAD);
    if near != error {
        ramp.set_position(encoder.wrapping_add(near));
    }
    near
}

impl Settings {
    fn closed_loop(&self) -> closed_loop::Settings {
        let byte = |id| self.unsigned(id).min(255) as u8;
        let word = |id| self.unsigned(id).min(65_535) as u16;
        closed_loop::Settings {
            beta: word(Ap::ClBeta),
            gamma: byte(Ap::ClGamma),
            gamma_start_pps: self.unsigned(Ap::ClGammaMinSpeed),
            gamma_add_pps: self.unsigned(Ap::ClGammaAddSpeed),
            position_p: self.unsigned(Ap::ClPositionP),
            tolerance: byte(Ap::ClTolerance),
            current_min: byte(Ap::ClCurrentMin),
            current_max: byte(Ap::ClCurrentMax),
            start_up: byte(Ap::ClStartUp),
            upscale_clocks: self.unsigned(Ap::ClUpscaleDelay),
            downscale_clocks: self.unsigned(Ap::ClDownscaleDelay),
            speed_p: self.unsigned(Ap::ClSpeedP),
            speed_i: self.unsigned(Ap::ClSpeedI),
            speed_i_clip: word(Ap::ClSpeedIClip),
            speed_d_clock: word(Ap::ClSpeedDClock),
            speed_clip_pps: self.unsigned(Ap::ClSpeedDClip),
        }
    }
}

// On and off.
impl Axis {
    /// SAP 129. The mode that is on already goes on.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] if the loop cannot work.
    pub(crate) fn set_closed_loop<A: StepperStage + AxisInputs>(
        &mut self,
        mode: i32,
        port: &mut A,
    ) -> Result<(), Status> {
        if mode == self.settings.get(Ap::ClosedLoop) {
            return Ok(());
        }
        let impossible = !self.powered
            || self.settings.get(Ap::MicrostepResolution) != RESOLUTION
            || self.settings.get(Ap::FullStepResolution) == 0
            || self.settings.get(Ap::EncoderResolution) == 0;
        if mode != 0 && impossible {
            return Err(Status::NOT_AVAILABLE);
        }
        self.open_loop();
        port.set_scale(255);
        self.rotate(0)?;
        if mode != 0 {
            self.close_loop(mode, port);
        }
        Ok(())
    }

    fn close_loop<A: AxisInputs>(&mut self, mode: i32, port: &mut A) {
        self.settings.set(Ap::ClosedLoop, mode);
        self.closed = Some(ClosedLoop {
            stage: Stage::Braking,
            gains: Gains::default(),
            state: closed_loop::State::new(self.settings.unsigned(Ap::ClCurrentMax).min(255) as u8),
            field: 0,
            encoder: self.encoder.position(port.encoder()),
            error: 0,
            measured_offset: 0,
            offset: 0,
            window: 0,
            torque: None,
        });
        self.derive_loop();
    }

    /// Ends the loop where the field is.
    pub(crate) fn open_loop(&mut self) {
        self.end_torque();
        self.settings.set(Ap::ClosedLoop, 0);
        if let Some(closed) = self.closed.take()
            && closed.stage == Stage::Regulating
        {
            self.ramp.set_position(closed.field);
        }
    }

    /// After a change of a setting.
    pub(crate) fn derive_loop(&mut self) {
        if let Some(closed) = &mut self.closed {
            closed.gains = self.settings.closed_loop().gains(self.tick_hz);
            closed.window = self.settings.unsigned(Ap::PositioningWindow);
            closed.offset = self.settings.get(Ap::ClOffset).wrapping_sub(closed.measured_offset);
        }
    }

    /// SAP 50.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] but in closed loop.
    pub(crate) fn set_torque(&mut self, torque: i32) -> Result<(), Status> {
        if !self.is_regulating() {
            return Err(Status::NOT_AVAILABLE);
        }
        self.rotate(0)?;
        self.ramp.hard_stop();
        self.settings.set(Ap::TorqueMode, torque);
        if let Some(closed) = &mut self.closed {
            closed.torque = Some(torque);
        }
        Ok(())
    }

    pub(crate) fn end_torque(&mut self) {
        self.settings.set(Ap::TorqueMode, 0);
        if let Some(closed) = &mut self.closed {
            closed.torque = None;
        }
    }

    /// The drivers are off: a start-up is over.
    pub(crate) fn abandon_start_up(&mut self) {
        if self.closed.as_ref().is_some_and(|closed| !closed.is_ready()) {
            self.open_loop();
        }
    }
}

// What it says.
impl Axis {
    /// False while the drivers are off, and while a loop starts up.
    pub(crate) fn may_move(&self) -> bool {
        self.powered && self.closed.as_ref().is_none_or(ClosedLoop::is_ready)
    }

    /// Whether a loop wants the run current all the time.
    pub(crate) fn needs_run_current(&self) -> bool {
        self.closed.as_ref().is_some_and(|closed| !matches!(closed.stage, Stage::Correcting { .. }))
    }

    /// Axis parameter 133.
    pub(crate) fn is_loop_ready(&self) -> bool {
        self.closed.as_ref().is_some_and(ClosedLoop::is_ready)
    }

    fn is_regulating(&self) -> bool {
        self.closed.as_ref().is_some_and(|closed| closed.stage == Stage::Regulating)
    }

    /// Current scale of the closed loop (axis parameter 123), `None` if it has none.
    pub(crate) fn loop_scale(&self) -> Option<u8> {
        self.closed.as_ref().filter(|closed| closed.stage == Stage::Regulating).map(|closed| closed.state.scale())
    }

    /// Whether the encoder is where the motor should be (axis parameter 134).
    pub(crate) fn is_in_window(&self) -> bool {
        self.closed.as_ref().is_none_or(|closed| closed.error.unsigned_abs() <= closed.window)
    }

    /// Which way a torque turns the motor.
    pub(crate) fn torque_sign(&self) -> i32 {
        self.closed.as_ref().and_then(|closed| closed.torque).map_or(0, i32::signum)
    }
}

// Origin.
impl Axis {
    /// Makes this the position of the motor. The encoder goes along if a loop is on.
    pub(crate) fn set_position<A: AxisInputs>(&mut self, position: i32, port: &mut A) {
        match self.is_loop_ready() {
            true => self.shift_origin(position.wrapping_sub(self.ramp.position()), port),
            false => self.ramp.set_position(position),
        }
    }

    /// Makes this the position of the encoder. The motor's goes along if a loop is on.
    pub(crate) fn set_encoder_position<A: AxisInputs>(&mut self, position: i32, port: &mut A) {
        let before = self.encoder_position(port);
        match self.is_loop_ready() {
            true => self.shift_origin(position.wrapping_sub(before), port),
            false => self.encoder.set_position(position, port.encoder()),
        }
    }

    fn shift_origin<A: AxisInputs>(&mut self, shift: i32, port: &mut A) {
        let encoder = self.encoder.position(port.encoder()).wrapping_add(shift);
        self.encoder.set_position(encoder, port.encoder());
        self.ramp.set_position(self.ramp.position().wrapping_add(shift));
        if let Some(closed) = &mut self.closed {
            closed.field = closed.field.wrapping_add(shift);
            closed.encoder = closed.encoder.wrapping_add(shift);
        }
    }
}

// Time.
impl Axis {
    /// A tick of the loop: gives back by how many microsteps the field turns, when the ramp has moved by `moved`.
    pub(crate) fn tick_loop<A: StepperStage + AxisInputs>(&mut self, moved: i32, port: &mut A) -> i32 {
        let raw = port.encoder();
        let Some(closed) = &mut self.closed else { return moved };
        match closed.stage {
            Stage::Regulating => self.regulate(raw, port),
            Stage::Correcting { .. } if !self.powered => {
                self.ramp.set_position(self.encoder.position(raw));
                0
            }
            Stage::Correcting { with_ramp } => {
                closed.error = self.ramp.position().wrapping_sub(self.encoder.position(raw));
                let correction = closed.state.correction(&closed.gains, closed.error);
                correction.wrapping_add(if with_ramp { moved } else { 0 })
            }
            _ => self.start_up(moved, raw),
        }
    }

    fn regulate<A: StepperStage>(&mut self, raw: i32, port: &mut A) -> i32 {
        let Some(closed) = &mut self.closed else { return 0 };
        if !self.powered {
            closed.torque = Some(0); // the ramp goes along with the shaft until ENABLE comes back
        }
        let before = self.ramp.position();
        let field = closed.regulate(&mut self.ramp, self.encoder.position(raw).wrapping_sub(closed.offset));
        port.set_scale(closed.state.scale());
        if closed.torque.is_some() {
            self.travel = self.travel.wrapping_add(self.ramp.position().wrapping_sub(before));
        }
        closed.turn_to(field)
    }

    /// Tells the loop a new sample of the encoder's averaged speed.
    pub(crate) fn see_mean_speed<A: AxisInputs>(&mut self, now: u64, port: &mut A) {
        let speed_pps = self.mean_speed_pps(now, port);
        if let Some(closed) = &mut self.closed {
            closed.state.see_speed(&closed.gains, speed_pps);
        }
    }

    /// A tick of the start-up.
    fn start_up(&mut self, moved: i32, raw: i32) -> i32 {
        let second = self.tick_hz;
        let Some(closed) = &mut self.closed else { return moved };
        match closed.stage {
            Stage::Braking if self.ramp.is_idle() => self.stand(raw),
            Stage::Aligning => return self.align(),
            Stage::Settling(0) => {
                self.encoder.set_position(self.ramp.position(), raw);
                closed.stage = Stage::Calibrating(second);
            }
            Stage::Settling(left) => closed.stage = Stage::Settling(left - 1),
            Stage::Calibrating(0) => self.begin_regulation(raw),
            Stage::Calibrating(left) => closed.stage = Stage::Calibrating(left - 1),
            _ => {}
        }
        moved
    }

    /// The motor stands: a PID mode can begin, a closed loop seeks a full step.
    fn stand(&mut self, raw: i32) {
        let mode = self.settings.get(Ap::ClosedLoop);
        let Some(closed) = &mut self.closed else { return };
        if mode == CLOSED_LOOP {
            closed.stage = Stage::Aligning;
        } else {
            self.encoder.set_position(self.ramp.position(), raw);
            closed.stage = Stage::Correcting { with_ramp: mode == PID_ON_RAMP };
        }
    }

    /// Turns the field by a microstep towards the nearest full step, and the motor's position with it.
    fn align(&mut self) -> i32 {
        let ahead = BETWEEN_COILS - self.phase.rem_euclid(FULL_STEP);
        let step = if self.derived.reversed { -ahead.signum() } else { ahead.signum() };
        self.ramp.set_position(self.ramp.position().wrapping_add(step));
        if let Some(closed) = &mut self.closed
            && step == 0
        {
            closed.stage = Stage::Settling(self.tick_hz);
        }
        step
    }

    fn begin_regulation(&mut self, raw: i32) {
        let position = self.ramp.position();
        let offset = self.encoder.position(raw).wrapping_sub(position);
        self.settings.set(Ap::ClOffset, offset);
        self.encoder.set_position(position, raw);
        self.ramp.move_to(position);
        if let Some(closed) = &mut self.closed {
            closed.stage = Stage::Regulating;
            (closed.field, closed.encoder, closed.measured_offset) = (position, position, offset);
        }
        self.derive_loop();
    }
}
