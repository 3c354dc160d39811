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
}

impl Default for Supply {
    /// 24 V behind 0.1 ohm, 1 mF, which takes nothing back; a brake resistor of 10 ohms.
    fn default() -> Self {
        Self { source_v: 24.0, resistance_ohm: 0.1, capacitance_f: 1e-3, takes_back: false, chopper_ohm: 10.0 }
    }
}

impl Supply {
    /// Current out of the source when the bridge has `bus_v`.
    #[inline]
    pub(crate) fn source_a(&self, bus_v: f64) -> f64 {
        let current = (self.source_v - bus_v) / self.resistance_ohm;
        if self.takes_back { current } else { current.max(0.0) }
    }

    /// Voltage after `seconds`, during which the bridge took `power_w`. Implicit Euler, so that a small capacitor does
    /// not swing.
    #[inline]
    pub(crate) fn next_v(&self, bus_v: f64, power_w: f64, chopper: bool, seconds: f64) -> f64 {
        // A bridge that takes all there is cannot take more: its current ends at a tenth of the source's voltage.
        let bridge_a = power_w / bus_v.max(0.1 * self.source_v).max(0.1);
        let per_farad = seconds / self.capacitance_f;
        let chopper_s = if chopper { 1.0 / self.chopper_ohm } else { 0.0 };
        let without_source = (bus_v - bridge_a * per_farad) / (1.0 + chopper_s * per_farad);
        if !self.takes_back && without_source >= self.source_v {
            return without_source;
        }
        let source_s = 1.0 / self.resistance_ohm;
        let sum = bus_v + (self.source_v * source_s - bridge_a) * per_farad;
        (sum / (1.0 + (source_s + chopper_s) * per_farad)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Voltage after 100 ms at a power.
    fn settled(supply: &Supply, power_w: f64, chopper: bool) -> f64 {
        (0..2_500).fold(supply.source_v, |bus_v, _| supply.next_v(bus_v, power_w, chopper, 4e-5))
    }

    #[test]
    fn load_lowers_the_voltage_by_the_resistance() {
        let supply = Supply::default();
        assert_eq!(settled(&supply, 0.0, false), 24.0);
        let bus_v = settled(&supply, 100.0, false);
        assert!((bus_v - (24.0 - 0.1 * 100.0 / bus_v)).abs() < 1e-6, "{bus_v}");
    }

    #[test]
    fn power_from_the_motor_charges_the_capacitor() {
        let bus_v = settled(&Supply::default(), -5.0, false);
        assert!((bus_v - (24.0_f64.powi(2) + 2.0 * 0.5 / 1e-3).sqrt()).abs() < 0.01, "{bus_v}: half a joule");
        assert!((settled(&Supply { takes_back: true, ..Supply::default() }, -5.0, false) - 24.02).abs() < 0.01);
    }

    #[test]
    fn chopper_burns_what_comes_back() {
        let bus_v = settled(&Supply::default(), -90.0, true);
        assert!((bus_v - 30.0).abs() < 0.01, "{bus_v}: 90 W in 10 ohms");
    }
}
