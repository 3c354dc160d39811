//! The TMCM-3351: every parameter, port and interrupt, one row each.

use super::Access::{R, Rw, Rwa, Rwe};
use super::Direction::{In, Out};
use super::Unit::*;
use super::Values::{Any, Notes, Only};
use super::commands::modes;
use super::module::{axis_rows, global_rows, interrupt, port};
use super::parameter::{
    AUTO_START, BAUD_RATES, CAN_BIT_RATES, COORDINATE_STORAGE, DOWNLOAD, EDGES, LEVELS, PROTECTION, REPLY, RESTORE,
    RUN_STATES, axis, bits, global, one, span,
};
use super::{
    Ap, AxisParameter, GlobalParameter, Gp, Interrupt, InterruptKind, Model, Module, MotionChip, Port, Values,
};

/// The TMCM-3351.
pub static TMCM_3351: Module = Module {
    model: Model::Tmcm3351,
    name: "TMCM-3351",
    number: 3351,
    version: (1, 11),
    version_text: b"3351V111",
    chip: MotionChip::Tmc4361,
    axes: 3,
    program_len: 6144,
    coordinates: 21,
    least_supply_v: 9,
    tick_us: 100,
    instruction_us: 10,
    axis_parameters: AXIS,
    global_parameters: GLOBAL,
    ports: PORTS,
    interrupts: INTERRUPTS,
    axis_rows: axis_rows(AXIS),
    global_rows: global_rows(GLOBAL),
    modes: modes(Model::Tmcm3351),
};

/// Axis parameters (§4).
#[rustfmt::skip]
const AXIS: &[AxisParameter] = &[
    axis(Ap::TargetPosition, 0, "target position", "APNextPosition", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Where a positioning ramp goes; MVP sets it (§4, §3.6.4)."),
    axis(Ap::ActualPosition, 1, "actual position", "APActualPosition", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Where the ramp generator is; write it only at standstill, to define the origin (§4)."),
    axis(Ap::TargetSpeed, 2, "target speed", "APNextVelocity", -16777215, 16777215, Pps, Some(0), Rw, Any, "Signed speed asked of velocity mode; without meaning while positioning (§4)."),
    axis(Ap::ActualSpeed, 3, "actual speed", "APActualVelocity", -16777215, 16777215, Pps, Some(0), R, Any, "Signed speed of the ramp generator at this moment (§4; read only since firmware 1.11)."),
    axis(Ap::MaxSpeed, 4, "maximum positioning speed", "APMaxPositioningSpeed", 0, 16777215, Pps, Some(51200), Rw, Any, "Cruising speed of a positioning ramp (§4; ERRATA: the printed limit lacks a digit)."),
    axis(Ap::MaxAcceleration, 5, "maximum acceleration", "APMaxAcceleration", 0, 2147483647, PpsPerSecond, Some(51200), Rw, Any, "Rate of speeding up; a trapezoid uses it above the break velocity (§4)."),
    axis(Ap::MaxCurrent, 6, "maximum current", "APMaxCurrent", 0, 255, Plain, Some(128), Rw, Any, "Current while moving, in 1/255 of what the power stage can give (§4, §6.5)."),
    axis(Ap::StandbyCurrent, 7, "standby current", "APStandbyCurrent", 0, 255, Plain, Some(32), Rw, Any, "Current at rest, once the power down delay has passed, scaled as AP 6 (§4)."),
    axis(Ap::PositionReached, 8, "position reached flag", "APTargetPosReached", 0, 1, Plain, None, R, POSITION_REACHED, "1 while the position is the target, or within AP 134 of it in closed loop (§4)."),
    axis(Ap::HomeSwitch, 9, "home switch state", "APRefSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the home switch input (§4)."),
    axis(Ap::RightSwitch, 10, "right limit switch state", "APRightLimitSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the right limit switch input (§4)."),
    axis(Ap::LeftSwitch, 11, "left limit switch state", "APLeftLimitSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the left limit switch input (§4)."),
    axis(Ap::RightSwitchEnable, 12, "right limit switch enable/polarity", "APRightLimitSwitchDisable", 0, 3, Plain, Some(0), Rw, SWITCH_ENABLE, "Whether the right limit switch stops the motor, and at which level (§4)."),
    axis(Ap::LeftSwitchEnable, 13, "left limit switch enable/polarity", "APLeftLimitSwitchDisable", 0, 3, Plain, Some(0), Rw, SWITCH_ENABLE, "Whether the left limit switch stops the motor, and at which level (§4)."),
    axis(Ap::RampType, 14, "ramp type", "APRampType", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "trapezoidal"), one(1, "s-shaped")]), "Shape of the ramp (§4)."),
    axis(Ap::StartVelocity, 15, "start velocity", "APStartVelocity", 0, 16777215, Pps, Some(0), Rw, Any, "Speed with which a ramp begins; an S-shaped one leaves out bow 1 then (§4)."),
    axis(Ap::StartAcceleration, 16, "start acceleration", "APStartAcceleration", 0, 2147483647, PpsPerSecond, Some(0), Rw, Any, "Acceleration of a trapezoid below the break velocity (§4)."),
    axis(Ap::MaxDeceleration, 17, "maximum deceleration", "APMaximumDeceleration", 0, 2147483647, PpsPerSecond, Some(51200), Rw, Any, "Deceleration of a trapezoid above the break velocity (§4)."),
    axis(Ap::BreakVelocity, 18, "break velocity", "APBreakVelocity", 0, 16777215, Pps, Some(0), Rw, Any, "Speed at which a trapezoid changes between its two accelerations (§4; ERRATA: a speed, not an acceleration)."),
    axis(Ap::FinalDeceleration, 19, "final deceleration", "APFinalDeceleration", 0, 2147483647, PpsPerSecond, Some(0), Rw, Any, "Deceleration of a trapezoid below the break velocity (§4)."),
    axis(Ap::StopVelocity, 20, "stop velocity", "APStopVelocity", 0, 16777215, Pps, Some(0), Rw, Any, "Speed with which a trapezoid may end on its target (§4)."),
    axis(Ap::StopDeceleration, 21, "stop deceleration", "APStopDeceleration", 0, 2147483647, PpsPerSecond, Some(0), Rw, Any, "Deceleration at stop switches and virtual stops that stop softly (§4)."),
    axis(Ap::Bow1, 22, "bow 1", "APBow1", 0, 2147483647, PpsPerSecond2, Some(0), Rw, Any, "Jerk at the beginning of speeding up, S-shaped ramp (§4)."),
    axis(Ap::Bow2, 23, "bow 2", "APBow2", 0, 2147483647, PpsPerSecond2, Some(0), Rw, Any, "Jerk at the end of speeding up, S-shaped ramp (§4)."),
    axis(Ap::Bow3, 24, "bow 3", "APBow3", 0, 2147483647, PpsPerSecond2, Some(0), Rw, Any, "Jerk at the beginning of slowing down, S-shaped ramp (§4)."),
    axis(Ap::Bow4, 25, "bow 4", "APBow4", 0, 2147483647, PpsPerSecond2, Some(0), Rw, Any, "Jerk at the end of slowing down, S-shaped ramp (§4)."),
    axis(Ap::VirtualStopLeft, 26, "virtual stop left", "APVirtualStopLeft", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Position that ends travel in negative direction (§4)."),
    axis(Ap::VirtualStopRight, 27, "virtual stop right", "APVirtualStopRight", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Position that ends travel in positive direction (§4)."),
    axis(Ap::VirtualStopEnable, 28, "virtual stop enable", "APVirtualStopEnable", 0, 3, Plain, Some(0), Rw, VIRTUAL_STOP_ENABLE, "Which of the virtual stops act; bit 0 left, bit 1 right (§4)."),
    axis(Ap::VirtualStopMode, 29, "virtual stop mode", "APVirtualStopMode", 0, 2, Plain, Some(0), Rw, VIRTUAL_STOP_MODE, "How a virtual stop brings the motor to rest (§4; ERRATA: writable)."),
    axis(Ap::SwapSwitches, 33, "swap stop switches", "APSwapStopSwitches", 0, 1, Plain, Some(0), Rw, SWAP_SWITCHES, "Lets the two stop switches change places (§4)."),
    axis(Ap::SoftStop, 34, "enable soft stop", "APEnableSoftStop", 0, 1, Plain, Some(0), Rw, SOFT_STOP, "How a stop switch brings the motor to rest (§4)."),
    axis(Ap::BowScaling, 35, "bow scaling factor", "APBowScalingFactor", 1, 255, Plain, Some(1), Rw, Any, "Factor for the four bows, whose products may reach 467.837e9 pps^3 (§4)."),
    axis(Ap::TorqueMode, 50, "torque mode", "APTorqueMode", -255, 255, Plain, Some(0), Rw, Any, "Torque asked of the closed loop; writing begins torque mode, any motion command ends it (§4)."),
    axis(Ap::ClGammaMinSpeed, 108, "CL gamma Vmin", "APCLGammaVmin", 0, 16777215, Pps, Some(300000), Rw, Any, "Speed from which the back-EMF is compensated (§4, §6.3.4)."),
    axis(Ap::ClGammaAddSpeed, 109, "CL gamma Vmax", "APCLGammaVmax", 0, 16777215, Pps, Some(600000), Rw, Any, "Speed above AP 108 at which that compensation is complete (§4, §6.3.4)."),
    axis(Ap::ClGamma, 110, "CL maximum gamma", "APCLMaximumGamma", 0, 255, Plain, Some(255), Rw, Any, "Largest angle added against the back-EMF (§4, §6.3.4)."),
    axis(Ap::ClBeta, 111, "CL beta", "APCLBeta", 0, 511, Plain, Some(255), Rw, Any, "Largest load angle, 255 is 90 degrees (§4, §6.3.2)."),
    axis(Ap::ClOffset, 112, "CL offset", "APCLOffset", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Angle between encoder and rotor, found when closed loop is switched on (§4)."),
    axis(Ap::ClCurrentMin, 113, "CL current minimum", "APCLCurrentMinimum", 0, 255, Plain, Some(100), Rw, Any, "Current scale without load in closed loop (§4, §6.3.3)."),
    axis(Ap::ClCurrentMax, 114, "CL current maximum", "APCLCurrentMaximum", 0, 255, Plain, Some(240), Rw, Any, "Current scale at the largest load angle in closed loop (§4, §6.3.3)."),
    axis(Ap::ClSpeedP, 115, "CL correction velocity P", "APCLCorrectionVelocityP", 0, 16777215, Plain, Some(10000), Rw, Any, "Proportional gain of the regulator that limits the catch-up speed (§4, §6.3.5)."),
    axis(Ap::ClSpeedI, 116, "CL correction velocity I", "APCLCorrectionVelocityI", 0, 16777215, Plain, Some(20), Rw, Any, "Integral gain of the regulator that limits the catch-up speed (§4, §6.3.5)."),
    axis(Ap::ClSpeedIClip, 117, "CL correction velocity I clipping", "APCLCorrectionVelocityIClipping", 0, 32767, Plain, Some(10), Rw, Any, "Limit of that regulator's integral (§4, §6.3.5)."),
    axis(Ap::ClSpeedDClock, 118, "CL correction velocity DV clock", "APCLCorrectionVelocityDVClock", 0, 32767, Plain, Some(0), Rw, Any, "Clock divider of that regulator's differential part (§4, §6.3.5)."),
    axis(Ap::ClSpeedDClip, 119, "CL correction velocity DV clipping", "APCLCorrectionVelocityDVClipping", 0, 2147483647, Plain, Some(1073741823), Rw, Any, "How far catching up may exceed the ramp's top speed (§4, §6.3.5)."),
    axis(Ap::ClUpscaleDelay, 120, "CL upscale delay", "APCLUpscaleDelay", 0, 16777215, Plain, Some(1000), Rw, Any, "Slowness of raising the current in closed loop (§4, §6.3.3)."),
    axis(Ap::ClDownscaleDelay, 121, "CL downscale delay", "APCLDownscaleDelay", 0, 16777215, Plain, Some(10000), Rw, Any, "Slowness of lowering the current in closed loop (§4, §6.3.3)."),
    axis(Ap::ClScaler, 123, "actual scaler value", "APActualScalerValue", 0, 255, Plain, None, R, Any, "Current scale of the closed loop at this moment (§4)."),
    axis(Ap::ClPositionP, 124, "CL correction position P", "APCLCorrectionPositionP", 0, 16777215, Plain, Some(65536), Rw, Any, "Load angle for a position error, in 1/65536 (§4, §6.3.2)."),
    axis(Ap::ClTolerance, 125, "CL max. correction tolerance", "APCLMaxCorrectionTolerance", 0, 255, Plain, Some(100), Rw, Any, "Position error that the load angle control lets pass (§4, §6.3.2)."),
    axis(Ap::ClStartUp, 126, "CL start up", "APCLStartUp", 0, 255, Plain, Some(0), Rw, Any, "Position error up to which the closed loop keeps its smallest current (§4, §6.3.3)."),
    axis(Ap::RelativeOption, 127, "relative positioning option", "APRelativePositioningOption", 0, 2, Plain, Some(0), Rw, RELATIVE_OPTION, "What MVP REL counts from (§4, §3.6.4; ERRATA: three values)."),
    axis(Ap::ClosedLoop, 129, "closed loop mode", "APClosedLoopMode", 0, 3, Plain, Some(0), Rw, CLOSED_LOOP, "Closed loop or one of the PID modes; the motor may move once AP 133 is 1 (§4, §6.3; ERRATA: four values)."),
    axis(Ap::MeasuredSpeed, 131, "measured speed", "APMeasuredSpeed", -2147483648, 2147483647, Pps, None, R, Any, "Speed of the encoder, averaged (§4)."),
    axis(Ap::MeasuredSpeedNow, 132, "current measured speed", "APCurrentMeasuredSpeed", -2147483648, 2147483647, Pps, None, R, Any, "Speed of the encoder as measured last (§4)."),
    axis(Ap::ClInitialized, 133, "closed loop init flag", "APClosedLoopInitFlag", 0, 1, Plain, None, R, CL_INITIALIZED, "1 when closed loop is ready to move (§4, §6.3)."),
    axis(Ap::PositioningWindow, 134, "positioning window", "APPositioningWindow", 0, 2147483647, Microsteps, Some(100), Rw, Any, "Distance from the target that counts as reached (§4, §6.3.3)."),
    axis(Ap::EncoderMeanWait, 136, "EncMeanWait", "APEncMeanWait", 0, 255, Plain, Some(0), Rw, Any, "Waiting time of the encoder speed filter (§4; ERRATA: range)."),
    axis(Ap::EncoderMeanFilter, 137, "EncMeanFilter", "APEncMeanFilter", 0, 15, Plain, Some(7), Rw, Any, "Exponent of the encoder speed filter (§4; ERRATA: range)."),
    axis(Ap::EncoderMeanInterval, 138, "EncMeanInt", "APEncMeanInt", 0, 65535, Plain, Some(500), Rw, Any, "Interval of the encoder speed filter (§4; ERRATA: range)."),
    axis(Ap::MicrostepResolution, 140, "microstep resolution", "APMicrostepResolution", 0, 8, Plain, Some(8), Rw, MICROSTEP_RESOLUTION, "Microsteps in a full step; closed loop needs 256 (§4, §6.6)."),
    axis(Ap::EncoderSampleRate, 150, "encoder input sample rate", "APEncoderInputSampleRate", 0, 7, Plain, Some(0), Rw, Any, "Sampling rate of the encoder inputs' filter (PyTrinamic; not in the manual)."),
    axis(Ap::EncoderFilterLength, 151, "encoder input filter length", "APEncoderInputFilterLength", 0, 7, Plain, Some(0), Rw, Any, "Length of the encoder inputs' filter (PyTrinamic; not in the manual)."),
    axis(Ap::BlankTime, 162, "chopper blank time", "APChopperBlankTime", 0, 3, Plain, Some(2), Rw, Any, "Time that the current comparator is blind after switching (§4)."),
    axis(Ap::ConstantTOff, 163, "constant TOff mode", "APConstantTOffMode", 0, 1, Plain, Some(0), Rw, CONSTANT_T_OFF, "Kind of chopper (§4)."),
    axis(Ap::FastDecayComparatorOff, 164, "disable fast decay comparator", "APDisableFastDecayComparator", 0, 1, Plain, Some(0), Rw, FAST_DECAY_COMPARATOR_OFF, "Keeps the comparator from ending fast decay, constant off time chopper (§4)."),
    axis(Ap::HysteresisEnd, 165, "chopper hysteresis end / fast decay time", "APChopperHysteresisEndFastDecayTime", 0, 15, Plain, Some(4), Rw, Any, "Hysteresis end of spread cycle, or fast decay time with constant off time (§4)."),
    axis(Ap::HysteresisStart, 166, "chopper hysteresis start / sine wave offset", "APChopperHysteresisStartSineWaveOffset", 0, 8, Plain, Some(5), Rw, Any, "Hysteresis start of spread cycle, or sine wave offset with constant off time (§4)."),
    axis(Ap::OffTime, 167, "chopper off time", "APChopperOffTime", 0, 15, Plain, Some(3), Rw, Any, "Off time of the chopper, 12 + 32 n clocks; 0 switches the power stage off (§4)."),
    axis(Ap::CoolStepMin, 168, "smartEnergy current minimum", "APSmartEnergyCurrentMinimum", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "1/2 of CS"), one(1, "1/4 of CS")]), "Least current that CoolStep goes down to (§4, §6.5)."),
    axis(Ap::CoolStepDown, 169, "smartEnergy current down step", "APSmartEnergyCurrentDownStep", 0, 3, Plain, Some(0), Rw, Only(&[one(0, "32"), one(1, "8"), one(2, "2"), one(3, "1")]), "StallGuard2 readings above the threshold before CoolStep lowers the current (§4, §6.5)."),
    axis(Ap::CoolStepHysteresis, 170, "smartEnergy hysteresis", "APSmartEnergyHysteresis", 0, 15, Plain, Some(0), Rw, Any, "Width of the StallGuard2 band that CoolStep keeps, (n + 1) * 32 (§4, §6.5; ERRATA: formula)."),
    axis(Ap::CoolStepUp, 171, "smartEnergy current up step", "APSmartEnergyCurrentUpStep", 0, 3, Plain, Some(0), Rw, Only(&[one(0, "1"), one(1, "2"), one(2, "4"), one(3, "8")]), "Steps in which CoolStep raises the current (§4, §6.5)."),
    axis(Ap::CoolStepStart, 172, "smartEnergy hysteresis start", "APSmartEnergyHysteresisStart", 0, 15, Plain, Some(0), Rw, Any, "Lower edge of CoolStep's StallGuard2 band, n * 32; 0 switches CoolStep off (§4, §6.5)."),
    axis(Ap::StallFilter, 173, "stallGuard2 filter enable", "APStallGuard2FilterEnable", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "standard mode"), one(1, "filtered mode")]), "Averages StallGuard2 over four full steps (§4, §6.4)."),
    axis(Ap::StallThreshold, 174, "stallGuard2 threshold", "APStallGuard2Threshold", -64, 63, Plain, Some(0), Rw, Any, "Sensitivity of StallGuard2; less means more sensitive (§4, §6.4)."),
    axis(Ap::ShortProtectionOff, 177, "short to ground protection", "APShortToGroundProtection", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "protection on"), one(1, "protection off")]), "Shut-down of the driver at a short to ground (PyTrinamic; not in the manual)."),
    axis(Ap::VSense, 179, "VSense", "APVSense", 0, 1, Plain, Some(1), Rw, Only(&[one(0, "full scale"), one(1, "high sensitivity")]), "Voltage range of the sense resistors (PyTrinamic; not in the manual)."),
    axis(Ap::CoolStepCurrent, 180, "smartEnergy actual current", "APSmartEnergyActualCurrent", 0, 31, Plain, None, R, Any, "Current that CoolStep gives now, (n + 1)/32 (§4)."),
    axis(Ap::StopOnStall, 181, "stop on stall", "APStopOnStall", 0, 2147483647, Pps, Some(0), Rw, Any, "Speed from which a stall stops the motor; 0 never (§4, §6.4)."),
    axis(Ap::CoolStepSpeed, 182, "smartEnergy threshold speed", "APSmartEnergyThresholdSpeed", 0, 2147483647, Pps, Some(16777215), Rw, Any, "Speed from which CoolStep acts (§4, §6.5)."),
    axis(Ap::RandomOffTime, 184, "random TOff mode", "APRandomTOffMode", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "off time fixed"), one(1, "off time random")]), "Varies the off time of the chopper by chance (§4)."),
    axis(Ap::ChopperSync, 185, "chopper synchronization", "APChopperSynchronization", 0, 15, Plain, Some(0), Rw, CHOPPER_SYNC, "Locks the choppers of the two coils together (§4)."),
    axis(Ap::PwmThresholdSpeed, 186, "PWM threshold speed", "APPWMThresholdSpeed", 0, 2147483647, Pps, Some(16777215), Rw, Any, "Speed up to which StealthChop is used (§4)."),
    axis(Ap::PwmGradient, 187, "PWM gradient", "APPWMGradient", 0, 15, Plain, Some(0), Rw, Only(&[one(0, "StealthChop off"), span(1, 15, "gradient")]), "Rise of the StealthChop amplitude with speed; 0 switches StealthChop off (§4)."),
    axis(Ap::PwmAmplitude, 188, "PWM amplitude", "APPWMAmplitude", 0, 255, Plain, Some(128), Rw, Any, "StealthChop amplitude to begin with, best above 64 (§4)."),
    axis(Ap::PwmScale, 189, "PWM scale", "APPWMScale", 0, 255, Plain, None, R, Any, "StealthChop amplitude at this moment, 255 is the full supply voltage (§4)."),
    axis(Ap::PwmMode, 190, "PWM mode", "APPWMMode", 0, 1, Plain, None, R, PWM_MODE, "1 while StealthChop is used (§4)."),
    axis(Ap::PwmFrequency, 191, "PWM frequency", "APPWMFrequency", 0, 3, Plain, Some(0), Rw, PWM_FREQUENCY, "Frequency of StealthChop (§4)."),
    axis(Ap::PwmAutoscale, 192, "PWM autoscale", "APPWMAutoscale", 0, 1, Plain, Some(1), Rw, PWM_AUTOSCALE, "Lets StealthChop set its amplitude by the current (§4)."),
    axis(Ap::ReferenceSearchMode, 193, "reference search mode", "APRefSearchMode", 1, 136, Plain, Some(1), Rw, REFERENCE_SEARCH_MODE, "Which switches a reference search looks for, and how (§4, §6.1; ERRATA: 64 or 128 may be added)."),
    axis(Ap::ReferenceSearchSpeed, 194, "reference search speed", "APRefSearchSpeed", 0, 16777215, Pps, Some(25600), Rw, Any, "Speed of looking for a switch (§4, §6.1)."),
    axis(Ap::ReferenceSwitchSpeed, 195, "reference switch speed", "APRefSwitchSpeed", 0, 16777215, Pps, Some(5120), Rw, Any, "Speed of finding the switching point, below AP 194 (§4, §6.1)."),
    axis(Ap::EndSwitchDistance, 196, "end switch distance", "APEndSwitchDistance", -2147483648, 2147483647, Microsteps, Some(0), R, Any, "Distance between the end switches, measured by search modes 2 and 3 (§4, §6.1)."),
    axis(Ap::LastReferencePosition, 197, "last reference position", "APLastReferencePosition", -2147483648, 2147483647, Microsteps, Some(0), R, Any, "Position that a reference search replaced by zero (§4)."),
    axis(Ap::LatchedPosition, 198, "latched actual position", "APLatchedActualPosition", -2147483648, 2147483647, Microsteps, Some(0), R, Any, "Position at the last encoder index (§4)."),
    axis(Ap::LatchedEncoderPosition, 199, "latched encoder position", "APLatchedEncoderPosition", -2147483648, 2147483647, Microsteps, Some(0), R, Any, "Encoder position at the last encoder index (§4)."),
    axis(Ap::BoostCurrent, 200, "boost current", "APBoostCurrent", 0, 255, Plain, Some(0), Rw, Notes(&[one(0, "use AP 6")]), "Current while the speed changes, scaled as AP 6; 0 takes AP 6 (§4)."),
    axis(Ap::EncoderMode, 201, "encoder mode", "APEncoderMode", 0, 511, Plain, Some(0), Rw, ENCODER_MODE, "What makes an index event of the encoder, and what it does (§4)."),
    axis(Ap::FullStepResolution, 202, "motor full step resolution", "APMotorFullStepResolution", 0, 65535, FullStepsPerTurn, Some(200), Rw, Any, "Full steps in a turn of the motor (§4, §6.2)."),
    axis(Ap::FreewheelingMode, 204, "freewheeling mode", "APFreeWheeling", 0, 3, Plain, Some(0), Rw, FREEWHEELING_MODE, "State of the coils at rest when the standby current is 0 (§4)."),
    axis(Ap::LoadValue, 206, "actual load value", "APActualStallguardValue", 0, 1023, Plain, None, R, Any, "StallGuard2 reading, 0 at the highest load (§4, §6.4)."),
    axis(Ap::ExtendedErrorFlags, 207, "extended error flags", "APExtendedErrorFlags", 0, 3, Plain, Some(0), R, EXTENDED_ERROR_FLAGS, "What stopped the motor, and 4 for a reference search that has failed (not in the manual); cleared by reading and by the next motion command (§4)."),
    axis(Ap::DriverErrorFlags, 208, "motor driver error flags", "APDriverErrorFlags", 0, 255, Plain, None, R, DRIVER_ERROR_FLAGS, "Flags of the driver chip (§4)."),
    axis(Ap::EncoderPosition, 209, "encoder position", "APEncoderPosition", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Position of the encoder in microsteps; a reference search sets it to zero (§4, §6.2)."),
    axis(Ap::EncoderResolution, 210, "encoder resolution", "APEncoderPredivAndFlags", -65535, 65535, CountsPerTurn, Some(4096), Rw, Any, "Counts in a turn of the encoder; a negative number reverses it (§4, §6.2)."),
    axis(Ap::MaxEncoderDeviation, 212, "maximum encoder deviation", "APMaxEncoderDeviation", 0, 2147483647, EncoderSteps, Some(0), Rw, Notes(&[one(0, "function off")]), "Distance between AP 1 and AP 209 that stops the motor (§4, §6.2; ERRATA: compared in microsteps)."),
    axis(Ap::MaxSpeedDeviation, 213, "maximum velocity deviation", "APMaximumVelocityDeviation", 0, 2147483647, Pps, Some(0), Rw, Notes(&[one(0, "function off")]), "Difference between asked and measured speed that stops the motor (§4; ERRATA: unit)."),
    axis(Ap::PowerDownDelay, 214, "power down delay", "APPowerDownDelay", 0, 65535, TenMs, Some(200), Rw, Any, "Rest before the current falls to standby (§4)."),
    axis(Ap::GroupIndex, 249, "group index", "APGroupIndex", 0, 255, Plain, Some(0), Rw, Notes(&[one(0, "off")]), "Axes with the same number obey ROL, ROR, MST, MVP and RFS together (§4)."),
    axis(Ap::ReverseShaft, 251, "reverse shaft", "APReverseShaft", 0, 1, Plain, Some(0), Rw, Only(&[one(0, "normal"), one(1, "reversed")]), "Turns the motor the other way; AP 210 turns the encoder (§4)."),
    axis(Ap::UnitMode, 255, "unit mode", "APUnitMode", 0, 1, Plain, Some(1), Rw, UNIT_MODE, "Unit of speeds and accelerations (§6.6)."),
];

/// Global parameters of banks 0, 2 and 3 (§5).
#[rustfmt::skip]
const GLOBAL: &[GlobalParameter] = &[
    global(Gp::SerialBaudRate, 0, 65, 65, "RS232 and RS485 baud rate", "GPSerialBaudRate", 0, 11, Some(0), Rwa, BAUD_RATES, "Speed of RS232 and RS485 from the next start on (§5.1)."),
    global(Gp::SerialAddress, 0, 66, 66, "serial address", "GPSerialAddress", 1, 255, Some(1), Rwa, Any, "Address of the module on a serial bus (§5.1)."),
    global(Gp::SerialHeartbeat, 0, 68, 68, "serial heartbeat", "GPSerialHeartbeat", 0, 65535, Some(0), Rwa, Notes(&[one(0, "off")]), "Longest silence of the host in ms before the motors stop, on serial links and USB (§5.1)."),
    global(Gp::CanBitRate, 0, 69, 69, "CAN bit rate", "GPCANBitRate", 2, 8, Some(8), Rwa, CAN_BIT_RATES, "Speed of the CAN bus from the next start on (§5.1)."),
    global(Gp::CanReplyId, 0, 70, 70, "CAN reply ID", "GPCANReplyID", 0, 2047, Some(2), Rwa, Any, "CAN identifier of replies (§5.1)."),
    global(Gp::CanId, 0, 71, 71, "CAN ID", "GPCANID", 0, 2047, Some(1), Rwa, Any, "CAN identifier that the module obeys (§5.1)."),
    global(Gp::TelegramPause, 0, 75, 75, "telegram pause time", "GPTelegramPauseTime", 0, 255, Some(0), Rwa, Any, "Time in ms that a serial reply is held back (§5.1)."),
    global(Gp::HostAddress, 0, 76, 76, "serial host address", "GPSerialHostAddress", 0, 255, Some(2), Rwa, Any, "Address of the host, which begins a serial reply (§5.1)."),
    global(Gp::AutoStart, 0, 77, 77, "auto start mode", "GPAutoStartMode", 0, 1, Some(0), Rwa, AUTO_START, "Whether the program starts by itself (§5.1)."),
    global(Gp::CodeProtection, 0, 81, 81, "TMCL code protection", "GPTMCLCodeProtection", 0, 3, Some(0), Rwa, PROTECTION, "Hides the program or keeps it; giving up bit 0 erases it (§5.1)."),
    global(Gp::CanHeartbeat, 0, 82, 82, "CAN heartbeat", "GPCANHeartbeat", 0, 65535, Some(0), Rwa, Notes(&[one(0, "off")]), "Longest silence of the host in ms before the motors stop, on CAN (§5.1)."),
    global(Gp::CanSecondaryId, 0, 83, 83, "CAN secondary address", "GPCANSecondaryAddress", 0, 2047, Some(0), Rwa, Notes(&[one(0, "off")]), "Another CAN identifier that the module obeys (§5.1)."),
    global(Gp::CoordinateStorage, 0, 84, 84, "coordinate storage", "GPCoordinateStorage", 0, 1, Some(0), Rwa, COORDINATE_STORAGE, "Whether coordinates live through a power cycle (§5.1)."),
    global(Gp::UserVariablesNotRestored, 0, 85, 85, "do not restore user variables", "GPDoNotRestoreUserVariables", 0, 1, Some(0), Rwa, RESTORE, "Whether user variables begin as stored or as zero (§5.1)."),
    global(Gp::SerialSecondaryAddress, 0, 87, 87, "serial secondary address", "GPSerialSecondaryAddress", 0, 255, Some(0), Rwa, Notes(&[one(0, "off")]), "Another address of the module on a serial bus (§5.1)."),
    global(Gp::ApplicationStatus, 0, 128, 128, "TMCL application status", "GPTMCLApplicationStatus", 0, 3, Some(0), R, RUN_STATES, "What the program does (§5.1)."),
    global(Gp::DownloadMode, 0, 129, 129, "download mode", "GPDownloadMode", 0, 1, Some(0), R, DOWNLOAD, "1 while commands are stored instead of executed (§5.1)."),
    global(Gp::ProgramCounter, 0, 130, 130, "TMCL program counter", "GPTMCLProgramCounter", 0, 6143, Some(0), R, Any, "Address of the command that runs or would run next (§5.1)."),
    global(Gp::LastError, 0, 131, 131, "last TMCL error", "GPLastTMCLError", 0, 2147483647, Some(0), R, Any, "Latest failure of the program: status << 16 | address; 0 if none (not in the manual)."),
    global(Gp::TickTimer, 0, 132, 132, "TMCL tick timer", "GPTickTimer", 0, 2147483647, Some(0), Rw, Any, "Milliseconds since the start (§5.1)."),
    global(Gp::RandomNumber, 0, 133, 133, "random number", "GPRandomNumber", 0, 2147483647, None, Rw, Any, "A different number each time; writing sets the seed (§5.1)."),
    global(Gp::SuppressReply, 0, 255, 255, "suppress reply", "GPSuppressReply", 0, 1, Some(0), Rw, REPLY, "Lets only GAP, GGP and GIO be answered; not stored (§5.1)."),
    global(Gp::UserVariable, 2, 0, 55, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rwe, Any, "Variable of programs, which STGP stores (§5.3)."),
    global(Gp::UserVariable, 2, 56, 255, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rw, Any, "Variable of programs, lost at power-off (§5.3)."),
    global(Gp::TimerPeriod, 3, 0, 0, "timer 0 period", "GPTimer0Period", 0, 4294967295, Some(0), Rw, Any, "Period of interrupt 0 in ms, unsigned (§5.4)."),
    global(Gp::TimerPeriod, 3, 1, 1, "timer 1 period", "GPTimer1Period", 0, 4294967295, Some(0), Rw, Any, "Period of interrupt 1 in ms, unsigned (§5.4)."),
    global(Gp::TimerPeriod, 3, 2, 2, "timer 2 period", "GPTimer2Period", 0, 4294967295, Some(0), Rw, Any, "Period of interrupt 2 in ms, unsigned (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 27, 27, "stop left 0 trigger transition", "GPStopLeft0Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 27 (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 28, 28, "stop right 0 trigger transition", "GPStopRight0Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 28 (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 29, 29, "stop left 1 trigger transition", "GPStopLeft1Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 29 (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 30, 30, "stop right 1 trigger transition", "GPStopRight1Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 30 (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 31, 31, "stop left 2 trigger transition", "GPStopLeft2Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 31 (§5.4)."),
    global(Gp::StopSwitchEdge, 3, 32, 32, "stop right 2 trigger transition", "GPStopRight2Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 32 (§5.4)."),
    global(Gp::InputEdge, 3, 39, 39, "input 0 trigger transition", "GPInput0Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 39 (§5.4)."),
    global(Gp::InputEdge, 3, 40, 40, "input 1 trigger transition", "GPInput1Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 40 (§5.4)."),
    global(Gp::InputEdge, 3, 41, 41, "input 2 trigger transition", "GPInput2Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 41 (§5.4)."),
    global(Gp::InputEdge, 3, 42, 42, "input 3 trigger transition", "GPInput3Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 42 (§5.4)."),
    global(Gp::InputEdge, 3, 43, 43, "input 4 trigger transition", "GPInput4Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 43 (§5.4)."),
    global(Gp::InputEdge, 3, 44, 44, "input 5 trigger transition", "GPInput5Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 44 (§5.4)."),
    global(Gp::InputEdge, 3, 45, 45, "input 6 trigger transition", "GPInput6Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 45 (§5.4)."),
    global(Gp::InputEdge, 3, 46, 46, "input 7 trigger transition", "GPInput7Transition", 0, 3, Some(0), Rw, EDGES, "Which edges raise interrupt 46 (§5.4)."),
];

/// Digital and analogue ports (§3.6.12, §3.6.13).
#[rustfmt::skip]
const PORTS: &[Port] = &[
    port(0, 0, "IN0", In, Some((0, 1))),
    port(0, 1, "IN1", In, Some((0, 1))),
    port(0, 2, "IN2", In, Some((0, 1))),
    port(0, 3, "IN3", In, Some((0, 1))),
    port(0, 4, "IN4", In, Some((0, 1))),
    port(0, 5, "IN5", In, Some((0, 1))),
    port(0, 6, "IN6", In, Some((0, 1))),
    port(0, 7, "IN7", In, Some((0, 1))),
    port(0, 8, "ADC range ANA0...ANA3", Out, Some((0, 1))),
    port(0, 10, "ENABLE", In, Some((0, 1))),
    port(0, 255, "all inputs", In, Some((0, 255))),
    port(1, 0, "ANA0", In, Some((0, 1023))),
    port(1, 1, "ANA1", In, Some((0, 1023))),
    port(1, 2, "ANA2", In, Some((0, 1023))),
    port(1, 3, "ANA3", In, Some((0, 1023))),
    port(1, 4, "supply voltage (ADC value)", In, Some((0, 1023))),
    port(1, 5, "temperature (ADC value)", In, Some((0, 1023))),
    port(1, 6, "IN6", In, Some((0, 1023))),
    port(1, 7, "IN7", In, Some((0, 1023))),
    port(1, 8, "supply voltage", In, None),
    port(1, 9, "temperature", In, None),
    port(2, 0, "OUT0", Out, Some((0, 1))),
    port(2, 1, "OUT1", Out, Some((0, 1))),
    port(2, 2, "OUT2", Out, Some((0, 1))),
    port(2, 3, "OUT3", Out, Some((0, 1))),
    port(2, 4, "OUT4", Out, Some((0, 1))),
    port(2, 5, "OUT5", Out, Some((0, 1))),
    port(2, 6, "OUT6", Out, Some((0, 1))),
    port(2, 7, "OUT7", Out, Some((0, 1))),
    port(2, 255, "all outputs", Out, Some((-1, 255))),
];

/// Interrupts (§3.5.6.1), also those of the TMCM-351.
#[rustfmt::skip]
pub(super) const INTERRUPTS: &[Interrupt] = &[
    interrupt(0, "timer 0", "TI_TIMER0", InterruptKind::Timer, 0),
    interrupt(1, "timer 1", "TI_TIMER1", InterruptKind::Timer, 1),
    interrupt(2, "timer 2", "TI_TIMER2", InterruptKind::Timer, 2),
    interrupt(3, "target position reached 0", "TI_POSITION0", InterruptKind::Position, 0),
    interrupt(4, "target position reached 1", "TI_POSITION1", InterruptKind::Position, 1),
    interrupt(5, "target position reached 2", "TI_POSITION2", InterruptKind::Position, 2),
    interrupt(15, "stallGuard axis 0", "TI_STALL0", InterruptKind::Stall, 0),
    interrupt(16, "stallGuard axis 1", "TI_STALL1", InterruptKind::Stall, 1),
    interrupt(17, "stallGuard axis 2", "TI_STALL2", InterruptKind::Stall, 2),
    interrupt(21, "deviation axis 0", "TI_DEVIATION0", InterruptKind::Deviation, 0),
    interrupt(22, "deviation axis 1", "TI_DEVIATION1", InterruptKind::Deviation, 1),
    interrupt(23, "deviation axis 2", "TI_DEVIATION2", InterruptKind::Deviation, 2),
    interrupt(27, "left stop switch 0", "TI_STOPLEFT0", InterruptKind::StopSwitch, 0),
    interrupt(28, "right stop switch 0", "TI_STOPRIGHT0", InterruptKind::StopSwitch, 1),
    interrupt(29, "left stop switch 1", "TI_STOPLEFT1", InterruptKind::StopSwitch, 2),
    interrupt(30, "right stop switch 1", "TI_STOPRIGHT1", InterruptKind::StopSwitch, 3),
    interrupt(31, "left stop switch 2", "TI_STOPLEFT2", InterruptKind::StopSwitch, 4),
    interrupt(32, "right stop switch 2", "TI_STOPRIGHT2", InterruptKind::StopSwitch, 5),
    interrupt(39, "input change 0", "TI_INPUT0", InterruptKind::Input, 0),
    interrupt(40, "input change 1", "TI_INPUT1", InterruptKind::Input, 1),
    interrupt(41, "input change 2", "TI_INPUT2", InterruptKind::Input, 2),
    interrupt(42, "input change 3", "TI_INPUT3", InterruptKind::Input, 3),
    interrupt(43, "input change 4", "TI_INPUT4", InterruptKind::Input, 4),
    interrupt(44, "input change 5", "TI_INPUT5", InterruptKind::Input, 5),
    interrupt(45, "input change 6", "TI_INPUT6", InterruptKind::Input, 6),
    interrupt(46, "input change 7", "TI_INPUT7", InterruptKind::Input, 7),
    interrupt(255, "global interrupts", "TI_GLOBAL", InterruptKind::Global, 0),
];

// What the values of some parameters mean.

const POSITION_REACHED: Values =
    Values::Only(&[one(0, "not reached"), one(1, "target position equals actual position")]);

const SWITCH_ENABLE: Values = Values::Only(&[
    one(0, "deactivated"),
    one(1, "active, stop when input low"),
    one(3, "active, stop when input high"),
]);

const VIRTUAL_STOP_ENABLE: Values =
    Values::Only(&[one(0, "both disabled"), one(1, "left enabled"), one(2, "right enabled"), one(3, "both enabled")]);

const VIRTUAL_STOP_MODE: Values =
    Values::Only(&[one(0, "normal ramp deceleration"), one(1, "hard stop"), one(2, "stop deceleration (AP 21)")]);

const SWAP_SWITCHES: Values =
    Values::Only(&[one(0, "normal"), one(1, "right switch for negative direction, left for positive")]);

const SOFT_STOP: Values = Values::Only(&[one(0, "hard stop"), one(1, "deceleration ramp (AP 21)")]);

const RELATIVE_OPTION: Values =
    Values::Only(&[one(0, "last target position"), one(1, "actual position"), one(2, "encoder position")]);

const CLOSED_LOOP: Values = Values::Only(&[
    one(0, "closed loop off"),
    one(1, "closed loop on"),
    one(2, "PID mode based on v_actual"),
    one(3, "PID mode based on v=0"),
]);

const CL_INITIALIZED: Values =
    Values::Only(&[one(0, "initialization not finished"), one(1, "initialization finished")]);

const MICROSTEP_RESOLUTION: Values = Values::Only(&[
    one(0, "fullstep"),
    one(1, "halfstep"),
    one(2, "4 microsteps"),
    one(3, "8 microsteps"),
    one(4, "16 microsteps"),
    one(5, "32 microsteps"),
    one(6, "64 microsteps"),
    one(7, "128 microsteps"),
    one(8, "256 microsteps"),
]);

const CONSTANT_T_OFF: Values = Values::Only(&[one(0, "spread cycle"), one(1, "classic constant off time")]);

const FAST_DECAY_COMPARATOR_OFF: Values = Values::Only(&[one(0, "comparator used"), one(1, "comparator not used")]);

const CHOPPER_SYNC: Values = Values::Only(&[one(0, "off"), span(1, 15, "chopper synchronization")]);

const PWM_MODE: Values = Values::Only(&[one(0, "StealthChop disabled"), one(1, "StealthChop enabled")]);

const PWM_FREQUENCY: Values =
    Values::Only(&[one(0, "15.625 kHz"), one(1, "23.426 kHz"), one(2, "31.250 kHz"), one(3, "39.024 kHz")]);

const PWM_AUTOSCALE: Values = Values::Only(&[one(0, "user defined amplitude"), one(1, "automatic current control")]);

const REFERENCE_SEARCH_MODE: Values = Values::Only(&[
    one(1, "search left stop switch only"),
    one(2, "search right stop switch, then left"),
    one(3, "search right stop switch, then left from both sides"),
    one(4, "search left stop switch from both sides"),
    one(5, "search home switch in negative direction, reverse at left stop switch"),
    one(6, "search home switch in positive direction, reverse at right stop switch"),
    one(7, "search home switch in positive direction, ignore end switches"),
    one(8, "search home switch in negative direction, ignore end switches"),
    span(65, 68, "modes 1..4 with left and right exchanged"),
    span(133, 136, "modes 5..8 with inverted home switch"),
]);

const ENCODER_MODE: Values = Values::Bits(&[
    bits(0, 0, "channel A polarity for null event"),
    bits(1, 1, "channel B polarity for null event"),
    bits(2, 2, "null channel polarity"),
    bits(3, 3, "ignore A and B polarity"),
    bits(4, 4, "clear/latch at every null event"),
    bits(5, 5, "clear/latch only at next null event"),
    bits(8, 8, "0 latch positions, 1 also clear encoder counter"),
]);

const FREEWHEELING_MODE: Values = Values::Only(&[
    one(0, "normal operation"),
    one(1, "freewheeling"),
    one(2, "coil shorted, low side"),
    one(3, "coil shorted, high side"),
]);

const EXTENDED_ERROR_FLAGS: Values = Values::Notes(&[one(1, "StallGuard error"), one(2, "deviation error")]);

const DRIVER_ERROR_FLAGS: Values = Values::Bits(&[
    bits(0, 0, "stall detected"),
    bits(1, 1, "overtemperature"),
    bits(2, 2, "overtemperature pre-warning"),
    bits(3, 3, "short to ground A"),
    bits(4, 4, "short to ground B"),
    bits(5, 5, "open load A"),
    bits(6, 6, "open load B"),
    bits(7, 7, "stand still"),
]);

const UNIT_MODE: Values = Values::Only(&[one(0, "internal units of the ramp generator"), one(1, "pps units")]);
