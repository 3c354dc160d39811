//! The two coils of a stepper motor with their inductance: the exact solution for a voltage that stays for a part of a step.
//!
//! Each coil has a bridge of its own, which gives it at most the supply, whatever the other one gets. The chopper gives what
//! makes the wanted current, as far as it can. In an open bridge a current flows through the diodes against the supply until
//! it has ended; a back-EMF above the supply drives one.

use crate::field::{Coil, Drive};

/// Change of a current in a step below which it has settled, in amperes.
const SETTLED_A: f64 = 1e-5;

/// What a part of a step does to a current.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct CoilGains {
    /// What is left of a current without voltage.
    kept: f64,
    /// Amperes that a volt adds, and the reverse.
    siemens: f64,
    ohm: f64,
}

impl CoilGains {
    pub(crate) fn new(resistance_ohm: f64, inductance_h: f64, part_s: f64) -> Self {
        let kept = decay(part_s * resistance_ohm / inductance_h);
        Self { kept, siemens: (1.0 - kept) / resistance_ohm, ohm: resistance_ohm / (1.0 - kept) }
    }

    /// The current after a voltage.
    fn after(&self, amps: f64, volts: f64) -> f64 {
        amps * self.kept + volts * self.siemens
    }
}

/// The currents of the coils.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Coils {
    pub(crate) amps: [f64; 2],
    /// The chopper has made the wanted currents of the latest part.
    pub(crate) obey: bool,
}

impl Coils {
    /// A part of a step with a vector of this sine and cosine, the back-EMF of the coils, and a supply.
    pub(crate) fn pass(
        &mut self,
        gains: &CoilGains,
        drive: Drive,
        (sin, cos): (f64, f64),
        emf: [f64; 2],
        supply_v: f64,
    ) {
        self.obey = false;
        match drive {
            Drive::Open => self.each(|coil, amps| through_diodes(gains, amps, emf[coil], supply_v)),
            Drive::Shorted => self.each(|coil, amps| gains.after(amps, -emf[coil])),
            Drive::Voltage(volts) => {
                let volts = [volts * cos, volts * sin];
                self.each(|coil, amps| gains.after(amps, volts[coil] - emf[coil]));
            }
            Drive::Current(amps) => self.chop(gains, [amps * cos, amps * sin], emf, supply_v),
        }
    }

    fn chop(&mut self, gains: &CoilGains, wanted_a: [f64; 2], emf: [f64; 2], supply_v: f64) {
        let wanted = |coil: usize| emf[coil] + gains.ohm * (wanted_a[coil] - gains.kept * self.amps[coil]);
        let wanted = [wanted(0), wanted(1)];
        self.obey = wanted.iter().all(|volts| volts.abs() <= supply_v);
        self.each(|coil, amps| gains.after(amps, wanted[coil].clamp(-supply_v, supply_v) - emf[coil]));
    }

    fn each(&mut self, after: impl Fn(usize, f64) -> f64) {
        self.amps = [after(0, self.amps[0]), after(1, self.amps[1])];
    }

    /// A coil that is not connected carries nothing.
    pub(crate) fn break_off(&mut self, coil: Option<Coil>) {
        if let Some(coil) = coil {
            self.amps[coil as usize] = 0.0;
            self.obey = false;
        }
    }

    /// True if the currents are nearly those before.
    pub(crate) fn have_settled(&self, before: &[f64; 2]) -> bool {
        self.amps.iter().zip(before).all(|(now, before)| (now - before).abs() < SETTLED_A)
    }
}

/// The current of an open bridge: its diodes let it through in one direction only, against the supply.
fn through_diodes(gains: &CoilGains, amps: f64, emf: f64, supply_v: f64) -> f64 {
    let way = if amps != 0.0 { amps } else { -emf };
    if amps == 0.0 && emf.abs() <= supply_v {
        return 0.0;
    }
    let after = gains.after(amps, -supply_v.copysign(way) - emf);
    if after * way > 0.0 { after } else { 0.0 }
}

/// `exp(-x)` for a positive number, from exactly rounded operations: a rational approximation of 1/256 of it, squared.
fn decay(x: f64) -> f64 {
    let part = x.min(50.0) / 256.0;
    let share = (1.0 - part / 2.0 + part * part / 12.0) / (1.0 + part / 2.0 + part * part / 12.0);
    (0..8).fold(share, |power, _| power * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.83 ohm and 2.2 mH in parts of 20 us.
    fn gains() -> CoilGains {
        CoilGains::new(0.83, 2.2e-3, 20e-6)
    }

    fn run(coils: &mut Coils, parts: u32, drive: Drive, vector: (f64, f64), emf: [f64; 2]) {
        (0..parts).for_each(|_| coils.pass(&gains(), drive, vector, emf, 24.0));
    }

    #[test]
    fn decay_is_an_exponential() {
        for x in [1e-9, 1e-3, 0.1, 1.0, 5.0] {
            assert!((decay(x) / f64::exp(-x) - 1.0).abs() < 1e-7, "{x}");
        }
    }

    #[test]
    fn current_rises_with_the_time_constant_of_the_coil() {
        let mut coils = Coils::default();
        run(&mut coils, 133, Drive::Voltage(0.83), (0.0, 1.0), [0.0; 2]);
        assert!((coils.amps[0] - 0.634).abs() < 1e-3 && coils.amps[1] == 0.0, "{:?}", coils.amps);
    }

    #[test]
    fn each_coil_gets_at_most_the_supply() {
        let mut coils = Coils::default();
        // 4 A at 45 degrees: both coils rise with 24 V, 10.9 A/ms, and then stay.
        run(&mut coils, 10, Drive::Current(4.0), (0.5_f64.sqrt(), 0.5_f64.sqrt()), [0.0; 2]);
        assert!(coils.amps.iter().all(|amps| (amps - 2.1).abs() < 0.05) && !coils.obey, "{coils:?}");
        run(&mut coils, 10, Drive::Current(4.0), (0.5_f64.sqrt(), 0.5_f64.sqrt()), [0.0; 2]);
        assert!(coils.amps.iter().all(|amps| (amps - 8.0_f64.sqrt()).abs() < 1e-9) && coils.obey, "{coils:?}");
    }

    #[test]
    fn open_bridge_ends_a_current_and_conducts_above_the_supply() {
        let mut coils = Coils { amps: [2.0, -1.0], ..Coils::default() };
        run(&mut coils, 12, Drive::Open, (0.0, 1.0), [0.0; 2]);
        assert_eq!(coils.amps, [0.0; 2], "2 A end in 0.18 ms");
        run(&mut coils, 100, Drive::Open, (0.0, 1.0), [23.0, -23.0]);
        assert_eq!(coils.amps, [0.0; 2], "below the supply");
        run(&mut coils, 1_000, Drive::Open, (0.0, 1.0), [26.0, -27.0]);
        assert!((coils.amps[0] + 2.0 / 0.83).abs() < 0.01 && (coils.amps[1] - 3.0 / 0.83).abs() < 0.01, "{coils:?}");
    }
}
