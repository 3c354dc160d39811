//! The table of a servo.

use std::fmt;

use gradus_plant::{
    Encoder, HallOrder, HallSensors, Mechanics, Phases, SERVO_MOTORS, ServoMotor, ServoSetup, Supply, Surroundings,
};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::ServoDrive;
use crate::quantity::{
    amperes, counts, degrees, flag, hall_offset, inductance, inertia, load, milliamperes, millifarads, pole_pairs,
    resistance, steps, torque, torque_constant,
};

const GCM2_PER_KGM2: f64 = 1e7;

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with the keys of a servo")]
pub(super) struct ServoTable {
    motor: Drive,
    #[serde(deserialize_with = "inertia")]
    inertia: f64,
    #[serde(deserialize_with = "torque")]
    friction: f64,
    #[serde(deserialize_with = "torque")]
    viscous: f64,
    #[serde(deserialize_with = "load")]
    load: f64,
    /// Where the magnet points at first, in electrical degrees ahead of phase A.
    #[serde(deserialize_with = "degrees")]
    magnet: f64,
    hall: HallTable,
    hall_errors: [Degrees; 3],
    encoder: Option<EncoderTable>,
    source: SourceTable,
    /// Standard deviation of a reading of the current.
    #[serde(deserialize_with = "steps")]
    current_noise: f64,
    seed: u64,
}

/// How hall sensors are mounted and wired: by the axis parameters 90, 91 and 93 that suit them.
#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields, expecting = "a table with polarity, direction, offset and order")]
struct HallTable {
    #[serde(deserialize_with = "flag")]
    polarity: f64,
    #[serde(deserialize_with = "flag")]
    direction: f64,
    #[serde(deserialize_with = "hall_offset")]
    offset: f64,
    order: Order,
}

#[derive(Deserialize, Clone, Copy, Default)]
#[serde(rename_all = "lowercase")]
enum Order {
    #[default]
    Abc,
    Acb,
    Bac,
    Bca,
    Cab,
    Cba,
}

#[derive(Clone, Copy)]
struct Drive(ServoMotor);

#[derive(Deserialize, Clone, Copy)]
#[serde(transparent)]
struct Degrees(#[serde(deserialize_with = "degrees")] f64);

/// Values of a sheet: from line to line.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorTable {
    #[serde(default)]
    direct_current: bool,
    #[serde(deserialize_with = "pole_pairs", default = "one")]
    pole_pairs: u32,
    #[serde(deserialize_with = "resistance")]
    resistance: f64,
    #[serde(deserialize_with = "inductance")]
    inductance: f64,
    #[serde(deserialize_with = "torque_constant")]
    torque_constant: f64,
    #[serde(deserialize_with = "amperes")]
    current: f64,
    #[serde(deserialize_with = "inertia")]
    inertia: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { counts_per_turn = 4096 }")]
struct EncoderTable {
    #[serde(deserialize_with = "counts")]
    counts_per_turn: u32,
    /// Without one there is no null channel.
    index: Option<u32>,
    #[serde(default)]
    reversed: bool,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with the keys of a source")]
struct SourceTable {
    #[serde(deserialize_with = "resistance")]
    resistance: f64,
    #[serde(deserialize_with = "millifarads")]
    capacitance: f64,
    takes_back: bool,
    #[serde(deserialize_with = "resistance")]
    brake_resistor: f64,
    /// What the board takes.
    #[serde(deserialize_with = "milliamperes")]
    quiescent: f64,
}

fn one() -> u32 {
    1
}

impl Default for ServoTable {
    fn default() -> Self {
        let ServoSetup { motor, mechanics, .. } = ServoSetup::default();
        let Mechanics { inertia_kgm2, friction_nm, viscous_nms, load_nm } = mechanics;
        Self {
            motor: Drive(motor),
            inertia: inertia_kgm2 * GCM2_PER_KGM2,
            friction: friction_nm,
            viscous: viscous_nms,
            load: load_nm,
            magnet: 0.0,
            hall: HallTable::default(),
            hall_errors: [Degrees(0.0); 3],
            encoder: None,
            source: SourceTable::default(),
            current_noise: ServoDrive::CURRENT_NOISE,
            seed: 1,
        }
    }
}

impl Default for SourceTable {
    fn default() -> Self {
        let Supply { resistance_ohm, capacitance_f, takes_back, chopper_ohm, quiescent_a, .. } = Supply::default();
        Self {
            resistance: resistance_ohm,
            capacitance: capacitance_f * 1e3,
            takes_back,
            brake_resistor: chopper_ohm,
            quiescent: quiescent_a * 1e3,
        }
    }
}

// The motor: a name or a table.

impl<'de> Deserialize<'de> for Drive {
    fn deserialize<D: Deserializer<'de>>(value: D) -> Result<Self, D::Error> {
        value.deserialize_any(DriveVisitor)
    }
}

struct DriveVisitor;

impl<'de> Visitor<'de> for DriveVisitor {
    type Value = Drive;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("the data of a motor as a table, or a motor by name: ")?;
        f.write_str(&SERVO_MOTORS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Drive, E> {
        ServoMotor::named(name).map(Drive).ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(name), &self))
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Drive, M::Error> {
        let table = MotorTable::deserialize(MapAccessDeserializer::new(map))?;
        let constant_us = table.inductance / table.resistance * 1e3;
        if constant_us < SHORTEST_US {
            return Err(M::Error::custom(format!(
                "the inductance over the resistance is {constant_us:.3} us; expected at least {SHORTEST_US} us, the PWM period"
            )));
        }
        Ok(Drive(table.build()))
    }
}

/// The shortest time constant of a winding that steps of a PWM period can follow, in microseconds.
const SHORTEST_US: f64 = 40.0;

impl MotorTable {
    fn build(&self) -> ServoMotor {
        // Of the two phases between two lines, one.
        let (phases, share) = if self.direct_current { (Phases::One, 1.0) } else { (Phases::Three, 0.5) };
        let inductance_h = self.inductance * 1e-3 * share;
        ServoMotor {
            phases,
            pole_pairs: self.pole_pairs,
            resistance_ohm: self.resistance * share,
            inductance_d_h: inductance_h,
            inductance_q_h: inductance_h,
            torque_nm_per_a: self.torque_constant,
            saturation_a: None,
            rated_current_a: self.current,
            inertia_kgm2: self.inertia / GCM2_PER_KGM2,
        }
    }
}

// From the tables to the machine.

impl ServoTable {
    pub(super) fn build(&self, surroundings: Surroundings) -> ServoDrive {
        let mut drive = ServoDrive::new(self.setup());
        drive.surround(surroundings);
        drive.cut_encoder(self.encoder.is_none());
        drive.set_current_noise(self.current_noise, self.seed);
        drive
    }

    fn setup(&self) -> ServoSetup {
        let encoder = self.encoder.as_ref().map(|encoder| Encoder {
            counts_per_turn: encoder.counts_per_turn,
            index: encoder.index,
            reversed: encoder.reversed,
            ..Encoder::default()
        });
        ServoSetup {
            motor: self.motor.0,
            mechanics: Mechanics {
                inertia_kgm2: self.inertia / GCM2_PER_KGM2,
                friction_nm: self.friction,
                viscous_nms: self.viscous,
                load_nm: self.load,
            },
            hall: self.hall.build(self.hall_errors.map(|Degrees(error)| error)),
            encoder: encoder.unwrap_or_default(),
            magnet_turns: self.magnet / 360.0,
            supply: self.source.build(),
            ..ServoSetup::default()
        }
    }
}

impl HallTable {
    fn build(&self, placement_error_deg: [f64; 3]) -> HallSensors {
        HallSensors {
            placement_error_deg,
            inverted: self.polarity != 0.0,
            reversed: self.direction != 0.0,
            offset_turns: self.offset / 65_536.0,
            order: HallOrder::ALL[self.order as usize],
        }
    }
}

impl SourceTable {
    fn build(&self) -> Supply {
        Supply {
            resistance_ohm: self.resistance,
            capacitance_f: self.capacitance * 1e-3,
            takes_back: self.takes_back,
            chopper_ohm: self.brake_resistor,
            quiescent_a: self.quiescent * 1e-3,
            ..Supply::default()
        }
    }
}
