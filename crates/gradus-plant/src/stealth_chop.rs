//! StealthChop: the driver chip gives the coils a voltage in place of a current.
//!
//! Without autoscale the voltage is what the settings say for the speed. With it, the chip looks at the current once in a half
//! wave of the coil vector, or after 10 ms without one, and moves the voltage towards what the current lacks in the resistance
//! of the coils: at most by `gradient`, and never above `amplitude`. It begins with none. The current is therefore late where
//! the speed changes, and too small where `amplitude` is.

/// PWM scale at which the RMS voltage is that of the supply (TMC5160: 248/256 of the peak).
const FULL_SCALE: f64 = 374.0;

/// Steps without a half wave after which the current is looked at.
const PATIENCE_STEPS: u8 = 100;

/// Settings of StealthChop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StealthChop {
    /// Speed below which it works.
    pub below: u32,
    /// With autoscale, 1/255 of all voltage by which the amplitude changes in a half wave at most; else what a step frequency
    /// of 62 500 microsteps a second adds to it.
    pub gradient: u8,
    /// With autoscale, the largest amplitude; else that at rest, in 1/255.
    pub amplitude: u8,
    /// The amplitude is regulated to the current that is wanted.
    pub autoscale: bool,
}

/// The amplitude that is regulated.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Amplitude {
    scale: f64,
    half_wave: i32,
    waited: u8,
}

/// What the chip measures.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Measured {
    pub(crate) phase: i32,
    /// Amperes that the current vector lacks.
    pub(crate) lacking_a: f64,
    pub(crate) resistance_ohm: f64,
    pub(crate) supply_v: f64,
}

impl Amplitude {
    /// PWM scale at a speed in microsteps a second.
    pub(crate) fn scale(&self, settings: StealthChop, speed: f64) -> f64 {
        let scale = match settings.autoscale {
            true => self.scale.min(f64::from(settings.amplitude)),
            false => f64::from(settings.amplitude) + f64::from(settings.gradient) * speed / 62_500.0,
        };
        scale.min(255.0)
    }

    /// Looks at a step that has been done.
    pub(crate) fn regulate(&mut self, settings: StealthChop, measured: Measured) {
        self.waited += 1;
        let half_wave = measured.phase >> 9;
        if half_wave == self.half_wave && self.waited < PATIENCE_STEPS {
            return;
        }
        (self.half_wave, self.waited) = (half_wave, 0);
        let lacking_v = measured.lacking_a * measured.resistance_ohm;
        let most = f64::from(settings.gradient);
        let change = (lacking_v / volts(1.0, measured.supply_v)).clamp(-most, most);
        // A chip counts: below half a count there is nothing to do.
        if change.abs() >= 0.5 {
            self.scale = (self.scale + change).clamp(0.0, f64::from(settings.amplitude));
        }
    }
}

/// Length of the voltage vector at a PWM scale.
pub(crate) fn volts(scale: f64, supply_v: f64) -> f64 {
    supply_v.max(0.1) * std::f64::consts::SQRT_2 * scale / FULL_SCALE
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: StealthChop = StealthChop { below: 0, gradient: 4, amplitude: 100, autoscale: true };

    /// Scales after steps with a phase that turns, at 1 ohm and 37.4 V (0.1 V RMS a count).
    fn scales(settings: StealthChop, lacking_a: f64, turns: i32, steps: i32) -> Vec<f64> {
        let mut amplitude = Amplitude::default();
        let scale = |step| {
            let measured = Measured { phase: step * turns, lacking_a, resistance_ohm: 1.0, supply_v: 37.4 };
            amplitude.regulate(settings, measured);
            amplitude.scale(settings, 0.0)
        };
        (1..=steps).map(scale).collect()
    }

    #[test]
    fn amplitude_changes_once_in_a_half_wave_and_at_most_by_the_gradient() {
        let scales = scales(SETTINGS, 3.0, 64, 80);
        let changes: Vec<f64> =
            scales.windows(2).map(|pair| pair[1] - pair[0]).filter(|change| *change > 0.0).collect();
        assert_eq!(changes, [4.0; 10], "80 steps of 64 microsteps are ten half waves");
    }

    #[test]
    fn amplitude_is_limited_and_changes_at_rest_every_10_ms() {
        let scales = scales(SETTINGS, 3.0, 0, 4_000);
        assert_eq!([98, 99, 199, 2_399, 2_499, 3_999].map(|step| scales[step]), [0.0, 4.0, 8.0, 96.0, 100.0, 100.0]);
    }

    #[test]
    fn small_deviations_take_small_steps() {
        let settings = StealthChop { gradient: 15, ..SETTINGS };
        assert!((scales(settings, 1.0, 0, 100)[99] - 10.0 / std::f64::consts::SQRT_2).abs() < 1e-9);
        assert_eq!(scales(settings, 0.05, 0, 1_000)[999], 0.0);
    }
}
