//! The supply of a servo: a source behind a resistance, a capacitor, and a brake chopper.

/// What feeds the bridge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Supply {
    /// Voltage of the source without load.
    pub source_v: f64,
    /// Resistance of source and cable in ohms, above 0.
    pub resistance_ohm: f64,
    /// Capacitor at the bridge in farads, above 0.
    pub capacitance_f: f64,
    /// The source takes current back, as a battery does. Others do not: while the motor brakes, the voltage rises.
    pub takes_back: bool,
    /// Brake resistor in ohms.
    pub chopper_ohm: f64,
    /// Current in amperes that the board itself takes. After braking it brings the voltage down again.
    pub quiescent_a: f64,
}

/// The bridge's voltage does not rise above this: suppressor diodes take the rest.
pub const HIGHEST_V: f64 = 100.0;

impl Default for Supply {
    /// 24 V behind 0.1 ohm, 1 mF, which takes nothing back, as lab supplies do not; a brake resistor of 10 ohms; 50 mA for
    /// the board.
    fn default() -> Self {
        Self {
            source_v: 24.0,
            resistance_ohm: 0.1,
            capacitance_f: 1e-3,
            takes_back: false,
            chopper_ohm: 10.0,
            quiescent_a: 0.05,
        }
    }
}

impl Supply {
    /// Current out of the source when the bridge has `bus_v`.
    pub(crate) fn source_a(&self, bus_v: f64) -> f64 {
        let current = (self.source_v - bus_v) / self.resistance_ohm;
        if self.takes_back { current } else { current.max(0.0) }
    }

    /// Voltage at the bridge when nothing else takes current.
    pub(crate) fn resting_v(&self) -> f64 {
        (self.source_v - self.quiescent_a * self.resistance_ohm).max(0.0)
    }

    /// What steps of so many seconds need.
    pub(crate) fn gains(&self, seconds: f64) -> SupplyGains {
        let per_farad = seconds / self.capacitance_f;
        let source_s = 1.0 / self.resistance_ohm;
        let share = |siemens: f64| 1.0 / (1.0 + siemens * per_farad);
        let chopper_s = 1.0 / self.chopper_ohm;
        SupplyGains {
            source_v: self.source_v,
            takes_back: self.takes_back,
            lowest_v: (0.1 * self.source_v).max(0.1),
            per_farad,
            quiescent_v: self.quiescent_a * per_farad,
            from_source_v: self.source_v * source_s * per_farad,
            without_source: [1.0, share(chopper_s)],
            with_source: [share(source_s), share(source_s + chopper_s)],
        }
    }
}

/// A [`Supply`] as a step needs it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SupplyGains {
    source_v: f64,
    takes_back: bool,
    /// A bridge that takes all there is cannot take more: its current does not rise below this voltage.
    lowest_v: f64,
    per_farad: f64,
    /// What the board takes from the voltage in a step.
    quiescent_v: f64,
    from_source_v: f64,
    /// What is left of the voltage after a step, without and with the brake resistor.
    without_source: [f64; 2],
    with_source: [f64; 2],
}

impl SupplyGains {
    /// Voltage after a step, in which the bridge took `power_w`. Implicit Euler, so that a small capacitor does not
    /// swing.
    #[inline]
    pub(crate) fn next_v(&self, bus_v: f64, power_w: f64, chopper: bool) -> f64 {
        let bridge_v = power_w / bus_v.max(self.lowest_v) * self.per_farad + self.quiescent_v;
        let alone_v = (bus_v - bridge_v) * self.without_source[usize::from(chopper)];
        if !self.takes_back && alone_v >= self.source_v {
            return alone_v.min(HIGHEST_V);
        }
        ((bus_v + self.from_source_v - bridge_v) * self.with_source[usize::from(chopper)]).clamp(0.0, HIGHEST_V)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Voltage after 100 ms at a power.
    fn settled(supply: &Supply, power_w: f64, chopper: bool) -> f64 {
        let gains = supply.gains(4e-5);
        (0..2_500).fold(supply.source_v, |bus_v, _| gains.next_v(bus_v, power_w, chopper))
    }

    #[test]
    fn board_alone_brings_the_voltage_down_after_braking() {
        let supply = Supply::default();
        let gains = supply.gains(4e-5);
        let mut bus_v = 45.0;
        let steps = (1..).find(|_| {
            bus_v = gains.next_v(bus_v, 0.0, false);
            bus_v < 31.0
        });
        let seconds = f64::from(steps.unwrap()) * 4e-5;
        assert!((seconds - 1e-3 * 14.0 / 0.05).abs() < 1e-3, "{seconds} s at 50 mA");
        assert!((settled(&supply, 0.0, false) - supply.resting_v()).abs() < 1e-9);
    }

    #[test]
    fn voltage_keeps_its_limits_whatever_the_bridge_does() {
        for power_w in [1e12, -1e12] {
            for takes_back in [false, true] {
                let supply = Supply { takes_back, capacitance_f: 1e-5, ..Supply::default() };
                let bus_v = settled(&supply, power_w, false);
                assert!((0.0..=HIGHEST_V).contains(&bus_v), "{bus_v}");
            }
        }
    }

    #[test]
    fn load_lowers_the_voltage_by_the_resistance() {
        let supply = Supply { quiescent_a: 0.0, ..Supply::default() };
        assert_eq!(settled(&supply, 0.0, false), 24.0);
        let bus_v = settled(&supply, 100.0, false);
        assert!((bus_v - (24.0 - 0.1 * 100.0 / bus_v)).abs() < 1e-6, "{bus_v}");
    }

    #[test]
    fn power_from_the_motor_charges_the_capacitor() {
        let supply = Supply { quiescent_a: 0.0, ..Supply::default() };
        let bus_v = settled(&supply, -5.0, false);
        assert!((bus_v - (24.0_f64.powi(2) + 2.0 * 0.5 / 1e-3).sqrt()).abs() < 0.01, "{bus_v}: half a joule");
        assert!((settled(&Supply { takes_back: true, ..supply }, -5.0, false) - 24.02).abs() < 0.01);
    }

    #[test]
    fn chopper_burns_what_comes_back() {
        let bus_v = settled(&Supply { quiescent_a: 0.0, ..Supply::default() }, -90.0, true);
        assert!((bus_v - 30.0).abs() < 0.01, "{bus_v}: 90 W in 10 ohms");
    }
}
