//! Motors of a servo: the data of their makers' sheets.

/// What a motor's winding is connected to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Phases {
    /// Three phases in star: a synchronous motor with permanent magnets (BLDC, PMSM).
    Three,
    /// One, between the half bridges A and B: a direct-current motor.
    One,
}

/// A motor, in the units of the equations: values of one phase of the star, or of the winding of a direct-current
/// motor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ServoMotor {
    /// Kind of winding.
    pub phases: Phases,
    /// Pole pairs; 1 with one phase.
    pub pole_pairs: u32,
    /// Resistance at 25 degC in ohms.
    pub resistance_ohm: f64,
    /// Inductance along the magnet in henries.
    pub inductance_d_h: f64,
    /// Inductance a quarter electrical turn ahead in henries.
    pub inductance_q_h: f64,
    /// Newton metres per ampere of the current's amplitude.
    pub torque_nm_per_a: f64,
    /// Current at which the flux of the current is half of what the inductance says; `None`: the iron does not
    /// saturate.
    pub saturation_a: Option<f64>,
    /// Amplitude of the current that the winding bears for ever, in amperes.
    pub rated_current_a: f64,
    /// Inertia of the rotor in kg m^2.
    pub inertia_kgm2: f64,
}

/// A row of [`SERVO_MOTORS`] in the units of the sheet: A, Nm/A, ohm and mH from line to line, gcm^2.
const fn qbl4208(current_a: f64, torque: f64, resistance_ohm: f64, inductance_mh: f64, inertia: f64) -> ServoMotor {
    let inductance_h = inductance_mh * 1e-3 / 2.0;
    ServoMotor {
        phases: Phases::Three,
        pole_pairs: 4,
        resistance_ohm: resistance_ohm / 2.0,
        inductance_d_h: inductance_h,
        inductance_q_h: inductance_h,
        torque_nm_per_a: torque,
        saturation_a: None,
        rated_current_a: current_a,
        inertia_kgm2: inertia * 1e-7,
    }
}

/// Motors by name. The three-phase ones are TRINAMIC's, 24 V and 4000 rpm, from the data sheet "QBL4208": rated phase
/// current, torque constant, resistance and inductance from line to line, inertia of the rotor. The sheet gives the
/// inertias ten times as large as a rotor of 42 mm can have; here they are a tenth. A current is taken for the
/// amplitude of a sine; the sheet does not say.
///
/// `DC` is a small brushed motor for 24 V that no maker sells: 0.05 Nm/A, 1 ohm, 1 mH, 100 gcm^2, 3 A.
pub const SERVO_MOTORS: &[(&str, ServoMotor)] = &[
    ("QBL4208-41", qbl4208(1.79, 0.035, 1.8, 2.6, 24.0)),
    ("QBL4208-61", qbl4208(3.47, 0.036, 0.72, 1.2, 48.0)),
    ("QBL4208-81", qbl4208(5.14, 0.036, 0.55, 0.8, 72.0)),
    ("QBL4208-100", qbl4208(6.95, 0.036, 0.28, 0.54, 96.0)),
    (
        "DC",
        ServoMotor {
            phases: Phases::One,
            pole_pairs: 1,
            resistance_ohm: 1.0,
            inductance_d_h: 1e-3,
            inductance_q_h: 1e-3,
            torque_nm_per_a: 0.05,
            saturation_a: None,
            rated_current_a: 3.0,
            inertia_kgm2: 1e-5,
        },
    ),
];

impl ServoMotor {
    /// A motor of [`SERVO_MOTORS`], by its name in any case.
    pub fn named(name: &str) -> Option<Self> {
        SERVO_MOTORS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, motor)| *motor)
    }
}

impl Default for ServoMotor {
    /// QBL4208-61.
    fn default() -> Self {
        SERVO_MOTORS[1].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_have_names_of_any_case() {
        assert_eq!(ServoMotor::named("qbl4208-61"), Some(ServoMotor::default()));
        assert_eq!(ServoMotor::named("QBL4208"), None);
    }

    #[test]
    fn rated_current_gives_the_rated_torque_of_the_sheet() {
        for (name, torque_nm) in
            [("QBL4208-41", 0.0625), ("QBL4208-61", 0.125), ("QBL4208-81", 0.185), ("QBL4208-100", 0.25)]
        {
            let motor = ServoMotor::named(name).unwrap();
            let got = motor.torque_nm_per_a * motor.rated_current_a;
            assert!((got / torque_nm - 1.0).abs() < 0.01, "{name}: {got}");
        }
    }
}
