//! Stepper motors: the data of their makers' sheets.

/// A two-phase hybrid stepper motor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motor {
    /// Full steps in a turn of the shaft; four are an electrical period.
    pub full_steps: u32,
    /// Resistance of a phase in ohms at 25 degC; it rises by 0.39 % with a kelvin.
    pub resistance_ohm: f64,
    /// Inductance of a phase in henries.
    pub inductance_h: f64,
    /// Rated current of a phase in amperes RMS.
    pub current_a: f64,
    /// Holding torque in newton metres, at the rated current in both phases.
    pub holding_torque_nm: f64,
    /// Amplitude of the detent torque in newton metres; its period is a full step.
    pub detent_torque_nm: f64,
    /// Inertia of the rotor in kg m^2.
    pub inertia_kgm2: f64,
}

/// A row of [`MOTORS`] in the units of the sheets: ohm, mH, Nm, Nm, gcm^2.
const fn row(resistance_ohm: f64, inductance_mh: f64, holding: f64, detent: f64, inertia_gcm2: f64) -> Motor {
    Motor {
        full_steps: 200,
        resistance_ohm,
        inductance_h: inductance_mh * 1e-3,
        current_a: 2.8,
        holding_torque_nm: holding,
        detent_torque_nm: detent,
        inertia_kgm2: inertia_gcm2 * 1e-7,
    }
}

/// Motors by name: the manuals of QSH5718 and QSH6018, 2.8 A RMS. That of QSH6018 has no detent torque: 3.5 % of the
/// holding torque are taken, the share that it has in a QSH5718.
pub const MOTORS: &[(&str, Motor)] = &[
    ("QSH5718-41", row(0.7, 1.4, 0.55, 0.020, 120.0)),
    ("QSH5718-51", row(0.83, 2.2, 1.01, 0.035, 275.0)),
    ("QSH5718-56", row(0.9, 2.5, 1.26, 0.039, 300.0)),
    ("QSH5718-76", row(1.13, 3.6, 1.89, 0.066, 480.0)),
    ("QSH6018-45", row(0.75, 2.0, 1.1, 0.039, 275.0)),
    ("QSH6018-56", row(0.9, 3.6, 1.65, 0.058, 400.0)),
    ("QSH6018-65", row(1.2, 4.6, 2.1, 0.074, 570.0)),
    ("QSH6018-86", row(1.5, 6.8, 3.1, 0.109, 840.0)),
];

impl Motor {
    /// A motor of [`MOTORS`], by its name in any case.
    pub fn named(name: &str) -> Option<Self> {
        MOTORS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, motor)| *motor)
    }

    /// Torque of a phase in Nm per ampere, and its back-EMF in V per rad/s: the holding torque belongs to a vector of
    /// sqrt(2) times the rated current.
    pub fn torque_constant(&self) -> f64 {
        self.holding_torque_nm / (std::f64::consts::SQRT_2 * self.current_a)
    }
}

impl Motor {
    /// Turns a second up to which a supply gives the motor its rated current under full load: `(R I)^2 + (X I + E)^2 = V^2`,
    /// with the amplitude `I`, the reactance `X` and the back-EMF `E`. 0 if it gives it nowhere.
    pub fn limit_rps(&self, supply_v: f64) -> f64 {
        let amps = std::f64::consts::SQRT_2 * self.current_a;
        let resistive_v = self.resistance_ohm * amps;
        let left_v = (supply_v * supply_v - resistive_v * resistive_v).max(0.0).sqrt();
        let volts_per_rad_s = f64::from(self.full_steps / 4) * self.inductance_h * amps + self.torque_constant();
        left_v / volts_per_rad_s / std::f64::consts::TAU
    }
}

impl Default for Motor {
    /// QSH5718-51.
    fn default() -> Self {
        MOTORS[1].1
    }
}

/// What hangs on the shaft, in units of the shaft.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mechanics {
    /// Inertia of the load in kg m^2.
    pub inertia_kgm2: f64,
    /// Coulomb friction in Nm: opposes motion, and holds a shaft that stands.
    pub friction_nm: f64,
    /// Viscous friction in Nm per rad/s.
    pub viscous_nms: f64,
    /// A torque against the positive direction in Nm, like that of a weight.
    pub load_nm: f64,
}

impl Default for Mechanics {
    /// A light load: 200 gcm^2, 0.01 Nm and 1 mNm per rad/s.
    fn default() -> Self {
        Self { inertia_kgm2: 2e-5, friction_nm: 0.01, viscous_nms: 1e-3, load_nm: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_have_names_of_any_case() {
        assert_eq!(Motor::named("qsh5718-51"), Some(Motor::default()));
        assert_eq!(Motor::named("QSH6018-86").map(|motor| motor.holding_torque_nm), Some(3.1));
        assert_eq!(Motor::named("QSH"), None);
    }

    #[test]
    fn supply_suffices_up_to_the_limit_speed() {
        // The manual of QSH6018 prints 1.907 and 2.861 turns a second for the -65, 1.144 and 2.003 for the -86: about 0.7 of it.
        for (name, supply_v, rpm) in [
            ("QSH5718-51", 24.0, 328.7),
            ("QSH5718-51", 48.0, 662.1),
            ("QSH6018-65", 24.0, 155.9),
            ("QSH6018-86", 24.0, 104.3),
            ("QSH5718-51", 3.0, 0.0),
        ] {
            let found = 60.0 * Motor::named(name).unwrap().limit_rps(supply_v);
            assert!((found - rpm).abs() < 0.1, "{name} at {supply_v} V: {found}");
        }
    }

    #[test]
    fn rated_current_gives_the_holding_torque() {
        for (name, motor) in MOTORS {
            let torque = motor.torque_constant() * std::f64::consts::SQRT_2 * motor.current_a;
            assert!((torque - motor.holding_torque_nm).abs() < 1e-12, "{name}");
        }
    }
}
