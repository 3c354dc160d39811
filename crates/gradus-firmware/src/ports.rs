//! The hardware boundary: what a board, or a simulated machine, gives to the firmware.
//!
//! The traits are at the level of power stage and sensors. A module owns one [`Ports`] and one [`Store`].

use crate::drive::axes::Axes;

/// The hardware of a module.
pub trait Ports: Sized {
    /// The kind of axes that the module has: [`Steppers`](crate::Steppers) or a [`Servo`](crate::Servo).
    type Axes: Axes<Self>;
    /// One power stage with the sensors of its axis: for steppers a [`StepperStage`] with [`AxisInputs`], for a servo a
    /// [`Bridge`] with [`RotorInputs`] and a [`Supply`].
    type Axis;
    /// The ports of the module.
    type Io: Io;

    /// The hardware of an axis, below the module's number of axes.
    fn axis(&mut self, axis: usize) -> &mut Self::Axis;

    /// Digital and analogue ports.
    fn io(&mut self) -> &mut Self::Io;

    /// Exchanges bytes with the device on the SPI bus that chip select 0, 1 or 2 selects. Where nothing is connected zeros come
    /// back; a module without SAC never asks.
    fn exchange(&mut self, _chip_select: u8, bytes: &mut [u8]) {
        bytes.fill(0);
    }
}

/// The power stage of a stepper motor with its driver chip.
pub trait StepperStage {
    /// Sets the coil vector. `phase` counts 1/256 full steps and wraps; its low ten bits are the electrical angle (1024 a
    /// period), the higher bits tell a simulated motor how far the ramp went between two ticks. `current` is 0..=255, 255 is
    /// the module's maximum. Called in every control tick of a
    /// moving axis, and when the current changes.
    fn set_coils(&mut self, phase: i32, current: u8);

    /// Scales the coil vector beside its current, 255 is 1: 255 but in closed loop, where it may change in every tick.
    fn set_scale(&mut self, scale: u8);

    /// Gives the driver chip its settings, at the start and when one changes.
    fn configure(&mut self, settings: &DriverSettings);

    /// What the driver chip reports now.
    fn driver(&mut self) -> DriverState;
}

/// Settings of a stepper driver chip. Speeds are those of the coil vector, in 1/256 full steps a second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DriverSettings {
    /// The chopper runs.
    pub enabled: bool,
    /// Coils without current are shorted; else they are open.
    pub shorted: bool,
    /// StallGuard2 threshold, -64..=63.
    pub stall_threshold: i8,
    /// StallGuard2 reads the mean of four full steps.
    pub stall_filter: bool,
    /// CoolStep, if it is on.
    pub cool_step: Option<CoolStep>,
    /// StealthChop, if it is on.
    pub stealth_chop: Option<StealthChop>,
}

/// Settings of CoolStep.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CoolStep {
    /// Speed above which it works.
    pub above: u32,
    /// A StallGuard2 reading below 32 times this, 1..=15, raises the current.
    pub low: u8,
    /// A reading of 32 times `low + hysteresis + 1` or more lowers it; 0..=15.
    pub hysteresis: u8,
    /// Steps of 1/32 that a low reading raises the current by: 1, 2, 4, 8.
    pub up: u8,
    /// High readings that lower the current by a step: 32, 8, 2, 1.
    pub down: u8,
    /// The lower limit is a quarter of the current of [`StepperStage::set_coils`] instead of a half.
    pub quarter: bool,
}

/// Settings of StealthChop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StealthChop {
    /// Speed below which it works.
    pub below: u32,
    /// Rise of the PWM amplitude with speed, 1..=15.
    pub gradient: u8,
    /// PWM amplitude at rest, 0..=255.
    pub amplitude: u8,
    /// The chip finds the amplitude that gives the current.
    pub autoscale: bool,
}

/// What a stepper driver chip reports.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DriverState {
    /// StallGuard2 value, 0..=1023; 0 is full load.
    pub load: u16,
    /// The flags of axis parameter 208.
    pub flags: u8,
    /// Current of CoolStep in steps of 1/32, 0..=31.
    pub current_step: u8,
    /// PWM amplitude of StealthChop, 255 is all voltage.
    pub pwm_scale: u8,
    /// StealthChop is in use.
    pub stealth_chop: bool,
}

impl DriverState {
    /// Flag: the motor stalls.
    pub const STALL: u8 = 1;
}

/// Three half bridges with the shunts of two of them.
pub trait Bridge {
    /// Readings of the shunts of phases A and B at the beginning of this PWM period, 0..=65535. A step is 1 mA into the motor;
    /// without current they read about 32767.
    fn shunts(&mut self) -> [u16; 2];

    /// The PWM period that begins now: how long the upper switches of A, B and C are on, 32768 for always. `None`: all
    /// switches stay open. Called once a period while there are control ticks.
    fn set_duties(&mut self, duties: Option<[u16; 3]>);

    /// Opens all switches; until the next [`set_duties`](Self::set_duties) there are no control ticks.
    fn rest(&mut self);

    /// Sets the PWM frequency in Hz, 25000..=100000.
    fn set_frequency(&mut self, hz: u32);

    /// True while the gate driver reports a fault.
    fn is_faulty(&mut self) -> bool;
}

/// Sensors of a servo's rotor.
pub trait RotorInputs {
    /// Levels of the hall sensors, three bits; bit 0 is that of phase A.
    fn hall(&mut self) -> u8;

    /// Encoder counter in counts (four a line), wrapping.
    fn encoder(&mut self) -> i32;

    /// Levels of the encoder's channels: bit 0 is A, bit 1 B, bit 2 N.
    fn encoder_levels(&mut self) -> u8;

    /// As [`AxisInputs::watch_null`].
    fn watch_null(&mut self, event: Option<NullEvent>);

    /// As [`AxisInputs::take_null`].
    fn take_null(&mut self) -> Option<i32>;
}

/// Supply and warmth of a servo's power stage.
pub trait Supply {
    /// Supply voltage in 0.1 V.
    fn voltage_dv(&mut self) -> i32;

    /// Temperature of the power stage in degrees Celsius.
    fn temperature_c(&mut self) -> i32;

    /// Switches the resistor of the brake chopper on or off.
    fn set_brake_chopper(&mut self, on: bool);
}

/// Switches and encoder of an axis.
pub trait AxisInputs {
    /// The levels of the switch inputs.
    fn switches(&mut self) -> Switches;

    /// Encoder counter in counts (four a line), wrapping.
    fn encoder(&mut self) -> i32;

    /// What a null event is from now on; `None`: nobody asks for one. An event that has not been taken is forgotten.
    fn watch_null(&mut self, event: Option<NullEvent>);

    /// The counter's value where the latest null event began, if one has come since the last call.
    fn take_null(&mut self) -> Option<i32>;
}

/// When an encoder's null channel counts. The event begins where the channels come to these levels; true is high.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NullEvent {
    /// Level of the null channel N.
    pub n: bool,
    /// Levels of the channels A and B, `None` if any will do.
    pub ab: Option<(bool, bool)>,
}

/// Levels of the switch inputs of an axis; true is high.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Switches {
    /// Left stop switch.
    pub left: bool,
    /// Right stop switch.
    pub right: bool,
    /// Home switch.
    pub home: bool,
}

/// Digital and analogue ports of a module.
pub trait Io {
    /// Levels of the digital inputs, bit 0 is input 0.
    fn inputs(&mut self) -> u8;

    /// Sets the digital outputs, bit 0 is output 0.
    fn set_outputs(&mut self, levels: u8);

    /// An analogue input of bank 1, 0..=1023, in the range that [`set_circuit`](Io::set_circuit) chose.
    fn analog(&mut self, port: u8) -> i32;

    /// Switches what stands before the inputs.
    fn set_circuit(&mut self, circuit: InputCircuit);

    /// Level of the ENABLE input, which is the SHUTDOWN input of the TMCM-351.
    fn enable(&mut self) -> bool;
}

/// What stands before the inputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct InputCircuit {
    /// Range of ANA0 to ANA3: false 3.3 V, true 10 V.
    pub ten_volts: bool,
    /// Inputs with a pull-up resistor, bit 0 is input 0.
    pub pull_ups: u8,
}

/// A byte-addressed memory that keeps its contents without power. An erased byte may have any value.
pub trait Store {
    /// Reads bytes from `address` on; what lies past the end reads as `0xff`.
    fn read(&mut self, address: u32, bytes: &mut [u8]);

    /// Writes one byte. When the call returns the byte is safe; when the power fails in it the byte is either the old or the
    /// new one.
    fn write(&mut self, address: u32, byte: u8);
}
