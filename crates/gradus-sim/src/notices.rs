//! What a bench has to say without being asked: why the driver of a servo has been switched off, why a reference search has
//! found no zero.

use std::collections::VecDeque;

use gradus_tmcl::catalogue::Ap;

use crate::{Firmware, ServoDrive};

/// Something worth knowing that has happened by itself.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Notice {
    /// When, in microseconds of virtual time.
    pub at_us: u64,
    /// What, and what to do.
    pub text: String,
}

/// Faults among the flags of axis parameter 156.
const FAULTS: u32 = 0xef;

/// Older notices that nobody has taken are forgotten.
const MOST: usize = 32;

/// The notices of a bench that nobody has taken yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notices {
    /// Faults of the servo when it was looked at last.
    faults: u32,
    waiting: VecDeque<Notice>,
}

impl Notices {
    /// Looks whether the driver of a servo has been switched off, or a reference search has failed.
    #[inline]
    pub(crate) fn look(&mut self, now_us: u64, firmware: &mut Firmware) {
        match firmware {
            Firmware::Servo(_) => self.look_at_drive(now_us, firmware),
            Firmware::Steppers(module) => {
                while let Some((axis, failure)) = module.take_search_failure() {
                    let reason = failure.reason();
                    self.add(now_us, format!("the reference search of axis {axis} has found no zero: {reason}"));
                }
            }
        }
    }

    fn look_at_drive(&mut self, now_us: u64, firmware: &mut Firmware) {
        let faults = faults(firmware);
        let new = faults & !self.faults;
        self.faults = faults;
        if new != 0 {
            for reason in reasons(new, &firmware.machine().servos[0]) {
                self.add(now_us, format!("the drive of axis 0 is off: {reason}"));
            }
        }
    }

    fn add(&mut self, at_us: u64, text: String) {
        if self.waiting.len() == MOST {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Notice { at_us, text });
    }

    /// True if there is nothing to take.
    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    pub(crate) fn take(&mut self) -> Vec<Notice> {
        self.waiting.drain(..).collect()
    }
}

/// What keeps the driver of a servo module off now, with what to do; nothing if it is on.
pub(crate) fn why_off(firmware: &mut Firmware) -> Vec<String> {
    let faults = faults(firmware);
    firmware.machine().servos.first().map_or_else(Vec::new, |drive| reasons(faults, drive))
}

fn faults(firmware: &mut Firmware) -> u32 {
    firmware.get_axis(0, Ap::StatusFlags).unwrap_or(0) as u32 & FAULTS
}

fn reasons(faults: u32, drive: &ServoDrive) -> Vec<String> {
    (0..8).filter(|bit| faults >> bit & 1 == 1).map(|bit| reason(bit, drive)).collect()
}

/// The reason for a flag of axis parameter 156.
fn reason(bit: u32, drive: &ServoDrive) -> String {
    let plant = &drive.plant;
    let (volts, driver_c) = (plant.supply_v(), plant.driver_c());
    match bit {
        0 => "over-current, a phase has had more than 30 A; `SAP 255, 0, 1` switches it on again".to_owned(),
        1 => format!("under-voltage, {volts:.1} V; it may be on again above 9.0 V"),
        2 if plant.setup().supply.takes_back => format!("over-voltage, {volts:.1} V; it may be on again below 31.0 V"),
        2 => format!(
            "over-voltage, {volts:.1} V: braking has charged the capacitor, because the supply takes no energy back. A brake \
             chopper burns it (axis parameters 140 to 144), or brake more slowly (44); it may be on again below 31.0 V"
        ),
        3 => format!("over-temperature, {driver_c:.0} degC; it may be on again below 100 degC"),
        5 => "the hall sensors show a code that does not exist (axis parameter 94); `SAP 255, 0, 1` switches it on again".to_owned(),
        6 => "the gate driver reports a fault; `SAP 255, 0, 1` switches it on again".to_owned(),
        _ => "the initialisation of the encoder has failed: the rotor did not come to rest, or the encoder did not count the \
              quarter of an electrical turn backwards that the field turned it. See encoder steps and direction (axis parameters \
              100, 101), pole pairs (10), open loop current (12) and init delay (104); `SAP 255, 0, 1` tries again"
            .to_owned(),
    }
}
