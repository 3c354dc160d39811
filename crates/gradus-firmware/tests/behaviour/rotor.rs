//! A rotor for the fake power stage: inertia, friction, a load; 4096 encoder counts a turn.

/// A rotor of 550 gcm2 on a motor of 1.01 Nm at full current, in microsteps of 1/256 full step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rotor {
    pub position: f64,
    pub speed: f64,
    /// Load in holding torques at full current, against positive motion.
    pub load: f64,
    pub blocked: bool,
    /// Torque of the motor at the latest vector, in holding torques.
    pub torque: f64,
}

/// Microsteps/s^2 by the holding torque.
const STRENGTH: f64 = 149.6e6;

/// Speed lost by friction each second.
const FRICTION: f64 = 9.0;

/// Dry friction in holding torques.
const DRY_FRICTION: f64 = 0.03;

impl Rotor {
    /// A control tick of 100 us with this coil vector; a current of 1 gives the holding torque.
    pub fn turn(&mut self, phase: i32, current: f64) {
        const STEPS: u32 = 4;
        let dt = 100e-6 / f64::from(STEPS);
        for _ in 0..STEPS {
            let angle = (f64::from(phase) - self.position) * std::f64::consts::PI / 512.0;
            self.torque = current * angle.sin();
            self.speed += ((self.torque - self.load) * STRENGTH - self.speed * FRICTION) * dt;
            // Dry friction slows down, and does not turn round.
            self.speed -= self.speed.clamp(-DRY_FRICTION * STRENGTH * dt, DRY_FRICTION * STRENGTH * dt);
            if self.blocked {
                self.speed = 0.0;
            }
            self.position += self.speed * dt;
        }
    }

    pub fn count(&self) -> i32 {
        (self.position * 4_096.0 / 51_200.0).floor() as i32
    }
}
