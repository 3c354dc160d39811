//! One stepper axis: its parameters, ramp, power stage and switches.
//!
//! Three types: [`Settings`] is what the user has set, [`Derived`] what a tick needs of it, and the rest of [`Axis`] what
//! moves.
//!
//! Where the manual is silent:
//! - After a stop switch has opened the motor goes on as it was told to; MST ends that. Until then it is under way, and position
//!   reached comes when it arrives.
//! - A deviation from the encoder (axis parameter 212) makes the encoder's position the actual one, so that the next move
//!   does not fail for the same reason.
//! - New currents (axis parameters 6, 7, 200) flow at once. A restart keeps the motor within two full steps of where it is.

use gradus_motion::{Limits, Ramp};
use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, AxisParameter, Module};

use crate::encoder::Encoder;
use crate::ports::{AxisInputs, DriverState, StepperStage, Switches};
use crate::program::NEVER;
use crate::reference_search::{Pace, Reference, ReferenceSearch, Sight, Step, Way};

/// Values of axis parameters, by meaning.
#[derive(Clone, Debug)]
pub(crate) struct Settings([i32; Ap::COUNT]);

impl Settings {
    pub(crate) fn factory(catalogue: &Module) -> Self {
        let mut values = [0; Ap::COUNT];
        for row in catalogue.axis_parameters {
            values[row.id as usize] = row.default.unwrap_or(0) as i32;
        }
        Self(values)
    }

    #[inline]
    pub(crate) fn get(&self, id: Ap) -> i32 {
        self.0[id as usize]
    }

    fn unsigned(&self, id: Ap) -> u32 {
        self.get(id).max(0) as u32
    }

    fn set(&mut self, id: Ap, value: i32) {
        self.0[id as usize] = value;
    }
}

/// What a tick needs of the settings.
#[derive(Clone, Copy, Debug, Default)]
struct Derived {
    /// A microstep is `1 << phase_shift` steps of 1/256 full step.
    phase_shift: u32,
    reversed: bool,
    run_current: u8,
    boost_current: u8,
    standby_current: u8,
    power_down_us: u64,
    stop_right: StopSwitch,
    stop_left: StopSwitch,
    max_deviation: i32,
    stall_speed_pps: i32,
}

/// A stop switch as axis parameters 12 and 13 describe it.
#[derive(Clone, Copy, Debug, Default)]
struct StopSwitch {
    enabled: bool,
    active_high: bool,
}

impl StopSwitch {
    fn new(setting: i32) -> Self {
        Self { enabled: setting & 1 != 0, active_high: setting & 2 != 0 }
    }

    fn blocks(self, level: bool) -> bool {
        self.enabled && level == self.active_high
    }

    /// As a reference search sees it: without a setting it is active high.
    fn is_active(self, level: bool) -> bool {
        level == (self.active_high || !self.enabled)
    }
}

/// What a tick has found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Events {
    /// The target of a move is reached.
    pub(crate) arrived: bool,
    /// A stall has stopped the motor.
    pub(crate) stalled: bool,
    /// A deviation from the encoder has stopped the motor.
    pub(crate) deviated: bool,
}

/// Bits of axis parameter 207.
const STALL_ERROR: i32 = 1;
const DEVIATION_ERROR: i32 = 2;
/// Not in the manual: a reference search has failed.
const SEARCH_ERROR: i32 = 4;

/// Bit of axis parameter 208.
const STANDSTILL: i32 = 1 << 7;

/// Four full steps, after which the coil vector is the same again.
const PHASE_PERIOD: i32 = 1024;

/// One axis of a module.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    settings: Settings,
    derived: Derived,
    tick_hz: u32,
    ramp: Ramp,
    /// The ramp follows an interpolated line.
    led: bool,
    encoder: Encoder,
    search: Option<ReferenceSearch>,
    /// A move has been started and its end has not been reported.
    underway: bool,
    /// A stop switch holds the ramp; it goes on when the way is free.
    held: bool,
    powered: bool,
    phase: i32,
    /// When the standby current is due: never while the motor turns, `None` once it flows.
    standby_at_us: Option<u64>,
    errors: i32,
}

impl Axis {
    pub(crate) fn new(catalogue: &Module) -> Self {
        let tick_hz = 1_000_000 / catalogue.tick_us.max(1);
        let mut axis = Self {
            settings: Settings::factory(catalogue),
            derived: Derived::default(),
            tick_hz,
            ramp: Ramp::new(Limits::default().gains(tick_hz)),
            led: false,
            encoder: Encoder::default(),
            search: None,
            underway: false,
            held: false,
            powered: true,
            phase: 0,
            standby_at_us: None,
            errors: 0,
        };
        axis.derive();
        axis.derive_ramp();
        axis
    }

    /// As after switching on. The coil vector begins at its angle 0, the next one to where it is.
    pub(crate) fn restart(&mut self, catalogue: &Module) {
        let phase = self.phase.wrapping_add(PHASE_PERIOD / 2) & -PHASE_PERIOD;
        *self = Self { phase, ..Self::new(catalogue) };
    }

    /// Puts the axis on its hardware: standby current, or none, and the encoder at zero.
    pub(crate) fn start<A: StepperStage + AxisInputs>(&mut self, powered: bool, port: &mut A) {
        self.scale_encoder(port);
        let raw = port.encoder();
        self.encoder.set_position(0, raw);
        self.set_power(powered, port);
    }
}

// Parameters.
impl Axis {
    /// A parameter as GAP reads it.
    #[inline]
    pub(crate) fn get<A: StepperStage + AxisInputs>(&mut self, id: Ap, port: &mut A) -> i32 {
        match id {
            Ap::TargetPosition => self.ramp.target(),
            Ap::ActualPosition => self.ramp.position(),
            Ap::ActualSpeed => self.ramp.speed_pps(),
            Ap::PositionReached => i32::from(self.ramp.at_target()),
            Ap::HomeSwitch => i32::from(port.switches().home),
            Ap::RightSwitch => i32::from(port.switches().right),
            Ap::LeftSwitch => i32::from(port.switches().left),
            Ap::EncoderPosition => self.encoder.position(port.encoder()),
            Ap::ExtendedErrorFlags => core::mem::take(&mut self.errors),
            Ap::LoadValue => i32::from(port.driver().load),
            Ap::DriverErrorFlags => self.driver_flags(port.driver()),
            _ => self.settings.get(id),
        }
    }

    fn driver_flags(&self, driver: DriverState) -> i32 {
        i32::from(driver.flags) | if self.ramp.is_idle() { STANDSTILL } else { 0 }
    }

    /// Writes a parameter as SAP does, after the checks of its row.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if it is read only, [`Status::INVALID_VALUE`] if the value is not accepted,
    /// [`Status::NOT_AVAILABLE`] for a motion while the drivers are off.
    pub(crate) fn set<A: StepperStage + AxisInputs>(
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
        match row.id {
            Ap::TargetPosition => return self.move_to(value),
            Ap::TargetSpeed => return self.rotate(value),
            Ap::ActualPosition => {
                self.stop_search();
                self.ramp.set_position(value);
            }
            Ap::EncoderPosition => self.encoder.set_position(value, port.encoder()),
            _ => self.configure(row.id, value, port),
        }
        Ok(())
    }

    /// Stores a setting and derives anew what depends on it.
    fn configure<A: StepperStage + AxisInputs>(&mut self, id: Ap, value: i32, port: &mut A) {
        self.settings.set(id, value);
        match id {
            Ap::MaxSpeed
            | Ap::MaxAcceleration
            | Ap::StartVelocity
            | Ap::StartAcceleration
            | Ap::MaxDeceleration
            | Ap::BreakVelocity
            | Ap::FinalDeceleration
            | Ap::StopVelocity => self.derive_ramp(),
            Ap::MicrostepResolution | Ap::FullStepResolution | Ap::EncoderResolution => {
                self.scale_encoder(port);
                self.derive();
            }
            Ap::MaxCurrent | Ap::StandbyCurrent | Ap::BoostCurrent => {
                self.derive();
                self.energize(port);
            }
            _ => self.derive(),
        }
    }

    fn derive_ramp(&mut self) {
        let get = |id| self.settings.unsigned(id);
        let limits = Limits {
            max_speed_pps: get(Ap::MaxSpeed),
            acceleration: get(Ap::MaxAcceleration),
            deceleration: get(Ap::MaxDeceleration),
            break_speed_pps: get(Ap::BreakVelocity),
            start_acceleration: get(Ap::StartAcceleration),
            final_deceleration: get(Ap::FinalDeceleration),
            start_speed_pps: get(Ap::StartVelocity),
            stop_speed_pps: get(Ap::StopVelocity),
        };
        self.ramp.set_gains(limits.gains(self.tick_hz));
    }

    fn derive(&mut self) {
        let get = |id| self.settings.get(id);
        let (right, left) = (StopSwitch::new(get(Ap::RightSwitchEnable)), StopSwitch::new(get(Ap::LeftSwitchEnable)));
        let current = |id| get(id).clamp(0, 255) as u8;
        self.derived = Derived {
            phase_shift: 8 - get(Ap::MicrostepResolution).clamp(0, 8) as u32,
            reversed: get(Ap::ReverseShaft) != 0,
            run_current: current(Ap::MaxCurrent),
            boost_current: current(Ap::BoostCurrent),
            standby_current: current(Ap::StandbyCurrent),
            power_down_us: u64::from(self.settings.unsigned(Ap::PowerDownDelay)) * 10_000,
            stop_right: right,
            stop_left: left,
            max_deviation: get(Ap::MaxEncoderDeviation),
            stall_speed_pps: get(Ap::StopOnStall),
        };
    }

    fn scale_encoder<A: AxisInputs>(&mut self, port: &mut A) {
        let per_full_step = 1_i64 << self.settings.get(Ap::MicrostepResolution).clamp(0, 8);
        let per_turn = i64::from(self.settings.get(Ap::FullStepResolution)) * per_full_step;
        self.encoder.set_scale(per_turn, i64::from(self.settings.get(Ap::EncoderResolution)), port.encoder());
    }

    pub(crate) fn group(&self) -> i32 {
        self.settings.get(Ap::GroupIndex)
    }
}

// Motion commands.
impl Axis {
    /// MVP ABS: moves to a position with the ramp of the settings.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn move_to(&mut self, target: i32) -> Result<(), Status> {
        self.begin()?;
        self.underway = true;
        self.ramp.move_to(target);
        Ok(())
    }

    /// ROR: turns with a speed; 0 stops with the ramp.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off and the speed is not 0.
    pub(crate) fn rotate(&mut self, speed_pps: i32) -> Result<(), Status> {
        if speed_pps != 0 || self.powered {
            self.begin()?;
        }
        self.settings.set(Ap::TargetSpeed, speed_pps);
        self.underway = false;
        self.ramp.rotate(speed_pps);
        Ok(())
    }

    /// Follows a line instead of its own ramp.
    pub(crate) fn follow(&mut self) {
        self.led = true;
    }

    /// The line is at its end.
    pub(crate) fn release(&mut self) {
        self.led = false;
    }

    /// The ramp, for a line.
    pub(crate) fn ramp(&self) -> &Ramp {
        &self.ramp
    }

    /// Where MVP REL starts from (axis parameter 127).
    pub(crate) fn relative_base<A: AxisInputs>(&mut self, port: &mut A) -> i32 {
        match self.settings.get(Ap::RelativeOption) {
            0 if self.ramp.is_positioning() => self.ramp.target(),
            2 => self.encoder.position(port.encoder()),
            _ => self.ramp.position(),
        }
    }

    /// Stands still at once, as after ROR 0.
    pub(crate) fn halt(&mut self) {
        self.settings.set(Ap::TargetSpeed, 0);
        self.underway = false;
        self.held = false;
        self.led = false;
        self.abandon_search();
        self.ramp.hard_stop();
    }

    /// Switches the driver on or off; off stops the motor at once.
    pub(crate) fn set_power<A: StepperStage>(&mut self, on: bool, port: &mut A) {
        self.powered = on;
        if !on {
            self.halt();
        }
        self.standby_at_us = None;
        self.energize(port);
    }

    fn begin(&mut self) -> Result<(), Status> {
        if !self.powered {
            return Err(Status::NOT_AVAILABLE);
        }
        self.errors = 0;
        self.held = false;
        self.led = false;
        self.search = None;
        Ok(())
    }
}

// Time.
impl Axis {
    /// True when the axis needs control ticks.
    #[inline]
    pub(crate) fn is_active(&self) -> bool {
        !self.ramp.is_idle() || self.underway || self.held || self.search.is_some()
    }

    /// True when the motor stands and nothing is left to do.
    pub(crate) fn is_standing(&self) -> bool {
        self.ramp.is_idle()
    }

    /// Position reached (axis parameter 8).
    #[inline]
    pub(crate) fn is_reached(&self) -> bool {
        self.ramp.at_target()
    }

    /// When the axis has something to do besides control ticks.
    pub(crate) fn due_at(&self) -> Option<u64> {
        self.standby_at_us
    }

    /// One control tick.
    #[inline]
    pub(crate) fn tick<A: StepperStage + AxisInputs>(
        &mut self,
        now: u64,
        switches: Switches,
        lead: impl FnOnce(&mut Ramp),
        port: &mut A,
    ) -> Events {
        match self.search {
            None => self.watch_switches(switches),
            Some(_) => self.tick_search(switches, port),
        }
        let before = self.ramp.position();
        if self.led {
            lead(&mut self.ramp);
        } else {
            self.ramp.tick();
        }
        self.drive(self.ramp.position().wrapping_sub(before), now, port);
        let mut events = self.watch_load(port);
        if events != Events::default() {
            // It stands now: the time to the standby current begins.
            self.drive(0, now, port);
        }
        if self.underway && self.is_reached() {
            self.underway = false;
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
    }

    /// Turns the coil vector by `microsteps`.
    fn drive<A: StepperStage>(&mut self, microsteps: i32, now: u64, port: &mut A) {
        let steps = microsteps.wrapping_shl(self.derived.phase_shift);
        self.phase = self.phase.wrapping_add(if self.derived.reversed { steps.wrapping_neg() } else { steps });
        if !self.ramp.is_idle() {
            self.standby_at_us = Some(NEVER);
        } else if self.standby_at_us == Some(NEVER) {
            self.standby_at_us = Some(now.saturating_add(self.derived.power_down_us));
        }
        self.energize(port);
    }

    fn energize<A: StepperStage>(&self, port: &mut A) {
        port.set_coils(self.phase, self.current());
    }

    /// The current of this moment (axis parameters 6, 7 and 200).
    fn current(&self) -> u8 {
        let derived = &self.derived;
        if !self.powered {
            0
        } else if self.standby_at_us.is_none() {
            derived.standby_current
        } else if derived.boost_current != 0 && self.ramp.acceleration_pps2() != 0 {
            derived.boost_current
        } else {
            derived.run_current
        }
    }
}

// What stops a motor.
impl Axis {
    /// A stop switch stops motion towards it; when it opens the ramp goes on.
    fn watch_switches(&mut self, switches: Switches) {
        let derived = &self.derived;
        if !derived.stop_left.enabled && !derived.stop_right.enabled {
            return;
        }
        let Switches { left, right, .. } = self.swapped(switches);
        let heading = self.heading();
        let blocked =
            (heading > 0 && derived.stop_right.blocks(right)) || (heading < 0 && derived.stop_left.blocks(left));
        if blocked != self.held {
            self.held = blocked;
            if blocked { self.hold() } else { self.resume() }
        }
    }

    /// The end switches in their places (axis parameter 33).
    fn swapped(&self, switches: Switches) -> Switches {
        if self.settings.get(Ap::SwapSwitches) == 0 {
            return switches;
        }
        Switches { left: switches.right, right: switches.left, ..switches }
    }

    /// Which way the motor turns, or would turn if nothing held it.
    fn heading(&self) -> i32 {
        match self.ramp.speed_pps().signum() {
            0 if self.underway => self.ramp.target().wrapping_sub(self.ramp.position()).signum(),
            0 => self.settings.get(Ap::TargetSpeed).signum(),
            sign => sign,
        }
    }

    fn hold(&mut self) {
        self.led = false;
        let deceleration = self.settings.unsigned(Ap::StopDeceleration);
        if self.settings.get(Ap::SoftStop) != 0 && deceleration != 0 {
            self.ramp.soft_stop(deceleration);
        } else {
            self.ramp.hard_stop();
        }
    }

    fn resume(&mut self) {
        if self.underway {
            self.ramp.move_to(self.ramp.target());
        } else {
            self.ramp.rotate(self.settings.get(Ap::TargetSpeed));
        }
    }

    /// Stall and deviation from the encoder stop the motor at once.
    fn watch_load<A: StepperStage + AxisInputs>(&mut self, port: &mut A) -> Events {
        let mut events = Events::default();
        let derived = self.derived;
        if derived.stall_speed_pps != 0
            && self.ramp.speed_pps().unsigned_abs() > derived.stall_speed_pps.unsigned_abs()
            && port.driver().flags & DriverState::STALL != 0
        {
            self.halt();
            self.errors |= STALL_ERROR;
            events.stalled = true;
        }
        if derived.max_deviation != 0 {
            let encoder = self.encoder.position(port.encoder());
            if self.ramp.position().wrapping_sub(encoder).unsigned_abs() > derived.max_deviation.unsigned_abs() {
                self.halt();
                self.ramp.set_position(encoder);
                self.errors |= DEVIATION_ERROR;
                events.deviated = true;
            }
        }
        events
    }
}

// Reference search.
impl Axis {
    /// What RFS STATUS answers: 0 when no search is under way.
    pub(crate) fn search_state(&self) -> i32 {
        self.search.as_ref().map_or(0, ReferenceSearch::stage)
    }

    pub(crate) fn is_searching(&self) -> bool {
        self.search.is_some()
    }

    /// RFS START: stops with the ramp if the motor turns, then searches.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn start_search(&mut self) -> Result<(), Status> {
        self.begin()?;
        self.rotate(0)?;
        self.search = ReferenceSearch::new(self.settings.get(Ap::ReferenceSearchMode));
        Ok(())
    }

    /// RFS STOP: stops with the ramp; the position counter stays as it is.
    pub(crate) fn stop_search(&mut self) {
        if self.search.take().is_some() {
            self.ramp.rotate(0);
        }
    }

    /// One tick of a search, in place of the stop switches.
    fn tick_search<A: AxisInputs>(&mut self, levels: Switches, port: &mut A) {
        let Switches { left, right, home } = self.swapped(levels);
        let (left, right) = (self.derived.stop_left.is_active(left), self.derived.stop_right.is_active(right));
        let switches = Switches { left, right, home };
        let Some(search) = &mut self.search else { return };
        let sight = Sight { position: self.ramp.position(), standing: self.ramp.is_idle(), switches };
        match search.tick(sight) {
            Step::Continue => {}
            Step::Turn(way, pace) => self.ramp.rotate(self.search_speed(way, pace)),
            Step::Brake => self.ramp.rotate(0),
            Step::Stop => self.hold(),
            Step::Move(position) => self.ramp.move_to(position),
            Step::Found(reference) => self.take_reference(reference, port),
            Step::Fail => {
                self.hold();
                self.abandon_search();
            }
        }
    }

    fn search_speed(&self, way: Way, pace: Pace) -> i32 {
        let speed = match pace {
            Pace::Rough => self.settings.get(Ap::ReferenceSearchSpeed),
            Pace::Exact => self.settings.get(Ap::ReferenceSwitchSpeed),
        };
        if way == Way::Left { -speed } else { speed }
    }

    /// Makes the zero point that was found zero for ramp and encoder.
    fn take_reference<A: AxisInputs>(&mut self, reference: Reference, port: &mut A) {
        self.search = None;
        self.settings.set(Ap::LastReferencePosition, reference.zero);
        if let Some(distance) = reference.distance {
            self.settings.set(Ap::EndSwitchDistance, distance);
        }
        // Not 0 if the axis could not go there, for want of a top speed.
        let position = self.ramp.position().wrapping_sub(reference.zero);
        self.ramp.set_position(position);
        self.encoder.set_position(position, port.encoder());
    }

    /// Ends a search that has not found its switch.
    fn abandon_search(&mut self) {
        if self.search.take().is_some() {
            self.errors |= SEARCH_ERROR;
        }
    }
}
