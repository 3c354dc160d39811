//! The stepper axes of a module: what they do together.
//!
//! Axes of one group (axis parameter 249) obey each other's commands, and MVP COORD leads several along a straight line.
//!
//! Where the manual is silent:
//! - SAP 0 and SAP 2 move their own axis only, not its group.
//! - A line of motors of which some still turn (bit 6 of MVP COORD) waits: all of them come to rest with their ramps, then the
//!   line goes straight from where they stand. Until then they are on the way to their targets, and what names one of them
//!   takes that one out. A line under way ends for a motor with a command to that motor only; lines of other motors go beside it.
//! - A command for several motors, a group or a mask, is checked for all of them before any starts: it is refused as a whole.

use core::iter::zip;

use gradus_motion::{Generator, Line};
use gradus_tmcl::catalogue::{Ap, AxisParameter, Module};
use gradus_tmcl::{MoveKind, Search, Status};

use crate::drive::axes::{Axes, Events, Motors, Move, axis_index, members, motors};
use crate::drive::stepper::axis::{Axis, Part};
use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::ticks::Period;
use crate::module::MAX_AXES;
use crate::ports::{AxisInputs, Ports, StepperStage, Switches};
use crate::program::program::NEVER;
use crate::storage::coordinates::{Coordinates, NO_COORDINATES};

/// Bits of the motor field of MVP COORD (TMCM-3351 §3.6.4).
const SEVERAL: u8 = 1 << 7;
const INTERPOLATED: u8 = 1 << 6;

/// Up to three stepper axes.
#[derive(Clone, Debug)]
pub struct Steppers {
    catalogue: &'static Module,
    period: Period,
    axes: [Axis; MAX_AXES],
    /// Lines under way; each axis knows which one leads it. Every line has a motor of its own, so there is always a free one.
    lines: [Option<Line<MAX_AXES>>; MAX_AXES],
    /// A line waits for its motors to come to rest.
    gathers: bool,
    coordinates: Coordinates,
}

impl<P: Ports<Axis: StepperStage + AxisInputs>> Axes<P> for Steppers {
    fn new(catalogue: &'static Module) -> Self {
        Self {
            catalogue,
            period: Period::from_ns(catalogue.tick_us.saturating_mul(1000)),
            axes: core::array::from_fn(|_| Axis::new(catalogue)),
            lines: [None; MAX_AXES],
            gathers: false,
            coordinates: NO_COORDINATES,
        }
    }

    fn restart(&mut self) {
        for axis in &mut self.axes {
            axis.restart(self.catalogue);
        }
        self.lines = [None; MAX_AXES];
        self.gathers = false;
        self.coordinates = NO_COORDINATES;
    }

    fn start(&mut self, index: usize, now: u64, powered: bool, ports: &mut P) {
        if let Some(axis) = self.axes.get_mut(index) {
            axis.start(now, powered, ports.axis(index));
        }
    }

    #[inline]
    fn get(&mut self, index: usize, id: Ap, now: u64, ports: &mut P) -> i32 {
        self.axes.get_mut(index).map_or(0, |axis| axis.get(id, now, ports.axis(index)))
    }

    fn set(&mut self, index: usize, row: &AxisParameter, value: i32, ports: &mut P) -> Result<(), Status> {
        self.axis_mut(index)?.set(row, value, ports.axis(index))
    }

    fn accepts_speed(&self, index: usize, row: &AxisParameter, speed: i32) -> bool {
        members(self.group(index)).all(|axis| self.axes.get(axis).is_some_and(|axis| axis.settings.accepts(row, speed)))
    }

    fn rotate(&mut self, index: usize, speed: i32) -> Result<(), Status> {
        let motors = self.group(index);
        if speed != 0 {
            self.may_move(motors)?;
        }
        for index in members(motors) {
            self.axis_mut(index)?.rotate(speed)?;
        }
        Ok(())
    }

    fn move_to(&mut self, kind: MoveKind, motor: u8, value: i32, ports: &mut P) -> Result<Move, Status> {
        match kind {
            MoveKind::ABS => self.move_group(motor, |_, _| Ok(value)),
            MoveKind::REL => self.move_group(motor, |axes, axis| axes.relative_target(axis, value, ports)),
            MoveKind::COORD if self.catalogue.coordinates > 0 => self.move_to_coordinate(motor, value),
            _ => axis_index(self.catalogue, motor).and(Err(Status::WRONG_TYPE)),
        }
    }

    fn search(&mut self, what: Search, index: usize) -> Result<Option<i32>, Status> {
        match what {
            Search::STATUS => return Ok(Some(self.axis_mut(index)?.search_state())),
            Search::START | Search::STOP => {}
            _ => return Err(Status::WRONG_TYPE),
        }
        let motors = self.group(index);
        if what == Search::START {
            self.may_move(motors)?;
        }
        for index in members(motors) {
            let axis = self.axis_mut(index)?;
            if what == Search::START { axis.start_search()? } else { axis.stop_search() }
        }
        Ok(None)
    }

    fn take_search_failure(&mut self) -> Option<(usize, SearchFailure)> {
        self.axes.iter_mut().enumerate().find_map(|(index, axis)| Some((index, axis.search_failure.take()?)))
    }

    fn coordinate_mut(&mut self, number: u8, index: usize) -> Option<&mut i32> {
        self.coordinates.get_mut(index)?.get_mut(usize::from(number))
    }

    fn set_power(&mut self, index: usize, on: bool, ports: &mut P) {
        if let Some(axis) = self.axes.get_mut(index) {
            axis.set_power(on, ports.axis(index));
        }
    }

    #[inline]
    fn switches(&mut self, index: usize, ports: &mut P) -> Switches {
        match self.axes.get(index) {
            Some(axis) => axis.switches(ports.axis(index)),
            None => Switches::default(),
        }
    }

    fn active_switches(&mut self, index: usize, ports: &mut P) -> Switches {
        match self.axes.get(index) {
            Some(axis) => axis.active_switches(axis.switches(ports.axis(index))),
            None => Switches::default(),
        }
    }

    #[inline]
    fn is_shut_down(&self, index: usize, ports: &mut P) -> bool {
        self.axes.get(index).is_some_and(|axis| axis.is_shut_down(ports.axis(index)))
    }

    #[inline]
    fn is_reached(&self, index: usize) -> bool {
        self.axes.get(index).is_some_and(Axis::is_reached)
    }

    fn is_searching(&self, index: usize) -> bool {
        self.axes.get(index).is_some_and(Axis::is_searching)
    }

    #[inline]
    fn is_active(&self, index: usize) -> bool {
        self.axes.get(index).is_some_and(Axis::is_active)
    }

    #[inline]
    fn period(&self) -> Period {
        self.period
    }

    #[inline]
    fn begin_tick(&mut self) {
        if self.gathers {
            self.start_lines();
        }
        self.lines.iter_mut().flatten().for_each(Line::tick);
    }

    #[inline]
    fn tick(&mut self, index: usize, now: u64, switches: Switches, ports: &mut P) -> Events {
        let lines = &self.lines;
        let lead = |line: usize, ramp: &mut Generator| {
            if let Some(Some(line)) = lines.get(line) {
                ramp.follow(line, index);
            }
        };
        match self.axes.get_mut(index) {
            Some(axis) => axis.tick(now, switches, lead, ports.axis(index)),
            None => Events::default(),
        }
    }

    #[inline]
    fn end_tick(&mut self) {
        for (number, line) in self.lines.iter_mut().enumerate() {
            if line.as_ref().is_some_and(Line::is_done) {
                *line = None;
                let led = self.axes.iter_mut().filter(|axis| axis.part == Part::Led(number));
                led.for_each(|axis| axis.part = Part::None);
            }
        }
    }

    #[inline]
    fn due_at(&self) -> u64 {
        self.axes.iter().fold(NEVER, |earliest, axis| earliest.min(axis.due_at()))
    }

    fn run_timer(&mut self, index: usize, now: u64, ports: &mut P) {
        if let Some(axis) = self.axes.get_mut(index) {
            axis.run_timer(now, ports.axis(index));
        }
    }
}

// Positions.
impl Steppers {
    /// The value of the reply for a mask is the coordinate's number.
    fn move_to_coordinate(&mut self, motor: u8, value: i32) -> Result<Move, Status> {
        if motor & (SEVERAL | INTERPOLATED) == 0 {
            return self.move_group(motor, |axes, axis| axes.coordinate(value, axis));
        }
        let motors = motors(self.catalogue, motor & !(SEVERAL | INTERPOLATED))?;
        if motors == 0 {
            return Err(Status::INVALID_VALUE);
        }
        let mut targets = [None; MAX_AXES];
        for axis in members(motors) {
            if let Some(target) = targets.get_mut(axis) {
                *target = Some(self.coordinate(value, axis)?);
            }
        }
        match motor & INTERPOLATED {
            0 => self.start_moves(&targets)?,
            _ => self.gather(&targets)?,
        };
        Ok(Move { value, motors })
    }

    /// Moves an axis and its group; the reply is the target of the axis.
    fn move_group(
        &mut self,
        motor: u8,
        mut target: impl FnMut(&mut Self, usize) -> Result<i32, Status>,
    ) -> Result<Move, Status> {
        let index = axis_index(self.catalogue, motor)?;
        let mut targets = [None; MAX_AXES];
        for axis in members(self.group(index)) {
            let wanted = target(self, axis)?;
            if let Some(target) = targets.get_mut(axis) {
                *target = Some(wanted);
            }
        }
        let motors = self.start_moves(&targets)?;
        let value = targets.get(index).copied().flatten().ok_or(Status::INVALID_VALUE)?;
        Ok(Move { value, motors })
    }

    /// Starts all axes that have a target; none if one cannot.
    fn start_moves(&mut self, targets: &[Option<i32>; MAX_AXES]) -> Result<Motors, Status> {
        let motors = named(targets);
        self.may_move(motors)?;
        for (axis, target) in zip(&mut self.axes, targets) {
            if let Some(target) = target {
                axis.move_to(*target)?;
            }
        }
        Ok(motors)
    }

    /// # Errors
    /// [`Status::NOT_AVAILABLE`] if one of the motors cannot start: its drivers are off or a closed loop starts up.
    fn may_move(&self, motors: Motors) -> Result<(), Status> {
        let all = members(motors).all(|axis| self.axes.get(axis).is_some_and(Axis::may_move));
        if all { Ok(()) } else { Err(Status::NOT_AVAILABLE) }
    }

    /// Lets all axes that have a target come to rest, for a line from there; none if one cannot.
    fn gather(&mut self, targets: &[Option<i32>; MAX_AXES]) -> Result<Motors, Status> {
        let motors = named(targets);
        self.may_move(motors)?;
        members(motors).for_each(|axis| self.leave_line(axis));
        let number = self.free_line();
        for (axis, target) in zip(&mut self.axes, targets) {
            if let Some(target) = target {
                axis.join(*target, number)?;
            }
        }
        self.gathers = true;
        Ok(motors)
    }

    fn leave_line(&mut self, axis: usize) {
        if let Some(axis) = self.axes.get_mut(axis) {
            axis.part = Part::None;
        }
    }

    /// A line that leads no axis and for which none waits.
    fn free_line(&mut self) -> usize {
        let is_free = |number: &usize| !self.axes.iter().any(|axis| axis.part.line() == Some(*number));
        let number = (0..MAX_AXES).find(is_free).unwrap_or(0);
        if let Some(line) = self.lines.get_mut(number) {
            *line = None;
        }
        number
    }

    /// Starts the lines whose motors have all come to rest.
    fn start_lines(&mut self) {
        self.gathers = false;
        for number in 0..MAX_AXES {
            let waiting = || self.axes.iter().filter(|axis| axis.part == Part::Waits(number));
            if waiting().all(Axis::is_standing) {
                self.start_line(number);
            } else {
                self.gathers = true;
            }
        }
    }

    /// Makes the motors that wait for a line, which stand and have their targets, arrive together.
    fn start_line(&mut self, number: usize) {
        let waits = |axis: &Axis| axis.part == Part::Waits(number);
        if !self.axes.iter().any(waits) {
            return;
        }
        self.axes.iter_mut().filter(|axis| waits(axis)).for_each(Axis::aim);
        let line = Line::new(self.axes.each_ref().map(|axis| waits(axis).then(|| axis.course())));
        if let Some(place) = self.lines.get_mut(number) {
            *place = Some(line);
        }
        self.axes.iter_mut().filter(|axis| waits(axis)).for_each(|axis| axis.part = Part::Led(number));
    }

    fn relative_target<P: Ports<Axis: AxisInputs>>(
        &mut self,
        index: usize,
        offset: i32,
        ports: &mut P,
    ) -> Result<i32, Status> {
        Ok(self.axis_mut(index)?.relative_base(ports.axis(index)).wrapping_add(offset))
    }

    fn coordinate(&self, number: i32, axis: usize) -> Result<i32, Status> {
        let number = usize::try_from(number).map_err(|_| Status::INVALID_VALUE)?;
        if number >= usize::from(self.catalogue.coordinates) {
            return Err(Status::INVALID_VALUE);
        }
        self.coordinates.get(axis).and_then(|row| row.get(number)).copied().ok_or(Status::INVALID_VALUE)
    }

    fn axis_mut(&mut self, index: usize) -> Result<&mut Axis, Status> {
        self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)
    }

    /// The axis and those that share its group index, if that is not 0 (axis parameter 249).
    fn group(&self, index: usize) -> Motors {
        let group = self.axes.get(index).map_or(0, Axis::group);
        let mut motors: Motors = 1 << index;
        for (other, axis) in self.axes.iter().enumerate().take(self.catalogue.axes.into()) {
            if group != 0 && axis.group() == group {
                motors |= 1 << other;
            }
        }
        motors
    }
}

/// The motors that have a target.
fn named(targets: &[Option<i32>; MAX_AXES]) -> Motors {
    targets.iter().rev().fold(0, |motors, target| motors << 1 | Motors::from(target.is_some()))
}
