//! Axis parameters of a servo: what GAP reads and SAP writes.

use gradus_motion::foc::Dq;
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, AxisParameter};

use crate::drive::servo::protection::flag;
use crate::drive::servo::servo::{Mode, Servo};
use crate::ports::{Bridge, RotorInputs, Supply};

/// Ticks of the ramp in a second (axis parameter 230).
const RAMP_HZ: i32 = 1000;

// What GAP reads.
impl Servo {
    pub(crate) fn read<A: Bridge + RotorInputs + Supply>(&self, id: Ap, port: &mut A) -> i32 {
        match id {
            Ap::AdcI0Raw => port.shunts()[0].into(),
            Ap::AdcI1Raw => port.shunts()[1].into(),
            Ap::AdcI0 => self.phases_ma(port)[0],
            Ap::AdcI1 => self.phases_ma(port)[1],
            Ap::AdcI2 => self.phases_ma(port)[2],
            Ap::HallInputs => port.hall().into(),
            Ap::EncoderInputs => port.encoder_levels().into(),
            Ap::SupplyVoltage => port.voltage_dv(),
            Ap::DriverTemperature => port.temperature_c(),
            Ap::StatusFlags => self.flags() as i32,
            Ap::EnableDriver => self.enabled.into(),
            Ap::BrakeChopperActive => self.chopping.into(),
            Ap::MainLoops => RAMP_HZ,
            Ap::TorqueLoops | Ap::VelocityLoops => self.settings.get(Ap::PwmFrequencyHz),
            _ => self.regulated(id),
        }
    }

    /// Targets, what is measured, and the state of the regulators; else a setting.
    fn regulated(&self, id: Ap) -> i32 {
        let control = &self.control;
        match id {
            Ap::TargetCurrent => control.target_current_ma().q,
            Ap::TargetFlux => control.target_current_ma().d,
            Ap::ActualCurrent => control.mean_torque_ma(),
            Ap::ActualFlux => control.mean_flux_ma(),
            Ap::TargetSpeed => control.target_velocity_rpm(),
            Ap::RampSpeed => control.ramp_velocity_rpm(),
            Ap::ActualSpeed => control.mean_velocity_rpm(),
            Ap::TargetPosition => self.target_position(),
            Ap::ActualPosition => self.outside(control.position()),
            Ap::RampPosition => self.outside(control.ramp_position()),
            Ap::PositionReached => self.has_arrived().into(),
            Ap::TorqueErrorSum => control.current_loop().torque.error_sum(),
            Ap::FluxErrorSum => control.current_loop().flux.error_sum(),
            Ap::VelocityErrorSum => control.velocity_loop().error_sum(),
            Ap::TorqueError => control.current_loop().torque.error(),
            Ap::FluxError => control.current_loop().flux.error(),
            Ap::VelocityError => control.velocity_loop().error(),
            Ap::PositionError => control.position_error(),
            Ap::OpenLoopAngle => control.open_loop_angle_q16().into(),
            Ap::EncoderAngle => control.encoder_angle_q16().into(),
            Ap::HallAngle => control.hall_angle_q16().into(),
            Ap::EncoderInitState => control.init_state() as i32,
            Ap::EncoderOffset => control.encoder_offset().into(),
            _ => self.settings.get(id),
        }
    }

    /// Axis parameter 156.
    fn flags(&self) -> u32 {
        let mode = match self.mode {
            Mode::Stop => flag::STOP_MODE,
            Mode::Torque => flag::TORQUE_MODE,
            Mode::Velocity => flag::VELOCITY_MODE,
            Mode::Position => flag::POSITION_MODE,
        };
        let halted = self.control.mean_velocity_rpm().unsigned_abs() < self.settings.unsigned(Ap::MotorHaltedSpeed);
        let knows_angle = !self.derived.encoder_commutates || self.control.encoder_is_initialised();
        let initialized = knows_angle && !self.protection.has_failed_init();
        let when = |flag, holds| if holds { flag } else { 0 };
        self.protection.flags()
            | mode
            | when(flag::MOTOR_HALTED, halted)
            | when(flag::POSITION_END, self.has_arrived())
            | when(flag::INITIALIZED, initialized)
    }
}

// What SAP writes.
impl Servo {
    pub(crate) fn write<A: Bridge + RotorInputs>(
        &mut self,
        row: &AxisParameter,
        value: i32,
        port: &mut A,
    ) -> Result<(), Status> {
        if !row.access.writable() {
            return Err(Status::WRONG_TYPE);
        }
        if !row.accepts(value) {
            return Err(Status::INVALID_VALUE);
        }
        let Dq { d, q } = self.control.target_current_ma();
        match row.id {
            Ap::TargetCurrent => return self.push(Dq { d, q: value }),
            Ap::TargetFlux => return self.push(Dq { d: value, q }),
            Ap::TargetSpeed => return self.turn(value),
            Ap::TargetPosition => return self.go(value),
            Ap::ActualPosition => return self.set_position(value),
            Ap::EncoderOffset => self.control.set_encoder_offset(value as u16),
            Ap::EnableDriver => self.enable(value != 0, port),
            _ => self.configure(row.id, value, port),
        }
        Ok(())
    }

    /// Stores a setting and derives anew what depends on it.
    fn configure<A: Bridge + RotorInputs>(&mut self, id: Ap, value: i32, port: &mut A) {
        self.settings.set(id, value);
        self.derive();
        match id {
            Ap::CommutationMode => self.retry(),
            Ap::PositionScaler => self.target = self.outside(self.control.target_position()),
            Ap::PwmFrequencyHz => port.set_frequency(value.unsigned_abs()),
            Ap::ClearOnNull => self.arm_null(port),
            _ => {}
        }
    }
}
