//! A two-phase hybrid stepper motor with what it moves: it lags behind its coils, resonates and loses steps.
//!
//! In a step of 100 us the coil vector is taken where the firmware has put it, which is where it is on average. The rotor
//! takes a leapfrog step: half of the way, the torque there, the new speed, the other half. That neither damps nor excites an
//! oscillation, and the torque is computed once.
//!
//! With [`Currents::QuasiStatic`] the currents are those of a steady state: in the frame of the rotor the voltage that the
//! wanted current needs is `R i + j X i + j E`, and where the supply does not have so much, the current is what the supply
//! gives in that direction. `X` belongs to the mean frequency of the vector, `E` to the speed of the rotor. With
//! [`Currents::Electrical`] the currents have their inductance, and each coil gets at most the supply: five parts of 20 us.
//!
//! Both are the same while the chopper makes the current that it wants. [`Currents::Hybrid`] therefore takes the steady state
//! while the voltage vector is shorter than 0.95 of the supply and the load angle below 90 degrees, and the coils with their
//! inductance otherwise, until they again carried what was wanted for a whole step.
//!
//! No rotor turns faster than two electrical periods a step, 24 000 rpm of a motor with 200 full steps, whatever pulls it.
//!
//! Not modelled: iron losses, saturation, the ripple of the chopper.

use crate::coils::Coils;
use crate::field::{Coil, Drive, Field, STEP_S};
use crate::motors::{Mechanics, Motor};
use crate::stepper_gains::{FASTEST, Gains, PARTS, PERIOD, Stretch, microsteps_per_turn};
use crate::trigonometry::sin_cos;

/// Share of the supply up to which currents are those of a steady state.
const STEADY_SHARE: f64 = 0.95;

/// Kelvin that a winding warms until its resistance is looked at again.
const WARMER_K: f64 = 0.25;

/// How the currents of the coils are computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Currents {
    /// As a steady state while the supply suffices and the rotor follows, with the inductance of the coils otherwise.
    #[default]
    Hybrid,
    /// They are always those of a steady state, 10 000 times a second.
    QuasiStatic,
    /// They always rise and fall with the inductance of the coils, 50 000 times a second.
    Electrical,
}

/// A motor with its load.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Stepper {
    pub(crate) motor: Motor,
    mechanics: Mechanics,
    currents: Currents,
    gains: Gains,
    /// Temperature of the winding to which the gains belong.
    winding_c: f64,
    /// Position of the rotor in microsteps.
    position: f64,
    /// Microsteps a step.
    speed: f64,
    coils: Coils,
    /// The latest step was one of a steady state: the coils are not up to date.
    steady: bool,
    /// The next one may be: the coils carry what is wanted.
    obeyed: bool,
    /// The currents stay as they are.
    settled: bool,
    blocked: bool,
    pub(crate) reading: Reading,
}

/// What the latest step has found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Reading {
    /// Torque of the motor, detent torque included, in Nm.
    pub(crate) torque_nm: f64,
    /// Sine and cosine of the angle between rotor and coil vector; no current: 0 and 1.
    pub(crate) load_angle: (f64, f64),
    /// Square of the length of the current vector in amperes.
    pub(crate) current_square: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self { torque_nm: 0.0, load_angle: (0.0, 1.0), current_square: 0.0 }
    }
}

impl Stepper {
    pub(crate) fn new(motor: Motor, mechanics: Mechanics, currents: Currents) -> Self {
        let winding_c = 25.0;
        Self {
            motor,
            mechanics,
            currents,
            gains: Gains::new(&motor, &mechanics, winding_c),
            winding_c,
            position: 0.0,
            speed: 0.0,
            coils: Coils::default(),
            steady: true,
            obeyed: true,
            settled: true,
            blocked: false,
            reading: Reading::default(),
        }
    }

    pub(crate) fn mechanics(&self) -> &Mechanics {
        &self.mechanics
    }

    pub(crate) fn set_mechanics(&mut self, mechanics: Mechanics) {
        self.mechanics = mechanics;
        self.gains = Gains::new(&self.motor, &mechanics, self.winding_c);
    }

    /// The winding has this temperature.
    #[inline]
    pub(crate) fn warm_to(&mut self, winding_c: f64) {
        if (winding_c - self.winding_c).abs() > WARMER_K {
            self.winding_c = winding_c;
            self.gains = Gains::new(&self.motor, &self.mechanics, winding_c);
        }
    }

    /// Position of the shaft in microsteps.
    #[inline]
    pub(crate) fn position(&self) -> f64 {
        self.position
    }

    /// The same rounded.
    #[inline]
    pub(crate) fn microstep(&self) -> i64 {
        let position = self.position();
        (position + 0.5f64.copysign(position)) as i64
    }

    /// Puts the rotor somewhere else, where it stands.
    pub(crate) fn place(&mut self, position: f64) {
        self.position = position;
        self.speed = 0.0;
    }

    /// Holds the rotor, or lets it go.
    pub(crate) fn block(&mut self, blocked: bool) {
        self.blocked = blocked;
        self.place(self.position());
    }

    /// True if the currents stay as they are.
    #[inline]
    pub(crate) fn has_settled(&self) -> bool {
        self.settled
    }

    /// True if all is a number, and the speed one that a shaft can have.
    pub(crate) fn is_sane(&self) -> bool {
        let Reading { torque_nm, current_square, .. } = self.reading;
        let all = [self.position, torque_nm, current_square];
        all.iter().all(|number| number.is_finite()) && self.speed.abs() <= FASTEST
    }

    /// Turns of the shaft in a second.
    pub(crate) fn speed_rps(&self) -> f64 {
        self.rps(self.speed)
    }

    /// Electrical angle from the rotor to the coil vector in degrees.
    pub(crate) fn load_angle_deg(&self) -> f64 {
        let (sin, cos) = self.reading.load_angle;
        angle_deg(sin, cos)
    }

    /// Current in amperes RMS.
    pub(crate) fn current_a(&self) -> f64 {
        (0.5 * self.reading.current_square).sqrt()
    }

    /// Square of the current as share of the rated one.
    #[inline]
    pub(crate) fn warmth(&self) -> f64 {
        self.reading.current_square * self.gains.per_rated_square
    }

    /// Resistance of a coil, as warm as it is.
    pub(crate) fn resistance_ohm(&self) -> f64 {
        self.gains.resistance_ohm
    }

    /// Turns a second of a speed in microsteps a step of the plant.
    pub(crate) fn rps(&self, microsteps: f64) -> f64 {
        microsteps / (STEP_S * microsteps_per_turn(&self.motor))
    }

    /// Volts of back-EMF at a speed in microsteps a step of the plant.
    pub(crate) fn emf_v(&self, microsteps: f64) -> f64 {
        self.gains.emf * microsteps
    }

    /// A step of the plant.
    #[inline]
    pub(crate) fn step(&mut self, field: &Field) {
        match self.currents {
            Currents::Hybrid => self.hybrid_step(field),
            Currents::QuasiStatic => {
                let angle = self.load_angle(field);
                let amps = self.steady_current(field, angle);
                self.steady_step(field, angle, amps);
            }
            Currents::Electrical => self.electrical_steps(field),
        }
    }

    #[inline]
    fn hybrid_step(&mut self, field: &Field) {
        if self.obeyed {
            let angle = self.load_angle(field);
            if let Some(amps) = self.obedient_current(field, angle) {
                return self.steady_step(field, angle, amps);
            }
        }
        if self.steady {
            self.charge_coils(field);
        }
        self.electrical_steps(field);
    }

    /// Sine and cosine of the angle from the rotor to the coil vector in the middle of the step.
    #[inline]
    fn load_angle(&self, field: &Field) -> (f64, f64) {
        sin_cos((f64::from(field.phase & 1023) - self.position - 0.5 * self.speed) * (1.0 / PERIOD))
    }

    /// A step with a current along the rotor's magnet and one across it, in amperes.
    #[inline]
    fn steady_step(&mut self, field: &Field, angle: (f64, f64), [direct, quadrature]: [f64; 2]) {
        let stretch = self.gains.whole;
        self.position += stretch.half * self.speed;
        (self.steady, self.settled) = (true, true);
        self.reading.load_angle = if field.drive == Drive::Open { (0.0, 1.0) } else { angle };
        self.reading.current_square = direct * direct + quadrature * quadrature;
        let rotor = sin_cos(self.position * (1.0 / PERIOD));
        let quadrature = match field.broken {
            None => quadrature,
            Some(coil) => without(coil, [direct, quadrature], rotor),
        };
        self.turn(self.gains.torque_nm_per_a * quadrature, rotor, field.ends, &stretch);
    }

    /// The current that the chopper wants, if it has it: the supply suffices and the rotor follows.
    #[inline]
    fn obedient_current(&self, field: &Field, (sin, cos): (f64, f64)) -> Option<[f64; 2]> {
        let amps = match field.drive {
            Drive::Current(amps) if cos > 0.0 && field.broken.is_none() => amps,
            Drive::Open => 0.0,
            _ => return None,
        };
        let amps = [amps * cos, amps * sin];
        let [direct, quadrature] = self.wanted_volts(amps, field.speed);
        let reach = STEADY_SHARE * field.volts;
        (direct * direct + quadrature * quadrature <= reach * reach).then_some(amps)
    }

    /// The voltage of a steady state with a current, of a vector with a speed.
    #[inline]
    fn wanted_volts(&self, [direct, quadrature]: [f64; 2], speed: f64) -> [f64; 2] {
        let Gains { resistance_ohm: r, emf, reactance, .. } = self.gains;
        let x = reactance * speed;
        [r * direct - x * quadrature, r * quadrature + x * direct + emf * self.speed]
    }

    /// The current of a steady state along the rotor's magnet and across it, in amperes.
    fn steady_current(&self, field: &Field, (sin, cos): (f64, f64)) -> [f64; 2] {
        // What flows in shorted coils has the frequency of the rotor, not that of a vector.
        let turned = if field.drive == Drive::Shorted { self.speed } else { field.speed };
        let voltage = match field.drive {
            Drive::Open => return [0.0; 2],
            Drive::Shorted => [0.0; 2],
            Drive::Voltage(volts) => [volts * cos, volts * sin],
            Drive::Current(amps) => {
                let amps = [amps * cos, amps * sin];
                let wanted = self.wanted_volts(amps, turned);
                let square = wanted[0] * wanted[0] + wanted[1] * wanted[1];
                if square <= field.volts * field.volts {
                    return amps;
                }
                let scale = field.volts / square.sqrt();
                wanted.map(|volts| volts * scale)
            }
        };
        let Gains { resistance_ohm: r, emf, reactance, .. } = self.gains;
        let x = reactance * turned;
        let [direct, quadrature] = [voltage[0], voltage[1] - emf * self.speed];
        let admittance = 1.0 / (r * r + x * x);
        [(direct * r + quadrature * x) * admittance, (quadrature * r - direct * x) * admittance]
    }

    /// Gives the coils the currents that they have at the end of a steady state, where the vector is on its way.
    fn charge_coils(&mut self, field: &Field) {
        let vector = f64::from(field.phase & 1023) - 0.5 * f64::from(field.turned);
        let (sin, cos) = sin_cos(vector * (1.0 / PERIOD));
        let amps = self.reading.current_square.sqrt();
        self.coils.amps = [amps * cos, amps * sin];
    }

    fn electrical_steps(&mut self, field: &Field) {
        let turn = f64::from(field.turned) * (1.0 / f64::from(PARTS));
        let mut vector = f64::from(field.phase & 1023) - 0.5 * f64::from(field.turned);
        let before = self.coils.amps;
        let mut obeyed = true;
        for _ in 0..PARTS {
            vector += turn;
            self.electrical_part(field, vector, turn);
            obeyed &= self.coils.obey;
        }
        self.settled = self.coils.have_settled(&before);
        self.steady = false;
        self.obeyed = obeyed || field.drive == Drive::Open && self.coils.amps == [0.0; 2];
    }

    /// A part in which the vector turns, up to an angle: the chopper wants the current of its end. What turns the rotor is the
    /// mean of the currents before and after.
    fn electrical_part(&mut self, field: &Field, vector: f64, turn: f64) {
        let stretch = self.gains.part;
        self.position += stretch.half * self.speed;
        let rotor = sin_cos(self.position * (1.0 / PERIOD));
        let emf = self.gains.emf * self.speed;
        let before = self.coils.amps;
        let end = sin_cos(vector * (1.0 / PERIOD));
        self.coils.pass(&self.gains.coils, field.drive, end, [-emf * rotor.0, emf * rotor.1], field.volts);
        self.coils.break_off(field.broken);
        self.reading.load_angle = match field.drive {
            Drive::Open => (0.0, 1.0),
            _ => sin_cos((vector - 0.5 * turn - self.position) * (1.0 / PERIOD)),
        };
        let [a, b] = core::array::from_fn(|coil| 0.5 * (before[coil] + self.coils.amps[coil]));
        self.reading.current_square = a * a + b * b;
        self.turn(self.gains.torque_nm_per_a * (b * rotor.1 - a * rotor.0), rotor, field.ends, &stretch);
    }

    /// The second half of a stretch: torques become speed and way.
    #[inline]
    fn turn(&mut self, torque_nm: f64, rotor: (f64, f64), ends: [Option<i64>; 2], stretch: &Stretch) {
        let (sin_2, cos_2) = (2.0 * rotor.0 * rotor.1, 1.0 - 2.0 * rotor.0 * rotor.0);
        self.reading.torque_nm = torque_nm - self.motor.detent_torque_nm * 2.0 * sin_2 * cos_2;
        if self.blocked {
            return;
        }
        let drive_nm = self.reading.torque_nm - self.mechanics.load_nm;
        let speed = (self.speed + drive_nm * stretch.speed_per_nm) * stretch.kept;
        let friction = stretch.friction;
        let speed = if speed.abs() <= friction { 0.0 } else { speed - friction.copysign(speed) };
        self.speed = speed.clamp(-FASTEST, FASTEST);
        self.position += stretch.half * self.speed;
        self.stop_at(ends);
    }

    /// An end stop takes the speed that goes into it.
    #[inline]
    fn stop_at(&mut self, [left, right]: [Option<i64>; 2]) {
        if let Some(left) = left.map(|end| end as f64).filter(|end| self.position < *end) {
            (self.position, self.speed) = (left, self.speed.max(0.0));
        }
        if let Some(right) = right.map(|end| end as f64).filter(|end| self.position > *end) {
            (self.position, self.speed) = (right, self.speed.min(0.0));
        }
    }
}

/// The angle of a sine and a cosine in degrees, -180 to 180, found by halving: each step takes the half in which
/// it lies. For instruments only.
fn angle_deg(sin: f64, cos: f64) -> f64 {
    let (mut low, mut high) = (0.0, 0.5);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if sin_cos(middle).1 > cos { low = middle } else { high = middle }
    }
    (180.0 * (low + high)).copysign(sin)
}

/// Current across the rotor's magnet when one coil carries none.
fn without(coil: Coil, [direct, quadrature]: [f64; 2], (sin, cos): (f64, f64)) -> f64 {
    match coil {
        Coil::A => (direct * sin + quadrature * cos) * cos,
        Coil::B => (quadrature * sin - direct * cos) * sin,
    }
}
