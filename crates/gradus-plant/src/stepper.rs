//! A two-phase hybrid stepper motor with what it moves: it lags behind its coils, resonates and loses steps.
//!
//! In a step of 100 us the coil vector is taken where the firmware has put it, which is where it is on average. The rotor
//! takes a leapfrog step: half of the way, the torque there, the new speed, the other half. That neither damps nor excites an
//! oscillation, and the torque is computed once.
//!
//! The currents are those of a steady state ([`Currents::QuasiStatic`]): in the frame of the rotor the voltage that the
//! wanted current needs is `R i + j X i + j E`, and where the supply does not have so much, the current is what the supply
//! gives in that direction. `X` belongs to the frequency of the vector, `E` to the speed of the rotor. With
//! [`Currents::Electrical`] the currents have their inductance: five steps of 20 us, each the exact solution for a voltage
//! that stays.
//!
//! Not modelled: iron losses, saturation, the ripple of the chopper, the warmth in the resistance.

use crate::motors::{Mechanics, Motor};
use crate::trigonometry::sin_cos;

/// Seconds in a step of the plant.
pub(crate) const STEP_S: f64 = 1e-4;

/// Microsteps in an electrical period.
const PERIOD: f64 = 1024.0;

/// How the currents of the coils are computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Currents {
    /// They are those of a steady state, 10 000 times a second.
    #[default]
    QuasiStatic,
    /// They rise and fall with the inductance of the coils, 50 000 times a second.
    Electrical,
}

/// One of the two coils.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Coil {
    /// Coil A.
    A,
    /// Coil B.
    B,
}

/// What the power stage does with the coils.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Drive {
    /// No current flows.
    Open,
    /// The coils are shorted: they brake.
    Shorted,
    /// The chopper makes a current vector of this length in amperes.
    Current(f64),
    /// A voltage vector of this length.
    Voltage(f64),
}

/// What a step needs to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    /// Angle of the coil vector in microsteps, and how far it has turned since the last step.
    pub(crate) phase: i32,
    pub(crate) turned: i32,
    pub(crate) drive: Drive,
    /// Supply voltage.
    pub(crate) volts: f64,
    /// A coil that is not connected.
    pub(crate) broken: Option<Coil>,
    /// End stops in microsteps.
    pub(crate) ends: [Option<i64>; 2],
}

/// What a step needs of the data, in microsteps and steps of the plant (or parts of one).
#[derive(Clone, Copy, PartialEq, Debug)]
struct Gains {
    /// Steps of the motor in a step of the plant.
    parts: u8,
    part: f64,
    /// Speed that a newton metre gives in a step.
    speed_per_nm: f64,
    /// Share of the speed that viscous friction takes in a step.
    viscous: f64,
    torque_nm_per_a: f64,
    resistance_ohm: f64,
    /// Back-EMF and reactance of a speed of one microstep a step.
    emf: f64,
    reactance: f64,
    /// What is left of a current without voltage after a step.
    kept: f64,
    /// 1 by the square of the vector's length at the rated current.
    per_rated_square: f64,
}

/// A motor with its load.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Stepper {
    pub(crate) motor: Motor,
    mechanics: Mechanics,
    currents: Currents,
    gains: Gains,
    /// Position of the rotor in microsteps.
    position: f64,
    /// Microsteps a step of the motor.
    speed: f64,
    /// Currents of the coils in amperes, for the electrical model.
    coils: [f64; 2],
    pub(crate) blocked: bool,
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
    /// The same of the voltage vector that the wanted current needs.
    pub(crate) wanted_square: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self { torque_nm: 0.0, load_angle: (0.0, 1.0), current_square: 0.0, wanted_square: 0.0 }
    }
}

impl Stepper {
    pub(crate) fn new(motor: Motor, mechanics: Mechanics, currents: Currents) -> Self {
        Self {
            motor,
            mechanics,
            currents,
            gains: gains(&motor, &mechanics, currents),
            position: 0.0,
            speed: 0.0,
            coils: [0.0; 2],
            blocked: false,
            reading: Reading::default(),
        }
    }

    pub(crate) fn mechanics(&self) -> &Mechanics {
        &self.mechanics
    }

    pub(crate) fn set_mechanics(&mut self, mechanics: Mechanics) {
        self.mechanics = mechanics;
        self.gains = gains(&self.motor, &mechanics, self.currents);
    }

    /// Position of the rotor in microsteps.
    #[inline]
    pub(crate) fn position(&self) -> f64 {
        self.position
    }

    /// The same rounded.
    #[inline]
    pub(crate) fn microstep(&self) -> i64 {
        (self.position + 0.5f64.copysign(self.position)) as i64
    }

    /// Puts the rotor somewhere else, where it stands.
    pub(crate) fn place(&mut self, position: f64) {
        self.position = position;
        self.speed = 0.0;
    }

    /// Turns of the shaft in a second.
    pub(crate) fn speed_rps(&self) -> f64 {
        self.rps(self.speed * f64::from(self.gains.parts))
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

    /// Turns a second of a speed in microsteps a step of the plant.
    pub(crate) fn rps(&self, microsteps: f64) -> f64 {
        microsteps / (STEP_S * microsteps_per_turn(&self.motor))
    }

    /// Volts of back-EMF at a speed in microsteps a step of the plant.
    pub(crate) fn emf_v(&self, microsteps: f64) -> f64 {
        self.gains.emf * microsteps * self.gains.part
    }

    /// A step of the plant.
    #[inline]
    pub(crate) fn step(&mut self, field: Field) {
        match self.currents {
            Currents::QuasiStatic => self.quasi_static_step(field),
            Currents::Electrical => self.electrical_steps(field),
        }
    }

    fn quasi_static_step(&mut self, field: Field) {
        self.position += 0.5 * self.speed;
        let angle = sin_cos((f64::from(field.phase & 1023) - self.position) * (1.0 / PERIOD));
        let [direct, quadrature] = self.steady_current(field, angle);
        self.reading.current_square = direct * direct + quadrature * quadrature;
        let rotor = sin_cos(self.position * (1.0 / PERIOD));
        let quadrature = match field.broken {
            None => quadrature,
            Some(coil) => without(coil, [direct, quadrature], rotor),
        };
        self.turn(self.gains.torque_nm_per_a * quadrature, rotor, field.ends);
    }

    /// The current along the rotor's magnet and across it, in amperes.
    fn steady_current(&mut self, field: Field, angle: (f64, f64)) -> [f64; 2] {
        let Gains { resistance_ohm: r, emf, reactance, .. } = self.gains;
        // What flows in shorted coils has the frequency of the rotor, not that of a vector.
        let turned = if field.drive == Drive::Shorted { self.speed } else { f64::from(field.turned) };
        let (emf, x) = (emf * self.speed, reactance * turned);
        let (sin, cos) = angle;
        self.reading.load_angle = angle;
        let voltage = match field.drive {
            Drive::Open => {
                self.reading.load_angle = (0.0, 1.0);
                return [0.0; 2];
            }
            Drive::Shorted => [0.0; 2],
            Drive::Voltage(volts) => [volts * cos, volts * sin],
            Drive::Current(amps) => {
                let [direct, quadrature] = [amps * cos, amps * sin];
                let wanted = [r * direct - x * quadrature, r * quadrature + x * direct + emf];
                let square = wanted[0] * wanted[0] + wanted[1] * wanted[1];
                self.reading.wanted_square = square;
                if square <= field.volts * field.volts {
                    return [direct, quadrature];
                }
                let scale = field.volts / square.sqrt();
                wanted.map(|volts| volts * scale)
            }
        };
        let [direct, quadrature] = [voltage[0], voltage[1] - emf];
        let admittance = 1.0 / (r * r + x * x);
        [(direct * r + quadrature * x) * admittance, (quadrature * r - direct * x) * admittance]
    }

    fn electrical_steps(&mut self, field: Field) {
        let turn = f64::from(field.turned) * self.gains.part;
        let mut vector = f64::from(field.phase & 1023) - 0.5 * f64::from(field.turned) - 0.5 * turn;
        for _ in 0..self.gains.parts {
            vector += turn;
            self.electrical_step(field, vector);
        }
    }

    fn electrical_step(&mut self, field: Field, vector: f64) {
        self.position += 0.5 * self.speed;
        let rotor = sin_cos(self.position * (1.0 / PERIOD));
        let (sin, cos) = sin_cos(vector * (1.0 / PERIOD));
        let emf = [-self.gains.emf * self.speed * rotor.0, self.gains.emf * self.speed * rotor.1];
        self.reading.load_angle = (sin * rotor.1 - cos * rotor.0, cos * rotor.1 + sin * rotor.0);
        match field.drive {
            Drive::Open => (self.coils, self.reading.load_angle) = ([0.0; 2], (0.0, 1.0)),
            Drive::Shorted => self.feed([0.0; 2], emf),
            Drive::Voltage(volts) => self.feed([volts * cos, volts * sin], emf),
            Drive::Current(amps) => {
                let voltage = self.voltage_for([amps * cos, amps * sin], emf, field.volts);
                self.feed(voltage, emf);
            }
        }
        if let Some(coil) = field.broken {
            self.coils[coil as usize] = 0.0;
        }
        let [a, b] = self.coils;
        self.reading.current_square = a * a + b * b;
        self.turn(self.gains.torque_nm_per_a * (b * rotor.1 - a * rotor.0), rotor, field.ends);
    }

    /// The currents after a step with a voltage.
    fn feed(&mut self, voltage: [f64; 2], emf: [f64; 2]) {
        let Gains { resistance_ohm, kept, .. } = self.gains;
        self.coils = core::array::from_fn(|coil| {
            self.coils[coil] * kept + (voltage[coil] - emf[coil]) / resistance_ohm * (1.0 - kept)
        });
    }

    /// The voltage that makes the currents of the next step, as far as the supply goes.
    fn voltage_for(&mut self, amps: [f64; 2], emf: [f64; 2], supply_v: f64) -> [f64; 2] {
        let Gains { resistance_ohm, kept, .. } = self.gains;
        let wanted: [f64; 2] = core::array::from_fn(|coil| {
            emf[coil] + resistance_ohm * (amps[coil] - kept * self.coils[coil]) / (1.0 - kept)
        });
        let square = wanted[0] * wanted[0] + wanted[1] * wanted[1];
        self.reading.wanted_square = square;
        let scale = if square > supply_v * supply_v { supply_v / square.sqrt() } else { 1.0 };
        wanted.map(|volts| volts * scale)
    }

    /// The second half of a step: torques become speed and way.
    #[inline]
    fn turn(&mut self, torque_nm: f64, rotor: (f64, f64), ends: [Option<i64>; 2]) {
        let (sin_2, cos_2) = (2.0 * rotor.0 * rotor.1, 1.0 - 2.0 * rotor.0 * rotor.0);
        self.reading.torque_nm = torque_nm - self.motor.detent_torque_nm * 2.0 * sin_2 * cos_2;
        if self.blocked {
            self.position -= 0.5 * self.speed;
            self.speed = 0.0;
            return;
        }
        let drive_nm = self.reading.torque_nm - self.mechanics.load_nm;
        let speed = self.speed + (drive_nm * self.gains.speed_per_nm - self.gains.viscous * self.speed);
        let friction = self.mechanics.friction_nm * self.gains.speed_per_nm;
        self.speed = if speed.abs() <= friction { 0.0 } else { speed - friction.copysign(speed) };
        self.position += 0.5 * self.speed;
        self.stop_at(ends);
    }

    /// An end stop takes the speed that goes into it.
    #[inline]
    fn stop_at(&mut self, [left, right]: [Option<i64>; 2]) {
        if let Some(left) = left.map(|end| end as f64).filter(|end| self.position < *end) {
            self.position = left;
            self.speed = self.speed.max(0.0);
        }
        if let Some(right) = right.map(|end| end as f64).filter(|end| self.position > *end) {
            self.position = right;
            self.speed = self.speed.min(0.0);
        }
    }
}

fn microsteps_per_turn(motor: &Motor) -> f64 {
    256.0 * f64::from(motor.full_steps)
}

fn gains(motor: &Motor, mechanics: &Mechanics, currents: Currents) -> Gains {
    let parts = match currents {
        Currents::QuasiStatic => 1,
        Currents::Electrical => 5,
    };
    let step_s = STEP_S / f64::from(parts);
    let radians_per_microstep = std::f64::consts::TAU / microsteps_per_turn(motor);
    let acceleration = step_s / (motor.inertia_kgm2 + mechanics.inertia_kgm2);
    Gains {
        parts,
        part: 1.0 / f64::from(parts),
        speed_per_nm: acceleration * step_s / radians_per_microstep,
        viscous: (mechanics.viscous_nms * acceleration).min(1.0),
        torque_nm_per_a: motor.torque_constant(),
        resistance_ohm: motor.resistance_ohm,
        emf: motor.torque_constant() * radians_per_microstep / step_s,
        reactance: motor.inductance_h * std::f64::consts::TAU / (PERIOD * step_s),
        per_rated_square: 0.5 / (motor.current_a * motor.current_a),
        kept: decay(step_s * motor.resistance_ohm / motor.inductance_h),
    }
}

/// `exp(-x)` for a positive number, from exactly rounded operations: a rational approximation of 1/256 of it, squared.
fn decay(x: f64) -> f64 {
    let part = x.min(50.0) / 256.0;
    let share = (1.0 - part / 2.0 + part * part / 12.0) / (1.0 + part / 2.0 + part * part / 12.0);
    (0..8).fold(share, |power, _| power * power)
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
