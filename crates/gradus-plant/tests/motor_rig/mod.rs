//! A motor on a test bench.

#![allow(dead_code)] // each test takes what it needs

use gradus_plant::{Currents, Mechanics, Motor, Readings, STEP_US, StepperAxis, Surroundings};

/// Microsteps in a turn.
pub const TURN: f64 = 51_200.0;

/// An axis on a test bench: 24 V, its rated current, a vector that turns.
pub struct Rig {
    pub axis: StepperAxis,
    pub surroundings: Surroundings,
    now_us: u64,
    phase: f64,
    /// Microsteps to which the vector is rounded down.
    resolution: i32,
}

impl Rig {
    pub fn new(motor: Motor, mechanics: Mechanics, currents: Currents) -> Self {
        let mut axis = StepperAxis::with_motor(motor, mechanics, currents);
        axis.set_full_scale(motor.current_a);
        Self { axis, surroundings: Surroundings::default(), now_us: 0, phase: 0.0, resolution: 1 }
    }

    /// The same with a supply and a vector that jumps so many microsteps.
    pub fn with(self, supply_v: f64, resolution: i32) -> Self {
        Self { surroundings: Surroundings { supply_v, ..self.surroundings }, resolution, ..self }
    }

    /// A step with a vector of so many turns a second.
    pub fn step(&mut self, rps: f64) {
        self.phase += rps * TURN * 1e-4;
        let phase = self.phase.floor() as i32;
        self.axis.set_coils(phase - phase.rem_euclid(self.resolution), 255);
        self.advance();
    }

    pub fn advance(&mut self) {
        self.now_us += STEP_US;
        self.axis.advance(self.now_us, &self.surroundings);
    }

    pub fn stepped(&mut self, rps: f64) -> Readings {
        self.step(rps);
        self.readings()
    }

    pub fn run(&mut self, rps: f64, steps: usize) {
        (0..steps).for_each(|_| self.step(rps));
    }

    /// Goes from rest to a speed, with an acceleration in turns per s^2.
    pub fn ramp(&mut self, acceleration: f64, rps: f64) {
        let mut speed = 0.0;
        while speed < rps {
            speed = f64::min(speed + acceleration * 1e-4, rps);
            self.step(speed);
        }
    }

    pub fn readings(&self) -> Readings {
        self.axis.readings(self.now_us, &self.surroundings)
    }

    /// Full steps that the rotor is behind its vector.
    pub fn lag(&self) -> f64 {
        (self.phase - self.readings().position) / 256.0
    }
}
