//! The TMCM-351: every parameter, port and interrupt, one row each.

use super::Access::{R, Rw, Rwa, Rwe};
use super::Direction::{In, Out};
use super::Unit::*;
use super::Values::{Any, Notes, Only};
use super::commands::modes;
use super::module::{axis_rows, global_rows, port};
use super::parameter::{
    AUTO_START, BAUD_RATES, CAN_BIT_RATES, COORDINATE_STORAGE, DOWNLOAD, EDGES, LEVELS, PROTECTION, RESTORE,
    RUN_STATES, axis, bits, global, one, span,
};
use super::{Ap, AxisParameter, GlobalParameter, Gp, Model, Module, MotionChip, Port, Values};

/// The TMCM-351.
pub static TMCM_351: Module = Module {
    model: Model::Tmcm351,
    name: "TMCM-351",
    number: 351,
    version: (4, 45),
    version_text: b"351V.445",
    chip: MotionChip::Tmc428,
    axes: 3,
    program_len: 2048,
    coordinates: 21,
    least_supply_v: 6,
    tick_us: 100,
    instruction_us: 10,
    axis_parameters: AXIS,
    global_parameters: GLOBAL,
    ports: PORTS,
    interrupts: super::tmcm3351::INTERRUPTS,
    axis_rows: axis_rows(AXIS),
    global_rows: global_rows(GLOBAL),
    modes: modes(Model::Tmcm351),
};

/// Axis parameters (§5.7.5, §5.7.6).
#[rustfmt::skip]
const AXIS: &[AxisParameter] = &[
    axis(Ap::TargetPosition, 0, "target (next) position", "APNextPosition", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Where position mode goes; MVP sets it (§5.7.5)."),
    axis(Ap::ActualPosition, 1, "actual position", "APActualPosition", -2147483648, 2147483647, Microsteps, Some(0), Rw, Any, "Position counter; write it only to define the origin (§5.7.5)."),
    axis(Ap::TargetSpeed, 2, "target (next) speed", "APNextVelocity", -2047, 2047, Tmc428Speed, Some(0), Rw, Any, "Signed speed asked of velocity mode; position mode sets it itself (§5.7.5)."),
    axis(Ap::ActualSpeed, 3, "actual speed", "APActualVelocity", -2047, 2047, Tmc428Speed, Some(0), Rw, Any, "Signed speed at this moment (§5.7.5)."),
    axis(Ap::MaxSpeed, 4, "maximum positioning speed", "APMaxPositioningSpeed", 0, 2047, Tmc428Speed, Some(1000), Rwe, Any, "Top speed of position mode (§5.7.5)."),
    axis(Ap::MaxAcceleration, 5, "maximum acceleration", "APMaxAcceleration", 0, 2047, Tmc428Acceleration, Some(500), Rwe, Any, "Rate of changing the speed in both directions (§5.7.5)."),
    axis(Ap::MaxCurrent, 6, "absolute max. current", "APMaxCurrent", 0, 255, Plain, Some(255), Rwe, Any, "Current while moving, in 1/255 of 2.8 A RMS (§5.7.5)."),
    axis(Ap::StandbyCurrent, 7, "standby current", "APStandbyCurrent", 0, 255, Plain, Some(32), Rwe, Any, "Current at rest, once the power down delay has passed, scaled as AP 6 (§5.7.5)."),
    axis(Ap::PositionReached, 8, "target pos. reached", "APTargetPosReached", 0, 1, Plain, None, R, Only(&[one(0, "not reached"), one(1, "reached")]), "1 while the position is the target (§5.7.6)."),
    axis(Ap::HomeSwitch, 9, "ref. switch status", "APRefSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the reference switch, which is the left one (§5.7.6)."),
    axis(Ap::RightSwitch, 10, "right limit switch status", "APRightLimitSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the right limit switch (§5.7.6)."),
    axis(Ap::LeftSwitch, 11, "left limit switch status", "APLeftLimitSwitchStatus", 0, 1, Plain, None, R, LEVELS, "Level at the left limit switch of three switch mode (§5.7.6)."),
    axis(Ap::RightSwitchDisable, 12, "right limit switch disable", "APRightLimitSwitchDisable", 0, 1, Plain, Some(1), Rwe, SWITCH_DISABLE, "Keeps the right switch from stopping the motor; the TMCM-3351 counts the other way (§5.7.5)."),
    axis(Ap::LeftSwitchDisable, 13, "left limit switch disable", "APLeftLimitSwitchDisable", 0, 1, Plain, Some(1), Rwe, SWITCH_DISABLE, "Keeps the left switch from stopping the motor; it is the reference switch too (§5.7.5)."),
    axis(Ap::MinSpeed, 130, "minimum speed", "APMinimumSpeed", 0, 2047, Tmc428Speed, Some(1), Rwe, Any, "Speed of the last microsteps; more than 1 may miss the target (§5.7.5)."),
    axis(Ap::ActualAcceleration, 135, "actual acceleration", "APActualAcceleration", 0, 2047, Plain, Some(0), R, Any, "Acceleration at this moment (§5.7.6)."),
    axis(Ap::RampMode, 138, "ramp mode", "APRampMode", 0, 2, Plain, Some(0), Rw, RAMP_MODE, "What the ramp generator does; the motion commands set it (§5.7.5)."),
    axis(Ap::MicrostepResolution, 140, "microstep resolution", "APMicrostepResolution", 0, 6, Plain, Some(6), Rwe, MICROSTEP_RESOLUTION, "Microsteps in a full step; the speed changes with it (§5.7.5)."),
    axis(Ap::ReferenceSwitchTolerance, 141, "reference switch tolerance", "APRefSwitchTolerance", 0, 4095, Microsteps, Some(0), Rw, Any, "Distance around the left switch in which the middle one does not stop, three switch mode (Rev. 1.06)."),
    axis(Ap::SoftStop, 149, "soft stop flag", "APSoftStopFlag", 0, 1, Plain, Some(0), Rwe, SOFT_STOP, "How a switch brings the motor to rest (§5.7.5)."),
    axis(Ap::RampDivisor, 153, "ramp divisor", "APRampDivisor", 0, 13, Plain, Some(3), Rwe, Any, "Exponent of the unit of acceleration (§5.7.5)."),
    axis(Ap::PulseDivisor, 154, "pulse divisor", "APPulseDivisor", 0, 13, Plain, Some(2), Rwe, Any, "Exponent of the unit of speed (§5.7.5)."),
    axis(Ap::ReferenceSearchMode, 193, "referencing mode", "APRefSearchMode", 1, 3, Plain, Some(1), Rwe, REFERENCE_SEARCH_MODE, "Which switches a reference search looks for (§5.7.5)."),
    axis(Ap::ReferenceSearchSpeed, 194, "referencing search speed", "APRefSearchSpeed", 0, 2047, Tmc428Speed, Some(1000), Rwe, Any, "Speed of looking for a switch (§5.7.5)."),
    axis(Ap::ReferenceSwitchSpeed, 195, "referencing switch speed", "APRefSwitchSpeed", 0, 2047, Tmc428Speed, Some(250), Rwe, Any, "Speed of finding the switching point (§5.7.5)."),
    axis(Ap::EndSwitchDistance, 196, "distance end switches", "APDistanceEndSwitches", 0, 2147483647, Microsteps, Some(0), R, Any, "Distance between the end switches, measured by search modes 2 and 3 (§5.7.6)."),
    axis(Ap::LastReferencePosition, 197, "last reference position", "APLastReferencePosition", -2147483648, 2147483647, Plain, Some(0), R, Any, "Position that a reference search replaced by zero (Rev. 1.06)."),
    axis(Ap::BoostCurrent, 200, "boost current", "APBoostCurrent", 0, 255, Plain, Some(0), Rwe, Notes(&[one(0, "use AP 6")]), "Current while the speed changes, scaled as AP 6; 0 takes AP 6 (Rev. 1.06)."),
    axis(Ap::MixedDecay, 203, "mixed decay threshold", "APMixedDecay", -1, 2048, Tmc428Speed, Some(2048), Rwe, MIXED_DECAY, "Speed from which the driver mixes its decay modes (§5.7.5)."),
    axis(Ap::FreewheelingDelay, 204, "freewheeling", "APFreeWheeling", 0, 65535, Ms, Some(0), Rwe, Notes(&[one(0, "never")]), "Rest before the coils are switched off (§5.7.5)."),
    axis(Ap::StallDetection, 205, "stall detection threshold", "APStallguardThresholdLevel", 0, 7, Plain, Some(0), Rwe, STALL_DETECTION, "Load at which the motor stops (§5.7.5)."),
    axis(Ap::LoadValue, 206, "actual load value", "APActualStallguardValue", 0, 7, Plain, None, R, Any, "Load measured by the driver, more means more load (§5.7.6)."),
    axis(Ap::ExtendedErrorFlags, 207, "extended error flags", "APExtendedErrorFlags", 0, 3, Plain, Some(0), R, EXTENDED_ERROR_FLAGS, "What stopped the motor; cleared by the next motion command (Rev. 1.06)."),
    axis(Ap::DriverErrorFlags, 208, "driver error flags", "APDriverErrorFlags", 0, 255, Plain, None, R, DRIVER_ERROR_FLAGS, "Flags of the driver chip (§5.7.6; bits from Rev. 1.06)."),
    axis(Ap::EncoderPosition, 209, "encoder position", "APEncoderPosition", -2147483648, 2147483647, EncoderSteps, Some(0), Rw, Any, "Counter of the encoder (§5.7.5)."),
    axis(Ap::EncoderPrescaler, 210, "encoder prescaler", "APEncoderPredivAndFlags", 64, 78463, Plain, Some(512), Rwe, PRESCALERS, "Code of the factor between encoder and position, with flags for the index (§5.7.5; values from Rev. 1.06)."),
    axis(Ap::FullStepThreshold, 211, "fullstep threshold", "APFullStepThreshold", 0, 2048, Tmc428Speed, Some(0), Rwe, Notes(&[one(0, "off"), one(2048, "off")]), "Speed from which the motor is driven in full steps (§5.7.5)."),
    axis(Ap::MaxEncoderDeviation, 212, "maximum encoder deviation", "APMaxEncoderDeviation", 0, 65535, EncoderSteps, Some(0), Rwe, Notes(&[one(0, "function off")]), "Distance between AP 1 and AP 209 that stops the motor (§5.7.5)."),
    axis(Ap::GroupIndex, 213, "group index", "APGroupIndex", 0, 255, Plain, Some(0), Rw, Notes(&[one(0, "off")]), "Axes with the same number obey ROL, ROR, MST, MVP and RFS together (§5.7.5)."),
    axis(Ap::PowerDownDelay, 214, "power down delay", "APPowerDownDelay", 1, 65535, TenMs, Some(200), Rwe, Any, "Rest before the current falls to standby (§5.7.5)."),
];

/// Global parameters of banks 0, 2 and 3 (§5.7.9, §5.7.10; bank 3: Rev. 1.06).
#[rustfmt::skip]
const GLOBAL: &[GlobalParameter] = &[
    global(Gp::EepromMagic, 0, 64, 64, "EEPROM magic", "GPEEPROMMagic", 0, 255, Some(228), Rwa, Notes(&[one(228, "configuration valid")]), "Any value but $E4 makes the module take factory settings at the next start (§5.7.9)."),
    global(Gp::SerialBaudRate, 0, 65, 65, "RS232/RS485 baud rate", "GPSerialBaudRate", 0, 11, Some(0), Rwa, BAUD_RATES, "Speed of RS232 and RS485 from the next start on (§5.7.9)."),
    global(Gp::SerialAddress, 0, 66, 66, "serial address", "GPSerialAddress", 0, 255, Some(1), Rwa, Any, "Address of the module on a serial bus (§5.7.9)."),
    global(Gp::AsciiMode, 0, 67, 67, "ASCII mode", "GPASCIIMode", 0, 33, Some(0), Rwa, ASCII_MODES, "Whether the serial port starts in ASCII mode, and what it echoes (§5.7.9)."),
    global(Gp::SerialHeartbeat, 0, 68, 68, "serial heartbeat", "GPSerialHeartbeat", 0, 65535, Some(0), Rwa, Notes(&[one(0, "off")]), "Longest silence of the host in ms before the motors stop, on serial links and USB (Rev. 1.06)."),
    global(Gp::CanBitRate, 0, 69, 69, "CAN bit rate", "GPCANBitRate", 2, 8, Some(8), Rwa, CAN_BIT_RATES, "Speed of the CAN bus from the next start on (§5.7.9)."),
    global(Gp::CanReplyId, 0, 70, 70, "CAN reply ID", "GPCANReplyID", 0, 2047, Some(2), Rwa, Any, "CAN identifier of replies (§5.7.9)."),
    global(Gp::CanId, 0, 71, 71, "CAN ID", "GPCANID", 0, 2047, Some(1), Rwa, Any, "CAN identifier that the module obeys (§5.7.9)."),
    global(Gp::EepromLock, 0, 73, 73, "configuration EEPROM lock flag", "GPEEPROMLock", 0, 1, Some(0), Rwa, LOCK, "Keeps commands from writing the EEPROM; they get status 5 (§5.7.9)."),
    global(Gp::TelegramPause, 0, 75, 75, "telegram pause time", "GPTelegramPauseTime", 0, 255, Some(0), Rwa, Any, "Time in ms that a serial reply is held back (§5.7.9)."),
    global(Gp::HostAddress, 0, 76, 76, "serial host address", "GPSerialHostAddress", 0, 255, Some(2), Rwa, Any, "Address of the host, which begins a serial reply (§5.7.9)."),
    global(Gp::AutoStart, 0, 77, 77, "auto start mode", "GPAutoStartMode", 0, 1, Some(0), Rwa, AUTO_START, "Whether the program starts by itself (§5.7.9)."),
    global(Gp::ShutdownPin, 0, 80, 80, "shutdown pin functionality", "GPShutdownPin", 0, 2, Some(0), Rwa, SHUTDOWN_PIN, "What the SHUTDOWN pin does (§5.7.9)."),
    global(Gp::CodeProtection, 0, 81, 81, "TMCL code protection", "GPTMCLCodeProtection", 0, 3, Some(0), Rwa, PROTECTION, "Hides the program or keeps it; giving up bit 0 erases it (§5.7.9)."),
    global(Gp::CanHeartbeat, 0, 82, 82, "CAN heartbeat", "GPCANHeartbeat", 0, 65535, Some(0), Rwa, Notes(&[one(0, "off")]), "Longest silence of the host in ms before the motors stop, on CAN (Rev. 1.06)."),
    global(Gp::CanSecondaryId, 0, 83, 83, "CAN secondary address", "GPCANSecondaryAddress", 0, 2047, Some(0), Rwa, Notes(&[one(0, "off")]), "Another CAN identifier that the module obeys (§5.7.9)."),
    global(Gp::CoordinateStorage, 0, 84, 84, "coordinate storage", "GPCoordinateStorage", 0, 1, Some(0), Rwa, COORDINATE_STORAGE, "Whether coordinates live through a power cycle (§5.7.9)."),
    global(Gp::UserVariablesNotRestored, 0, 85, 85, "do not restore user variables", "GPDoNotRestoreUserVariables", 0, 1, Some(0), Rwa, RESTORE, "Whether user variables begin as stored or as zero (Rev. 1.06)."),
    global(Gp::SerialSecondaryAddress, 0, 87, 87, "serial secondary address", "GPSerialSecondaryAddress", 0, 255, Some(0), Rwa, Notes(&[one(0, "off")]), "Another address of the module on a serial bus (Rev. 1.06)."),
    global(Gp::ApplicationStatus, 0, 128, 128, "TMCL application status", "GPTMCLApplicationStatus", 0, 3, Some(0), R, RUN_STATES, "What the program does (§5.7.10)."),
    global(Gp::DownloadMode, 0, 129, 129, "download mode", "GPDownloadMode", 0, 1, Some(0), R, DOWNLOAD, "1 while commands are stored instead of executed (§5.7.10)."),
    global(Gp::ProgramCounter, 0, 130, 130, "TMCL program counter", "GPTMCLProgramCounter", 0, 2047, Some(0), R, Any, "Address of the command that runs or would run next (§5.7.10)."),
    global(Gp::LastError, 0, 131, 131, "last TMCL error", "GPLastTMCLError", 0, 2147483647, Some(0), R, Any, "Latest failure of the program: status << 16 | address; 0 if none (not in the manual)."),
    global(Gp::TickTimer, 0, 132, 132, "tick timer", "GPTickTimer", 0, 2147483647, Some(0), Rw, Any, "Milliseconds since the start (§5.7.10)."),
    global(Gp::RandomNumber, 0, 133, 133, "random number", "GPRandomNumber", 0, 2147483647, None, R, Any, "A different number each time (§5.7.10)."),
    global(Gp::UserVariable, 2, 0, 55, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rwe, Any, "Variable of programs, which STGP stores (§5.7.9)."),
    global(Gp::UserVariable, 2, 56, 255, "user variable", "GPUserVariable", -2147483648, 2147483647, Some(0), Rw, Any, "Variable of programs, lost at power-off (§5.7.9)."),
    global(Gp::TimerPeriod, 3, 0, 0, "timer 0 period", "GPTimer0Period", 0, 4294967295, Some(0), Rwe, Any, "Period of interrupt 0 in ms, unsigned (Rev. 1.06)."),
    global(Gp::TimerPeriod, 3, 1, 1, "timer 1 period", "GPTimer1Period", 0, 4294967295, Some(0), Rwe, Any, "Period of interrupt 1 in ms, unsigned (Rev. 1.06)."),
    global(Gp::TimerPeriod, 3, 2, 2, "timer 2 period", "GPTimer2Period", 0, 4294967295, Some(0), Rwe, Any, "Period of interrupt 2 in ms, unsigned (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 27, 27, "stop left 0 trigger transition", "GPStopLeft0Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 27 (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 28, 28, "stop right 0 trigger transition", "GPStopRight0Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 28 (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 29, 29, "stop left 1 trigger transition", "GPStopLeft1Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 29 (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 30, 30, "stop right 1 trigger transition", "GPStopRight1Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 30 (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 31, 31, "stop left 2 trigger transition", "GPStopLeft2Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 31 (Rev. 1.06)."),
    global(Gp::StopSwitchEdge, 3, 32, 32, "stop right 2 trigger transition", "GPStopRight2Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 32 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 39, 39, "input 0 trigger transition", "GPInput0Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 39 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 40, 40, "input 1 trigger transition", "GPInput1Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 40 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 41, 41, "input 2 trigger transition", "GPInput2Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 41 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 42, 42, "input 3 trigger transition", "GPInput3Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 42 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 43, 43, "input 4 trigger transition", "GPInput4Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 43 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 44, 44, "input 5 trigger transition", "GPInput5Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 44 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 45, 45, "input 6 trigger transition", "GPInput6Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 45 (Rev. 1.06)."),
    global(Gp::InputEdge, 3, 46, 46, "input 7 trigger transition", "GPInput7Transition", 0, 3, Some(0), Rwe, EDGES, "Which edges raise interrupt 46 (Rev. 1.06)."),
];

/// Digital and analogue ports (§5.7.14; Rev. 1.06).
#[rustfmt::skip]
const PORTS: &[Port] = &[
    port(0, 0, "IN_0", In, Some((0, 1))),
    port(0, 0, "pull-up resistors", Out, Some((0, 255))),
    port(0, 1, "IN_1", In, Some((0, 1))),
    port(0, 2, "IN_2", In, Some((0, 1))),
    port(0, 3, "IN_3", In, Some((0, 1))),
    port(0, 4, "IN_4", In, Some((0, 1))),
    port(0, 5, "IN_5", In, Some((0, 1))),
    port(0, 6, "ADIN_6", In, Some((0, 1))),
    port(0, 7, "ADIN_7", In, Some((0, 1))),
    port(0, 8, "analogue input range", Out, Some((0, 1))),
    port(0, 255, "all inputs", In, Some((0, 255))),
    port(1, 0, "AIN_0", In, Some((0, 1023))),
    port(1, 1, "AIN_1", In, Some((0, 1023))),
    port(1, 2, "AIN_2", In, Some((0, 1023))),
    port(1, 3, "AIN_3", In, Some((0, 1023))),
    port(1, 4, "power supply", In, Some((0, 1023))),
    port(1, 5, "temperature", In, Some((0, 1023))),
    port(1, 6, "ADIN_6", In, Some((0, 1023))),
    port(1, 7, "ADIN_7", In, Some((0, 1023))),
    port(2, 0, "OUT_0", Out, Some((0, 1))),
    port(2, 1, "OUT_1", Out, Some((0, 1))),
    port(2, 2, "OUT_2", Out, Some((0, 1))),
    port(2, 3, "OUT_3", Out, Some((0, 1))),
    port(2, 4, "OUT_4", Out, Some((0, 1))),
    port(2, 5, "OUT_5", Out, Some((0, 1))),
    port(2, 6, "OUT_6", Out, Some((0, 1))),
    port(2, 7, "OUT_7", Out, Some((0, 1))),
    port(2, 255, "all outputs", Out, Some((-1, 255))),
];

// What the values of some parameters mean.

/// Factors of the encoder, code by code, and the flags in the code's low bits (§5.7.5; Rev. 1.06).
const PRESCALERS: Values = Values::Flagged(
    &[
        one(64, "0.125"),
        one(128, "0.25"),
        one(256, "0.5"),
        one(512, "1"),
        one(800, "1.5625"),
        one(66144, "1.6"),
        one(1024, "2"),
        one(1600, "3.125"),
        one(67104, "3.2"),
        one(2048, "4"),
        one(3200, "6.25"),
        one(68672, "6.4"),
        one(4096, "8"),
        one(6400, "12.5"),
        one(71808, "12.8"),
        one(8192, "16"),
        one(78432, "25.6"),
        one(16384, "32"),
        one(32768, "64"),
    ],
    &[
        bits(0, 0, "counts the other way"),
        bits(1, 1, "acts at every index, else at the next only"),
        bits(2, 2, "index clears the position"),
        bits(3, 3, "latches at the index only"),
        bits(4, 4, "index is active high"),
    ],
);

/// What the ASCII interface echoes, and whether the module starts with it (§5.6.4).
const ASCII_MODES: Values = Values::Flagged(
    &[one(0, "echo of each character"), one(16, "echo of the whole line"), one(32, "no echo")],
    &[bits(0, 0, "starts in ASCII mode, else in binary mode")],
);

/// Keys of the EEPROM lock, and its state (§5.7.9).
const LOCK: Values = Values::Keys(&[one(1234, "lock"), one(4321, "unlock")], &[one(0, "unlocked"), one(1, "locked")]);

const SWITCH_DISABLE: Values = Values::Only(&[one(0, "stop function active"), one(1, "stop function deactivated")]);

const RAMP_MODE: Values = Values::Only(&[one(0, "position mode"), one(1, "soft mode"), one(2, "velocity mode")]);

const MICROSTEP_RESOLUTION: Values = Values::Only(&[
    one(0, "full step"),
    one(1, "half step"),
    one(2, "4 microsteps"),
    one(3, "8 microsteps"),
    one(4, "16 microsteps"),
    one(5, "32 microsteps"),
    one(6, "64 microsteps"),
]);

const SOFT_STOP: Values = Values::Only(&[one(0, "stop immediately at a switch"), one(1, "soft stop")]);

const REFERENCE_SEARCH_MODE: Values = Values::Only(&[
    one(1, "search left reference switch only"),
    one(2, "search right switch, then left switch"),
    one(3, "three switch mode: right switch, then reference switch"),
]);

const MIXED_DECAY: Values = Values::Notes(&[one(-1, "mixed decay always on, also in the rising part")]);

const STALL_DETECTION: Values = Values::Only(&[one(0, "no stall detection"), span(1, 7, "threshold low to high")]);

const EXTENDED_ERROR_FLAGS: Values =
    Values::Bits(&[bits(0, 0, "stopped by encoder deviation"), bits(1, 1, "stopped by stall")]);

const DRIVER_ERROR_FLAGS: Values = Values::Bits(&[
    bits(0, 0, "overcurrent bridge A low side"),
    bits(1, 1, "overcurrent bridge B low side"),
    bits(2, 2, "open load bridge A"),
    bits(3, 3, "open load bridge B"),
    bits(4, 4, "overcurrent high side"),
    bits(5, 5, "driver undervoltage"),
    bits(6, 6, "temperature warning"),
    bits(7, 7, "overtemperature"),
]);

const SHUTDOWN_PIN: Values = Values::Only(&[one(0, "no function"), one(1, "high active"), one(2, "low active")]);
