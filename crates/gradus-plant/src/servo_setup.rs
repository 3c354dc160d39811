//! What is connected to a servo module, as data.

use crate::Encoder;
use crate::hall::HallSensors;
use crate::motors::Mechanics;
use crate::servo_motors::ServoMotor;
use crate::supply::Supply;

/// Everything that a servo's connectors lead to, as data.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ServoSetup {
    /// The motor.
    pub motor: ServoMotor,
    /// What hangs on the shaft.
    pub mechanics: Mechanics,
    /// Hall sensors.
    pub hall: HallSensors,
    /// The encoder on the shaft; its count is 0 at position 0.
    pub encoder: Encoder,
    /// Where the magnet points at position 0, in electrical turns ahead of phase A.
    pub magnet_turns: f64,
    /// The supply.
    pub supply: Supply,
    /// The bridge.
    pub bridge: BridgeData,
}

impl Default for ServoSetup {
    /// A QBL4208-61 with a light load: 50 gcm^2, 1 mNm of friction.
    fn default() -> Self {
        let mechanics = Mechanics { inertia_kgm2: 5e-6, friction_nm: 1e-3, viscous_nms: 1e-6, load_nm: 0.0 };
        Self {
            motor: ServoMotor::default(),
            mechanics,
            hall: HallSensors::default(),
            encoder: Encoder::default(),
            magnet_turns: 0.0,
            supply: Supply::default(),
            bridge: BridgeData::default(),
        }
    }
}

/// Bridge of three half bridges.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BridgeData {
    /// Seconds in which both switches of a half bridge are off at each change.
    pub dead_time_s: f64,
    /// Resistance of a switch in ohms.
    pub switch_ohm: f64,
}

impl Default for BridgeData {
    /// 300 ns and 5 milliohms.
    fn default() -> Self {
        Self { dead_time_s: 3e-7, switch_ohm: 5e-3 }
    }
}
