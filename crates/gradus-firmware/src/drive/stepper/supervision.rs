//! What stops an axis or takes it over: stop switches, virtual stops, stall, deviation from the encoder, reference search.
//!
//! Where the manual is silent: StallGuard2 is valid above one turn of the motor a second (axis parameters 202 and 140), or above the
//! speed of 181 if that is lower. Below it a reading of 0 is no stall: bit 0 of 208 is 0, and nothing happens. Above it a stall sets
//! bit 0 of 208 while it lasts (of a motor that it has stopped, until it turns again), and when it begins value 1 of 207 and the
//! interrupt, whether 181 stops the motor or not. In closed loop there is no stall unless 181 is set.

use gradus_tmcl::Status;
use gradus_tmcl::catalogue::{Ap, MotionChip};

use crate::drive::axes::Events;
use crate::drive::stepper::axis::{Axis, Part};
use crate::drive::stepper::reference_search::{Reference, ReferenceSearch, Sight, Step};
use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::stepper::search_modes::{Pace, Way};
use crate::drive::stepper::settings::{Derived, Stop};
use crate::ports::{AxisInputs, DriverState, StepperStage, Switches};

/// Bits of axis parameter 207.
#[derive(Clone, Copy, Debug)]
struct ErrorBits {
    stall: i32,
    deviation: i32,
}

/// Bit of axis parameter 207, not in the manuals: a reference search has failed.
const SEARCH_FAILED: i32 = 4;

impl ErrorBits {
    const fn of(chip: MotionChip) -> Self {
        match chip {
            MotionChip::Tmc428 => Self { stall: 2, deviation: 1 },
            _ => Self { stall: 1, deviation: 2 },
        }
    }
}

// What stops a motor.
impl Axis {
    /// A stop switch and a virtual stop stop motion towards them; when the way is free again the ramp goes on.
    pub(crate) fn watch_stops(&mut self, switches: Switches) {
        if !self.derived.has_stops() && !self.held {
            return;
        }
        let stop = self.stop_ahead(self.swapped(switches));
        if stop.is_some() == self.held {
            return;
        }
        self.held = stop.is_some();
        match stop {
            Some(stop) => self.hold(stop),
            None => self.resume(),
        }
    }

    /// How to stop, if the motor must not go on in its direction.
    fn stop_ahead(&self, switches: Switches) -> Option<Stop> {
        let (derived, position) = (&self.derived, self.ramp.position());
        let (by_switch, by_position) = match self.heading() {
            1 => (derived.stop_right.blocks(switches.right), derived.virtual_right.is_some_and(|end| position >= end)),
            -1 => (
                derived.stop_left.blocks(switches.left) && !self.is_at_reference(),
                derived.virtual_left.is_some_and(|end| position <= end),
            ),
            _ => (false, false),
        };
        if by_switch { Some(derived.switch_stop) } else { by_position.then_some(derived.virtual_stop) }
    }

    /// So near to zero that the reference switch is not taken for the left stop switch.
    fn is_at_reference(&self) -> bool {
        self.derived.reference_tolerance.is_some_and(|tolerance| self.ramp.position().unsigned_abs() <= tolerance)
    }

    /// The end switches in their places (axis parameter 33).
    fn swapped(&self, switches: Switches) -> Switches {
        match self.derived.swapped {
            true => Switches { left: switches.right, right: switches.left, ..switches },
            false => switches,
        }
    }

    /// The switches in their places, true where one is active. The home switch is as reference searches take it (axis parameter
    /// 193).
    pub(crate) fn active_switches(&self, levels: Switches) -> Switches {
        let Switches { left, right, home } = self.swapped(levels);
        Switches {
            left: self.derived.stop_left.is_active(left),
            right: self.derived.stop_right.is_active(right),
            home: home == self.derived.home_level,
        }
    }

    /// Which way the motor turns, or would turn if nothing held it.
    fn heading(&self) -> i32 {
        match self.ramp.speed().signum() {
            _ if self.torque_sign() != 0 => self.torque_sign(),
            0 if self.underway => self.ramp.target().wrapping_sub(self.ramp.position()).signum(),
            0 => self.settings.get(Ap::TargetSpeed).signum(),
            sign => sign,
        }
    }

    fn hold(&mut self, stop: Stop) {
        if matches!(self.part, Part::Led(_)) {
            self.part = Part::None;
        }
        self.end_torque();
        match stop {
            Stop::Hard => self.ramp.hard_stop(),
            Stop::Ramp => self.ramp.rotate(0),
            Stop::Linear(deceleration) => self.ramp.soft_stop(deceleration),
        }
    }

    fn resume(&mut self) {
        if self.is_waiting() {
            self.ramp.rotate(0);
        } else if self.underway {
            self.ramp.move_to(self.ramp.target());
        } else {
            self.ramp.rotate(self.settings.get(Ap::TargetSpeed));
        }
    }

    fn error_bits(&self) -> ErrorBits {
        ErrorBits::of(self.settings.chip)
    }

    /// What GAP 207 answers. Reading clears the flags; on the TMCM-351 only the next motion command does.
    pub(crate) fn error_flags(&mut self) -> i32 {
        match self.settings.chip {
            MotionChip::Tmc428 => self.errors,
            _ => core::mem::take(&mut self.errors),
        }
    }

    /// True while StallGuard2 reports a stall at a speed at which it is valid. A motor that stands keeps what was last.
    fn stalls<A: StepperStage>(&self, port: &mut A) -> bool {
        match self.ramp.speed().unsigned_abs() {
            0 => self.stalling,
            speed => speed > self.stall_valid_pps() && port.driver().flags & DriverState::STALL != 0,
        }
    }

    /// A closed loop itself turns the field as far ahead as the load needs: that is no stall, unless axis parameter 181 asks.
    fn stall_valid_pps(&self) -> u32 {
        let Derived { stall_speed_pps, stall_valid_pps, .. } = self.derived;
        if self.closed.is_some() && stall_speed_pps == 0 { u32::MAX } else { stall_valid_pps }
    }

    /// A stall is flagged when it begins; above the speed of axis parameter 181, or at too much load, it stops the motor at
    /// once.
    fn watch_stall<A: StepperStage>(&mut self, port: &mut A) -> bool {
        let stalls = self.stalls(port);
        let begins = !core::mem::replace(&mut self.stalling, stalls) && stalls;
        let stop_pps = self.derived.stall_speed_pps;
        let stops = stalls && stop_pps != 0 && self.ramp.speed().unsigned_abs() > stop_pps || self.is_overloaded(port);
        if stops {
            self.halt();
        }
        if begins || stops {
            self.errors |= self.error_bits().stall;
        }
        begins || stops
    }

    /// Stall and deviation from the encoder: flags them and stops the motor where it is to be stopped.
    pub(crate) fn watch_load<A: StepperStage + AxisInputs>(&mut self, now: u64, port: &mut A) -> Events {
        let mut events = Events { stalled: self.watch_stall(port), ..Events::default() };
        if self.deviates(port) {
            let (target, encoder) = (self.ramp.target(), self.encoder_position(port));
            self.halt();
            if self.settings.chip != MotionChip::Tmc428 {
                self.ramp.set_position(encoder);
                self.ramp.set_target(target);
            }
            self.rest_speeds(now, port);
            self.errors |= self.error_bits().deviation;
            events.deviated = true;
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
        self.begin()?; // `rotate(0)` alone would not fail
        self.rotate(0)?;
        self.search = ReferenceSearch::new(self.settings.search_mode(), self.settings.microsteps_per_turn());
        Ok(())
    }

    /// RFS STOP: stops with the ramp; the position counter stays as it is.
    pub(crate) fn stop_search(&mut self) {
        if self.search.take().is_some() {
            self.ramp.rotate(0);
        }
    }

    /// One tick of a search, in place of the stop switches.
    pub(crate) fn tick_search<A: AxisInputs>(&mut self, levels: Switches, port: &mut A) {
        let switches = self.active_switches(levels);
        let encoder = self.encoder.position(port.encoder());
        let encoder = self.encoder.is_there().then_some(encoder);
        let Some(search) = &mut self.search else { return };
        let sight = Sight { position: self.ramp.position(), encoder, standing: self.ramp.is_idle(), switches };
        match search.tick(sight) {
            Step::Continue => {}
            Step::Turn(way, pace) => self.ramp.rotate(self.search_speed(way, pace)),
            Step::Brake => self.ramp.rotate(0),
            Step::Stop => self.hold(self.derived.switch_stop),
            Step::Move(position) => self.ramp.move_to(position),
            Step::Found(reference) => self.take_reference(reference, port),
            Step::Fail(failure) => {
                self.hold(self.derived.switch_stop);
                self.abandon_search(failure);
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
        self.set_position(position, port);
        if self.closed.is_none() {
            self.encoder.set_position(position, port.encoder());
        }
    }

    /// Ends a search that has not found its switch.
    pub(crate) fn abandon_search(&mut self, failure: SearchFailure) {
        if self.search.take().is_some() {
            self.search_failure = Some(failure);
            self.errors |= SEARCH_FAILED;
        }
    }
}
