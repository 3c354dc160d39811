//! Motion commands: ROR, ROL, MST, MVP, and axis parameters.
//!
//! Where the manual is silent: SAP 0 and SAP 2 move their own axis only, not its group. MST is accepted while ENABLE is low.

use gradus_motion::Line;
use gradus_tmcl::catalogue::{Ap, AxisParameter, InterruptKind};
use gradus_tmcl::{MoveKind, Search, Status};

use crate::axis::{Axis, Events};
use crate::cpu::Flags;
use crate::interrupts;
use crate::module::{MAX_AXES, Module};
use crate::ports::{AxisInputs, Io, Ports, Store, Switches};
use crate::program::NEVER;

/// Bits of the motor field of MVP COORD (TMCM-3351 §3.6.4).
const SEVERAL: u8 = 1 << 7;
const INTERPOLATED: u8 = 1 << 6;

/// A set of motors, bit 0 is motor 0.
type Motors = u8;

impl<P: Ports, S: Store> Module<P, S> {
    /// GAP.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for a parameter that the module lacks.
    #[inline]
    pub(crate) fn get_axis_parameter(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        let index = self.axis_index(axis)?;
        let row = self.axis_row(number)?;
        let axis = self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)?;
        Ok(axis.get(row.id, self.now, self.ports.axis(index)))
    }

    /// SAP.
    ///
    /// # Errors
    /// As BEHAVIOUR 1 orders them: axis, parameter, value.
    pub(crate) fn set_axis_parameter(&mut self, number: u8, axis: u8, value: i32) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let row = self.axis_row(number)?;
        let axis = self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)?;
        axis.set(row, value, self.ports.axis(index))?;
        if row.id == Ap::TargetPosition {
            self.events.moved(1 << index);
        }
        self.wake_axes();
        Ok(())
    }

    /// A parameter by its meaning, which the module must have.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis.
    pub(crate) fn get_id(&mut self, axis: u8, id: Ap) -> Result<i32, Status> {
        let index = self.axis_index(axis)?;
        let axis = self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)?;
        Ok(axis.get(id, self.now, self.ports.axis(index)))
    }

    /// ROR (`sign` 1), ROL (-1) and MST (speed 0).
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis or a speed out of range, [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn rotate(&mut self, axis: u8, speed: i32, sign: i32) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let speed = speed.checked_mul(sign).ok_or(Status::INVALID_VALUE)?;
        if !self.row_of(Ap::TargetSpeed).is_some_and(|row| row.accepts(speed)) {
            return Err(Status::INVALID_VALUE);
        }
        for axis in self.group(index) {
            self.axes.get_mut(axis).ok_or(Status::INVALID_VALUE)?.rotate(speed)?;
        }
        self.wake_axes();
        Ok(())
    }

    /// MVP; the value of the reply is the target of the motor, or the coordinate's number for a mask of motors. Motors of a
    /// mask with bit 6 that do not all stand go each with its own ramp.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, a mask or a coordinate, [`Status::WRONG_TYPE`] for a kind that the module
    /// lacks, [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn move_to_position(&mut self, kind: MoveKind, motor: u8, value: i32) -> Result<i32, Status> {
        match kind {
            MoveKind::ABS => self.move_group(motor, |_, _| Ok(value)),
            MoveKind::REL => self.move_group(motor, |module, axis| module.relative_target(axis, value)),
            MoveKind::COORD if self.catalogue.coordinates > 0 => self.move_to_coordinate(motor, value),
            _ => self.axis_index(motor).and(Err(Status::WRONG_TYPE)),
        }
    }

    fn move_to_coordinate(&mut self, motor: u8, value: i32) -> Result<i32, Status> {
        if motor & (SEVERAL | INTERPOLATED) == 0 {
            return self.move_group(motor, |module, axis| module.coordinate(value, axis));
        }
        let motors = self.motors(motor & !(SEVERAL | INTERPOLATED))?;
        if motors == 0 {
            return Err(Status::INVALID_VALUE);
        }
        let mut targets = [None; MAX_AXES];
        for axis in members(motors) {
            if let Some(target) = targets.get_mut(axis) {
                *target = Some(self.coordinate(value, axis)?);
            }
        }
        let standing = members(motors).all(|axis| self.axes.get(axis).is_some_and(Axis::is_standing));
        self.start(&targets)?;
        if motor & INTERPOLATED != 0 && standing {
            self.interpolate(motors);
        }
        Ok(value)
    }

    /// Moves an axis and its group; gives back the target of the axis.
    fn move_group(
        &mut self,
        motor: u8,
        target: impl Fn(&mut Self, usize) -> Result<i32, Status>,
    ) -> Result<i32, Status> {
        let index = self.axis_index(motor)?;
        let mut targets = [None; MAX_AXES];
        for axis in self.group(index) {
            let wanted = target(self, axis)?;
            if let Some(target) = targets.get_mut(axis) {
                *target = Some(wanted);
            }
        }
        self.start(&targets)?;
        targets.get(index).copied().flatten().ok_or(Status::INVALID_VALUE)
    }

    /// Starts all axes that have a target; none if one cannot.
    fn start(&mut self, targets: &[Option<i32>; MAX_AXES]) -> Result<(), Status> {
        let mut motors = 0;
        for (index, (axis, target)) in self.axes.iter_mut().zip(targets).enumerate() {
            if let Some(target) = target {
                axis.move_to(*target)?;
                motors |= 1 << index;
            }
        }
        self.events.moved(motors);
        self.wake_axes();
        Ok(())
    }

    /// Makes the motors, which stood and have their targets, arrive together. Those of an earlier line that are still under
    /// way go on with their own ramps: there is one line at a time.
    fn interpolate(&mut self, motors: Motors) {
        self.axes.iter_mut().for_each(Axis::release);
        let mut index = 0;
        let paths = self.axes.each_ref().map(|axis| {
            let taking_part = motors & 1 << index != 0;
            index += 1;
            taking_part.then(|| axis.ramp())
        });
        self.line = Some(Line::new(paths));
        for axis in members(motors) {
            if let Some(axis) = self.axes.get_mut(axis) {
                axis.follow();
            }
        }
    }

    fn relative_target(&mut self, index: usize, offset: i32) -> Result<i32, Status> {
        let axis = self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)?;
        Ok(axis.relative_base(self.ports.axis(index)).wrapping_add(offset))
    }

    fn coordinate(&mut self, number: i32, axis: usize) -> Result<i32, Status> {
        let number = u8::try_from(number).map_err(|_| Status::INVALID_VALUE)?;
        let axis = u8::try_from(axis).map_err(|_| Status::INVALID_VALUE)?;
        self.get_coordinate(number, axis).map_err(|_| Status::INVALID_VALUE)
    }

    /// RFS; the value of the reply is the stage for STATUS, else the command's.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for an unknown kind, [`Status::NOT_AVAILABLE`] for START
    /// while the drivers are off.
    pub(crate) fn reference_search(&mut self, what: Search, motor: u8, value: i32) -> Result<i32, Status> {
        let index = self.axis_index(motor)?;
        match what {
            Search::STATUS => return Ok(self.axes.get(index).map_or(0, Axis::search_state)),
            Search::START | Search::STOP => {}
            _ => return Err(Status::WRONG_TYPE),
        }
        for index in self.group(index) {
            let axis = self.axes.get_mut(index).ok_or(Status::INVALID_VALUE)?;
            if what == Search::START { axis.start_search()? } else { axis.stop_search() }
        }
        self.wake_axes();
        Ok(value)
    }

    /// All motors stop with their ramps, as after MST.
    pub(crate) fn stop_all(&mut self) {
        for axis in &mut self.axes {
            // A motor without power stands already.
            let _ = axis.rotate(0);
        }
        self.wake_axes();
    }
}

// Which axes.
impl<P: Ports, S: Store> Module<P, S> {
    pub(crate) fn axis_count(&self) -> usize {
        usize::from(self.catalogue.axes).min(MAX_AXES)
    }

    /// # Errors
    /// [`Status::INVALID_VALUE`] if the module has no such axis.
    #[inline]
    pub(crate) fn axis_index(&self, axis: u8) -> Result<usize, Status> {
        let index = usize::from(axis);
        if index < self.axis_count() { Ok(index) } else { Err(Status::INVALID_VALUE) }
    }

    /// # Errors
    /// [`Status::INVALID_VALUE`] if a motor of the mask does not exist.
    pub(crate) fn motors(&self, mask: u8) -> Result<Motors, Status> {
        if u32::from(mask) >> self.axis_count() == 0 { Ok(mask) } else { Err(Status::INVALID_VALUE) }
    }

    #[inline]
    fn axis_row(&self, number: u8) -> Result<&'static AxisParameter, Status> {
        self.catalogue.axis_parameter(number).ok_or(Status::WRONG_TYPE)
    }

    /// The row of a parameter by its meaning: a search, not for a tick.
    pub(crate) fn row_of(&self, id: Ap) -> Option<&'static AxisParameter> {
        self.catalogue.axis_parameters.iter().find(|row| row.id == id)
    }

    /// The axis and those that share its group index, if that is not 0 (axis parameter 249).
    fn group(&self, index: usize) -> impl Iterator<Item = usize> + use<P, S> {
        let group = self.axes.get(index).map_or(0, Axis::group);
        let mut motors: Motors = 1 << index;
        for (other, axis) in self.axes.iter().enumerate().take(self.axis_count()) {
            if group != 0 && axis.group() == group {
                motors |= 1 << other;
            }
        }
        members(motors)
    }
}

/// The numbers of the motors in a set.
fn members(motors: Motors) -> impl Iterator<Item = usize> {
    (0..MAX_AXES).filter(move |axis| motors & 1 << axis != 0)
}

// Time.
impl<P: Ports, S: Store> Module<P, S> {
    /// One control tick of all active axes.
    pub(crate) fn control_tick(&mut self) {
        if let Some(line) = &mut self.line {
            line.tick();
        }
        let mut any = false;
        for index in 0..self.axis_count() {
            if self.axes.get(index).is_some_and(Axis::is_active) {
                self.tick_axis(index);
                any = true;
            }
        }
        if self.line.as_ref().is_some_and(Line::is_done) {
            self.line = None;
            self.axes.iter_mut().for_each(Axis::release);
        }
        if self.events.is_waiting() {
            self.report_arrivals();
        }
        self.tick_at_us = if any { self.tick_at_us + u64::from(self.catalogue.tick_us) } else { NEVER };
    }

    #[inline]
    fn tick_axis(&mut self, index: usize) {
        let Some(axis) = self.axes.get_mut(index) else { return };
        let port = self.ports.axis(index);
        let switches = port.switches();
        let line = &self.line;
        let lead = |ramp: &mut _| {
            if let Some(line) = line {
                line.lead(index, ramp);
            }
        };
        let events = axis.tick(self.now, switches, lead, port);
        if switches != self.inputs.switches[index] {
            self.see_switches(index, switches);
        }
        if events != Events::default() {
            self.see_events(index, events);
        }
    }

    fn see_events(&mut self, index: usize, events: Events) {
        let kinds = [
            (events.arrived, InterruptKind::Position),
            (events.stalled, InterruptKind::Stall),
            (events.deviated, InterruptKind::Deviation),
        ];
        if events.deviated {
            self.program.cpu.registers.flags.insert(Flags::DEVIATION);
        }
        for (happened, kind) in kinds {
            if happened && let Some(number) = interrupts::number(self.catalogue, kind, index) {
                self.raise(number);
            }
        }
    }

    fn report_arrivals(&mut self) {
        let mut reached = 0;
        for (index, axis) in self.axes.iter().enumerate() {
            if axis.is_reached() {
                reached |= 1 << index;
            }
        }
        self.events.update(reached);
    }

    /// Looks at everything that changes from outside: ENABLE, inputs, switches.
    pub(crate) fn sample_inputs(&mut self) {
        let enabled = self.ports.io().enable();
        if enabled != self.inputs.enabled {
            self.see_enable(enabled);
        }
        let levels = self.ports.io().inputs();
        if levels != self.inputs.levels {
            self.see_inputs(levels);
        }
        for index in 0..self.axis_count() {
            let switches = self.ports.axis(index).switches();
            if switches != self.inputs.switches[index] {
                self.see_switches(index, switches);
            }
        }
    }

    fn see_enable(&mut self, enabled: bool) {
        self.inputs.enabled = enabled;
        let axes = self.axis_count();
        for (index, axis) in self.axes.iter_mut().enumerate().take(axes) {
            axis.set_power(enabled, self.ports.axis(index));
        }
    }
}

// Edges.
impl<P: Ports, S: Store> Module<P, S> {
    fn see_inputs(&mut self, levels: u8) {
        let changed = levels ^ self.inputs.levels;
        self.inputs.levels = levels;
        for input in (0..8).filter(|input| changed >> input & 1 != 0) {
            self.see_edge(InterruptKind::Input, input, levels >> input & 1 != 0);
        }
    }

    fn see_switches(&mut self, index: usize, switches: Switches) {
        let before = core::mem::replace(&mut self.inputs.switches[index], switches);
        if before.left != switches.left {
            self.see_edge(InterruptKind::StopSwitch, 2 * index, switches.left);
        }
        if before.right != switches.right {
            self.see_edge(InterruptKind::StopSwitch, 2 * index + 1, switches.right);
        }
    }

    fn see_edge(&mut self, kind: InterruptKind, index: usize, level: bool) {
        if self.program.is_running()
            && let Some(number) = interrupts::number(self.catalogue, kind, index)
        {
            self.interrupts.raise_edge(number, level);
        }
    }

    /// An interrupt's event has come; it is lost unless the program runs.
    fn raise(&mut self, number: u8) {
        if self.program.is_running() {
            self.interrupts.raise(number);
        }
    }
}
