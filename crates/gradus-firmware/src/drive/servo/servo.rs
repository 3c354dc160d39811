//! The axis of a servo module: one motor under field-oriented control.
//!
//! The arithmetic is that of [`gradus_motion::foc`]; here are the commands, the protection and the ticks, one a PWM period
//! (axis parameter 110). The module ticks while its driver works or the rotor turns; a quarter of a second after both have come
//! to rest it costs nothing.
//!
//! Where the manual is silent:
//! - The axis begins in stop mode: no current. MST regulates velocity 0 (velocity mode). A fault, axis parameter 255 = 0 and a
//!   fault's end lead to stop mode; a motion command while the driver is off is not available, but MST is.
//! - An active right or left switch that is enabled (axis parameters 209, 210) brakes a motion towards it without a ramp and
//!   ends it: the velocity is 0 then, and a motion away is free. A switch that is not enabled is not active. Home stops nothing.
//! - Outside position mode the target (50) is where the motor is, so that position reached (55) is 1 where the speed is in its
//!   window: a module that nobody has moved stands on its target. MVP REL always goes from where the motor is (§3.6.4).
//! - Writing 52 sets the actual position, the target and the ramp, in every mode: what stands, stays. A motor on its way brakes
//!   by its ramp and comes back to there. When the null channel clears the position (107), a target keeps its number.
//! - The velocity of the position ramp is fed forward to the velocity regulator, always; the manual has no parameter for it.
//! - Positions outside are those inside times 56 / 65536, rounded down; a target that does not fit inside is an invalid value.
//!   When 56 changes, so do all positions that are read, the target too; the motor stays.
//! - The encoder is initialised when it first commutates, or when its parameters or those of the motor have changed. An
//!   alignment (102 = 0) lasts as long as 104 says, and longer where the rotor has not come to rest. It is an initialisation
//!   error if the rotor never does, or if the encoder does not count what the rotor turns from one place of rest to the next
//!   (see the [`Servo`](gradus_motion::foc::Servo) of the regulators); another commutation mode, or 1 to 255, tries again. The
//!   module is not initialized (bit 15 of 156) while there is such an error.
//! - Axis parameter 105 has no use: no mode of initialisation turns the motor to its null channel. IIT flags stay 0.
//! - Loops a second (230 to 232) are those of the ramp, of the current loop and of the velocity loop. They run always, whether
//!   or not the driver works.

use gradus_motion::foc::{self, Dq, Feedback};
use gradus_tmcl::catalogue::{Ap, AxisParameter, Module};
use gradus_tmcl::{MoveKind, Search, Status};

use crate::drive::axes::{Axes, Events, Move, axis_index};
use crate::drive::servo::chips::Chips;
use crate::drive::servo::protection::{Protection, Sight};
use crate::drive::servo::settings::ServoDerived;
use crate::drive::stepper::settings::Settings;
use crate::drive::ticks::Period;
use crate::ports::{Bridge, Io, Ports, RotorInputs, Supply, Switches};
use crate::program::program::NEVER;

/// Bits of axis parameters 209 and 210.
const RIGHT: u8 = 1 << 0;
const LEFT: u8 = 1 << 1;
const HOME: u8 = 1 << 2;

/// Number of the first reference switch among the digital inputs: right, left, home.
const FIRST_SWITCH: u8 = 2;

/// What the axis was told to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Mode {
    #[default]
    Stop,
    Torque,
    Velocity,
    Position,
}

/// The axis of a servo module.
#[derive(Clone, Debug)]
pub struct Servo {
    pub(crate) catalogue: &'static Module,
    pub(crate) settings: Settings,
    pub(crate) derived: ServoDerived,
    pub(crate) control: foc::Servo,
    period: Period,
    pub(crate) mode: Mode,
    /// Target of position mode as the user gave it.
    pub(crate) target: i32,
    pub(crate) protection: Protection,
    /// Axis parameter 255.
    pub(crate) enabled: bool,
    /// The module's ENABLE input, where a board has one.
    powered: bool,
    pub(crate) chopping: bool,
    seen: Feedback,
    pub(crate) chips: Chips,
    /// Ticks until a rotor that no longer moves is at rest.
    pub(crate) quiet_in: u32,
}

impl<P: Ports<Axis: Bridge + RotorInputs + Supply>> Axes<P> for Servo {
    fn new(catalogue: &'static Module) -> Self {
        let settings = Settings::factory(catalogue);
        Self {
            catalogue,
            derived: settings.derive_servo(),
            control: foc::Servo::new(settings.servo().gains()),
            period: settings.pwm_period(),
            settings,
            mode: Mode::Stop,
            target: 0,
            protection: Protection::default(),
            enabled: true,
            powered: true,
            chopping: false,
            seen: Feedback::default(),
            chips: Chips::default(),
            quiet_in: 0,
        }
    }

    fn restart(&mut self) {
        *self = <Self as Axes<P>>::new(self.catalogue);
    }

    fn start(&mut self, index: usize, _now: u64, powered: bool, ports: &mut P) {
        let port = ports.axis(index);
        self.powered = powered;
        port.set_frequency(self.settings.unsigned(Ap::PwmFrequencyHz));
        port.set_brake_chopper(false);
        port.rest();
        self.arm_null(port);
        let phases_ma = self.phases_ma(port);
        self.protect(phases_ma, port);
        self.seen = feedback(phases_ma, port);
        self.control.idle(&self.seen);
    }

    #[inline]
    fn get(&mut self, index: usize, id: Ap, _now: u64, ports: &mut P) -> i32 {
        match id {
            Ap::RightSwitch => i32::from(self.switches_of(ports).right),
            Ap::LeftSwitch => i32::from(self.switches_of(ports).left),
            Ap::HomeSwitch => i32::from(self.switches_of(ports).home),
            _ => self.read(id, ports.axis(index)),
        }
    }

    fn set(&mut self, index: usize, row: &AxisParameter, value: i32, ports: &mut P) -> Result<(), Status> {
        self.write(row, value, ports.axis(index))
    }

    fn rotate(&mut self, _index: usize, speed: i32) -> Result<(), Status> {
        self.turn(speed)
    }

    fn move_to(&mut self, kind: MoveKind, motor: u8, value: i32, _ports: &mut P) -> Result<Move, Status> {
        axis_index(self.catalogue, motor)?;
        let target = match kind {
            MoveKind::ABS => value,
            MoveKind::REL => self.outside(self.control.position()).wrapping_add(value),
            _ => return Err(Status::WRONG_TYPE),
        };
        self.go(target)?;
        Ok(Move { value: target, motors: 1 })
    }

    /// The module has no reference search.
    fn search(&mut self, _what: Search, _index: usize) -> Result<Option<i32>, Status> {
        Err(Status::WRONG_TYPE)
    }

    /// Nor coordinates.
    fn coordinate_mut(&mut self, _number: u8, _index: usize) -> Option<&mut i32> {
        None
    }

    fn read_register(&mut self, chip: u8, address: u8, ports: &mut P) -> Result<i32, Status> {
        self.read_chip(chip, address, ports.axis(0))
    }

    fn write_register(&mut self, chip: u8, address: u8, value: i32, ports: &mut P) -> Result<(), Status> {
        self.write_chip(chip, address, value, ports.axis(0))
    }

    fn set_power(&mut self, index: usize, on: bool, ports: &mut P) {
        self.powered = on;
        self.release_if_off(ports.axis(index));
    }

    #[inline]
    fn switches(&mut self, _index: usize, ports: &mut P) -> Switches {
        self.switches_of(ports)
    }

    #[inline]
    fn is_reached(&self, _index: usize) -> bool {
        self.has_arrived()
    }

    fn is_searching(&self, _index: usize) -> bool {
        false
    }

    #[inline]
    fn is_active(&self, _index: usize) -> bool {
        self.is_ticking()
    }

    #[inline]
    fn period(&self) -> Period {
        self.period
    }

    /// A change of supply or temperature, and a rotor that somebody turns.
    fn look(&mut self, index: usize, ports: &mut P) {
        if self.is_ticking() {
            return;
        }
        let port = ports.axis(index);
        // No current flows that the module could do something about.
        self.protect([0; 3], port);
        if (port.hall(), port.encoder()) != (self.seen.hall_bits, self.seen.encoder_count) {
            self.quiet_in = self.derived.quiet_ticks;
        }
    }

    #[inline]
    fn tick(&mut self, index: usize, _now: u64, switches: Switches, ports: &mut P) -> Events {
        let port = ports.axis(index);
        let phases_ma = self.phases_ma(port);
        self.protect(phases_ma, port);
        self.brake_at(switches);
        let seen = feedback(phases_ma, port);
        let duties = if self.is_on() {
            self.control.cycle(&seen)
        } else {
            self.control.idle(&seen);
            None
        };
        port.set_duties(duties.map(|duties| duties.q15));
        self.watch_null(port);
        if self.control.encoder_init_failed() && self.is_on() {
            self.protection.fail_init();
            self.stop();
        }
        self.watch_rest(seen);
        if !self.is_ticking() {
            port.rest();
        }
        Events::default()
    }

    #[inline]
    fn due_at(&self) -> u64 {
        NEVER
    }

    fn run_timer(&mut self, _index: usize, _now: u64, _ports: &mut P) {}
}

// Motion.
impl Servo {
    /// ROR, MST and axis parameter 40.
    pub(crate) fn turn(&mut self, rpm: i32) -> Result<(), Status> {
        if rpm != 0 || self.is_on() {
            self.begin(Mode::Velocity)?;
            self.control.turn(rpm);
        }
        Ok(())
    }

    /// MVP and axis parameter 50.
    pub(crate) fn go(&mut self, target: i32) -> Result<(), Status> {
        let inside = self.inside(target).ok_or(Status::INVALID_VALUE)?;
        self.go_inside(inside)?;
        self.target = target;
        Ok(())
    }

    /// The same to a position as the regulator counts it.
    pub(crate) fn go_inside(&mut self, position: i32) -> Result<(), Status> {
        self.begin(Mode::Position)?;
        self.target = self.outside(position);
        self.control.move_to(position);
        Ok(())
    }

    /// Axis parameters 30 and 32.
    pub(crate) fn push(&mut self, target_ma: Dq) -> Result<(), Status> {
        self.begin(Mode::Torque)?;
        self.control.regulate_current(target_ma);
        Ok(())
    }

    fn begin(&mut self, mode: Mode) -> Result<(), Status> {
        if !self.is_on() {
            return Err(Status::NOT_AVAILABLE);
        }
        self.mode = mode;
        Ok(())
    }

    /// A position as the user sees it (axis parameter 56).
    pub(crate) fn outside(&self, position: i32) -> i32 {
        ((i64::from(position) * i64::from(self.settings.get(Ap::PositionScaler))) >> 16) as i32
    }

    /// A position of the user's as the regulator sees it, if there is one: the smallest that [`outside`](Self::outside) shows
    /// so, or next to it.
    pub(crate) fn inside(&self, position: i32) -> Option<i32> {
        let scaler = i64::from(self.settings.get(Ap::PositionScaler)).max(1);
        let scaled = i64::from(position) << 16;
        let floor = scaled.checked_div_euclid(scaler)?;
        let up = i64::from(scaled.checked_rem_euclid(scaler)? != 0);
        i32::try_from(floor + up).ok()
    }

    /// Axis parameter 52.
    pub(crate) fn set_position(&mut self, position: i32) -> Result<(), Status> {
        let inside = self.inside(position).ok_or(Status::INVALID_VALUE)?;
        self.control.set_position(inside);
        self.target = position;
        Ok(())
    }

    /// Axis parameter 50: outside position mode the motor is where it is to be.
    pub(crate) fn target_position(&self) -> i32 {
        if self.mode == Mode::Position { self.target } else { self.outside(self.control.position()) }
    }

    /// Position reached (axis parameters 53 to 55).
    pub(crate) fn has_arrived(&self) -> bool {
        let distance = self.target_position().wrapping_sub(self.outside(self.control.position()));
        let speed = self.control.mean_velocity_rpm();
        distance.unsigned_abs() <= self.settings.unsigned(Ap::PositionReachedDistance)
            && speed.unsigned_abs() <= self.settings.unsigned(Ap::PositionReachedSpeed)
    }

    /// A switch in the way ends a motion.
    #[inline]
    fn brake_at(&mut self, switches: Switches) {
        let ahead = match self.heading() {
            1 => switches.right,
            -1 => switches.left,
            _ => false,
        };
        if ahead {
            self.mode = Mode::Velocity;
            self.control.brake();
        }
    }

    /// Which way the motor is to turn.
    #[inline]
    fn heading(&self) -> i32 {
        match self.mode {
            Mode::Stop => 0,
            Mode::Torque => self.control.target_current_ma().q.signum(),
            Mode::Velocity => self.control.target_velocity_rpm().signum(),
            Mode::Position => self.control.target_position().wrapping_sub(self.control.position()).signum(),
        }
    }

    /// Reference switches (axis parameters 209 to 213).
    #[inline]
    pub(crate) fn switches_of<P: Ports>(&self, ports: &mut P) -> Switches {
        let derived = &self.derived;
        if derived.switch_enable == 0 {
            return Switches::default();
        }
        let levels = ports.io().inputs() >> FIRST_SWITCH;
        let active = !(levels ^ derived.switch_polarity) & derived.switch_enable;
        Switches { right: active & RIGHT != 0, left: active & LEFT != 0, home: active & HOME != 0 }
    }
}

// The driver.
impl Servo {
    /// Derives anew what depends on the settings.
    pub(crate) fn derive(&mut self) {
        self.derived = self.settings.derive_servo();
        self.period = self.settings.pwm_period();
        self.control.set_gains(self.settings.servo().gains());
    }

    /// True while the driver may work.
    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        self.enabled && self.powered && self.protection.allows()
    }

    #[inline]
    pub(crate) fn is_ticking(&self) -> bool {
        (self.derived.drives && self.is_on()) || self.quiet_in > 0
    }

    /// Axis parameter 255: 1 also clears latched faults.
    pub(crate) fn enable<A: Bridge>(&mut self, on: bool, port: &mut A) {
        self.enabled = on;
        if on {
            self.retry();
        }
        self.release_if_off(port);
    }

    /// Clears what is latched.
    pub(crate) fn retry(&mut self) {
        if !self.protection.allows() {
            self.protection.clear();
            self.control.initialise_encoder();
        }
    }

    fn release_if_off<A: Bridge>(&mut self, port: &mut A) {
        if !self.is_on() {
            self.stop();
            port.rest();
        }
    }

    /// Stop mode; the motor runs down.
    pub(crate) fn stop(&mut self) {
        self.mode = Mode::Stop;
        self.control.brake();
        self.control.regulate_current(Dq::default());
        self.quiet_in = self.derived.quiet_ticks;
    }

    /// Currents of the three phases (axis parameters 2 to 4).
    #[inline]
    pub(crate) fn phases_ma<A: Bridge>(&self, port: &mut A) -> [i32; 3] {
        let [a, b] = port.shunts().map(i32::from);
        let [offset_a, offset_b] = self.derived.shunt_offsets;
        let (a, b) = (a - offset_a, b - offset_b);
        [a, b, -a - b]
    }

    /// Looks for faults and works the brake chopper.
    #[inline]
    fn protect<A: Bridge + Supply>(&mut self, phases_ma: [i32; 3], port: &mut A) {
        let voltage_dv = port.voltage_dv();
        let sight = Sight {
            voltage_dv,
            temperature_c: port.temperature_c(),
            phases_ma,
            gate_fault: port.is_faulty(),
            hall_fault: self.derived.hall_commutates && self.control.hall_is_faulty(),
        };
        let allowed = self.protection.allows();
        self.protection.watch(&sight, self.derived.patience);
        if allowed && !self.protection.allows() {
            self.stop();
        }
        self.chop(voltage_dv, port);
    }

    #[inline]
    fn chop<A: Supply>(&mut self, voltage_dv: i32, port: &mut A) {
        let on = match self.derived.chopper {
            Some((limit_dv, off_dv)) => voltage_dv >= limit_dv || (self.chopping && voltage_dv >= off_dv),
            None => false,
        };
        if on != self.chopping {
            self.chopping = on;
            port.set_brake_chopper(on);
        }
    }

    /// The module rests when the rotor has not moved for a while.
    #[inline]
    fn watch_rest(&mut self, seen: Feedback) {
        let moved = (seen.hall_bits, seen.encoder_count) != (self.seen.hall_bits, self.seen.encoder_count);
        self.quiet_in = if moved { self.derived.quiet_ticks } else { self.quiet_in.saturating_sub(1) };
        self.seen = seen;
    }
}

#[inline]
fn feedback<A: RotorInputs>([a, b, _]: [i32; 3], port: &mut A) -> Feedback {
    Feedback { phases_ma: [a, b], hall_bits: port.hall(), encoder_count: port.encoder() }
}
