//! Hall sensors of a servo motor.

/// Three hall sensors, a third of an electrical turn apart. That of phase A is closed for half a turn around the angle
/// 0, where the magnet points along phase A.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct HallSensors {
    /// How far each sensor stands from its place, in electrical degrees.
    pub placement_error_deg: [f64; 3],
}

impl HallSensors {
    /// Bits 0 to 2 of the sensors A, B and C at an electrical angle in turns, from 0 to 1.
    #[inline]
    pub fn bits(&self, electrical_turns: f64) -> u8 {
        let [a, b, c] = self.placement_error_deg;
        let bit = |begins: f64, error_deg: f64| u8::from(closes(electrical_turns - begins - error_deg / 360.0));
        bit(-0.25, a) | bit(1.0 / 12.0, b) << 1 | bit(5.0 / 12.0, c) << 2
    }
}

/// True for half a turn after 0; from -2 turns on.
#[inline]
fn closes(turns: f64) -> bool {
    let turns = turns + 2.0;
    turns - f64::from(turns as i32) < 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_follow_the_sequence_of_a_positive_turn() {
        let sensors = HallSensors::default();
        let middles: Vec<u8> = (0..6).map(|sector| sensors.bits(f64::from(sector) / 6.0)).collect();
        assert_eq!(middles, [1, 3, 2, 6, 4, 5]);
        assert_eq!([29.9, 30.1, 329.9, 330.1].map(|degrees| sensors.bits(degrees / 360.0)), [1, 3, 5, 1]);
    }

    #[test]
    fn misplaced_sensor_switches_later() {
        let sensors = HallSensors { placement_error_deg: [0.0, 5.0, 0.0] };
        assert_eq!([34.9, 35.1].map(|degrees| sensors.bits(degrees / 360.0)), [1, 3]);
    }
}
