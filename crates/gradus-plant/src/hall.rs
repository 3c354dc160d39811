//! Hall sensors of a servo motor.

/// Three hall sensors, a third of an electrical turn apart, and how they are mounted and wired. As they are by default,
/// that of phase A is closed for half a turn around the angle 0, where the magnet points along phase A.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct HallSensors {
    /// How far each sensor stands from its place, in electrical degrees.
    pub placement_error_deg: [f64; 3],
    /// They are low where they should be high: suits axis parameter 90 = 1.
    pub inverted: bool,
    /// They are mounted the other way round: suits axis parameter 91 = 1.
    pub reversed: bool,
    /// They are turned on by so many electrical turns, from -1 to 1: suits axis parameter 93, 65536 a turn.
    pub offset_turns: f64,
    /// Which sensor each of the module's inputs is connected to.
    pub order: HallOrder,
}

/// The sensors at the inputs 0, 1 and 2: a permutation of 0, 1 and 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HallOrder(pub [u8; 3]);

impl HallOrder {
    /// All there are.
    pub const ALL: [Self; 6] =
        [Self([0, 1, 2]), Self([0, 2, 1]), Self([1, 0, 2]), Self([1, 2, 0]), Self([2, 0, 1]), Self([2, 1, 0])];
}

impl Default for HallOrder {
    fn default() -> Self {
        Self([0, 1, 2])
    }
}

impl HallSensors {
    /// Bits 0 to 2 of the module's inputs at an electrical angle in turns, from 0 to 1.
    #[inline]
    pub fn bits(&self, electrical_turns: f64) -> u8 {
        let beyond = electrical_turns - self.offset_turns;
        let turns = if self.reversed { -beyond } else { beyond };
        let [a, b, c] = self.placement_error_deg;
        let level = |begins: f64, error_deg: f64| closes(turns - begins - error_deg / 360.0) != self.inverted;
        let levels = [level(-0.25, a), level(1.0 / 12.0, b), level(5.0 / 12.0, c)];
        let [first, second, third] = self.order.0.map(|sensor| u8::from(levels[usize::from(sensor % 3)]));
        first | second << 1 | third << 2
    }
}

/// True for half a turn after 0; from -200 turns on.
#[inline]
fn closes(turns: f64) -> bool {
    let turns = turns + 200.0;
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
        let sensors = HallSensors { placement_error_deg: [0.0, 5.0, 0.0], ..HallSensors::default() };
        assert_eq!([34.9, 35.1].map(|degrees| sensors.bits(degrees / 360.0)), [1, 3]);
    }

    #[test]
    fn wiring_turns_inverts_reverses_and_exchanges() {
        let standard = HallSensors::default();
        for sector in 0..6 {
            let turns = f64::from(sector) / 6.0;
            let bits = standard.bits(turns);
            assert_eq!(HallSensors { inverted: true, ..standard }.bits(turns), !bits & 7);
            assert_eq!(HallSensors { reversed: true, ..standard }.bits((1.0 - turns) % 1.0), bits);
            assert_eq!(HallSensors { offset_turns: 0.25, ..standard }.bits((turns + 0.25) % 1.0), bits);
            let order = HallOrder([1, 2, 0]);
            assert_eq!(HallSensors { order, ..standard }.bits(turns), bits >> 1 | (bits & 1) << 2);
        }
    }
}
