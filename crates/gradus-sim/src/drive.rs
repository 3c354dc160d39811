//! The hardware of a servo: its plant behind the ports of the firmware, with what can go wrong.

use gradus_firmware::{Bridge, NullEvent, RotorInputs, Supply};
use gradus_plant::{Bridge as Switches, Channels, ServoMachine, ServoSetup, Surroundings};

use crate::current_noise::CurrentNoise;

/// Reading of a shunt without current.
const SHUNT_ZERO: f64 = 32_767.0;

/// Milliamperes in an ampere: a step of a shunt's reading is one.
const MA_PER_A: f64 = 1000.0;

/// A duty of one.
const FULL_DUTY: f64 = 32_768.0;

/// The power stage of a servo module with the simulated machine that it drives.
///
/// While the firmware has control ticks, the plant goes on by a PWM period in each of them. Else the bench moves it on, until
/// it is at rest.
#[derive(Clone, PartialEq, Debug)]
pub struct ServoDrive {
    /// Motor, load, sensors, supply.
    pub plant: ServoMachine,
    /// Length of a PWM period.
    period_s: f64,
    /// The firmware has control ticks.
    ticking: bool,
    /// Levels at which hall sensors are stuck.
    stuck: [Option<bool>; 3],
    /// What the counter shows while the line of the encoder is cut.
    cut_at: Option<i32>,
    /// The gate driver reports a fault.
    faulty: bool,
    noise: CurrentNoise,
}

impl ServoDrive {
    /// A drive of that machine.
    pub fn new(setup: ServoSetup) -> Self {
        let plant = ServoMachine::new(setup);
        let noise = CurrentNoise::new(Self::CURRENT_NOISE, 1);
        Self { plant, period_s: 4e-5, ticking: false, stuck: [None; 3], cut_at: None, faulty: false, noise }
    }

    /// Standard deviation of a shunt's reading in steps, unless told otherwise.
    pub const CURRENT_NOISE: f64 = 1.0;

    /// Gives the readings of the shunts this standard deviation, in steps, with dice of this seed.
    pub fn set_current_noise(&mut self, steps: f64, seed: u64) {
        self.noise = CurrentNoise::new(steps, seed);
    }

    /// A hall sensor, 0 to 2, is stuck at a level; `None`: it works.
    pub fn stick_hall(&mut self, sensor: usize, level: Option<bool>) {
        if let Some(stuck) = self.stuck.get_mut(sensor) {
            *stuck = level;
        }
    }

    /// Cuts the line of the encoder, or mends it: the counter goes on from where it was.
    pub fn cut_encoder(&mut self, cut: bool) {
        self.cut_at = cut.then(|| self.plant.encoder_count());
    }

    /// The gate driver reports a fault, or none any more.
    pub fn fail_gate_driver(&mut self, faulty: bool) {
        self.faulty = faulty;
    }

    /// True while the firmware has control ticks.
    pub(crate) fn is_ticking(&self) -> bool {
        self.ticking
    }

    /// True while the bench must move it on.
    pub(crate) fn is_awake(&self) -> bool {
        !self.ticking && !self.plant.is_at_rest()
    }

    /// Looks at its surroundings anew.
    pub(crate) fn surround(&mut self, surroundings: Surroundings) {
        self.plant.surround(surroundings);
    }

    /// A step of the bench, unless the firmware moves it on.
    pub(crate) fn advance(&mut self, seconds: f64) {
        if !self.ticking {
            self.plant.step(seconds, Switches::Open);
        }
    }

    /// No power, for as long as the supply's capacitor needs to lose what braking has left in it.
    pub(crate) fn release(&mut self) {
        self.rest();
        self.plant.switch_chopper(false);
        self.plant.discharge();
    }
}

impl Default for ServoDrive {
    /// A QBL4208-61 with a light load.
    fn default() -> Self {
        Self::new(ServoSetup::default())
    }
}

impl Bridge for ServoDrive {
    #[inline]
    fn shunts(&mut self) -> [u16; 2] {
        let [a, b, _] = self.plant.phase_currents_a();
        let [noise_a, noise_b] = self.noise.read(self.ticking);
        [(a, noise_a), (b, noise_b)]
            .map(|(current_a, noise)| (SHUNT_ZERO + (current_a * MA_PER_A + noise).round()) as u16)
    }

    #[inline]
    fn set_duties(&mut self, duties: Option<[u16; 3]>) {
        self.ticking = true;
        let switches = match duties {
            Some(duties) => Switches::Duties(duties.map(|duty| f64::from(duty) * (1.0 / FULL_DUTY))),
            None => Switches::Open,
        };
        self.plant.step(self.period_s, switches);
        self.noise.advance();
    }

    fn rest(&mut self) {
        self.ticking = false;
    }

    fn set_frequency(&mut self, hz: u32) {
        self.period_s = 1.0 / f64::from(hz.max(1));
    }

    #[inline]
    fn is_faulty(&mut self) -> bool {
        self.faulty
    }
}

impl RotorInputs for ServoDrive {
    #[inline]
    fn hall(&mut self) -> u8 {
        let mut bits = self.plant.hall_bits();
        for (sensor, level) in self.stuck.iter().enumerate() {
            if let Some(level) = level {
                bits = bits & !(1 << sensor) | u8::from(*level) << sensor;
            }
        }
        bits
    }

    #[inline]
    fn encoder(&mut self) -> i32 {
        self.cut_at.unwrap_or_else(|| self.plant.encoder_count())
    }

    fn encoder_levels(&mut self) -> u8 {
        let Channels { a, b, n } = self.plant.encoder_channels();
        if self.cut_at.is_some() { 0 } else { u8::from(a) | u8::from(b) << 1 | u8::from(n) << 2 }
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        self.plant.watch_null(event.map(|NullEvent { n, ab }| gradus_plant::NullEvent { n, ab }));
    }

    #[inline]
    fn take_null(&mut self) -> Option<i32> {
        self.plant.take_null().filter(|_| self.cut_at.is_none())
    }
}

impl Supply for ServoDrive {
    #[inline]
    fn voltage_dv(&mut self) -> i32 {
        (self.plant.supply_v() * 10.0).round() as i32
    }

    #[inline]
    fn temperature_c(&mut self) -> i32 {
        self.plant.driver_c().round() as i32
    }

    fn set_brake_chopper(&mut self, on: bool) {
        self.plant.switch_chopper(on);
    }
}
