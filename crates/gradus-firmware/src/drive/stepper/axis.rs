//! One stepper axis: its parameters, ramp, power stage and switches.
//!
//! Three types: [`Settings`] is what the user has set, [`Derived`] what a tick needs of it, and the rest of [`Axis`] what
//! moves.
//!
//! Where the manual is silent:
//! - After a stop switch has opened the motor goes on as it was told to; MST ends that. Until then it is under way, and position
//!   reached comes when it arrives.
//! - A deviation from the encoder (axis parameters 212, 213) makes the encoder's position the actual one, so that the next
//!   move does not fail for the same reason. The target stays: it has not been reached.
//! - New currents (axis parameters 6, 7, 200) flow at once. A restart keeps the motor within two full steps of where it is.

use gradus_motion::{Approach, Course, Generator};
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, AxisParameter, Module};

use crate::drive::axes::Events;
use crate::drive::stepper::closed_loop::ClosedLoop;
use crate::drive::stepper::encoder::Encoder;
use crate::drive::stepper::reference_search::ReferenceSearch;
use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::stepper::settings::{Derived, Settings};
use crate::drive::stepper::speed::Speeds;
use crate::ports::{AxisInputs, StepperStage, Switches};
use crate::program::program::NEVER;

/// Four full steps, after which the coil vector is the same again.
const PHASE_PERIOD: i32 = 1024;

/// The part that an axis has in an interpolated move, with the number of its line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Part {
    None,
    /// Brakes, then waits until all motors of the line stand.
    Waits(usize),
    /// Follows the line in place of its own ramp.
    Led(usize),
}

impl Part {
    pub(crate) fn line(self) -> Option<usize> {
        match self {
            Self::None => None,
            Self::Waits(line) | Self::Led(line) => Some(line),
        }
    }
}

/// One axis of a module.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    pub(crate) settings: Settings,
    pub(crate) derived: Derived,
    pub(crate) tick_hz: u32,
    pub(crate) ramp: Generator,
    pub(crate) part: Part,
    pub(crate) encoder: Encoder,
    /// Closed loop or a PID mode, if one is on (axis parameter 129).
    pub(crate) closed: Option<ClosedLoop>,
    pub(crate) speeds: Speeds,
    /// Microsteps that the motor was to go, wrapping.
    pub(crate) travel: i32,
    pub(crate) search: Option<ReferenceSearch>,
    /// Why the latest search has failed, until the next motion command.
    pub(crate) search_failure: Option<SearchFailure>,
    /// A move to a target has been started and its end has not been reported; no stop ends it.
    pub(crate) underway: bool,
    /// A stop switch or a virtual stop holds the ramp; it goes on when the way is free.
    pub(crate) held: bool,
    pub(crate) powered: bool,
    pub(crate) phase: i32,
    /// When the standby current is due: never while the motor turns, `None` once it flows.
    standby_at_us: Option<u64>,
    /// When the current ends altogether; it has ended once that is past.
    freewheels_at_us: Option<u64>,
    freewheels: bool,
    pub(crate) errors: i32,
    /// When the coil vector has turned last.
    pub(crate) stepped_at_us: u64,
    /// A stall lasts.
    pub(crate) stalling: bool,
}

impl Axis {
    pub(crate) fn new(catalogue: &Module) -> Self {
        let tick_hz = 1_000_000 / catalogue.tick_us.max(1);
        let settings = Settings::factory(catalogue);
        Self {
            derived: settings.derive(),
            ramp: Generator::new(settings.profile(tick_hz)),
            settings,
            tick_hz,
            part: Part::None,
            encoder: Encoder::default(),
            closed: None,
            speeds: Speeds::default(),
            travel: 0,
            search: None,
            search_failure: None,
            underway: false,
            held: false,
            powered: true,
            phase: 0,
            standby_at_us: None,
            freewheels_at_us: None,
            freewheels: false,
            errors: 0,
            stepped_at_us: 0,
            stalling: false,
        }
    }

    /// As after switching on. The coil vector begins at its angle 0, the next one to where it is.
    pub(crate) fn restart(&mut self, catalogue: &Module) {
        let phase = self.phase.wrapping_add(PHASE_PERIOD / 2) & -PHASE_PERIOD;
        *self = Self { phase, ..Self::new(catalogue) };
    }

    /// Puts the axis on its hardware: standby current, or none, and the encoder at zero.
    pub(crate) fn start<A: StepperStage + AxisInputs>(&mut self, now: u64, powered: bool, port: &mut A) {
        self.stepped_at_us = now;
        self.scale_encoder(port);
        self.arm_encoder(port);
        self.set_encoder_position(0, port);
        self.rest_speeds(now, port);
        port.set_scale(255);
        self.set_power(powered, port);
    }
}

// Parameters.
impl Axis {
    /// A parameter as GAP reads it.
    #[inline]
    pub(crate) fn get<A: StepperStage + AxisInputs>(&mut self, id: Ap, now: u64, port: &mut A) -> i32 {
        match id {
            Ap::TargetPosition => self.ramp.target(),
            Ap::ActualPosition => self.ramp.position(),
            Ap::TargetSpeed => self.target_speed(),
            Ap::ActualSpeed => self.actual_speed(),
            Ap::ActualAcceleration => self.ramp.acceleration(),
            Ap::RampMode => self.ramp_mode(),
            Ap::PositionReached => i32::from(self.is_reached()),
            Ap::HomeSwitch => i32::from(self.switches(port).home),
            Ap::RightSwitch => i32::from(self.switches(port).right),
            Ap::LeftSwitch => i32::from(self.switches(port).left),
            Ap::EncoderPosition => self.shown_encoder_position(port),
            Ap::LatchedPosition | Ap::LatchedEncoderPosition => {
                self.watch_null(port);
                self.settings.get(id)
            }
            Ap::ClScaler => self.loop_scale().map_or(0, i32::from),
            Ap::ClInitialized => i32::from(self.is_loop_ready()),
            Ap::MeasuredSpeed => self.mean_speed_pps(now, port),
            Ap::MeasuredSpeedNow => self.measured_speed_pps(now, port),
            Ap::ExtendedErrorFlags => self.error_flags(),
            Ap::LoadValue => self.load(port),
            Ap::DriverErrorFlags => self.driver_flags(now, port),
            Ap::CoolStepCurrent | Ap::PwmScale | Ap::PwmMode => self.driver_value(id, port.driver()),
            _ => self.settings.get(id),
        }
    }

    /// Writes a parameter as SAP does, after the checks of its row.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if it is read only, [`Status::INVALID_VALUE`] if the value is not accepted,
    /// [`Status::NOT_AVAILABLE`] for a motion while the drivers are off, and for what a closed loop does not allow.
    pub(crate) fn set<A: StepperStage + AxisInputs>(
        &mut self,
        row: &AxisParameter,
        value: i32,
        port: &mut A,
    ) -> Result<(), Status> {
        if !row.access.writable() {
            return Err(Status::WRONG_TYPE);
        }
        if !self.settings.accepts(row, value) {
            return Err(Status::INVALID_VALUE);
        }
        match row.id {
            Ap::TargetPosition => return self.set_target_position(value),
            Ap::TargetSpeed => return self.set_target_speed(value),
            Ap::RampMode => return self.set_ramp_mode(value),
            Ap::ActualPosition => {
                self.stop_search();
                self.set_position(value, port);
            }
            Ap::ClosedLoop => return self.set_closed_loop(value, port),
            Ap::TorqueMode => return self.set_torque(value),
            Ap::MicrostepResolution | Ap::FullStepResolution | Ap::EncoderResolution | Ap::ReverseShaft
                if self.closed.is_some() =>
            {
                return Err(Status::NOT_AVAILABLE);
            }
            Ap::EncoderPosition => self.set_encoder_position(value, port),
            _ => self.configure(row.id, value, port),
        }
        Ok(())
    }

    /// Stores a setting and derives anew what depends on it.
    fn configure<A: StepperStage + AxisInputs>(&mut self, id: Ap, value: i32, port: &mut A) {
        match id {
            Ap::UnitMode => self.settings.set_unit_mode(value),
            _ => self.settings.set(id, value),
        }
        match id {
            Ap::MaxSpeed
            | Ap::MaxAcceleration
            | Ap::StartVelocity
            | Ap::StartAcceleration
            | Ap::MaxDeceleration
            | Ap::BreakVelocity
            | Ap::FinalDeceleration
            | Ap::StopVelocity
            | Ap::RampType
            | Ap::Bow1
            | Ap::Bow2
            | Ap::Bow3
            | Ap::Bow4
            | Ap::BowScaling
            | Ap::MinSpeed
            | Ap::RampDivisor
            | Ap::PulseDivisor => self.derive_ramp(),
            Ap::UnitMode => {
                self.derive_ramp();
                self.derive();
            }
            Ap::MicrostepResolution | Ap::FullStepResolution | Ap::EncoderResolution => {
                self.scale_encoder(port);
                self.derive();
                self.configure_driver(port);
            }
            Ap::OffTime
            | Ap::FreewheelingMode
            | Ap::StallThreshold
            | Ap::StallFilter
            | Ap::CoolStepMin
            | Ap::CoolStepDown
            | Ap::CoolStepHysteresis
            | Ap::CoolStepUp
            | Ap::CoolStepStart
            | Ap::CoolStepSpeed
            | Ap::PwmThresholdSpeed
            | Ap::PwmGradient
            | Ap::PwmAmplitude
            | Ap::PwmAutoscale => self.configure_driver(port),
            Ap::EncoderMode => self.arm_encoder(port),
            Ap::EncoderPrescaler => {
                self.scale_encoder(port);
                self.arm_encoder(port);
            }
            Ap::MaxCurrent | Ap::StandbyCurrent | Ap::BoostCurrent => {
                self.derive();
                self.energize(port);
            }
            _ => self.derive(),
        }
    }

    fn derive_ramp(&mut self) {
        self.ramp.set_profile(self.settings.profile(self.tick_hz));
    }

    fn derive(&mut self) {
        self.derived = self.settings.derive();
        self.derive_loop();
    }

    /// Group index, 0 for none (axis parameter 249).
    pub(crate) fn group(&self) -> i32 {
        self.settings.get(Ap::GroupIndex)
    }
}

// Motion commands.
impl Axis {
    /// MVP ABS: moves to a position with the ramp of the settings.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off or a closed loop starts up.
    pub(crate) fn move_to(&mut self, target: i32) -> Result<(), Status> {
        self.begin()?;
        self.underway = true;
        self.set_approach(Approach::Ramp);
        self.ramp.move_to(target);
        Ok(())
    }

    /// ROR: turns with a speed; 0 stops with the ramp.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off or a closed loop starts up, and the speed is not 0.
    pub(crate) fn rotate(&mut self, speed_pps: i32) -> Result<(), Status> {
        if speed_pps != 0 || self.may_move() {
            self.begin()?;
        }
        self.settings.set(Ap::TargetSpeed, speed_pps);
        self.underway = false;
        self.ramp.rotate(speed_pps);
        Ok(())
    }

    /// MVP COORD with bit 6: comes to rest with the ramp and waits there for the other motors of a line.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off or a closed loop starts up.
    pub(crate) fn join(&mut self, target: i32, line: usize) -> Result<(), Status> {
        self.begin()?;
        self.underway = true;
        self.part = Part::Waits(line);
        self.ramp.rotate(0);
        self.ramp.set_target(target);
        Ok(())
    }

    /// All motors of the line stand: sets the course that the line needs.
    pub(crate) fn aim(&mut self) {
        self.held = false;
        self.set_approach(Approach::Ramp);
        self.ramp.move_to(self.ramp.target());
    }

    /// What a line has to know of the axis.
    pub(crate) fn course(&self) -> Course<'_> {
        self.ramp.course()
    }

    /// Where MVP REL starts from (axis parameter 127). A move that a stop switch holds is still one to its target.
    pub(crate) fn relative_base<A: AxisInputs>(&mut self, port: &mut A) -> i32 {
        match self.settings.get(Ap::RelativeOption) {
            0 if self.underway || self.ramp.is_positioning() => self.ramp.target(),
            2 => self.encoder_position(port),
            _ => self.ramp.position(),
        }
    }

    /// Stands still at once, as after ROR 0.
    pub(crate) fn halt(&mut self) {
        self.settings.set(Ap::TargetSpeed, 0);
        self.underway = false;
        self.held = false;
        self.part = Part::None;
        self.abandon_search(SearchFailure::Stopped);
        self.end_torque();
        self.ramp.hard_stop();
    }

    /// Switches the driver on or off; off stops the motor at once.
    pub(crate) fn set_power<A: StepperStage>(&mut self, on: bool, port: &mut A) {
        self.powered = on;
        if on {
            self.end_torque();
        } else {
            self.abandon_start_up();
            self.halt();
        }
        self.standby_at_us = None;
        self.configure_driver(port);
        self.energize(port);
    }

    /// Ends what another motion command has started.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off or a closed loop starts up.
    pub(crate) fn begin(&mut self) -> Result<(), Status> {
        if !self.may_move() {
            return Err(Status::NOT_AVAILABLE);
        }
        self.errors = 0;
        self.held = false;
        self.part = Part::None;
        self.search = None;
        self.end_torque();
        Ok(())
    }
}

// Time.
impl Axis {
    /// True when the axis needs control ticks.
    #[inline]
    pub(crate) fn is_active(&self) -> bool {
        !self.ramp.is_idle()
            || self.underway
            || self.held
            || self.search.is_some()
            || self.closed.is_some()
            || self.standby_at_us == Some(NEVER)
    }

    /// True when the motor stands and nothing is left to do.
    pub(crate) fn is_standing(&self) -> bool {
        self.ramp.is_idle()
    }

    /// Position reached (axis parameter 8). A motor that a stop brakes past its target has not reached it.
    #[inline]
    pub(crate) fn is_reached(&self) -> bool {
        self.ramp.at_target() && !self.is_waiting() && (!self.held || self.ramp.is_idle()) && self.is_in_window()
    }

    /// True while the axis waits for the other motors of a line.
    #[inline]
    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.part, Part::Waits(_))
    }

    /// When the axis has something to do besides control ticks.
    #[inline]
    pub(crate) fn due_at(&self) -> u64 {
        self.standby_at_us.unwrap_or(NEVER).min(self.freewheels_at_us.unwrap_or(NEVER))
    }

    /// One control tick.
    #[inline]
    pub(crate) fn tick<A: StepperStage + AxisInputs>(
        &mut self,
        now: u64,
        switches: Switches,
        lead: impl FnOnce(usize, &mut Generator),
        port: &mut A,
    ) -> Events {
        match self.search {
            None => self.watch_stops(switches),
            Some(_) => self.tick_search(switches, port),
        }
        let before = self.ramp.position();
        match self.part {
            Part::Led(line) => lead(line, &mut self.ramp),
            _ => self.ramp.tick(),
        }
        let moved = self.ramp.position().wrapping_sub(before);
        self.travel = self.travel.wrapping_add(moved);
        let step = if self.closed.is_some() { self.tick_loop(moved, port) } else { moved };
        self.drive(step, now, port);
        self.watch_null(port);
        self.measure_speeds(now, port);
        let mut events = self.watch_load(now, port);
        if events != Events::default() {
            // It stands now: the time to the standby current begins.
            self.drive(0, now, port);
        }
        if self.underway && self.is_reached() {
            self.underway = false;
            self.held = false;
            events.arrived = true;
        }
        events
    }

    /// Lowers the current when the motor has stood long enough.
    pub(crate) fn run_timer<A: StepperStage>(&mut self, now: u64, port: &mut A) {
        if self.standby_at_us.is_some_and(|due| due <= now) {
            self.standby_at_us = None;
            self.energize(port);
        }
        if self.freewheels_at_us.is_some_and(|due| due <= now) {
            self.freewheels_at_us = None;
            self.freewheels = true;
            self.energize(port);
        }
    }

    /// Turns the coil vector by `microsteps`.
    fn drive<A: StepperStage>(&mut self, microsteps: i32, now: u64, port: &mut A) {
        if microsteps != 0 {
            self.stepped_at_us = now;
        }
        let steps = microsteps.wrapping_shl(self.derived.phase_shift);
        self.phase = self.phase.wrapping_add(if self.derived.reversed { steps.wrapping_neg() } else { steps });
        if !self.ramp.is_idle() || self.needs_run_current() {
            self.standby_at_us = Some(NEVER);
            self.freewheels_at_us = None;
            self.freewheels = false;
        } else if self.standby_at_us == Some(NEVER) {
            self.standby_at_us = Some(now.saturating_add(self.derived.power_down_us));
            self.freewheels_at_us = self.derived.freewheeling_us.map(|delay| now.saturating_add(delay));
        }
        self.energize(port);
    }

    fn energize<A: StepperStage>(&self, port: &mut A) {
        port.set_coils(self.coil_phase(self.phase), self.current());
    }

    /// The current of this moment (axis parameters 6, 7 and 200).
    fn current(&self) -> u8 {
        let derived = &self.derived;
        if !self.powered || self.freewheels {
            0
        } else if self.standby_at_us.is_none() {
            derived.standby_current
        } else if derived.boost_current != 0 && self.ramp.acceleration() != 0 && !self.needs_run_current() {
            derived.boost_current
        } else {
            derived.run_current
        }
    }
}
