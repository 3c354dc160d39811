//! The data of a stepper motor and its load as a step needs them: in microsteps and steps of the plant.

use crate::coils::CoilGains;
use crate::field::STEP_S;
use crate::microsteps::MICROSTEPS_PER_FULL_STEP;
use crate::motors::{Mechanics, Motor};

/// Microsteps in an electrical period.
pub(crate) const PERIOD: f64 = 1024.0;

/// Parts of a step in which the currents have their inductance.
pub(crate) const PARTS: u8 = 5;

/// Share of its resistance that copper gains with a kelvin.
const COPPER_PER_K: f64 = 0.0039;

/// Microsteps a step that no rotor exceeds: two electrical periods, of which five parts of a step still see something.
pub(crate) const FASTEST: f64 = 2.0 * PERIOD;

/// Data that change when somebody changes the machine.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Gains {
    pub(crate) torque_nm_per_a: f64,
    pub(crate) resistance_ohm: f64,
    /// Back-EMF and reactance of a speed of one microstep a step.
    pub(crate) emf: f64,
    pub(crate) reactance: f64,
    /// 1 by the square of the vector's length at the rated current.
    pub(crate) per_rated_square: f64,
    pub(crate) whole: Stretch,
    pub(crate) part: Stretch,
    pub(crate) coils: CoilGains,
}

/// What a stretch of time does to the rotor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Stretch {
    /// Half of its share of a step.
    pub(crate) half: f64,
    /// Speed that a newton metre gives, and that Coulomb friction takes, in microsteps a step.
    pub(crate) speed_per_nm: f64,
    pub(crate) friction: f64,
    /// What viscous friction leaves of a speed.
    pub(crate) kept: f64,
}

pub(crate) fn microsteps_per_turn(motor: &Motor) -> f64 {
    f64::from(MICROSTEPS_PER_FULL_STEP) * f64::from(motor.full_steps)
}

impl Gains {
    /// With a winding of so many degrees Celsius.
    pub(crate) fn new(motor: &Motor, mechanics: &Mechanics, winding_c: f64) -> Self {
        let radians_per_microstep = std::f64::consts::TAU / microsteps_per_turn(motor);
        let resistance_ohm = motor.resistance_ohm * (1.0 + COPPER_PER_K * (winding_c - 25.0));
        let part_s = STEP_S / f64::from(PARTS);
        Self {
            torque_nm_per_a: motor.torque_constant(),
            resistance_ohm,
            emf: motor.torque_constant() * radians_per_microstep / STEP_S,
            reactance: motor.inductance_h * std::f64::consts::TAU / (PERIOD * STEP_S),
            per_rated_square: 0.5 / (motor.current_a * motor.current_a),
            whole: Stretch::new(motor, mechanics, 1.0),
            part: Stretch::new(motor, mechanics, 1.0 / f64::from(PARTS)),
            coils: CoilGains::new(resistance_ohm, motor.inductance_h, part_s),
        }
    }
}

impl Stretch {
    fn new(motor: &Motor, mechanics: &Mechanics, share: f64) -> Self {
        let radians_per_microstep = std::f64::consts::TAU / microsteps_per_turn(motor);
        let acceleration = share * STEP_S / (motor.inertia_kgm2 + mechanics.inertia_kgm2);
        let speed_per_nm = acceleration * STEP_S / radians_per_microstep;
        Self {
            half: 0.5 * share,
            speed_per_nm,
            friction: mechanics.friction_nm * speed_per_nm,
            // Implicit, so that no friction turns a shaft round.
            kept: 1.0 / (1.0 + mechanics.viscous_nms * acceleration),
        }
    }
}
