//! The regulators of `gradus-motion` on the machine of `gradus-plant`, cycle by cycle.

#![allow(dead_code, reason = "each test uses its part")]

use std::f64::consts::{PI, TAU};

use gradus_motion::foc::{Commutation, Duties, Feedback, MotorKind, PiSettings, Servo, ServoSettings};
use gradus_plant::{Bridge, Phases, ServoMachine, ServoSetup};

/// A servo with its motor.
pub struct Rig {
    pub settings: ServoSettings,
    pub servo: Servo,
    pub machine: ServoMachine,
    pub seconds: f64,
    pub duties: Option<Duties>,
}

impl Rig {
    pub fn new(settings: ServoSettings, setup: ServoSetup) -> Self {
        let servo = Servo::new(settings.gains());
        Self { settings, servo, machine: ServoMachine::new(setup), seconds: 0.0, duties: None }
    }

    /// One PWM period.
    pub fn cycle(&mut self) {
        let currents = self.machine.phase_currents_a().map(|current| (current * 1_000.0).round() as i32);
        let feedback = Feedback {
            phases_ma: [currents[0], currents[1]],
            hall_bits: self.machine.hall_bits(),
            encoder_count: self.machine.encoder_count(),
        };
        self.duties = self.servo.cycle(&feedback);
        let bridge = self
            .duties
            .map_or(Bridge::Open, |duties| Bridge::Duties(duties.q15.map(|duty| f64::from(duty) / 32_768.0)));
        let period_s = 1.0 / f64::from(self.settings.pwm_hz);
        self.machine.step(period_s, bridge);
        self.seconds += period_s;
    }

    /// Cycles for some time, looking after each.
    pub fn run(&mut self, seconds: f64, mut look: impl FnMut(&mut Self)) {
        for _ in 0..(seconds * f64::from(self.settings.pwm_hz)).round() as u64 {
            self.cycle();
            look(self);
        }
    }

    /// On the encoder, with the rotor's angle found and at rest.
    pub fn on_encoder(settings: ServoSettings, setup: ServoSetup) -> Self {
        let mut rig = Self::new(ServoSettings { commutation: Commutation::Encoder, ..settings }, setup);
        if setup.motor.phases == Phases::Three {
            rig.run(1.01, |_| ());
            while !rig.servo.encoder_is_initialised() {
                assert!(!rig.servo.encoder_init_failed(), "after {} s", rig.seconds);
                rig.run(0.01, |_| ());
            }
        }
        rig.run(0.1, |_| ());
        rig.seconds = 0.0;
        rig
    }

    /// Puts a flywheel on the shaft that does not move within the time of a test.
    pub fn hold_shaft(&mut self) {
        let mut setup = *self.machine.setup();
        setup.mechanics.inertia_kgm2 = 1.0;
        self.machine.set_up(setup);
    }

    /// How far the encoder's angle is from that of the rotor, in electrical degrees.
    pub fn encoder_error_deg(&self) -> f64 {
        let angle = f64::from(self.servo.encoder_angle_q16()) / 65_536.0;
        ((angle - self.machine.electrical_turns() + 1.5).rem_euclid(1.0) - 0.5) * 360.0
    }
}

/// How fast the loops are, in rad/s.
pub struct Bandwidth {
    pub current: f64,
    pub velocity: f64,
    pub position: f64,
}

pub const RECOMMENDED: Bandwidth = Bandwidth { current: 4_000.0, velocity: 200.0, position: 30.0 };

/// Settings for a motor from its data: the current's P and I cancel the winding's time constant, the velocity's I comes
/// a fifth as fast as its P.
pub fn recommended(setup: &ServoSetup, bandwidth: &Bandwidth) -> ServoSettings {
    let motor = &setup.motor;
    let three = motor.phases == Phases::Three;
    let full_v = setup.supply.source_v / if three { 3.0_f64.sqrt() } else { 1.0 };
    // Steps of voltage per mA, for a volt per ampere.
    let step = 32_767.0 / full_v / 1_000.0;
    let gain = |value: f64| value.round() as u16;
    let inertia = motor.inertia_kgm2 + setup.mechanics.inertia_kgm2;
    // mA per rpm.
    let velocity_p = bandwidth.velocity * inertia / motor.torque_nm_per_a * 1_000.0 * PI / 30.0;
    ServoSettings {
        motor: if three { MotorKind::ThreePhase } else { MotorKind::SinglePhase },
        pole_pairs: motor.pole_pairs,
        torque: PiSettings {
            p: gain(256.0 * step * bandwidth.current * motor.inductance_q_h),
            i: gain(65_536.0 * 32e-6 * step * bandwidth.current * motor.resistance_ohm),
        },
        velocity: PiSettings {
            p: gain(256.0 * velocity_p),
            i: gain(65_536.0 * 256e-6 * velocity_p * bandwidth.velocity / 5.0),
        },
        position_p: gain(bandwidth.position * 60.0),
        acceleration_rpm_s: 5_000,
        ..ServoSettings::default()
    }
}

/// A setup and the settings that are recommended for it.
pub fn default_rig() -> Rig {
    let setup = ServoSetup::default();
    Rig::on_encoder(recommended(&setup, &RECOMMENDED), setup)
}

pub fn rad_s(rpm: f64) -> f64 {
    rpm * TAU / 60.0
}
