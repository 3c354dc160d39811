//! Digital hall sensors: sector, angle, speed.

use super::turns::{CountScale, TurnCounter};

/// Hall sensors (axis parameters 90 to 93).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HallSettings {
    /// Sensors are low where they should be high.
    pub inverted_polarity: bool,
    /// Sensors B and C are exchanged.
    pub inverted_direction: bool,
    /// The angle goes on between edges.
    pub interpolation: bool,
    /// Added to the electrical angle, 65536 a turn.
    pub offset_q16: i16,
}

/// A sixth of an electrical turn.
const SECTOR_Q32: u32 = 715_827_883;

/// What a cycle needs to read hall sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HallGains {
    settings: HallSettings,
    /// Six sectors an electrical turn.
    scale: CountScale,
    /// 1/pole pairs, 32 fraction bits.
    inverse_pole_pairs_q32: u64,
    /// Cycles between two edges at 60 rpm. Slower motion is not interpolated.
    longest_interpolated: u32,
    /// Cycles without an edge after which the rotor is at rest: a quarter of a second.
    rest_after: u32,
}

impl HallGains {
    pub(crate) fn new(settings: HallSettings, pole_pairs: u32, pwm_hz: u32) -> Self {
        let pole_pairs = pole_pairs.max(1);
        Self {
            settings,
            scale: CountScale::new(6 * pole_pairs),
            inverse_pole_pairs_q32: (1_u64 << 32) / u64::from(pole_pairs),
            longest_interpolated: pwm_hz / (6 * pole_pairs),
            rest_after: pwm_hz / 4,
        }
    }
}

/// Three hall sensors, a third of an electrical turn apart. Bit 0 is the sensor of phase A, which is closed for half a
/// turn around angle 0.
///
/// Sector `n` lies around the angle `n` * 60 degrees. Without interpolation the angle is the middle of the sector. With
/// interpolation it goes on from the edge with the speed between the last two edges, at most to the end of the sector;
/// below 60 rpm, and after a reversal, it is the middle. Codes 0 and 7 do not exist: they are a
/// [fault](Self::is_faulty), and the angle stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hall {
    sector: Option<u8>,
    faulty: bool,
    counter: TurnCounter,
    /// Direction of the last edge: 1, -1, or 0 if there was none.
    direction: i32,
    cycles_since_edge: u32,
    /// Electrical angle in a cycle; signless, 0 while it is not known.
    speed_q32: u32,
    /// Cycles since the last edge at which the speed is halved next.
    slower_after: u32,
}

impl Hall {
    /// Reads the sensors once a cycle: three bits.
    #[inline]
    pub fn update(&mut self, gains: &HallGains, bits: u8) {
        self.cycles_since_edge = self.cycles_since_edge.saturating_add(1);
        let sector = sector(bits, &gains.settings);
        self.faulty = sector.is_none();
        match (self.sector, sector) {
            (Some(last), Some(new)) if last != new => self.edge(gains, last, new),
            (None, Some(new)) => self.sector = Some(new),
            _ => self.slow_down(gains),
        }
    }

    fn edge(&mut self, gains: &HallGains, last: u8, new: u8) {
        self.sector = Some(new);
        let steps = shortest(last, new);
        self.counter.advance(&gains.scale, steps);
        let same_way = steps.signum() == self.direction;
        self.direction = steps.signum();
        self.speed_q32 = if same_way { SECTOR_Q32 / self.cycles_since_edge.max(1) } else { 0 };
        self.slower_after = self.cycles_since_edge.saturating_mul(2);
        self.cycles_since_edge = 0;
    }

    /// Without an edge in twice the last time, the rotor turns at most half as fast.
    #[inline]
    fn slow_down(&mut self, gains: &HallGains) {
        if self.cycles_since_edge > gains.rest_after {
            self.speed_q32 = 0;
        } else if self.cycles_since_edge > self.slower_after {
            self.speed_q32 /= 2;
            self.slower_after = self.slower_after.saturating_mul(2);
        }
    }

    /// Electrical angle, 65536 a turn, with the offset of the settings.
    #[inline]
    pub fn angle_q16(&self, gains: &HallGains) -> i16 {
        let middle = u32::from(self.sector.unwrap_or(0)).wrapping_mul(SECTOR_Q32);
        let angle = middle.wrapping_add(self.beyond_middle(gains) as u32);
        ((angle >> 16) as i16).wrapping_add(gains.settings.offset_q16)
    }

    /// How far interpolation puts the rotor beyond the middle of its sector.
    #[inline]
    fn beyond_middle(&self, gains: &HallGains) -> i32 {
        let fast = self.speed_q32 > 0 && self.slower_after / 2 <= gains.longest_interpolated;
        if !(gains.settings.interpolation && fast) {
            return 0;
        }
        let since_edge = u64::from(self.speed_q32) * u64::from(self.cycles_since_edge);
        let since_edge = since_edge.min(u64::from(SECTOR_Q32)) as i32;
        self.direction * (since_edge - (SECTOR_Q32 / 2) as i32)
    }

    /// Middle between the last two sectors: where the rotor was at the last edge, with the offset of the settings.
    pub fn edge_angle_q16(&self, gains: &HallGains) -> i16 {
        let middle = u32::from(self.sector.unwrap_or(0)).wrapping_mul(SECTOR_Q32);
        let edge = middle.wrapping_add((-self.direction * (SECTOR_Q32 / 2) as i32) as u32);
        ((edge >> 16) as i16).wrapping_add(gains.settings.offset_q16)
    }

    /// Position, 2^32 a mechanical turn, in steps of a sector.
    #[inline]
    pub fn position_q32(&self, gains: &HallGains) -> i64 {
        self.counter.position_q32(&gains.scale)
    }

    /// Speed of the shaft, 2^32 a mechanical turn, in a cycle.
    #[inline]
    pub fn velocity_q32(&self, gains: &HallGains) -> i64 {
        let speed = (u64::from(self.speed_q32) * gains.inverse_pole_pairs_q32) >> 32;
        i64::from(self.direction) * speed as i64
    }

    /// Sector from 0 to 5, `None` before the first valid code.
    pub fn sector(&self) -> Option<u8> {
        self.sector
    }

    /// True while the sensors show a code that does not exist.
    pub fn is_faulty(&self) -> bool {
        self.faulty
    }
}

/// Sector of a code; `None` for codes that do not exist.
#[inline]
fn sector(bits: u8, settings: &HallSettings) -> Option<u8> {
    let code = if settings.inverted_polarity { !bits & 7 } else { bits & 7 };
    let sector = match code {
        1 => 0,
        3 => 1,
        2 => 2,
        6 => 3,
        4 => 4,
        5 => 5,
        _ => return None,
    };
    Some(if settings.inverted_direction && sector > 0 { 6 - sector } else { sector })
}

/// Sectors from `last` to `new` on the shorter way; half a turn counts as no way.
fn shortest(last: u8, new: u8) -> i32 {
    match (6 + i32::from(new) - i32::from(last)) % 6 {
        3 => 0,
        steps @ 0..3 => steps,
        steps => steps - 6,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEQUENCE: [u8; 6] = [1, 3, 2, 6, 4, 5];
    const PWM_HZ: u32 = 25_000;

    fn gains(settings: HallSettings) -> HallGains {
        HallGains::new(settings, 4, PWM_HZ)
    }

    /// What sensors show at an electrical angle in degrees.
    fn code(degrees: f64) -> u8 {
        SEQUENCE[((degrees + 30.0).rem_euclid(360.0) / 60.0) as usize % 6]
    }

    /// Turns at `rpm` for `seconds`; calls `check` with the true angle in degrees and the interpolation's error.
    fn turn(hall: &mut Hall, gains: &HallGains, rpm: f64, seconds: f64, mut check: impl FnMut(f64, f64)) {
        for cycle in 0..(seconds * f64::from(PWM_HZ)) as u32 {
            let degrees = f64::from(cycle) / f64::from(PWM_HZ) * rpm / 60.0 * 4.0 * 360.0;
            hall.update(gains, code(degrees));
            let got = f64::from(hall.angle_q16(gains)) * 360.0 / 65_536.0;
            check(degrees, (got - degrees + 180.0).rem_euclid(360.0) - 180.0);
        }
    }

    #[test]
    fn sectors_follow_the_sequence_under_all_settings() {
        for (n, code) in SEQUENCE.into_iter().enumerate() {
            let n = n as u8;
            let standard = HallSettings::default();
            assert_eq!(sector(code, &standard), Some(n));
            assert_eq!(sector(!code, &HallSettings { inverted_polarity: true, ..standard }), Some(n));
            assert_eq!(sector(code, &HallSettings { inverted_direction: true, ..standard }), Some((6 - n) % 6));
        }
        for code in [0, 7] {
            assert_eq!(sector(code, &HallSettings::default()), None);
        }
    }

    #[test]
    fn angle_without_interpolation_is_within_half_a_sector() {
        let (gains, mut hall) = (gains(HallSettings::default()), Hall::default());
        turn(&mut hall, &gains, 300.0, 0.5, |degrees, error| assert!(error.abs() <= 30.1, "{error} at {degrees}"));
        assert_eq!(hall.position_q32(&gains) >> 16, 5 * 65_536 / 2);
    }

    #[test]
    fn angle_with_interpolation_follows_above_60_rpm() {
        let gains = gains(HallSettings { interpolation: true, ..HallSettings::default() });
        for (rpm, limit) in [(65.0, 0.5), (300.0, 1.0), (3_000.0, 3.5), (-3_000.0, 3.5)] {
            let mut hall = Hall::default();
            turn(&mut hall, &gains, rpm, 0.5, |degrees, error| {
                let settled = degrees.abs() > 180.0;
                assert!(error.abs() <= if settled { limit } else { 60.0 }, "{error} at {degrees}, {rpm} rpm");
            });
            let got = hall.velocity_q32(&gains) as f64 * f64::from(PWM_HZ) * 60.0 / 2.0_f64.powi(32);
            assert!((got / rpm - 1.0).abs() < 0.04, "{got} at {rpm}");
        }
        let mut slow = Hall::default();
        turn(&mut slow, &gains, 50.0, 0.5, |_, _| ());
        assert_eq!(slow.beyond_middle(&gains), 0, "not below 60 rpm");
    }

    #[test]
    fn stopped_rotor_has_no_speed_after_a_quarter_of_a_second() {
        let (gains, mut hall) = (gains(HallSettings::default()), Hall::default());
        turn(&mut hall, &gains, 3_000.0, 0.1, |_, _| ());
        let running = hall.velocity_q32(&gains);
        let last = SEQUENCE[usize::from(hall.sector().unwrap())];
        let mut speeds = (0..PWM_HZ / 4 + 2).map(|_| {
            hall.update(&gains, last);
            hall.velocity_q32(&gains)
        });
        assert!(speeds.by_ref().take(1_000).last().unwrap() < running / 25);
        assert_eq!(speeds.last(), Some(0));
    }

    #[test]
    fn invalid_code_is_a_fault_and_keeps_the_angle() {
        let (gains, mut hall) = (gains(HallSettings::default()), Hall::default());
        hall.update(&gains, 6);
        let angle = hall.angle_q16(&gains);
        for (code, faulty) in [(0, true), (6, false), (7, true)] {
            hall.update(&gains, code);
            assert_eq!((hall.is_faulty(), hall.angle_q16(&gains)), (faulty, angle), "{code}");
        }
    }

    #[test]
    fn reversal_does_not_interpolate_with_the_old_speed() {
        let gains = gains(HallSettings { interpolation: true, ..HallSettings::default() });
        let mut hall = Hall::default();
        turn(&mut hall, &gains, 300.0, 0.1, |_, _| ());
        let (sector, speed) = (hall.sector().unwrap(), hall.velocity_q32(&gains));
        assert!(speed > 0);
        hall.update(&gains, SEQUENCE[usize::from(sector + 5) % 6]);
        assert_eq!((hall.velocity_q32(&gains), hall.beyond_middle(&gains)), (0, 0));
    }
}
