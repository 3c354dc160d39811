//! Motion commands: ROR, ROL, MST, MVP, and axis parameters.
//!
//! Where the manual is silent:
//! - MST is accepted while ENABLE is low.
//! - The event of command 138 follows MVP only, not a target that SAP 0 writes.

use gradus_tmcl::catalogue::{Ap, AxisParameter, Gp, InterruptKind, MotionChip};
use gradus_tmcl::{MoveKind, Search, Status};

use crate::drive::axes::{Axes, Events, Motors, axis_index, motors};
use crate::drive::ticks::Ticks;
use crate::module::{MAX_AXES, Module};
use crate::ports::{Io, Ports, Store, Switches};
use crate::program::cpu::Flags;
use crate::program::interrupts;

impl<P: Ports, S: Store> Module<P, S> {
    /// GAP.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for a parameter that the module lacks.
    #[inline]
    pub(crate) fn get_axis_parameter(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        let index = self.axis_index(axis)?;
        let row = self.axis_row(number)?;
        Ok(self.axes.get(index, row.id, self.now, &mut self.ports))
    }

    /// SAP.
    ///
    /// # Errors
    /// As BEHAVIOUR 1 orders them: axis, parameter, value.
    pub(crate) fn set_axis_parameter(&mut self, number: u8, axis: u8, value: i32) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let row = self.axis_row(number)?;
        self.axes.set(index, row, value, &mut self.ports)?;
        self.wake_axes();
        Ok(())
    }

    /// A parameter by its meaning, which the module must have.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis.
    pub(crate) fn get_id(&mut self, axis: u8, id: Ap) -> Result<i32, Status> {
        let index = self.axis_index(axis)?;
        Ok(self.axes.get(index, id, self.now, &mut self.ports))
    }

    /// ROR (`sign` 1), ROL (-1) and MST (speed 0).
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis or a speed out of range, [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn rotate(&mut self, axis: u8, speed: i32, sign: i32) -> Result<(), Status> {
        let index = self.axis_index(axis)?;
        let speed = speed.checked_mul(sign).ok_or(Status::INVALID_VALUE)?;
        if !self.row_of(Ap::TargetSpeed).is_some_and(|row| self.axes.accepts_speed(index, row, speed)) {
            return Err(Status::INVALID_VALUE);
        }
        self.axes.rotate(index, speed)?;
        self.wake_axes();
        Ok(())
    }

    /// MVP; the value of the reply is the target of the motor, or the coordinate's number for a mask of motors.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, a mask or a coordinate, [`Status::WRONG_TYPE`] for a kind that the module
    /// lacks, [`Status::NOT_AVAILABLE`] while the drivers are off.
    pub(crate) fn move_to_position(&mut self, kind: MoveKind, motor: u8, value: i32) -> Result<i32, Status> {
        let started = self.axes.move_to(kind, motor, value, &mut self.ports)?;
        self.events.moved(started.motors);
        self.wake_axes();
        Ok(started.value)
    }

    /// RFS; the value of the reply is the stage for STATUS, else the command's.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, [`Status::WRONG_TYPE`] for an unknown kind, [`Status::NOT_AVAILABLE`] for START
    /// while the drivers are off.
    pub(crate) fn reference_search(&mut self, what: Search, motor: u8, value: i32) -> Result<i32, Status> {
        let index = self.axis_index(motor)?;
        let stage = self.axes.search(what, index)?;
        self.wake_axes();
        Ok(stage.unwrap_or(value))
    }

    /// All motors stop with their ramps, as after MST.
    pub(crate) fn stop_all(&mut self) {
        for index in 0..self.axis_count() {
            // A motor without power stands already.
            let _ = self.axes.rotate(index, 0);
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
        axis_index(self.catalogue, axis)
    }

    /// # Errors
    /// [`Status::INVALID_VALUE`] if a motor of the mask does not exist.
    pub(crate) fn motors(&self, mask: u8) -> Result<Motors, Status> {
        motors(self.catalogue, mask)
    }

    #[inline]
    pub(crate) fn axis_row(&self, number: u8) -> Result<&'static AxisParameter, Status> {
        self.catalogue.axis_parameter(number).ok_or(Status::WRONG_TYPE)
    }

    /// The row of a parameter by its meaning: a search, not for a tick.
    pub(crate) fn row_of(&self, id: Ap) -> Option<&'static AxisParameter> {
        self.catalogue.axis_parameters.iter().find(|row| row.id == id)
    }
}

// Time.
impl<P: Ports, S: Store> Module<P, S> {
    /// One control tick of all active axes.
    pub(crate) fn control_tick(&mut self) {
        self.axes.begin_tick();
        let mut any = false;
        for index in 0..self.axis_count() {
            if self.axes.is_active(index) {
                self.tick_axis(index);
                any = true;
            }
        }
        self.axes.end_tick();
        if self.events.is_waiting() {
            self.report_arrivals();
        }
        if any {
            self.ticks.advance(self.axes.period());
        } else {
            self.ticks = Ticks::NONE;
        }
    }

    #[inline]
    fn tick_axis(&mut self, index: usize) {
        let switches = self.axes.switches(index, &mut self.ports);
        let events = self.axes.tick(index, self.now, switches, &mut self.ports);
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
        for index in 0..self.axis_count() {
            if self.axes.is_reached(index) {
                reached |= 1 << index;
            }
        }
        self.events.update(reached);
    }

    /// Looks at everything that changes from outside: ENABLE, inputs, switches.
    pub(crate) fn sample_inputs(&mut self) {
        let enabled = self.is_enabled();
        if enabled != self.inputs.enabled {
            self.see_enable(enabled);
        }
        let levels = self.ports.io().inputs();
        if levels != self.inputs.levels {
            self.see_inputs(levels);
        }
        for index in 0..self.axis_count() {
            let switches = self.axes.switches(index, &mut self.ports);
            if switches != self.inputs.switches[index] {
                self.see_switches(index, switches);
            }
            self.axes.look(index, &mut self.ports);
            self.see_driver(index);
        }
        self.wake_axes();
    }

    /// Whether the drivers may be on: the level of ENABLE, or of SHUTDOWN as global parameter 80 of the TMCM-351 reads it.
    pub(crate) fn is_enabled(&mut self) -> bool {
        let level = self.ports.io().enable();
        match (self.catalogue.chip, self.globals.get(Gp::ShutdownPin)) {
            (MotionChip::Tmc428, 0) => true,
            (MotionChip::Tmc428, 1) => !level,
            _ => level,
        }
    }

    /// Sets the flag ESD when the driver of an axis switches itself off.
    #[inline]
    fn see_driver(&mut self, index: usize) {
        let bit = 1 << index;
        if !self.axes.is_shut_down(index, &mut self.ports) {
            self.inputs.shut_down &= !bit;
        } else if self.inputs.shut_down & bit == 0 {
            self.inputs.shut_down |= bit;
            self.program.cpu.registers.flags.insert(Flags::SHUTDOWN);
        }
    }

    fn see_enable(&mut self, enabled: bool) {
        self.inputs.enabled = enabled;
        if !enabled {
            self.program.cpu.registers.flags.insert(Flags::SHUTDOWN);
        }
        for index in 0..self.axis_count() {
            self.axes.set_power(index, enabled, &mut self.ports);
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
