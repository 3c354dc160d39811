//! An axis: driver chip, motor, travel with switches, encoder.
//!
//! The rotor is either rigid, and then it follows the coil vector at once and time has no meaning, or a motor with physics,
//! which moves in steps of 100 us when [`StepperAxis::advance`] is called. An axis whose rotor has come to rest falls
//! asleep: it costs nothing until a new vector, or anybody, wakes it.
//!
//! A motor rests when it was slower than 1/5000 turn a second for 5 ms, which is longer than a period of its resonance, under a
//! vector that stood, when its currents stay as they are, and when the chip has found that it stands (65 ms). Without any friction it may never rest. Its winding goes on warming or cooling; that has a closed form.

use crate::coil_vector::CoilVector;
use crate::contacts::{Contacts, STEP_US};
use crate::driver::{CoilFault, Driver, DriverSettings, DriverState};
use crate::encoder::NullLatch;
use crate::field::{Coil, Drive, Field};
use crate::microsteps::MICROSTEPS_PER_FULL_STEP;
use crate::motors::{Mechanics, Motor};
use crate::rigid::RigidRotor;
use crate::stepper::{Currents, Stepper};
use crate::winding::Winding;
use crate::{Encoder, NullEvent, Surroundings, Switch, Travel};

/// Current of the module at full scale in amperes RMS, unless told otherwise: TMCM-3351.
const FULL_SCALE_A: f64 = 3.3;

/// Microsteps a step below which a rotor stands, if for so many steps.
const REST_SPEED: f64 = 1e-3;
const REST_STEPS: u8 = 50;

#[derive(Clone, PartialEq, Debug)]
enum Rotor {
    Rigid { rotor: RigidRotor, full_steps: u32 },
    Motor(Box<Stepper>),
}

/// One axis of a machine.
#[derive(Clone, PartialEq, Debug)]
pub struct StepperAxis {
    rotor: Rotor,
    driver: Driver,
    winding: Winding,
    vector: CoilVector,
    /// Steps that the rotor has stood.
    quiet: u8,
    awake: bool,
    /// When the latest step ended.
    time_us: u64,
    contacts: Contacts,
    forced: [Option<bool>; Switch::ALL.len()],
    line: EncoderLine,
    null: Option<NullLatch>,
    /// Where the switches and end stops are.
    pub travel: Travel,
    /// The encoder on the shaft, if there is one.
    pub encoder: Option<Encoder>,
}

/// The line from the encoder to the module.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct EncoderLine {
    /// Count at which the line was cut, if it is.
    cut_at: Option<i64>,
    /// Counts that were lost while it was cut.
    lost: i64,
}

/// What an axis shows to instruments.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Readings {
    /// Position of the shaft in microsteps of 1/256 full step, with fractions.
    pub position: f64,
    /// Speed of the shaft in turns a second.
    pub speed_rps: f64,
    /// External load in Nm, positive against the positive direction.
    pub load_nm: f64,
    /// Torque of the motor in Nm.
    pub torque_nm: f64,
    /// Electrical angle from the rotor to the coil vector in degrees, -180 to 180.
    pub load_angle_deg: f64,
    /// Length of the current vector in amperes RMS.
    pub current_a: f64,
    /// Temperature of the winding in degrees Celsius.
    pub winding_c: f64,
    /// Temperature of the driver chip in degrees Celsius.
    pub driver_c: f64,
    /// StallGuard2 reading, 0..=1023.
    pub stallguard: u16,
}

impl Readings {
    /// True if each is a number.
    pub fn are_sane(&self) -> bool {
        let Self { position, speed_rps, load_nm, torque_nm, load_angle_deg, current_a, winding_c, driver_c, .. } = self;
        let all = [position, speed_rps, load_nm, torque_nm, load_angle_deg, current_a, winding_c, driver_c];
        all.iter().all(|reading| reading.is_finite())
    }
}

impl StepperAxis {
    /// An axis that never loses a step, at position 0, with the default encoder and without switches.
    pub fn rigid(full_steps_per_turn: u32) -> Self {
        Self::of(Rotor::Rigid { rotor: RigidRotor::default(), full_steps: full_steps_per_turn })
    }

    /// A motor that moves something, at position 0, with the default encoder and without switches.
    pub fn with_motor(motor: Motor, mechanics: Mechanics, currents: Currents) -> Self {
        Self::of(Rotor::Motor(Box::new(Stepper::new(motor, mechanics, currents))))
    }

    fn of(rotor: Rotor) -> Self {
        Self {
            rotor,
            driver: Driver::new(FULL_SCALE_A),
            winding: Winding::default(),
            vector: CoilVector::default(),
            quiet: 0,
            awake: false,
            time_us: 0,
            contacts: Contacts::default(),
            forced: [None; Switch::ALL.len()],
            line: EncoderLine::default(),
            null: None,
            travel: Travel::default(),
            encoder: Some(Encoder::default()),
        }
    }

    /// Gives StallGuard2 a noise of so many counts, standard deviation, from a seed.
    pub fn set_stallguard_noise(&mut self, counts: f64, seed: u32) {
        self.driver.set_noise(counts, seed);
    }

    /// Gives the driver chip another current at full scale, in amperes RMS.
    pub fn set_full_scale(&mut self, rms_a: f64) {
        self.driver.set_full_scale(rms_a);
    }
}

impl Default for StepperAxis {
    /// The default motor with the default load.
    fn default() -> Self {
        Self::with_motor(Motor::default(), Mechanics::default(), Currents::default())
    }
}

// The power stage.
impl StepperAxis {
    /// Applies a coil vector. `phase` counts microsteps and wraps; `current` is 0..=255, 0 for none.
    #[inline]
    pub fn set_coils(&mut self, phase: i32, current: u8) {
        let changed = self.driver.set_current(current) || phase != self.vector.phase;
        self.vector.phase = phase;
        if changed {
            self.wake();
        }
        if let Rotor::Rigid { .. } = self.rotor {
            self.follow();
        }
    }

    /// Scales the coil vector, 255 is 1.
    #[inline]
    pub fn set_scale(&mut self, scale: u8) {
        if self.driver.set_scale(scale) {
            self.wake();
        }
    }

    /// A rigid rotor goes where its coils point, if they do.
    fn follow(&mut self) {
        let Rotor::Rigid { rotor, .. } = &mut self.rotor else { return };
        let surroundings = Surroundings::default();
        match self.driver.drive(0.0, surroundings.supply_v, surroundings.temperature_c) {
            Drive::Current(_) | Drive::Voltage(_) => rotor.follow(self.vector.phase, self.travel.ends),
            Drive::Open | Drive::Shorted => rotor.release(),
        }
    }

    /// Gives settings to the driver chip.
    pub fn configure(&mut self, settings: DriverSettings) {
        self.driver.settings = settings;
        self.wake();
    }

    /// What the driver chip reports.
    pub fn driver(&self) -> &DriverState {
        &self.driver.state
    }

    /// Takes the current away.
    pub fn release(&mut self) {
        self.set_coils(self.vector.phase, 0);
    }
}

// Time.
impl StepperAxis {
    /// True if time has a meaning for this axis.
    pub fn lives(&self) -> bool {
        matches!(self.rotor, Rotor::Motor(_)) || self.travel.bounces()
    }

    /// True while the axis needs its steps.
    #[inline]
    pub fn is_awake(&self) -> bool {
        self.awake
    }

    /// Lets the axis look at its surroundings anew.
    pub fn wake(&mut self) {
        self.awake = self.lives();
        self.quiet = 0;
    }

    /// One step of 100 us, which ends at `now_us`; nothing while the axis sleeps. To be called for every multiple of
    /// 100 us while it is awake.
    #[inline]
    pub fn advance(&mut self, now_us: u64, surroundings: &Surroundings) {
        if !self.awake {
            return;
        }
        let slept = (now_us.saturating_sub(self.time_us) / STEP_US).saturating_sub(1);
        if slept > 0 {
            self.winding.pass(slept);
        }
        self.time_us = now_us;
        let stands = self.step(surroundings);
        debug_assert!(self.is_sane(), "{self:?}");
        if self.travel.bounces() {
            self.contacts.step(&self.travel, self.position());
        }
        self.quiet = if stands && self.contacts.are_quiet() { self.quiet + 1 } else { 0 };
        self.awake = self.quiet < REST_STEPS;
    }

    /// A step of the motor; true if it stands.
    fn step(&mut self, surroundings: &Surroundings) -> bool {
        let (turned, speed) = self.vector.step();
        let Rotor::Motor(motor) = &mut self.rotor else { return turned == 0 };
        let Surroundings { supply_v: volts, temperature_c } = *surroundings;
        motor.warm_to(self.winding.temperature_c(0));
        let drive = self.driver.drive(speed, volts, temperature_c);
        let (phase, ends) = (self.vector.phase, self.travel.ends);
        let field = Field { phase, turned, speed, drive, volts, broken: self.driver.broken(), ends };
        let before = motor.position();
        motor.step(&field);
        self.driver.observe(&field, motor);
        self.winding.step(motor.warmth(), temperature_c);
        let stands = turned == 0 && (motor.position() - before).abs() < REST_SPEED;
        stands && motor.has_settled() && self.driver.is_at_rest()
    }

    /// Nothing is absurd.
    fn is_sane(&self) -> bool {
        let motor = match &self.rotor {
            Rotor::Rigid { .. } => true,
            Rotor::Motor(motor) => motor.is_sane(),
        };
        motor && self.winding.temperature_c(0).is_finite()
    }

    /// What instruments show at a time after the latest step.
    pub fn readings(&self, now_us: u64, surroundings: &Surroundings) -> Readings {
        let board_c = surroundings.temperature_c;
        let slept = now_us.saturating_sub(self.time_us) / STEP_US;
        let common = Readings {
            position: self.position() as f64,
            winding_c: self.winding.temperature_c(slept),
            driver_c: self.driver.temperature_c(board_c),
            stallguard: self.driver.state.load,
            ..Readings::default()
        };
        match &self.rotor {
            Rotor::Rigid { .. } => common,
            Rotor::Motor(motor) => Readings {
                position: motor.position(),
                speed_rps: if self.awake { motor.speed_rps() } else { 0.0 },
                load_nm: motor.mechanics().load_nm,
                torque_nm: motor.reading.torque_nm,
                load_angle_deg: motor.load_angle_deg(),
                current_a: motor.current_a(),
                ..common
            },
        }
    }
}

// The shaft.
impl StepperAxis {
    /// Position of the shaft in microsteps, 0 where it was first.
    #[inline]
    pub fn position(&self) -> i64 {
        match &self.rotor {
            Rotor::Rigid { rotor, .. } => rotor.position(),
            Rotor::Motor(motor) => motor.microstep(),
        }
    }

    /// Puts the shaft somewhere else, by hand.
    pub fn place(&mut self, position: i64) {
        self.shift((position - self.position()) as f64);
        self.contacts.rest(&self.travel, position);
    }

    /// Turns the shaft by hand and lets it go.
    pub fn push(&mut self, degrees: f64) {
        self.shift(degrees / 360.0 * f64::from(self.microsteps_per_turn()));
    }

    fn shift(&mut self, microsteps: f64) {
        match &mut self.rotor {
            Rotor::Rigid { rotor, .. } => rotor.place(rotor.position() + microsteps.round() as i64),
            Rotor::Motor(motor) => motor.place(motor.position() + microsteps),
        }
        self.wake();
    }

    /// Holds the shaft, or lets it go.
    pub fn block(&mut self, blocked: bool) {
        match &mut self.rotor {
            Rotor::Rigid { rotor, .. } => rotor.blocked = blocked,
            Rotor::Motor(motor) => motor.block(blocked),
        }
        self.wake();
    }

    /// What hangs on the shaft; a rigid axis does not feel it.
    pub fn mechanics(&self) -> Option<&Mechanics> {
        match &self.rotor {
            Rotor::Rigid { .. } => None,
            Rotor::Motor(motor) => Some(motor.mechanics()),
        }
    }

    /// Changes what hangs on the shaft; without effect on a rigid axis.
    pub fn set_mechanics(&mut self, mechanics: Mechanics) {
        if let Rotor::Motor(motor) = &mut self.rotor {
            motor.set_mechanics(mechanics);
        }
        self.wake();
    }

    /// Microsteps in a turn of the shaft.
    pub fn microsteps_per_turn(&self) -> u32 {
        let full_steps = match &self.rotor {
            Rotor::Rigid { full_steps, .. } => *full_steps,
            Rotor::Motor(motor) => motor.motor.full_steps,
        };
        full_steps * MICROSTEPS_PER_FULL_STEP
    }

    /// Turns of the shaft as microsteps, rounded.
    pub fn microsteps(&self, turns: f64) -> i64 {
        (turns * f64::from(self.microsteps_per_turn())).round() as i64
    }
}

// Faults.
impl StepperAxis {
    /// Heats the driver chip to a temperature in degrees Celsius; `None` gives it back to the board.
    pub fn heat(&mut self, temperature_c: Option<f64>) {
        self.driver.heated_c = temperature_c;
        self.wake();
    }

    /// Breaks a coil, or mends it.
    pub fn set_coil(&mut self, coil: Coil, fault: CoilFault) {
        self.driver.faults[coil as usize] = fault;
        self.wake();
    }

    /// Cuts the line of the encoder, or mends it: counts are lost, and the counter goes on from where it stood.
    pub fn cut_encoder(&mut self, cut: bool) {
        if cut == self.line.cut_at.is_some() {
            return;
        }
        let count = self.count_from_zero();
        match self.line.cut_at.take() {
            None => self.line.cut_at = Some(count),
            Some(cut_at) => {
                self.line.lost += self.count_from_zero() - cut_at;
                self.null = self.null.take().map(|latch| latch.skip(self.count_from_zero()));
            }
        }
    }

    /// Lets the coupling of the encoder slip: the shaft gets so many degrees further ahead of it.
    pub fn slip_encoder(&mut self, degrees: f64) {
        let slip = self.microsteps(degrees / 360.0);
        if let Some(encoder) = &mut self.encoder {
            encoder.slip += slip;
        }
    }

    /// True while the line of the encoder is cut.
    pub fn is_encoder_cut(&self) -> bool {
        self.line.cut_at.is_some()
    }
}

// Switches and encoder.
impl StepperAxis {
    /// True when the switch is closed.
    pub fn switch(&self, switch: Switch) -> bool {
        self.switches()[switch as usize]
    }

    /// True for each switch that is closed, in the order of [`Switch::ALL`].
    #[inline]
    pub fn switches(&self) -> [bool; Switch::ALL.len()] {
        let levels = if self.travel.bounces() { self.contacts.levels() } else { self.travel.closed(self.position()) };
        core::array::from_fn(|switch| self.forced[switch].unwrap_or(levels[switch]))
    }

    /// Holds a switch open or closed, or gives it back to the travel (`None`).
    pub fn force_switch(&mut self, switch: Switch, closed: Option<bool>) {
        self.forced[switch as usize] = closed;
    }

    /// What holds a switch, `None` when the travel decides.
    pub fn forced_switch(&self, switch: Switch) -> Option<bool> {
        self.forced[switch as usize]
    }

    /// Counter of the encoder, wrapping; 0 for ever without one.
    #[inline]
    pub fn encoder_count(&self) -> i32 {
        self.count_from_zero().wrapping_sub(self.line.lost) as i32
    }

    #[inline]
    fn count_from_zero(&self) -> i64 {
        let count = |encoder: Encoder| encoder.count_from_zero(self.position(), self.microsteps_per_turn());
        self.line.cut_at.unwrap_or_else(|| self.encoder.map_or(0, count))
    }

    /// What a null event of the encoder is from now on, `None` if nobody asks for one.
    pub fn watch_null(&mut self, event: Option<NullEvent>) {
        self.null = event.map(|event| NullLatch::new(event, self.count_from_zero()));
    }

    /// Counter of the encoder where the latest null event has begun, if there was one since the last call.
    pub fn take_null(&mut self) -> Option<i32> {
        let count = self.count_from_zero();
        let latched = self.null.as_mut()?.take(&self.encoder?, count)?;
        Some(latched.wrapping_sub(self.line.lost) as i32)
    }
}

#[cfg(test)]
mod tests;
