//! The TMCM-1617: every parameter, port and interrupt, one row each.

use super::Access::{R, Rw, Rwa, Rwe};
use super::Direction::{In, Out};
use super::Unit::*;
use super::Values::{Any, Notes, Only};
use super::commands::modes;
use super::module::{axis_rows, global_rows, port};
use super::parameter::{
    AUTO_START, CAN_BIT_RATES, DOWNLOAD, PROTECTION, REPLY, RESTORE, RUN_STATES, axis, bits, global, one,
};
use super::{Ap, AxisParameter, GlobalParameter, Gp, Model, Module, MotionChip, Port, Values};

/// The TMCM-1617.
pub static TMCM_1617: Module = Module {
    model: Model::Tmcm1617,
    name: "TMCM-1617",
    number: 1617,
    version: (1, 8),
    version_text: b"1617V108",
    chip: MotionChip::Tmc4671,
    axes: 1,
    program_len: 1024,
    coordinates: 0,
    least_supply_v: 6,
    tick_us: 40,
    instruction_us: 10,
    axis_parameters: AXIS,
    global_parameters: GLOBAL,
    ports: PORTS,
    interrupts: &[],
    axis_rows: axis_rows(AXIS),
    global_rows: global_rows(GLOBAL),
    modes: modes(Model::Tmcm1617),
};

/// Axis parameters (§4).
#[rustfmt::skip]
const AXIS: &[AxisParameter] = &[
    axis(Ap::AdcI0Raw, 0, "adc_I0_raw", "APAdcI0Raw", 0, 65535, Plain, Some(32767), R, Any, "Raw reading of the shunt of phase A (§4)."),
    axis(Ap::AdcI1Raw, 1, "adc_I1_raw", "APAdcI1Raw", 0, 65535, Plain, Some(32767), R, Any, "Raw reading of the shunt of phase B (§4)."),
    axis(Ap::AdcI0, 2, "adc_I0", "APAdcI0", -32768, 32767, Plain, Some(0), R, Any, "Current of phase A, the raw reading less its offset (§4)."),
    axis(Ap::AdcI1, 3, "adc_I1", "APAdcI1", -32768, 32767, Plain, Some(0), R, Any, "Current of phase B, the raw reading less its offset (§4)."),
    axis(Ap::AdcI2, 4, "adc_I2", "APAdcI2", -32768, 32767, Plain, Some(0), R, Any, "Current of phase C, which follows from the other two (§4)."),
    axis(Ap::AdcI0Offset, 5, "adc_I0_offset", "APAdcI0Offset", 0, 65535, Plain, Some(32767), Rwe, Any, "Reading of phase A without current (§4)."),
    axis(Ap::AdcI1Offset, 6, "adc_I1_offset", "APAdcI1Offset", 0, 65535, Plain, Some(32767), Rwe, Any, "Reading of phase B without current (§4)."),
    axis(Ap::PolePairs, 10, "motor pole pairs", "APMotorPolePairs", 1, 255, Plain, Some(4), Rwe, Any, "Pole pairs of the motor (§4)."),
    axis(Ap::MaxCurrent, 11, "maximum current", "APMaxCurrent", 0, 18000, Milliampere, Some(4000), Rwe, Any, "Most current that regulation may ask for; overshoot can pass it a little (§4)."),
    axis(Ap::OpenLoopCurrent, 12, "open loop current", "APOpenLoopCurrent", 0, 18000, Milliampere, Some(1000), Rwe, Any, "Current of open loop commutation (§4)."),
    axis(Ap::MotorDirection, 13, "motor direction", "APMotorDirection", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "normal"), one(1, "inverted")]), "Sense of rotation (§4)."),
    axis(Ap::MotorType, 14, "motor type", "APMotorType", 0, 3, Plain, Some(3), Rwe, MOTOR_TYPE, "Kind of motor; 2 means nothing (§4; ERRATA: description)."),
    axis(Ap::CommutationMode, 15, "commutation mode", "APCommutationMode", 0, 3, Plain, Some(0), Rwe, COMMUTATION_MODE, "Where the electrical angle comes from (§4)."),
    axis(Ap::OpenLoopAngle, 16, "open loop commutation angle", "APOpenLoopCommutationAngle", -32768, 32767, Plain, Some(0), R, Any, "Angle of open loop commutation (§4)."),
    axis(Ap::EncoderAngle, 17, "encoder commutation angle", "APEncoderCommutationAngle", -32768, 32767, Plain, Some(0), R, Any, "Angle from the encoder (§4)."),
    axis(Ap::HallAngle, 18, "digital hall commutation angle", "APDigitalHallCommutationAngle", -32768, 32767, Plain, Some(0), R, Any, "Angle from the hall sensors (§4)."),
    axis(Ap::PositionSensor, 25, "position sensor selection", "APPositionSensorSelection", 0, 1, Plain, Some(0), Rwe, SENSOR, "What the position loop measures with (§4; ERRATA: description)."),
    axis(Ap::VelocitySensor, 26, "velocity sensor selection", "APVelocitySensorSelection", 0, 1, Plain, Some(0), Rwe, SENSOR, "What the velocity loop measures with (§4; ERRATA: description)."),
    axis(Ap::VelocityUnit, 27, "velocity unit selection", "APVelocityUnitSelection", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "mechanical rpm"), one(1, "electrical rpm")]), "Whether speeds are turns of the shaft or of the field (§4)."),
    axis(Ap::TargetCurrent, 30, "target current", "APTargetCurrent", -18000, 18000, Milliampere, Some(0), Rw, Any, "Torque current asked for; writing begins torque mode, positive is to the right (§4)."),
    axis(Ap::ActualCurrent, 31, "actual current", "APActualCurrent", -2147483648, 2147483647, Milliampere, Some(0), R, Any, "Torque current measured (§4)."),
    axis(Ap::TargetFlux, 32, "target flux", "APTargetFlux", -18000, 18000, Milliampere, Some(0), Rw, Any, "Flux current asked for; writing begins torque mode (§4)."),
    axis(Ap::ActualFlux, 33, "actual flux", "APActualFlux", -2147483648, 2147483647, Milliampere, Some(0), R, Any, "Flux current measured (§4)."),
    axis(Ap::TargetSpeed, 40, "target velocity", "APNextVelocity", -200000, 200000, Rpm, Some(0), Rw, Any, "Speed asked of velocity mode (§4)."),
    axis(Ap::RampSpeed, 41, "ramp velocity", "APRampVelocity", -200000, 200000, Rpm, Some(0), R, Any, "Speed that the ramp asks for now (§4)."),
    axis(Ap::ActualSpeed, 42, "actual velocity", "APActualVelocity", -2147483648, 2147483647, Rpm, Some(0), R, Any, "Speed measured (§4)."),
    axis(Ap::MaxSpeed, 43, "maximum velocity", "APMaxPositioningSpeed", 0, 200000, Rpm, Some(4000), Rwe, Any, "Top speed of velocity and position mode (§4)."),
    axis(Ap::MaxAcceleration, 44, "acceleration", "APMaxAcceleration", 0, 100000, RpmPerSecond, Some(2000), Rwe, Any, "Rate of changing the speed in velocity and position mode (§4)."),
    axis(Ap::VelocityRampEnable, 45, "enable velocity ramp", "APEnableVelocityRamp", 0, 1, Plain, Some(1), Rwe, VELOCITY_RAMP_ENABLE, "Puts a ramp in front of the velocity loop (§4)."),
    axis(Ap::MotorHaltedSpeed, 47, "motor halted velocity", "APMotorHaltedVelocity", 0, 200000, Rpm, Some(10), Rwe, Any, "Speed below which the motor counts as at rest (§4; ERRATA: unit)."),
    axis(Ap::TargetPosition, 50, "target position", "APNextPosition", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Where a positioning ramp goes; MVP sets it (§4, §3.6.4)."),
    axis(Ap::RampPosition, 51, "ramp position", "APRampPosition", -2147483648, 2147483647, Plain, Some(0), R, Any, "Position that the ramp asks for now (§4)."),
    axis(Ap::ActualPosition, 52, "actual position", "APActualPosition", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Position measured; may be set (§4)."),
    axis(Ap::PositionReachedDistance, 53, "position reached distance", "APPositionReachedDistance", 0, 100000, Plain, Some(50), Rwe, Any, "Distance from the target that counts as reached (§4)."),
    axis(Ap::PositionReachedSpeed, 54, "position reached velocity", "APPositionReachedVelocity", 0, 200000, Rpm, Some(500), Rwe, Any, "Speed that the motor must be below to count as arrived (§4)."),
    axis(Ap::PositionReached, 55, "position reached flag", "APTargetPosReached", 0, 1, Plain, Some(0), R, POSITION_REACHED, "1 while distance and speed are within AP 53 and AP 54 (§4)."),
    axis(Ap::PositionScaler, 56, "position scaler", "APPositionScaler", 6, 2147483647, Plain, Some(65536), Rwe, Any, "Position outside is position inside times this, in 1/65536 (§4)."),
    axis(Ap::TorqueP, 70, "torque P", "APTorqueP", 0, 32767, Plain, Some(300), Rwe, Any, "Proportional gain of the current loops (§4)."),
    axis(Ap::TorqueI, 71, "torque I", "APTorqueI", 0, 32767, Plain, Some(300), Rwe, Any, "Integral gain of the current loops (§4)."),
    axis(Ap::VelocityP, 72, "velocity P", "APVelocityP", 0, 32767, Plain, Some(300), Rwe, Any, "Proportional gain of the velocity loop (§4)."),
    axis(Ap::VelocityI, 73, "velocity I", "APVelocityI", 0, 32767, Plain, Some(100), Rwe, Any, "Integral gain of the velocity loop (§4)."),
    axis(Ap::PositionP, 74, "position P", "APPositionP", 0, 32767, Plain, Some(50), Rwe, Any, "Proportional gain of the position loop (§4)."),
    axis(Ap::TorqueErrorSum, 75, "torque PI error sum", "APTorquePIErrorSum", -2147483648, 2147483647, Plain, Some(0), R, Any, "Integral of the torque loop (§4)."),
    axis(Ap::FluxErrorSum, 76, "flux PI error sum", "APFluxPIErrorSum", -2147483648, 2147483647, Plain, Some(0), R, Any, "Integral of the flux loop (§4)."),
    axis(Ap::VelocityErrorSum, 77, "velocity PI error sum", "APVelocityPIErrorSum", -2147483648, 2147483647, Plain, Some(0), R, Any, "Integral of the velocity loop (§4)."),
    axis(Ap::TorqueError, 78, "torque PI error", "APTorquePIError", -2147483648, 2147483647, Plain, Some(0), R, Any, "Deviation of the torque loop (§4)."),
    axis(Ap::FluxError, 79, "flux PI error", "APFluxPIError", -2147483648, 2147483647, Plain, Some(0), R, Any, "Deviation of the flux loop (§4)."),
    axis(Ap::VelocityError, 80, "velocity PI error", "APVelocityPIError", -2147483648, 2147483647, Plain, Some(0), R, Any, "Deviation of the velocity loop (§4)."),
    axis(Ap::PositionError, 81, "position PI error", "APPositionPIError", -2147483648, 2147483647, Plain, Some(0), R, Any, "Deviation of the position loop (§4)."),
    axis(Ap::HallPolarity, 90, "hall polarity", "APHallPolarity", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "standard"), one(1, "inverted")]), "Inverts the three hall signals (§4)."),
    axis(Ap::HallDirection, 91, "hall direction", "APHallDirection", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "standard"), one(1, "inverted")]), "Reverses the order of the hall signals (§4)."),
    axis(Ap::HallInterpolation, 92, "hall interpolation", "APHallInterpolation", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "off"), one(1, "on")]), "Interpolates the angle between hall edges (§4)."),
    axis(Ap::HallOffset, 93, "hall phi_e offset", "APHallPhiEOffset", -32768, 32767, Plain, Some(0), Rwe, Any, "Electrical angle between hall sensors and rotor (§4)."),
    axis(Ap::HallInputs, 94, "hall inputs", "APHallInputs", 0, 7, Plain, Some(0), R, Any, "The three hall signals as bits (§4)."),
    axis(Ap::EncoderSteps, 100, "encoder steps", "APEncoderSteps", 0, 16777215, Plain, Some(4096), Rwe, Any, "Steps in a turn of the encoder (§4)."),
    axis(Ap::EncoderDirection, 101, "encoder direction", "APEncoderDirection", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "standard"), one(1, "inverted")]), "Sense of the encoder; right when ROR counts upward (§4)."),
    axis(Ap::EncoderInitMode, 102, "encoder init mode", "APEncoderInitMode", 0, 2, Plain, Some(0), Rwe, Only(&[one(0, "estimate offset"), one(2, "use hall")]), "How the encoder finds the rotor; 1 means nothing (§4; ERRATA: default)."),
    axis(Ap::EncoderInitState, 103, "encoder init state", "APEncoderInitState", 0, 3, Plain, Some(0), R, ENCODER_INIT_STATE, "How far that search is (§4)."),
    axis(Ap::EncoderInitDelay, 104, "encoder init delay", "APEncoderInitDelay", 0, 10000, Ms, Some(1000), Rwe, Any, "Time for the rotor to settle during that search (§4)."),
    axis(Ap::EncoderInitVelocity, 105, "encoder init velocity", "APEncoderInitVelocity", -200000, 200000, Rpm, Some(100), Rwe, Any, "Speed at which that search looks for the index (§4)."),
    axis(Ap::EncoderOffset, 106, "encoder offset", "APEncoderOffset", 0, 65535, Plain, Some(0), Rwe, Any, "Angle between encoder and rotor (§4)."),
    axis(Ap::ClearOnNull, 107, "clear on null", "APClearOnNull", 0, 1, Plain, Some(0), Rwe, CLEAR_ON_NULL, "Sets the position to zero at an index of the encoder (§4)."),
    axis(Ap::ClearOnce, 108, "clear once", "APClearOnce", 0, 1, Plain, Some(0), Rwe, CLEAR_ONCE, "Whether AP 107 acts at every index or at the next only (§4)."),
    axis(Ap::EncoderInputs, 109, "encoder inputs", "APEncoderInputs", 0, 7, Plain, Some(0), R, Any, "The signals A, B and N as bits (§4)."),
    axis(Ap::PwmFrequencyHz, 110, "motor PWM frequency", "APMotorPWMFrequency", 25000, 100000, Hertz, Some(25000), Rwe, Any, "Frequency of the power stage (§4)."),
    axis(Ap::BrakeChopper, 140, "enable brake chopper", "APEnableBrakeChopper", 0, 1, Plain, Some(0), Rwe, Only(&[one(0, "off"), one(1, "on")]), "Lets the chopper burn what the motor feeds back (§4)."),
    axis(Ap::BrakeChopperLimit, 141, "brake chopper voltage limit", "APBrakeChopperVoltageLimit", 60, 300, Decivolt, Some(300), Rwe, Any, "Supply voltage at which the chopper switches on (§4)."),
    axis(Ap::BrakeChopperHysteresis, 142, "brake chopper hysteresis", "APBrakeChopperHysteresis", 0, 50, Decivolt, Some(5), Rwe, Any, "How far below AP 141 it switches off (§4)."),
    axis(Ap::BrakeChopperActive, 144, "brake chopper active", "APBrakeChopperActive", 0, 300, Plain, Some(0), R, Notes(&[one(0, "not active")]), "Not 0 while the chopper works (§4)."),
    axis(Ap::StatusFlags, 156, "status flags", "APStatusFlags", 0, 4294967295, Plain, Some(0), R, STATUS_FLAGS, "State of the drive; the bits are those of tmcl_ros2 (§4; ERRATA: range)."),
    axis(Ap::ReferenceSwitchEnable, 209, "reference switch enable", "APReferenceSwitchEnable", 0, 7, Plain, Some(0), Rw, REFERENCE_SWITCHES, "Which reference switches act (§4)."),
    axis(Ap::ReferenceSwitchPolarity, 210, "reference switch polarity", "APReferenceSwitchPolarity", 0, 7, Plain, Some(0), Rw, REFERENCE_SWITCHES, "Which reference switches are active high (§4)."),
    axis(Ap::RightSwitch, 211, "right reference switch active", "APRightLimitSwitchStatus", 0, 1, Plain, Some(0), R, Only(&[one(0, "deactivated"), one(1, "activated")]), "State of the right switch (§4)."),
    axis(Ap::LeftSwitch, 212, "left reference switch active", "APLeftLimitSwitchStatus", 0, 1, Plain, Some(0), R, Only(&[one(0, "deactivated"), one(1, "activated")]), "State of the left switch (§4)."),
    axis(Ap::HomeSwitch, 213, "home reference switch active", "APRefSwitchStatus", 0, 1, Plain, Some(0), R, Only(&[one(0, "deactivated"), one(1, "activated")]), "State of the home switch (§4)."),
    axis(Ap::SupplyVoltage, 220, "supply voltage", "APSupplyVoltage", 0, 1000, Decivolt, Some(240), R, Any, "Supply voltage measured (§4)."),
    axis(Ap::DriverTemperature, 221, "driver temperature", "APDriverTemperature", -20, 150, Celsius, Some(0), R, Any, "Temperature of the power stage (§4)."),
    axis(Ap::MainLoops, 230, "main loops", "APMainLoops", 0, 4294967295, PerSecond, Some(0), R, Any, "How often the main loop runs (§4)."),
    axis(Ap::TorqueLoops, 231, "torque loops", "APTorqueLoops", 0, 4294967295, PerSecond, Some(0), R, Any, "How often the current loops run (§4)."),
    axis(Ap::VelocityLoops, 232, "velocity loops", "APVelocityLoops", 0, 4294967295, PerSecond, Some(0), R, Any, "How often the velocity loop runs (§4)."),
    axis(Ap::DebugValue0, 240, "debug value 0", "APDebugValue0", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue1, 241, "debug value 1", "APDebugValue1", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue2, 242, "debug value 2", "APDebugValue2", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue3, 243, "debug value 3", "APDebugValue3", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue4, 244, "debug value 4", "APDebugValue4", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue5, 245, "debug value 5", "APDebugValue5", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue6, 246, "debug value 6", "APDebugValue6", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue7, 247, "debug value 7", "APDebugValue7", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue8, 248, "debug value 8", "APDebugValue8", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::DebugValue9, 249, "debug value 9", "APDebugValue9", -2147483648, 2147483647, Plain, Some(0), Rw, Any, "Free for experiments (§4)."),
    axis(Ap::EnableDriver, 255, "enable driver", "APEnableDriver", 0, 1, Plain, Some(1), Rw, Only(&[one(0, "driver disabled"), one(1, "driver enabled")]), "Switches the power stage on (§4)."),
];

/// Global parameters of banks 0 and 2 (§5).
#[rustfmt::skip]
const GLOBAL: &[GlobalParameter] = &[
    global(Gp::SerialBaudRate, 0, 65, 65, "RS232 / RS485 baud rate", "GPSerialBaudRate", 0, 7, Some(0), Rwa, SERIAL_BAUD_RATE, "Speed of RS485 from the next start on (§5.1)."),
    global(Gp::SerialAddress, 0, 66, 66, "serial address", "GPSerialAddress", 1, 255, Some(1), Rwa, Any, "Address of the module on a serial bus (§5.1)."),
    global(Gp::CanBitRate, 0, 69, 69, "CAN bit rate", "GPCANBitRate", 2, 8, Some(8), Rwa, CAN_BIT_RATES, "Speed of the CAN bus from the next start on (§5.1)."),
    global(Gp::CanReplyId, 0, 70, 70, "CAN reply ID", "GPCANReplyID", 0, 2047, Some(2), Rwa, Any, "CAN identifier of replies (§5.1)."),
    global(Gp::CanId, 0, 71, 71, "CAN ID", "GPCANID", 0, 2047, Some(1), Rwa, Any, "CAN identifier that the module obeys (§5.1)."),
    global(Gp::TelegramPause, 0, 75, 75, "telegram pause time", "GPTelegramPauseTime", 0, 255, Some(0), Rwa, Any, "Time in ms that a serial reply is held back (§5.1)."),
    global(Gp::HostAddress, 0, 76, 76, "serial host address", "GPSerialHostAddress", 0, 255, Some(2), Rwa, Any, "Address of the host, which begins a serial reply (§5.1)."),
    global(Gp::AutoStart, 0, 77, 77, "auto start mode", "GPAutoStartMode", 0, 1, Some(0), Rwa, AUTO_START, "Whether the program starts by itself (§5.1)."),
    global(Gp::CodeProtection, 0, 81, 81, "TMCL code protection", "GPTMCLCodeProtection", 0, 3, Some(0), Rwa, PROTECTION, "Hides the program or keeps it; giving up bit 0 erases it (§5.1)."),
    global(Gp::CanHeartbeat, 0, 82, 82, "CAN heartbeat", "GPCANHeartbeat", 0, 65535, Some(0), Rwa, Notes(&[one(0, "off")]), "Longest silence of the host in ms before the motors stop, on CAN (§5.1)."),
    global(Gp::CanSecondaryId, 0, 83, 83, "CAN secondary address", "GPCANSecondaryAddress", 0, 2047, Some(0), Rwa, Notes(&[one(0, "off")]), "Another CAN identifier that the module obeys (§5.1)."),
    global(Gp::UserVariablesNotRestored, 0, 85, 85, "do not restore user variables", "GPDoNotRestoreUserVariables", 0, 1, Some(0), Rwa, RESTORE, "Whether user variables begin as stored or as zero (§5.1)."),
    global(Gp::ApplicationStatus, 0, 128, 128, "TMCL application status", "GPTMCLApplicationStatus", 0, 3, Some(0), R, RUN_STATES, "What the program does (§5.1)."),
    global(Gp::DownloadMode, 0, 129, 129, "download mode", "GPDownloadMode", 0, 1, Some(0), R, DOWNLOAD, "1 while commands are stored instead of executed (§5.1)."),
    global(Gp::ProgramCounter, 0, 130, 130, "TMCL program counter", "GPTMCLProgramCounter", 0, 1023, Some(0), R, Any, "Address of the command that runs or would run next (§5.1)."),
    global(Gp::LastError, 0, 131, 131, "last TMCL error", "GPLastTMCLError", 0, 2147483647, Some(0), R, Any, "Latest failure of the program: status << 16 | address; 0 if none (not in the manual)."),
    global(Gp::TickTimer, 0, 132, 132, "TMCL tick timer", "GPTickTimer", 0, 2147483647, Some(0), Rw, Any, "Milliseconds since the start (§5.1)."),
    global(Gp::SuppressReply, 0, 255, 255, "suppress reply", "GPSuppressReply", 0, 1, Some(0), Rw, REPLY, "Lets only GAP, GGP and GIO be answered; not stored (§5.1)."),
    global(Gp::UserVariable, 2, 0, 55, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rwe, Any, "Variable of programs, which STGP stores (§5.2)."),
    global(Gp::UserVariable, 2, 56, 255, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rw, Any, "Variable of programs, lost at power-off (§5.2)."),
];

/// Digital and analogue ports (§3.6.13, §3.6.14).
#[rustfmt::skip]
const PORTS: &[Port] = &[
    port(0, 0, "GPIO_0", In, Some((0, 1))),
    port(0, 1, "GPIO_1", In, Some((0, 1))),
    port(0, 2, "REF_R", In, Some((0, 1))),
    port(0, 3, "REF_L", In, Some((0, 1))),
    port(0, 4, "REF_H", In, Some((0, 1))),
    port(1, 0, "AIN0", In, Some((0, 4095))),
    port(1, 1, "AIN1", In, Some((0, 4095))),
    port(1, 2, "AIN2", In, Some((0, 4095))),
    port(2, 0, "GPIO_2", Out, Some((0, 1))),
    port(2, 1, "GPIO_3", Out, Some((0, 1))),
    port(2, 2, "GPIO_4", Out, Some((0, 1))),
    port(2, 3, "GPIO_5", Out, Some((0, 1))),
];

// What the values of some parameters mean.

const MOTOR_TYPE: Values = Values::Only(&[one(0, "no motor"), one(1, "single phase DC"), one(3, "three phase BLDC")]);

const COMMUTATION_MODE: Values =
    Values::Only(&[one(0, "disabled"), one(1, "open loop"), one(2, "digital hall"), one(3, "ABN encoder")]);

const SENSOR: Values = Values::Only(&[one(0, "same as commutation"), one(1, "ABN encoder")]);

const VELOCITY_RAMP_ENABLE: Values = Values::Only(&[one(0, "ramp generator off"), one(1, "ramp generator on")]);

const POSITION_REACHED: Values = Values::Only(&[one(0, "window not reached"), one(1, "window reached")]);

const ENCODER_INIT_STATE: Values =
    Values::Only(&[one(0, "nothing to do"), one(1, "start_init"), one(2, "wait_init_time"), one(3, "estimate_offset")]);

const CLEAR_ON_NULL: Values =
    Values::Only(&[one(0, "do not clear position at next N event"), one(1, "set position to zero at next N event")]);

const CLEAR_ONCE: Values = Values::Only(&[one(0, "clear always at an N event"), one(1, "clear only once")]);

const STATUS_FLAGS: Values = Values::Bits(&[
    bits(0, 0, "overcurrent"),
    bits(1, 1, "undervoltage"),
    bits(2, 2, "overvoltage"),
    bits(3, 3, "overtemperature"),
    bits(4, 4, "motor halted"),
    bits(5, 5, "hall error"),
    bits(6, 6, "driver error"),
    bits(7, 7, "init error"),
    bits(8, 8, "stop mode"),
    bits(9, 9, "velocity mode"),
    bits(10, 10, "position mode"),
    bits(11, 11, "torque mode"),
    bits(14, 14, "position end"),
    bits(15, 15, "module initialized"),
    bits(16, 16, "IIT exceeded 1"),
    bits(17, 17, "IIT exceeded 2"),
]);

const REFERENCE_SWITCHES: Values = Values::Bits(&[bits(0, 0, "REF_R"), bits(1, 1, "REF_L"), bits(2, 2, "REF_H")]);

const SERIAL_BAUD_RATE: Values = Values::Only(&[
    one(0, "9600"),
    one(1, "14400"),
    one(2, "19200"),
    one(3, "28800"),
    one(4, "38400"),
    one(5, "57600"),
    one(6, "76800"),
    one(7, "115200"),
]);
