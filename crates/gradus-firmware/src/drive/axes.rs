//! The axes of a module, whatever they drive.
//!
//! A module has axes of one kind, which its [`Ports`](crate::Ports) name: [`Steppers`](crate::Steppers). The module knows
//! them by [`Axes`] alone, and the calls are static: the firmware of a board holds the one kind that it drives.

use gradus_tmcl::catalogue::{Ap, AxisParameter, Module};
use gradus_tmcl::{MoveKind, Search, Status};

use crate::drive::stepper::search_failure::SearchFailure;
use crate::drive::ticks::Period;
use crate::ports::Switches;

/// A set of motors, bit 0 is motor 0.
pub type Motors = u8;

/// A motion to a position that MVP has started.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// The value of the reply.
    pub value: i32,
    /// The motors that move.
    pub motors: Motors,
}

/// What a tick has found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Events {
    /// The target of a move is reached.
    pub arrived: bool,
    /// A stall has begun, or has stopped the motor.
    pub stalled: bool,
    /// A deviation from the encoder has stopped the motor.
    pub deviated: bool,
}

/// What commands and time ask of the axes of a module on hardware `P`. An `index` is below the module's number of axes.
///
/// Only the firmware implements it.
pub trait Axes<P> {
    /// Axes with factory settings.
    fn new(catalogue: &'static Module) -> Self;

    /// As after switching on.
    fn restart(&mut self);

    /// Puts an axis on its hardware, with its drivers on or off.
    fn start(&mut self, index: usize, now: u64, powered: bool, ports: &mut P);

    /// A parameter that the module has, as GAP reads it.
    fn get(&mut self, index: usize, id: Ap, now: u64, ports: &mut P) -> i32;

    /// Writes a parameter as SAP does, after the checks of its row.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if it is read only, [`Status::INVALID_VALUE`] if the value is not accepted,
    /// [`Status::NOT_AVAILABLE`] for a motion while the drivers are off.
    fn set(&mut self, index: usize, row: &AxisParameter, value: i32, ports: &mut P) -> Result<(), Status>;

    /// Whether all axes that obey ROR together with this one take the speed, by the row of the target speed.
    fn accepts_speed(&self, _index: usize, row: &AxisParameter, speed: i32) -> bool {
        row.accepts(speed)
    }

    /// ROR; speed 0 is MST. If one of the axes that obey cannot, none starts; so do MVP and RFS.
    ///
    /// # Errors
    /// [`Status::NOT_AVAILABLE`] while the drivers are off and the speed is not 0.
    fn rotate(&mut self, index: usize, speed: i32) -> Result<(), Status>;

    /// MVP.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] for an axis, a mask or a coordinate, [`Status::WRONG_TYPE`] for a kind that the module
    /// lacks, [`Status::NOT_AVAILABLE`] while the drivers are off.
    fn move_to(&mut self, kind: MoveKind, motor: u8, value: i32, ports: &mut P) -> Result<Move, Status>;

    /// RFS; the stage for STATUS, else nothing.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] for a kind that the module lacks, [`Status::NOT_AVAILABLE`] for START while the drivers are off.
    fn search(&mut self, what: Search, index: usize) -> Result<Option<i32>, Status>;

    /// A reference search that has failed since the last call, by its axis and why.
    fn take_search_failure(&mut self) -> Option<(usize, SearchFailure)> {
        None
    }

    /// A position that MVP COORD moves to; `None` if there is no such coordinate.
    fn coordinate_mut(&mut self, number: u8, index: usize) -> Option<&mut i32>;

    /// Switches the driver on or off; off stops the motor at once.
    fn set_power(&mut self, index: usize, on: bool, ports: &mut P);

    /// A register of one of the chips that drive the axes.
    ///
    /// # Errors
    /// [`Status::INVALID_VALUE`] if there is no such chip or register.
    fn read_register(&mut self, _chip: u8, _address: u8, _ports: &mut P) -> Result<i32, Status> {
        Err(Status::INVALID_VALUE)
    }

    /// Writes it.
    ///
    /// # Errors
    /// The same, also if it cannot be written so.
    fn write_register(&mut self, _chip: u8, _address: u8, _value: i32, _ports: &mut P) -> Result<(), Status> {
        Err(Status::INVALID_VALUE)
    }

    /// Levels of the switch inputs.
    fn switches(&mut self, index: usize, ports: &mut P) -> Switches;

    /// The switches in their places, true where one is active.
    fn active_switches(&mut self, index: usize, ports: &mut P) -> Switches {
        self.switches(index, ports)
    }

    /// Position reached.
    fn is_reached(&self, index: usize) -> bool;

    /// True during a reference search.
    fn is_searching(&self, index: usize) -> bool;

    /// True when the axis needs control ticks.
    fn is_active(&self, index: usize) -> bool;

    /// Time between two control ticks.
    fn period(&self) -> Period;

    /// Looks at what may have changed from outside while the axis rested.
    fn look(&mut self, _index: usize, _ports: &mut P) {}

    /// Whether the driver of an axis has switched itself off.
    fn is_shut_down(&self, _index: usize, _ports: &mut P) -> bool {
        false
    }

    /// What the axes do together before they tick.
    fn begin_tick(&mut self) {}

    /// One control tick of an active axis.
    fn tick(&mut self, index: usize, now: u64, switches: Switches, ports: &mut P) -> Events;

    /// What the axes do together when they have ticked.
    fn end_tick(&mut self) {}

    /// When an axis has something to do besides control ticks; `u64::MAX` for never.
    fn due_at(&self) -> u64;

    /// Does what is due besides control ticks.
    fn run_timer(&mut self, index: usize, now: u64, ports: &mut P);
}

/// The number of an axis of a module.
///
/// # Errors
/// [`Status::INVALID_VALUE`] if there is no such axis.
#[inline]
pub(crate) fn axis_index(catalogue: &Module, axis: u8) -> Result<usize, Status> {
    if axis < catalogue.axes { Ok(usize::from(axis)) } else { Err(Status::INVALID_VALUE) }
}

/// The same for a mask of motors.
///
/// # Errors
/// [`Status::INVALID_VALUE`] if a motor of the mask does not exist.
pub(crate) fn motors(catalogue: &Module, mask: u8) -> Result<Motors, Status> {
    if mask.checked_shr(u32::from(catalogue.axes)).unwrap_or(0) == 0 { Ok(mask) } else { Err(Status::INVALID_VALUE) }
}

/// The numbers of the motors in a set.
pub(crate) fn members(motors: Motors) -> impl Iterator<Item = usize> {
    (0..8).filter(move |axis| motors & 1 << axis != 0)
}
