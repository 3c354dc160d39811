//! A servo motor with its bridge, supply, sensors and load.
//!
//! The motor is computed in the frame of its rotor (dq), by the classical Runge-Kutta method with one step a PWM
//! period. In a period the duties, the load and the supply's voltage stay; the voltage turns away from the rotor as the
//! rotor turns. A direct-current motor is the same equations without rotation.
//!
//! What the bridge does is averaged over the period. Its dead time takes `supply * dead time / period` from a phase,
//! against the current. With the bridge open the currents flow through the diodes against the supply until they end, and a
//! rotor whose voltage is above that of the supply charges it through them, and is braked. Not modelled are iron losses,
//! cogging, the ripple of the current in a period.
//!
//! Whatever the load, everything stays finite: the electrical angle turns by at most 10 000 rad/s (24 000 rpm with four pole
//! pairs), a current has at most 1000 A, the bridge at most 100 V ([`HIGHEST_V`]), the winding at most 300 degC and
//! the driver 200; a real one has burst or burnt there.

use crate::encoder::NullLatch;
use crate::equations::{Constants, Motion, Step, StepEnd, turned_back};
use crate::motors::Mechanics;
use crate::servo_motors::Phases;
use crate::servo_setup::ServoSetup;
use crate::supply::{HIGHEST_V, Supply, SupplyGains};
use crate::trigonometry::sin_cos;
use crate::{NullEvent, Surroundings};

/// 1/sqrt(3) and sqrt(3)/2.
const INV_SQRT_3: f64 = 0.577_350_269_189_625_8;
const HALF_SQRT_3: f64 = 0.866_025_403_784_438_6;

/// Copper's resistance rises by this share of its value at 25 degC for each kelvin.
const COPPER_PER_K: f64 = 0.003_9;

/// Limits, see above: of the electrical angle in rad/s, of a current in A, of winding and driver in degC.
const FASTEST: f64 = 1e4;
const LARGEST_A: f64 = 1e3;
const HOTTEST_WINDING_C: f64 = 300.0;
const HOTTEST_DRIVER_C: f64 = 200.0;

/// Speed in rad/s that is none any more: without friction a rotor would never come to rest.
const SLOWEST: f64 = 1e-6;

/// Below this current in amperes a phase takes less than the whole dead time: its ripple reverses within the period.
const DEAD_TIME_SOFT_A: f64 = 0.05;

/// What the firmware does with the bridge for a PWM period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Bridge {
    /// All switches are off.
    Open,
    /// How long the upper switches of A, B and C are on, from 0 to 1.
    Duties([f64; 3]),
}

/// Where power goes, in watts, at the end of the latest step.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Powers {
    /// Out of the source.
    pub source_w: f64,
    /// Lost in the resistance of source and cable.
    pub cable_w: f64,
    /// Lost in the brake resistor.
    pub chopper_w: f64,
    /// Lost in the bridge's switches.
    pub bridge_w: f64,
    /// Lost in the winding.
    pub copper_w: f64,
    /// Lost in friction, Coulomb and viscous.
    pub friction_w: f64,
    /// Given to the load torque.
    pub load_w: f64,
    /// Taken by the board itself.
    pub board_w: f64,
}

/// What a step needs of the data and its length, beside the [`Constants`].
#[derive(Clone, Copy, PartialEq, Debug)]
struct Period {
    seconds: f64,
    /// Share of the dead time in it.
    dead_time: f64,
    supply: SupplyGains,
    /// Shares of the difference to their final temperatures that winding and driver take.
    winding: f64,
    driver: f64,
    /// Kelvin of winding and driver for each square ampere.
    winding_k_per_a2: f64,
    driver_k_per_a2: f64,
}

impl Period {
    fn new(setup: &ServoSetup, constants: &Constants, seconds: f64) -> Self {
        let rated_a = setup.motor.rated_current_a;
        Self {
            seconds,
            dead_time: setup.bridge.dead_time_s / seconds,
            supply: setup.supply.gains(seconds),
            winding: seconds / WINDING_S,
            driver: seconds / DRIVER_S,
            winding_k_per_a2: WINDING_RISE_K / (rated_a * rated_a),
            driver_k_per_a2: DRIVER_K_PER_W * constants.power * constants.bridge_ohm,
        }
    }
}

/// A servo motor with everything that the module's connectors lead to.
#[derive(Clone, PartialEq, Debug)]
pub struct ServoMachine {
    setup: ServoSetup,
    constants: Constants,
    period: Period,
    motion: Motion,
    /// Turns of the shaft.
    position: f64,
    /// Cosine and sine of the rotor's electrical angle, and the steps until they are computed from the position again.
    angle: [f64; 2],
    angle_steps: u8,
    bridge: Bridge,
    bus_v: f64,
    chopper: bool,
    blocked: bool,
    ambient_c: f64,
    winding_c: f64,
    driver_c: f64,
    null: Option<NullLatch>,
}

impl ServoMachine {
    /// A machine at rest at position 0, with everything at 25 degC.
    pub fn new(setup: ServoSetup) -> Self {
        let constants = Constants::new(&setup);
        let mut machine = Self {
            constants,
            period: Period::new(&setup, &constants, 4e-5),
            motion: Motion::default(),
            position: 0.0,
            angle: [1.0, 0.0],
            angle_steps: 0,
            bridge: Bridge::Open,
            bus_v: setup.supply.resting_v(),
            chopper: false,
            blocked: false,
            ambient_c: 25.0,
            winding_c: 25.0,
            driver_c: 25.0,
            null: None,
            setup,
        };
        machine.place(0.0);
        machine
    }

    /// One PWM period.
    #[inline]
    pub fn step(&mut self, seconds: f64, bridge: Bridge) {
        if seconds != self.period.seconds {
            self.period = Period::new(&self.setup, &self.constants, seconds);
        }
        self.bridge = bridge;
        let volts = match bridge {
            Bridge::Duties(duties) => Some(self.driven_volts(duties)),
            Bridge::Open => self.diode_volts(),
        };
        let step = self.forces(volts);
        let before = self.motion;
        let mut after = match self.setup.motor.saturation_a {
            None => self.constants.runge_kutta::<false>(&step, before, seconds),
            Some(_) => self.constants.runge_kutta::<true>(&step, before, seconds),
        };
        if before.speed * after.motion.speed < 0.0 {
            // Friction may hold the shaft from here on: the next step decides.
            after.motion.speed = 0.0;
        }
        if matches!(bridge, Bridge::Open) {
            after.motion = without_reversed_currents(before, after.motion);
        }
        after.motion = self.within_limits(after.motion);
        self.take(before, after);
    }

    #[inline]
    fn within_limits(&self, Motion { d_a, q_a, speed }: Motion) -> Motion {
        let current = |a: f64| a.clamp(-LARGEST_A, LARGEST_A);
        let fastest = FASTEST / self.constants.pole_pairs;
        Motion { d_a: current(d_a), q_a: current(q_a), speed: speed.clamp(-fastest, fastest) }
    }

    /// The end of a step.
    #[inline]
    fn take(&mut self, before: Motion, StepEnd { motion, turned, mean_volts }: StepEnd) {
        let [volts_d, volts_q] = mean_volts;
        let twice_w = volts_d * (before.d_a + motion.d_a) + volts_q * (before.q_a + motion.q_a);
        self.bus_v = self.period.supply.next_v(self.bus_v, 0.5 * self.constants.power * twice_w, self.chopper);
        self.warm_up(motion);
        let turned = turned.clamp(-self.furthest(), self.furthest());
        self.position += turned * (0.5 / std::f64::consts::PI);
        self.motion = motion;
        debug_assert!(self.is_finite(), "{self:?}");
        match self.angle_steps.checked_sub(1) {
            None => self.take_angle(),
            Some(left) => {
                self.angle = turned_back(self.angle, -self.constants.rotation * turned);
                self.angle_steps = left;
            }
        }
    }

    /// The longest way of the shaft in a step, in radians.
    fn furthest(&self) -> f64 {
        FASTEST / self.constants.pole_pairs * self.period.seconds
    }

    /// True if every reading is a number, and within the limits of the machine: always.
    pub fn is_finite(&self) -> bool {
        let Motion { d_a, q_a, speed } = self.motion;
        let fastest = FASTEST / self.constants.pole_pairs;
        d_a.abs().max(q_a.abs()) <= LARGEST_A
            && speed.abs() <= fastest
            && self.position.is_finite()
            && (0.0..=HIGHEST_V).contains(&self.bus_v)
            && self.winding_c <= HOTTEST_WINDING_C
            && self.driver_c <= HOTTEST_DRIVER_C
    }

    /// The angle from the position; what is left of 16 turns by small angles is below 1e-9 at 10000 rpm.
    fn take_angle(&mut self) {
        let (sin, cos) = sin_cos(self.electrical_turns());
        self.angle = [cos, sin];
        self.angle_steps = 15;
    }

    /// Voltage that the bridge gives, in the frame of the rotor.
    #[inline]
    fn driven_volts(&self, [duty_a, duty_b, duty_c]: [f64; 3]) -> [f64; 2] {
        let [a, b, c] = self.phase_currents_a();
        let kept = |duty: f64, current_a: f64| duty - self.period.dead_time * against(current_a);
        let (a, b, c) = (kept(duty_a, a), kept(duty_b, b), kept(duty_c, c));
        if self.setup.motor.phases == Phases::One {
            return [0.0, (a - b) * self.bus_v];
        }
        let (alpha, beta) = ((2.0 * a - b - c) * (1.0 / 3.0), (b - c) * INV_SQRT_3);
        let [cos, sin] = self.angle;
        [(alpha * cos + beta * sin) * self.bus_v, (beta * cos - alpha * sin) * self.bus_v]
    }

    /// Voltage of the diodes: the supply against the currents, or against those that the rotor is about to drive; `None`
    /// when none flow.
    fn diode_volts(&self) -> Option<[f64; 2]> {
        let share = if self.setup.motor.phases == Phases::One { 1.0 } else { INV_SQRT_3 };
        let volts = self.bus_v * share;
        let Motion { d_a, q_a, speed } = self.motion;
        let length = (d_a * d_a + q_a * q_a).sqrt();
        if length > 0.0 {
            return Some([-volts * d_a / length, -volts * q_a / length]);
        }
        let emf_v = self.constants.emf_vs * speed;
        (emf_v.abs() > volts).then_some([0.0, volts.copysign(emf_v)])
    }

    /// What stays in the step that begins now; without volts no current can flow.
    #[inline]
    fn forces(&self, volts: Option<[f64; 2]>) -> Step {
        let constants = &self.constants;
        let mechanics = &self.setup.mechanics;
        let copper_ohm = self.setup.motor.resistance_ohm * (1.0 + COPPER_PER_K * (self.winding_c - 25.0));
        let ohm = copper_ohm + constants.bridge_ohm;
        let volt = |per_inductance: f64| if volts.is_some() { per_inductance } else { 0.0 };
        let (volt_d, volt_q) = (volt(constants.per_inductance_d), volt(constants.per_inductance_q));
        let (friction_nm, held) = self.friction();
        Step {
            volts: volts.unwrap_or([0.0; 2]),
            volt_d,
            volt_q,
            ohm_d: ohm * volt_d,
            ohm_q: ohm * volt_q,
            cross_d: constants.rotation * constants.inductance_q_h * volt_d,
            cross_q: constants.rotation * constants.inductance_d_h * volt_q,
            emf_q: constants.emf_vs * volt_q,
            viscous_nms: mechanics.viscous_nms,
            against_nm: mechanics.load_nm + friction_nm,
            per_inertia: if held { 0.0 } else { constants.per_inertia },
        }
    }

    /// Coulomb friction against the positive direction, and true where it holds the shaft.
    #[inline]
    fn friction(&self) -> (f64, bool) {
        let Mechanics { friction_nm, load_nm, .. } = self.setup.mechanics;
        if self.motion.speed != 0.0 {
            return (friction_nm.copysign(self.motion.speed), false);
        }
        let push_nm = self.torque_nm() - load_nm;
        (friction_nm.copysign(push_nm), self.blocked || push_nm.abs() <= friction_nm)
    }
}

/// Share of the dead time that a phase loses with this current, from -1 to 1.
#[inline]
fn against(current_a: f64) -> f64 {
    (current_a * (1.0 / DEAD_TIME_SOFT_A)).clamp(-1.0, 1.0)
}

/// Diodes let no current through backwards: where it would have turned, it has ended.
fn without_reversed_currents(before: Motion, after: Motion) -> Motion {
    let begins = (before.d_a, before.q_a) == (0.0, 0.0);
    let goes_on = begins || before.d_a * after.d_a + before.q_a * after.q_a > 0.0;
    if goes_on { after } else { Motion { d_a: 0.0, q_a: 0.0, ..after } }
}

/// Kelvin of the winding at the rated current, and its time constant in seconds.
const WINDING_RISE_K: f64 = 80.0;
const WINDING_S: f64 = 900.0;

/// Kelvin a watt of the bridge, and its time constant in seconds.
const DRIVER_K_PER_W: f64 = 12.0;
const DRIVER_S: f64 = 20.0;

/// Temperatures.
impl ServoMachine {
    #[inline]
    fn warm_up(&mut self, now: Motion) {
        let square = now.d_a * now.d_a + now.q_a * now.q_a;
        let winding_c = self.ambient_c + self.period.winding_k_per_a2 * square;
        let driver_c = self.ambient_c + self.period.driver_k_per_a2 * square;
        let winding_c = self.winding_c + (winding_c - self.winding_c) * self.period.winding;
        let driver_c = self.driver_c + (driver_c - self.driver_c) * self.period.driver;
        (self.winding_c, self.driver_c) = (winding_c.min(HOTTEST_WINDING_C), driver_c.min(HOTTEST_DRIVER_C));
    }

    /// Temperature of the winding in degrees Celsius.
    pub fn winding_c(&self) -> f64 {
        self.winding_c
    }

    /// Temperature of the bridge in degrees Celsius.
    pub fn driver_c(&self) -> f64 {
        self.driver_c
    }
}

/// What the module measures.
impl ServoMachine {
    /// Currents into the phases A, B and C, in amperes.
    #[inline]
    pub fn phase_currents_a(&self) -> [f64; 3] {
        let Motion { d_a, q_a, .. } = self.motion;
        if self.setup.motor.phases == Phases::One {
            return [q_a, -q_a, 0.0];
        }
        let [cos, sin] = self.angle;
        let (alpha, beta) = (d_a * cos - q_a * sin, d_a * sin + q_a * cos);
        [alpha, HALF_SQRT_3 * beta - 0.5 * alpha, -HALF_SQRT_3 * beta - 0.5 * alpha]
    }

    /// Hall sensors, bits 0 to 2.
    #[inline]
    pub fn hall_bits(&self) -> u8 {
        self.setup.hall.bits(self.electrical_turns())
    }

    /// Counter of the encoder, wrapping.
    #[inline]
    pub fn encoder_count(&self) -> i32 {
        self.count_from_zero() as i32
    }

    #[inline]
    fn count_from_zero(&self) -> i64 {
        let encoder = &self.setup.encoder;
        let turns = if encoder.reversed { -self.position } else { self.position };
        floor(turns * f64::from(encoder.counts_per_turn))
    }

    /// Channels of the encoder.
    pub fn encoder_channels(&self) -> crate::Channels {
        self.setup.encoder.channels(self.count_from_zero())
    }

    /// What a null event of the encoder is from now on, `None` if nobody asks for one.
    pub fn watch_null(&mut self, event: Option<NullEvent>) {
        self.null = event.map(|event| NullLatch::new(event, self.count_from_zero()));
    }

    /// Counter of the encoder where the latest null event has begun, if there was one since the last call.
    pub fn take_null(&mut self) -> Option<i32> {
        let count = self.count_from_zero();
        self.null.as_mut()?.take(&self.setup.encoder, count).map(|latched| latched as i32)
    }

    /// Voltage at the bridge.
    pub fn supply_v(&self) -> f64 {
        self.bus_v
    }
}

/// What is.
impl ServoMachine {
    /// The data.
    pub fn setup(&self) -> &ServoSetup {
        &self.setup
    }

    /// Changes the data. What moves, moves on.
    pub fn set_up(&mut self, setup: ServoSetup) {
        self.constants = Constants::new(&setup);
        self.period = Period::new(&setup, &self.constants, self.period.seconds);
        self.setup = setup;
    }

    /// Load torque against the positive direction in Nm, like that of a weight.
    pub fn set_load_nm(&mut self, load_nm: f64) {
        self.setup.mechanics.load_nm = load_nm;
    }

    /// Something holds the shaft, or nothing any more.
    pub fn block(&mut self, blocked: bool) {
        self.blocked = blocked;
        if blocked {
            self.motion.speed = 0.0;
        }
    }

    /// True while something holds the shaft.
    pub fn is_blocked(&self) -> bool {
        self.blocked
    }

    /// Voltage of the source and temperature around.
    pub fn surround(&mut self, surroundings: Surroundings) {
        self.setup.supply.source_v = surroundings.supply_v;
        self.period = Period::new(&self.setup, &self.constants, self.period.seconds);
        self.ambient_c = surroundings.temperature_c;
    }

    /// True if nothing would change with the bridge open: no current, no motion, friction bears the load, the supply is
    /// at its voltage and the bridge as warm as its surroundings, by a kelvin. The winding may still be warmer.
    pub fn is_at_rest(&self) -> bool {
        let Motion { d_a, q_a, speed, .. } = self.motion;
        let mechanics = &self.setup.mechanics;
        let bus_v = self.period.supply.next_v(self.bus_v, 0.0, self.chopper);
        (d_a, q_a) == (0.0, 0.0)
            && speed.abs() < SLOWEST
            && (self.blocked || mechanics.load_nm.abs() <= mechanics.friction_nm)
            && (bus_v - self.bus_v).abs() < 1e-4
            && (self.driver_c - self.ambient_c).abs() < 1.0
    }

    /// Warms the bridge, as something else on the board would.
    pub fn heat_driver(&mut self, driver_c: f64) {
        self.driver_c = driver_c.min(HOTTEST_DRIVER_C);
    }

    /// The supply has been away for a while: what braking has left in the capacitor is gone.
    pub fn discharge(&mut self) {
        self.bus_v = self.bus_v.min(self.setup.supply.resting_v());
    }

    /// Switches the brake resistor.
    pub fn switch_chopper(&mut self, on: bool) {
        self.chopper = on;
    }

    /// Turns of the shaft, 0 where it was first.
    pub fn position_turns(&self) -> f64 {
        self.position
    }

    /// Puts the shaft somewhere else, by hand: in turns, at rest and without current.
    pub fn place(&mut self, turns: f64) {
        self.position = turns;
        self.motion = Motion::default();
        self.take_angle();
    }

    /// Speed of the shaft in turns a minute.
    pub fn velocity_rpm(&self) -> f64 {
        self.motion.speed * (30.0 / std::f64::consts::PI)
    }

    /// Angle of the magnet ahead of phase A in electrical turns, from 0 to 1.
    #[inline]
    pub fn electrical_turns(&self) -> f64 {
        let turns = self.position * self.constants.pole_pairs + self.setup.magnet_turns;
        turns - floor(turns) as f64
    }

    /// Currents of flux and torque in amperes, in the frame of the rotor.
    pub fn currents_dq_a(&self) -> [f64; 2] {
        [self.motion.d_a, self.motion.q_a]
    }

    /// What the bridge did in the latest step.
    pub fn bridge(&self) -> Bridge {
        self.bridge
    }

    /// Torque of the motor in Nm, before friction.
    pub fn torque_nm(&self) -> f64 {
        self.constants.torque(self.motion)
    }

    /// Where power goes now.
    pub fn powers(&self) -> Powers {
        let Motion { d_a, q_a, speed } = self.motion;
        let Supply { source_v, resistance_ohm, chopper_ohm, quiescent_a, .. } = self.setup.supply;
        let heat_w = |ohm: f64| self.constants.power * ohm * (d_a * d_a + q_a * q_a);
        let source_a = self.setup.supply.source_a(self.bus_v);
        let mechanics = &self.setup.mechanics;
        let winding_ohm = self.setup.motor.resistance_ohm * (1.0 + COPPER_PER_K * (self.winding_c - 25.0));
        Powers {
            source_w: source_v * source_a,
            cable_w: resistance_ohm * source_a * source_a,
            chopper_w: if self.chopper { self.bus_v * self.bus_v / chopper_ohm } else { 0.0 },
            bridge_w: heat_w(self.constants.bridge_ohm),
            copper_w: heat_w(winding_ohm),
            friction_w: mechanics.viscous_nms * speed * speed + mechanics.friction_nm * speed.abs(),
            load_w: mechanics.load_nm * speed,
            board_w: quiescent_a * self.bus_v,
        }
    }

    /// Energy in the capacitor and in what turns, in joules; that of the inductances is left out.
    pub fn stored_j(&self) -> f64 {
        let speed = self.motion.speed;
        0.5 * self.setup.supply.capacitance_f * self.bus_v * self.bus_v
            + 0.5 * speed * speed / self.constants.per_inertia
    }
}

/// The next whole number below.
#[inline]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from((whole as f64) > x)
}

#[cfg(test)]
mod tests;
