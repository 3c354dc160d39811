//! What switches a servo's driver off, and the way back.
//!
//! The manual names the flags nowhere; their numbers are those of the maker's ROS driver. Where it is silent:
//! - Voltage and temperature have two thresholds each. When the value is beyond the second one again, the flag goes and the driver
//!   may be used. The supply is that of the manual's features, 8 to 28 V, with room for the brake chopper above it.
//! - A phase current of 30 A, beyond any that the regulators may ask for, a fault of the gate driver, and a hall code that does
//!   not exist while hall sensors commutate, are latched: writing 1 to axis parameter 255 clears them. The hall code must
//!   last for a millisecond: edges do not come at the same instant.
//! - Whatever switched the driver off, the motor does not move again by itself.

/// Flags of axis parameter 156.
pub(crate) mod flag {
    pub(crate) const OVER_CURRENT: u32 = 1 << 0;
    pub(crate) const UNDER_VOLTAGE: u32 = 1 << 1;
    pub(crate) const OVER_VOLTAGE: u32 = 1 << 2;
    pub(crate) const OVER_TEMPERATURE: u32 = 1 << 3;
    pub(crate) const MOTOR_HALTED: u32 = 1 << 4;
    pub(crate) const HALL_ERROR: u32 = 1 << 5;
    pub(crate) const DRIVER_ERROR: u32 = 1 << 6;
    pub(crate) const INIT_ERROR: u32 = 1 << 7;
    pub(crate) const STOP_MODE: u32 = 1 << 8;
    pub(crate) const VELOCITY_MODE: u32 = 1 << 9;
    pub(crate) const POSITION_MODE: u32 = 1 << 10;
    pub(crate) const TORQUE_MODE: u32 = 1 << 11;
    pub(crate) const POSITION_END: u32 = 1 << 14;
    pub(crate) const INITIALIZED: u32 = 1 << 15;
}

/// In 0.1 V: at or below the first the driver is off, above the second it may be on again.
const UNDER_VOLTAGE_DV: (i32, i32) = (80, 90);
/// In 0.1 V: at or above the first the driver is off, below the second it may be on again.
const OVER_VOLTAGE_DV: (i32, i32) = (320, 310);
/// In degrees Celsius, as those.
const OVER_TEMPERATURE_C: (i32, i32) = (120, 100);
/// The largest phase current, in mA.
const OVER_CURRENT_MA: i32 = 30_000;

/// What is looked at in every control tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) voltage_dv: i32,
    pub(crate) temperature_c: i32,
    /// Currents of all three phases.
    pub(crate) phases_ma: [i32; 3],
    pub(crate) gate_fault: bool,
    /// The hall sensors commutate, and show a code that does not exist.
    pub(crate) hall_fault: bool,
}

/// The faults of a servo.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Protection {
    flags: u32,
    /// Ticks in a row in which the hall sensors were wrong.
    hall_faults: u32,
}

impl Protection {
    /// The flags of all faults.
    pub(crate) fn flags(&self) -> u32 {
        self.flags
    }

    /// True if the driver may be on.
    #[inline]
    pub(crate) fn allows(&self) -> bool {
        self.flags == 0
    }

    /// Clears what is latched.
    pub(crate) fn clear(&mut self) {
        self.flags &= !(flag::OVER_CURRENT | flag::HALL_ERROR | flag::DRIVER_ERROR | flag::INIT_ERROR);
    }

    /// True when the encoder's initialisation has failed.
    pub(crate) fn has_failed_init(&self) -> bool {
        self.flags & flag::INIT_ERROR != 0
    }

    /// The encoder has not moved as the rotor must have.
    pub(crate) fn fail_init(&mut self) {
        self.flags |= flag::INIT_ERROR;
    }

    /// Looks at everything. `patience` is how many ticks the hall sensors may be wrong.
    #[inline]
    pub(crate) fn watch(&mut self, sight: &Sight, patience: u32) {
        self.hall_faults = if sight.hall_fault { self.hall_faults.saturating_add(1) } else { 0 };
        let (under, back) = UNDER_VOLTAGE_DV;
        self.follow(flag::UNDER_VOLTAGE, sight.voltage_dv <= under, sight.voltage_dv > back);
        let (over, back) = OVER_VOLTAGE_DV;
        self.follow(flag::OVER_VOLTAGE, sight.voltage_dv >= over, sight.voltage_dv < back);
        let (over, back) = OVER_TEMPERATURE_C;
        self.follow(flag::OVER_TEMPERATURE, sight.temperature_c >= over, sight.temperature_c < back);
        self.follow(flag::HALL_ERROR, self.hall_faults > patience, false);
        let too_much = sight.phases_ma.iter().any(|current| current.unsigned_abs() > OVER_CURRENT_MA.unsigned_abs());
        self.follow(flag::OVER_CURRENT, too_much, false);
        self.follow(flag::DRIVER_ERROR, sight.gate_fault, false);
    }

    /// A flag that comes and goes.
    #[inline]
    fn follow(&mut self, flag: u32, comes: bool, goes: bool) {
        if comes {
            self.flags |= flag;
        } else if goes {
            self.flags &= !flag;
        }
    }
}
