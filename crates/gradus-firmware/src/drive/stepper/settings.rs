//! Axis parameters: what the user has set, and what a tick needs of it.
//!
//! Where the manual is silent: axis parameters 12 and 13 belong to the input that they name. If 33 lets the inputs change
//! places, the right one stops motion to the left with its own enable and level (as `invert_stop_direction` of the TMC4361A does).
//! A value of 0 switches the stop function off and says nothing of the level: that of the latest 1 or 3 holds on for
//! reference searches and WAIT, a high one at first.

use gradus_motion::{Gains, Limits, Profile};
use gradus_tmcl::catalogue::{Ap, Module, MotionChip};

use crate::drive::stepper::search_modes;
use crate::drive::stepper::speed::LowPass;

/// Values of axis parameters, by meaning.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Decides what some of them mean.
    pub(crate) chip: MotionChip,
    values: [i32; Ap::COUNT],
    /// The levels at which the left and the right stop switch are active.
    stop_levels: [bool; 2],
}

impl Settings {
    pub(crate) fn factory(catalogue: &Module) -> Self {
        let mut values = [0; Ap::COUNT];
        // Of a module without these parameters the chopper runs always, and a motor has the usual 200 full steps.
        values[Ap::OffTime as usize] = 1;
        values[Ap::FullStepResolution as usize] = 200;
        for row in catalogue.axis_parameters {
            values[row.id as usize] = row.default.unwrap_or(0) as i32;
        }
        Self { chip: catalogue.chip, values, stop_levels: [true; 2] }
    }

    #[inline]
    pub(crate) fn get(&self, id: Ap) -> i32 {
        self.values[id as usize]
    }

    /// The value, 0 if it is negative.
    pub(crate) fn unsigned(&self, id: Ap) -> u32 {
        self.get(id).max(0) as u32
    }

    pub(crate) fn set(&mut self, id: Ap, value: i32) {
        self.values[id as usize] = value;
        match id {
            Ap::LeftSwitchEnable => self.set_stop_level(0, value),
            Ap::RightSwitchEnable => self.set_stop_level(1, value),
            _ => {}
        }
    }

    fn set_stop_level(&mut self, switch: usize, value: i32) {
        const ENABLED: i32 = 1;
        const ACTIVE_HIGH: i32 = 2;
        if value & ENABLED != 0 {
            self.stop_levels[switch] = value & ACTIVE_HIGH != 0;
        }
    }
}

// What depends on them.
impl Settings {
    /// The ramp per control tick.
    pub(crate) fn profile(&self, tick_hz: u32) -> Profile {
        match self.chip {
            MotionChip::Tmc428 => Profile::Tmc428(self.tmc428_limits().gains(tick_hz)),
            _ => Profile::Physical(self.gains(tick_hz)),
        }
    }

    /// The ramp of the shape that axis parameter 14 selects.
    fn gains(&self, tick_hz: u32) -> Gains {
        const S_SHAPED: i32 = 1;
        let gains = self.limits().gains_in(self.units(), tick_hz);
        if self.get(Ap::RampType) == S_SHAPED { gains.s_shaped(self.bows()) } else { gains }
    }

    /// The four bows in pps^3 (axis parameters 22 to 25, times 35).
    fn bows(&self) -> [u64; 4] {
        let scale = u64::from(self.unsigned(Ap::BowScaling));
        [Ap::Bow1, Ap::Bow2, Ap::Bow3, Ap::Bow4].map(|bow| u64::from(self.unsigned(bow)) * scale)
    }

    /// Limits of the ramp (axis parameters 4, 5 and 15 to 20), in the units of 255.
    fn limits(&self) -> Limits {
        let get = |id| self.unsigned(id);
        Limits {
            max_speed_pps: get(Ap::MaxSpeed),
            acceleration: get(Ap::MaxAcceleration),
            deceleration: get(Ap::MaxDeceleration),
            break_speed_pps: get(Ap::BreakVelocity),
            start_acceleration: get(Ap::StartAcceleration),
            final_deceleration: get(Ap::FinalDeceleration),
            start_speed_pps: get(Ap::StartVelocity),
            stop_speed_pps: get(Ap::StopVelocity),
        }
    }

    /// Microsteps of a turn of the motor (axis parameters 140 and 202).
    pub(crate) fn microsteps_per_turn(&self) -> i64 {
        i64::from(self.get(Ap::FullStepResolution)) << self.resolution()
    }

    /// Above this speed StallGuard2 is valid: one turn a second, or less if axis parameter 181 says so.
    fn stall_valid_pps(&self) -> u32 {
        let turn = u32::try_from(self.microsteps_per_turn()).unwrap_or(u32::MAX);
        match (self.chip, self.unsigned(Ap::StopOnStall)) {
            (MotionChip::Tmc428, _) => u32::MAX,
            (_, 0) => turn,
            (_, stop) => stop.min(turn),
        }
    }

    /// Binary logarithm of the microsteps of a full step (axis parameter 140).
    fn resolution(&self) -> u32 {
        self.get(Ap::MicrostepResolution).clamp(0, 8) as u32
    }

    /// The stop with axis parameter 21; without a deceleration it is a hard one.
    fn linear_stop(&self) -> Stop {
        match self.unsigned(Ap::StopDeceleration) {
            0 => Stop::Hard,
            deceleration => Stop::Linear(deceleration),
        }
    }

    /// How a stop switch stops (axis parameters 34 and 21; 149 of the TMCM-351).
    fn switch_stop(&self) -> Stop {
        match (self.get(Ap::SoftStop), self.chip) {
            (0, _) => Stop::Hard,
            (_, MotionChip::Tmc428) => Stop::Ramp,
            _ => self.linear_stop(),
        }
    }

    /// What stops motion to the left and to the right (axis parameters 13, 12 and 33).
    fn stop_switches(&self) -> [StopSwitch; 2] {
        let [left, right] = match self.chip {
            MotionChip::Tmc428 => [Ap::LeftSwitchDisable, Ap::RightSwitchDisable].map(|id| self.get(id) == 0),
            _ => [Ap::LeftSwitchEnable, Ap::RightSwitchEnable].map(|id| self.get(id) != 0),
        };
        let [left_level, right_level] = self.stop_levels;
        let left = StopSwitch { enabled: left, active_high: left_level };
        let right = StopSwitch { enabled: right, active_high: right_level };
        if self.swaps() { [right, left] } else { [left, right] }
    }

    fn swaps(&self) -> bool {
        self.get(Ap::SwapSwitches) != 0
    }

    pub(crate) fn derive(&self) -> Derived {
        let get = |id| self.get(id);
        let current = |id| get(id).clamp(0, 255) as u8;
        let [stop_left, stop_right] = self.stop_switches();
        Derived {
            phase_shift: 8 - self.resolution(),
            reversed: get(Ap::ReverseShaft) != 0,
            run_current: current(Ap::MaxCurrent),
            boost_current: current(Ap::BoostCurrent),
            standby_current: current(Ap::StandbyCurrent),
            power_down_us: u64::from(self.unsigned(Ap::PowerDownDelay)) * 10_000,
            stop_right,
            stop_left,
            swapped: self.swaps(),
            home_level: search_modes::home_level(self.search_mode()),
            switch_stop: self.switch_stop(),
            virtual_left: (get(Ap::VirtualStopEnable) & 1 != 0).then(|| get(Ap::VirtualStopLeft)),
            virtual_right: (get(Ap::VirtualStopEnable) & 2 != 0).then(|| get(Ap::VirtualStopRight)),
            virtual_stop: match get(Ap::VirtualStopMode) {
                0 => Stop::Ramp,
                1 => Stop::Hard,
                _ => self.linear_stop(),
            },
            max_deviation: self.unsigned(Ap::MaxEncoderDeviation),
            max_speed_deviation_pps: self.unsigned(Ap::MaxSpeedDeviation),
            speed_filter: LowPass::new(
                self.unsigned(Ap::EncoderMeanWait),
                self.unsigned(Ap::EncoderMeanFilter),
                self.unsigned(Ap::EncoderMeanInterval),
            ),
            stall_speed_pps: self.unsigned(Ap::StopOnStall),
            stall_valid_pps: self.stall_valid_pps(),
            stall_load: self.unsigned(Ap::StallDetection),
            mixed_decay_above: get(Ap::MixedDecay),
            reference_tolerance: self.reference_tolerance(),
            full_step_speed: Some(self.unsigned(Ap::FullStepThreshold)).filter(|speed| (1..2048).contains(speed)),
            freewheeling_us: Some(u64::from(self.unsigned(Ap::FreewheelingDelay)) * 1000).filter(|delay| *delay != 0),
        }
    }
}

/// How a motor comes to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Stop {
    /// At once.
    #[default]
    Hard,
    /// With the ramp of the settings.
    Ramp,
    /// With a deceleration of its own.
    Linear(u32),
}

/// What a tick needs of the settings.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Derived {
    /// A microstep is `1 << phase_shift` steps of 1/256 full step.
    pub(crate) phase_shift: u32,
    pub(crate) reversed: bool,
    pub(crate) run_current: u8,
    pub(crate) boost_current: u8,
    pub(crate) standby_current: u8,
    pub(crate) power_down_us: u64,
    pub(crate) stop_right: StopSwitch,
    pub(crate) stop_left: StopSwitch,
    /// The stop switch inputs are exchanged.
    pub(crate) swapped: bool,
    /// The level of an active home switch (axis parameter 193).
    pub(crate) home_level: bool,
    /// How a stop switch stops (axis parameter 34).
    pub(crate) switch_stop: Stop,
    /// Virtual stops, where they are enabled (axis parameters 26 to 29).
    pub(crate) virtual_left: Option<i32>,
    pub(crate) virtual_right: Option<i32>,
    pub(crate) virtual_stop: Stop,
    /// In microsteps, 0 for off (axis parameter 212).
    pub(crate) max_deviation: u32,
    /// 0 for off (axis parameter 213).
    pub(crate) max_speed_deviation_pps: u32,
    /// Averages the measured speed (axis parameters 136 to 138).
    pub(crate) speed_filter: LowPass,
    /// A stall stops the motor above this speed, 0 for off (axis parameter 181).
    pub(crate) stall_speed_pps: u32,
    /// Above this speed a stall is one.
    pub(crate) stall_valid_pps: u32,
    /// A greater load stops the motor, 0 for off (axis parameter 205 of the TMCM-351).
    pub(crate) stall_load: u32,
    /// Above this speed the driver mixes its decay modes (axis parameter 203 of the TMCM-351).
    pub(crate) mixed_decay_above: i32,
    /// The left switch does not stop the motor so near to zero (axis parameter 141 of the TMCM-351).
    pub(crate) reference_tolerance: Option<u32>,
    /// Above this speed the motor goes in full steps (axis parameter 211 of the TMCM-351).
    pub(crate) full_step_speed: Option<u32>,
    /// Rest after which there is no current (axis parameter 204 of the TMCM-351).
    pub(crate) freewheeling_us: Option<u64>,
}

/// A stop switch.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StopSwitch {
    enabled: bool,
    active_high: bool,
}

impl Derived {
    /// True if anything can stop the motor on its way.
    pub(crate) fn has_stops(&self) -> bool {
        let switches = self.stop_left.enabled || self.stop_right.enabled;
        switches || self.virtual_left.is_some() || self.virtual_right.is_some()
    }
}

impl StopSwitch {
    /// True if the switch stops the motor.
    pub(crate) fn blocks(self, level: bool) -> bool {
        self.enabled && self.is_active(level)
    }

    /// As reference searches and WAIT see it, whether it stops the motor or not.
    pub(crate) fn is_active(self, level: bool) -> bool {
        level == self.active_high
    }
}
