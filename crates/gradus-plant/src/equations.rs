//! The equations of a motor with permanent magnets, in the frame of its rotor, and a step of their solution.
//!
//! A direct-current motor is the same without rotation: its winding is the axis q.

use crate::servo_motors::Phases;
use crate::servo_setup::ServoSetup;

/// What moves: currents in the frame of the rotor in amperes, speed in rad/s. Also their slopes.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) d_a: f64,
    pub(crate) q_a: f64,
    pub(crate) speed: f64,
}

impl Motion {
    #[inline]
    pub(crate) fn plus(self, slope: Self, seconds: f64) -> Self {
        Self {
            d_a: self.d_a + slope.d_a * seconds,
            q_a: self.q_a + slope.q_a * seconds,
            speed: self.speed + slope.speed * seconds,
        }
    }
}

/// What a step needs of the data.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Constants {
    pub(crate) pole_pairs: f64,
    /// 0 without rotation of the frame.
    pub(crate) rotation: f64,
    pub(crate) inductance_d_h: f64,
    pub(crate) inductance_q_h: f64,
    pub(crate) per_inductance_d: f64,
    pub(crate) per_inductance_q: f64,
    pub(crate) per_saturation_a: f64,
    /// Back-EMF in V per rad/s of the shaft.
    pub(crate) emf_vs: f64,
    /// Torque of the currents' own flux: 1.5 pole pairs times the inductances, 0 with one phase.
    pub(crate) own_flux_d: f64,
    pub(crate) own_flux_q: f64,
    pub(crate) torque_nm_per_a: f64,
    pub(crate) per_inertia: f64,
    /// Power of a vector, `v i` times this.
    pub(crate) power: f64,
    /// Resistance of the bridge in a phase, or in the loop with one phase.
    pub(crate) bridge_ohm: f64,
}

impl Constants {
    pub(crate) fn new(setup: &ServoSetup) -> Self {
        let motor = &setup.motor;
        let three = motor.phases == Phases::Three;
        let pole_pairs = f64::from(motor.pole_pairs);
        let power = if three { 1.5 } else { 1.0 };
        let own_flux = if three { 1.5 * pole_pairs } else { 0.0 };
        let bridge_ohm = setup.bridge.switch_ohm * if three { 1.0 } else { 2.0 };
        Self {
            pole_pairs,
            rotation: if three { pole_pairs } else { 0.0 },
            inductance_d_h: motor.inductance_d_h,
            inductance_q_h: motor.inductance_q_h,
            per_inductance_d: 1.0 / motor.inductance_d_h,
            per_inductance_q: 1.0 / motor.inductance_q_h,
            per_saturation_a: motor.saturation_a.map_or(0.0, |current| 1.0 / current),
            emf_vs: if three { motor.torque_nm_per_a / 1.5 } else { motor.torque_nm_per_a },
            own_flux_d: own_flux * motor.inductance_d_h,
            own_flux_q: own_flux * motor.inductance_q_h,
            torque_nm_per_a: motor.torque_nm_per_a,
            per_inertia: 1.0 / (motor.inertia_kgm2 + setup.mechanics.inertia_kgm2),
            power,
            bridge_ohm,
        }
    }

    /// A step of the classical method. The angle, which turns the voltage away, is that of a constant acceleration: in
    /// a period the difference is a part in 10^6 of a radian.
    #[inline]
    pub(crate) fn runge_kutta<const SATURATES: bool>(&self, step: &Step, begin: Motion, whole: f64) -> StepEnd {
        let half = 0.5 * whole;
        let first = self.slope::<SATURATES>(step, step.volts, begin);
        let turned_after = |seconds: f64| self.rotation * seconds * (begin.speed + 0.5 * seconds * first.speed);
        let half_volts = turned_back(step.volts, turned_after(half));
        let end_volts = turned_back(step.volts, turned_after(whole));
        let at_second = begin.plus(first, half);
        let second = self.slope::<SATURATES>(step, half_volts, at_second);
        let at_third = begin.plus(second, half);
        let third = self.slope::<SATURATES>(step, half_volts, at_third);
        let at_fourth = begin.plus(third, whole);
        let fourth = self.slope::<SATURATES>(step, end_volts, at_fourth);
        let sixth = whole * (1.0 / 6.0);
        let slopes = first.plus(fourth, 1.0).plus(second.plus(third, 1.0), 2.0);
        let speeds = begin.speed + at_fourth.speed + 2.0 * (at_second.speed + at_third.speed);
        StepEnd { motion: begin.plus(slopes, sixth), turned: speeds * sixth, mean_volts: half_volts }
    }

    /// The equations of the motor.
    #[inline]
    fn slope<const SATURATES: bool>(&self, step: &Step, [volts_d, volts_q]: [f64; 2], now: Motion) -> Motion {
        let Motion { d_a, q_a, speed } = now;
        let (flux_d, steeper_d) = self.saturated::<SATURATES>(d_a);
        let (flux_q, steeper_q) = self.saturated::<SATURATES>(q_a);
        let torque_nm = self.torque_of(now, flux_d, flux_q);
        Motion {
            d_a: (volts_d * step.volt_d + speed * flux_q * step.cross_d - d_a * step.ohm_d) * steeper_d,
            q_a: (volts_q * step.volt_q - speed * (flux_d * step.cross_q + step.emf_q) - q_a * step.ohm_q) * steeper_q,
            speed: (torque_nm - (step.against_nm + step.viscous_nms * speed)) * step.per_inertia,
        }
    }

    /// The current that would have the same flux without saturation, and how much faster the current changes with it.
    #[inline]
    fn saturated<const SATURATES: bool>(&self, current_a: f64) -> (f64, f64) {
        if !SATURATES {
            return (current_a, 1.0);
        }
        let beyond = 1.0 + current_a.abs() * self.per_saturation_a;
        (current_a / beyond, beyond * beyond)
    }

    /// Torque of the motor in Nm, before friction.
    pub(crate) fn torque(&self, now: Motion) -> f64 {
        let (flux_d, _) = self.saturated::<true>(now.d_a);
        let (flux_q, _) = self.saturated::<true>(now.q_a);
        self.torque_of(now, flux_d, flux_q)
    }

    /// Torque in Nm; `flux_d` and `flux_q` are the currents that stand for the flux.
    #[inline]
    fn torque_of(&self, now: Motion, flux_d: f64, flux_q: f64) -> f64 {
        let own_nm = self.own_flux_d * flux_d * now.q_a - self.own_flux_q * flux_q * now.d_a;
        self.torque_nm_per_a * now.q_a + own_nm
    }
}

/// What stays in a step. Slopes are per second: of currents in A, for a volt or an ampere.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Step {
    /// Voltage in the frame of the rotor at the begin of the step.
    pub(crate) volts: [f64; 2],
    /// Slopes for a volt, for the resistance, for the other axis' current at 1 rad/s, for the back-EMF at 1 rad/s. All
    /// are 0 where no current can flow.
    pub(crate) volt_d: f64,
    pub(crate) volt_q: f64,
    pub(crate) ohm_d: f64,
    pub(crate) ohm_q: f64,
    pub(crate) cross_d: f64,
    pub(crate) cross_q: f64,
    pub(crate) emf_q: f64,
    pub(crate) viscous_nms: f64,
    /// Load and Coulomb friction, against the positive direction.
    pub(crate) against_nm: f64,
    /// 1 / inertia, 0 while friction holds the shaft.
    pub(crate) per_inertia: f64,
}

/// What a step has come to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct StepEnd {
    pub(crate) motion: Motion,
    /// Way of the shaft in radians.
    pub(crate) turned: f64,
    /// The voltage in the middle of the step, in the frame of the rotor there.
    pub(crate) mean_volts: [f64; 2],
}

/// A vector in a frame that has turned on by a small angle: the series up to the fifth power, 1e-8 at a third of a
/// radian.
#[inline]
pub(crate) fn turned_back([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let square = angle * angle;
    let sin = angle * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)));
    let cos = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)));
    [x * cos + y * sin, y * cos - x * sin]
}
