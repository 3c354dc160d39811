//! The tables of an axis.

use std::fmt;

use gradus_plant::{Currents, Encoder, MOTORS, Mechanics, Motor, STALLGUARD_NOISE, StepperAxis, Travel, Vane};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::MachineAxis;
use crate::quantity::{
    amperes, bounce, counts, counts_of_noise, full_steps, inductance, inertia, load, place, resistance, slip, torque,
    travel_per_turn, vane_width, width,
};

/// kg m^2 in a gcm^2.
const GCM2: f64 = 1e-7;

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table with the keys of an axis")]
pub(super) struct AxisTable {
    motor: Drive,
    currents: CurrentsName,
    #[serde(deserialize_with = "inertia")]
    inertia: f64,
    #[serde(deserialize_with = "torque")]
    friction: f64,
    #[serde(deserialize_with = "torque")]
    viscous: f64,
    #[serde(deserialize_with = "load")]
    load: f64,
    #[serde(deserialize_with = "full_steps")]
    full_steps: Option<u32>,
    #[serde(deserialize_with = "travel_per_turn")]
    travel_per_turn: f64,
    /// The carriage moves in negative direction when the shaft turns in positive direction.
    reversed: bool,
    #[serde(deserialize_with = "place")]
    start: f64,
    travel: TravelTable,
    encoder: Option<EncoderTable>,
    stallguard: StallGuardTable,
}

/// What makes readings of StallGuard2 differ.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table such as { noise = 10.0, seed = 1 }")]
struct StallGuardTable {
    /// Standard deviation in counts.
    #[serde(deserialize_with = "counts_of_noise")]
    noise: f64,
    /// That of the axis' number, unless it is named.
    seed: Option<u32>,
}

impl Default for StallGuardTable {
    fn default() -> Self {
        Self { noise: STALLGUARD_NOISE, seed: None }
    }
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
enum CurrentsName {
    Hybrid,
    QuasiStatic,
    Electrical,
}

/// What turns the shaft.
#[derive(Clone, Copy)]
enum Drive {
    Rigid,
    Motor(Motor),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorTable {
    #[serde(deserialize_with = "resistance")]
    resistance: f64,
    #[serde(deserialize_with = "inductance")]
    inductance: f64,
    #[serde(deserialize_with = "amperes")]
    current: f64,
    #[serde(deserialize_with = "torque")]
    holding_torque: f64,
    #[serde(deserialize_with = "torque", default)]
    detent_torque: f64,
    #[serde(deserialize_with = "inertia")]
    inertia: f64,
    #[serde(deserialize_with = "full_steps", default)]
    full_steps: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields, expecting = "a table with left, right, home and ends")]
struct TravelTable {
    left: Option<EndTable>,
    right: Option<EndTable>,
    home: Option<HomeTable>,
    ends: EndsTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { at = 0.0 }")]
struct EndTable {
    #[serde(deserialize_with = "place")]
    at: f64,
    #[serde(deserialize_with = "vane_width", default)]
    width: Option<f64>,
    #[serde(default)]
    normally_closed: bool,
    #[serde(deserialize_with = "bounce", default)]
    bounce: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { at = 60.0, width = 2.0 }")]
struct HomeTable {
    #[serde(deserialize_with = "place")]
    at: f64,
    #[serde(deserialize_with = "width")]
    width: f64,
    #[serde(default)]
    normally_closed: bool,
    #[serde(deserialize_with = "bounce", default)]
    bounce: u32,
}

/// End stops.
#[derive(Deserialize, Default)]
#[serde(default, deny_unknown_fields, expecting = "a table such as { left = -2.0, right = 102.0 }")]
struct EndsTable {
    left: Option<Place>,
    right: Option<Place>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(transparent)]
struct Place(#[serde(deserialize_with = "place")] f64);

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table such as { counts_per_turn = 4096 }")]
struct EncoderTable {
    #[serde(deserialize_with = "counts")]
    counts_per_turn: u32,
    /// Without one there is no null channel.
    index: Option<u32>,
    #[serde(default)]
    reversed: bool,
    /// Degrees of the shaft.
    #[serde(deserialize_with = "slip", default)]
    slip: f64,
}

impl Default for AxisTable {
    fn default() -> Self {
        let Mechanics { inertia_kgm2, friction_nm, viscous_nms, load_nm } = Mechanics::default();
        Self {
            motor: Drive::Motor(Motor::default()),
            currents: CurrentsName::Hybrid,
            inertia: inertia_kgm2 / GCM2,
            friction: friction_nm,
            viscous: viscous_nms,
            load: load_nm,
            full_steps: None,
            travel_per_turn: 1.0,
            reversed: false,
            start: 0.0,
            travel: TravelTable::default(),
            encoder: None,
            stallguard: StallGuardTable::default(),
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
        f.write_str("\"rigid\", the data of a motor as a table, or a motor by name: ")?;
        f.write_str(&MOTORS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Drive, E> {
        if name.eq_ignore_ascii_case("rigid") {
            return Ok(Drive::Rigid);
        }
        Motor::named(name).map(Drive::Motor).ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(name), &self))
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Drive, M::Error> {
        MotorTable::deserialize(MapAccessDeserializer::new(map)).map(|table| Drive::Motor(table.build()))
    }
}

impl MotorTable {
    fn build(&self) -> Motor {
        Motor {
            full_steps: self.full_steps.unwrap_or(200),
            resistance_ohm: self.resistance,
            inductance_h: self.inductance * 1e-3,
            current_a: self.current,
            holding_torque_nm: self.holding_torque,
            detent_torque_nm: self.detent_torque,
            inertia_kgm2: self.inertia * GCM2,
        }
    }
}

// From the tables to the machine.

impl AxisTable {
    /// The axis of this number.
    pub(super) fn build(&self, number: u8) -> MachineAxis {
        let mut plant = self.rotor();
        let StallGuardTable { noise, seed } = self.stallguard;
        plant.set_stallguard_noise(noise, seed.unwrap_or(u32::from(number) + 1));
        plant.travel = self.travel.build(|length| plant.microsteps(self.turns(length)));
        plant.encoder = self.encoder.as_ref().map(|encoder| encoder.build(|turns| plant.microsteps(turns)));
        plant.place(plant.microsteps(self.turns(self.start)));
        MachineAxis { plant, ..MachineAxis::default() }
    }

    /// Turns of the shaft at a place of the carriage.
    fn turns(&self, length: f64) -> f64 {
        let turns = length / self.travel_per_turn;
        if self.reversed { -turns } else { turns }
    }

    fn rotor(&self) -> StepperAxis {
        let motor = match self.motor {
            Drive::Rigid => return StepperAxis::rigid(self.full_steps.unwrap_or(200)),
            Drive::Motor(motor) => Motor { full_steps: self.full_steps.unwrap_or(motor.full_steps), ..motor },
        };
        let currents = match self.currents {
            CurrentsName::Hybrid => Currents::Hybrid,
            CurrentsName::QuasiStatic => Currents::QuasiStatic,
            CurrentsName::Electrical => Currents::Electrical,
        };
        StepperAxis::with_motor(motor, self.mechanics(), currents)
    }

    fn mechanics(&self) -> Mechanics {
        Mechanics {
            inertia_kgm2: self.inertia * GCM2,
            friction_nm: self.friction,
            viscous_nms: self.viscous,
            load_nm: self.load,
        }
    }
}

impl TravelTable {
    fn build(&self, microsteps: impl Fn(f64) -> i64) -> Travel {
        let vane = |[from, to]: [f64; 2], opens| {
            let (from, to) = (microsteps(from), microsteps(to));
            Vane { from: from.min(to), to: from.max(to), opens }
        };
        let left = |end: &EndTable| vane([end.at, end.far(-1.0)], end.normally_closed);
        let right = |end: &EndTable| vane([end.at, end.far(1.0)], end.normally_closed);
        let home =
            |home: &HomeTable| vane([home.at - home.width / 2.0, home.at + home.width / 2.0], home.normally_closed);
        let bounce = |end: &Option<EndTable>| end.as_ref().map_or(0, |end| end.bounce);
        Travel {
            left: self.left.as_ref().map(left),
            right: self.right.as_ref().map(right),
            home: self.home.as_ref().map(home),
            ends: self.ends.build(&microsteps),
            bounce_us: [bounce(&self.left), bounce(&self.right), self.home.as_ref().map_or(0, |home| home.bounce)],
        }
    }
}

impl EndTable {
    /// Where the vane ends outwards, which may be nowhere.
    fn far(&self, way: f64) -> f64 {
        self.width.map_or(way * f64::INFINITY, |width| self.at + way * width)
    }
}

impl EndsTable {
    /// The lower and the upper one in microsteps, of which a reversed axis has the right one on the left.
    fn build(&self, microsteps: impl Fn(f64) -> i64) -> [Option<i64>; 2] {
        let [left, right] = [self.left, self.right].map(|end| end.map(|Place(at)| microsteps(at)));
        if microsteps(1e6) < 0 { [right, left] } else { [left, right] }
    }
}

impl EncoderTable {
    fn build(&self, microsteps: impl Fn(f64) -> i64) -> Encoder {
        Encoder {
            counts_per_turn: self.counts_per_turn,
            index: self.index,
            reversed: self.reversed,
            slip: microsteps(self.slip / 360.0),
        }
    }
}
