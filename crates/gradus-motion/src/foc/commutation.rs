//! The sensors of a servo together: angle, position and velocity, whichever is wanted.

use super::encoder::AbnEncoder;
use super::hall::Hall;
use super::settings::{Commutation, Sensor, ServoGains};
use super::turns::electrical_q32;

/// Everything that knows where the rotor is, or should be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sensors {
    pub hall: Hall,
    pub encoder: AbnEncoder,
    pub open_loop: OpenLoop,
    /// Added to the electrical angle of the encoder, 65536 a turn.
    pub encoder_offset_q16: i16,
}

impl Sensors {
    #[inline]
    pub(crate) fn update(&mut self, gains: &ServoGains, hall_bits: u8, encoder_count: i32) {
        self.hall.update(&gains.hall, hall_bits);
        let encoder = &gains.encoder;
        self.encoder.update(&encoder.scale, encoder.inverted, encoder.window_shift, encoder_count);
    }

    /// Angle that commutates, `None` when nothing does.
    #[inline]
    pub(crate) fn angle_q16(&self, gains: &ServoGains) -> Option<i16> {
        match gains.commutation {
            Commutation::Disabled => None,
            Commutation::OpenLoop => Some(self.open_loop.angle_q16(gains.pole_pairs)),
            Commutation::Hall => Some(self.hall.angle_q16(&gains.hall)),
            Commutation::Encoder => Some(self.encoder_angle_q16(gains.pole_pairs)),
        }
    }

    pub(crate) fn encoder_angle_q16(&self, pole_pairs: u32) -> i16 {
        self.encoder_angle_without_offset(pole_pairs).wrapping_add(self.encoder_offset_q16)
    }

    /// Makes the encoder's angle `angle_q16` where the rotor is now.
    pub(crate) fn set_encoder_angle(&mut self, pole_pairs: u32, angle_q16: i16) {
        self.encoder_offset_q16 = angle_q16.wrapping_sub(self.encoder_angle_without_offset(pole_pairs));
    }

    fn encoder_angle_without_offset(&self, pole_pairs: u32) -> i16 {
        (electrical_q32(self.encoder.position_q32(), pole_pairs) >> 16) as i16
    }

    /// Position for the position regulator, 2^32 a turn.
    #[inline]
    pub(crate) fn position_q32(&self, gains: &ServoGains) -> i64 {
        match sensor(gains, gains.position_sensor) {
            Commutation::Disabled => 0,
            Commutation::OpenLoop => self.open_loop.position_q32,
            Commutation::Hall => self.hall.position_q32(&gains.hall),
            Commutation::Encoder => self.encoder.position_q32(),
        }
    }

    /// Velocity for the velocity regulator, 2^32 a turn, in a cycle.
    #[inline]
    pub(crate) fn velocity_q32(&self, gains: &ServoGains) -> i64 {
        match sensor(gains, gains.velocity_sensor) {
            Commutation::Disabled => 0,
            Commutation::OpenLoop => self.open_loop.step_q32,
            Commutation::Hall => self.hall.velocity_q32(&gains.hall),
            Commutation::Encoder => self.encoder.velocity_q32(),
        }
    }
}

#[inline]
fn sensor(gains: &ServoGains, selected: Sensor) -> Commutation {
    match selected {
        Sensor::Commutation => gains.commutation,
        Sensor::Encoder => Commutation::Encoder,
    }
}

/// A field that turns without a sensor.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OpenLoop {
    position_q32: i64,
    step_q32: i64,
}

impl OpenLoop {
    /// Turns on for a cycle by a velocity in 1/65536 rpm.
    #[inline]
    pub(crate) fn advance(&mut self, gains: &ServoGains, rpm_q16: i64) {
        self.step_q32 = (rpm_q16 * gains.step_q48_per_rpm) >> 32;
        self.position_q32 = self.position_q32.wrapping_add(self.step_q32);
    }

    #[inline]
    pub(crate) fn angle_q16(&self, pole_pairs: u32) -> i16 {
        (electrical_q32(self.position_q32, pole_pairs) >> 16) as i16
    }
}
