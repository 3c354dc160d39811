//! The hardware of a simulated module: plants behind the ports of the firmware.

use gradus_firmware::{
    AxisInputs, CoolStep, DriverSettings, DriverState, NullEvent, Ports, Servo, StealthChop, StepperStage, Steppers,
    Switches,
};
use gradus_plant::{STALLGUARD_NOISE, STEP_US, StepperAxis};
use gradus_tmcl::catalogue::{Model, Module};

use crate::{MachineIo, ServoDrive};

/// How the driver chips of a module report.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DriverChip {
    /// StallGuard2, which falls with the load.
    #[default]
    StallGuard2,
    /// Load in three bits, which rises with it.
    Tmc249,
}

/// Current at full scale of the TMCM-351, in amperes RMS.
const TMCM_351_FULL_SCALE_A: f64 = 2.8;

/// A power stage with the simulated axis it drives.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MachineAxis {
    /// Motor, travel and encoder.
    pub plant: StepperAxis,
    /// How the power stage reports.
    pub chip: DriverChip,
}

impl MachineAxis {
    /// The default axis of this number, whose StallGuard2 has a noise of its own.
    fn of(number: u8) -> Self {
        let mut axis = Self::default();
        axis.plant.set_stallguard_noise(STALLGUARD_NOISE, u32::from(number) + 1);
        axis
    }
}

impl StepperStage for MachineAxis {
    #[inline]
    fn set_coils(&mut self, phase: i32, current: u8) {
        self.plant.set_coils(phase, current);
    }

    #[inline]
    fn set_scale(&mut self, scale: u8) {
        self.plant.set_scale(scale);
    }

    fn configure(&mut self, settings: &DriverSettings) {
        let DriverSettings { enabled, shorted, stall_threshold, stall_filter, cool_step, stealth_chop } = *settings;
        self.plant.configure(gradus_plant::DriverSettings {
            enabled,
            shorted,
            stall_threshold,
            stall_filter,
            cool_step: cool_step.map(|CoolStep { above, low, hysteresis, up, down, quarter }| gradus_plant::CoolStep {
                above,
                low,
                hysteresis,
                up,
                down,
                quarter,
            }),
            stealth_chop: stealth_chop.map(|StealthChop { below, gradient, amplitude, autoscale }| {
                gradus_plant::StealthChop { below, gradient, amplitude, autoscale }
            }),
        });
    }

    fn driver(&mut self) -> DriverState {
        let state = self.plant.driver();
        if self.chip == DriverChip::Tmc249 {
            return tmc249(state);
        }
        let flags = [
            state.stalled,
            state.overheated,
            state.warm,
            state.shorted[0],
            state.shorted[1],
            state.open[0],
            state.open[1],
        ];
        let flags = flags.into_iter().rev().fold(0, |bits, flag| bits << 1 | u8::from(flag));
        DriverState {
            load: state.load,
            flags,
            current_step: state.current_step,
            pwm_scale: state.pwm_scale,
            stealth_chop: state.stealth,
        }
    }
}

/// What the driver chip of the TMCM-351 reports: its flags are those of axis parameter 208. A coil that is shorted to ground shows
/// on the low side of its bridge and on the high side, which the two bridges have in common.
fn tmc249(state: &gradus_plant::DriverState) -> DriverState {
    let [short_a, short_b] = state.shorted;
    let [open_a, open_b] = state.open;
    let flags =
        [short_a, short_b, open_a, open_b, short_a || short_b, state.undervoltage, state.warm, state.overheated];
    let flags = flags.into_iter().rev().fold(0, |bits, flag| bits << 1 | u8::from(flag));
    DriverState { load: u16::from(state.strain), flags, ..DriverState::default() }
}

impl AxisInputs for MachineAxis {
    /// A closed switch is high; an open or missing one is low.
    #[inline]
    fn switches(&mut self) -> Switches {
        let [left, right, home] = self.plant.switches();
        Switches { left, right, home }
    }

    #[inline]
    fn encoder(&mut self) -> i32 {
        self.plant.encoder_count()
    }

    fn watch_null(&mut self, event: Option<NullEvent>) {
        self.plant.watch_null(event.map(|NullEvent { n, ab }| gradus_plant::NullEvent { n, ab }));
    }

    #[inline]
    fn take_null(&mut self) -> Option<i32> {
        self.plant.take_null()
    }
}

/// All that hangs on the connectors of a module. [`Default`] is nothing.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Machine {
    /// The stepper axes, one for each motor of the module; none of a servo module.
    pub axes: Vec<MachineAxis>,
    /// The servo, of a servo module.
    pub servos: Vec<ServoDrive>,
    /// Digital and analogue ports.
    pub io: MachineIo,
}

impl Machine {
    /// The machine of a module: default motors with a light load and an encoder.
    pub fn of(catalogue: &Module) -> Self {
        let (steppers, servos) = if catalogue.is_servo() { (0, catalogue.axes) } else { (catalogue.axes, 0) };
        Self {
            axes: (0..steppers).map(MachineAxis::of).collect(),
            servos: vec![ServoDrive::default(); servos.into()],
            io: MachineIo::of(catalogue),
        }
    }

    /// The same with stepper axes that never lose a step, with 200 full steps a turn and an encoder. A servo is as it is.
    pub fn rigid(catalogue: &Module) -> Self {
        let mut machine = Self::of(catalogue);
        machine.axes.fill(MachineAxis { plant: StepperAxis::rigid(200), ..MachineAxis::default() });
        machine
    }

    /// Puts the machine on a module: its power stages.
    pub(crate) fn fit(&mut self, module: &Module) {
        if module.model == Model::Tmcm351 {
            for axis in &mut self.axes {
                axis.chip = DriverChip::Tmc249;
                axis.plant.set_full_scale(TMCM_351_FULL_SCALE_A);
            }
        }
    }

    /// True if time has a meaning for an axis.
    pub(crate) fn lives(&self) -> bool {
        self.axes.iter().any(|axis| axis.plant.lives()) || self.servos.iter().any(ServoDrive::is_ticking)
    }

    /// True while an axis needs its steps.
    pub(crate) fn is_awake(&self) -> bool {
        self.axes.iter().any(|axis| axis.plant.is_awake()) || self.servos.iter().any(ServoDrive::is_awake)
    }

    /// Lets all axes look at their surroundings anew.
    pub(crate) fn wake(&mut self) {
        self.axes.iter_mut().for_each(|axis| axis.plant.wake());
        self.servos.iter_mut().for_each(|servo| servo.surround(self.io.surroundings));
    }

    /// A step of all axes that are awake, which ends at `now_us`.
    #[inline]
    pub(crate) fn advance(&mut self, now_us: u64) {
        for axis in &mut self.axes {
            axis.plant.advance(now_us, &self.io.surroundings);
        }
        for servo in &mut self.servos {
            servo.advance(STEP_US as f64 * 1e-6);
        }
    }

    /// What the loss of power does: no current in the coils, all outputs low.
    pub(crate) fn lose_power(&mut self) {
        for axis in &mut self.axes {
            axis.plant.release();
        }
        for servo in &mut self.servos {
            servo.release();
        }
        self.io.lose_power();
    }
}

/// The machine of a servo module.
#[derive(Clone, Debug)]
pub struct ServoBoard(pub(crate) Machine);

impl Ports for ServoBoard {
    type Axes = Servo;
    type Axis = ServoDrive;
    type Io = MachineIo;

    #[inline]
    fn axis(&mut self, axis: usize) -> &mut ServoDrive {
        &mut self.0.servos[axis]
    }

    #[inline]
    fn io(&mut self) -> &mut MachineIo {
        &mut self.0.io
    }
}

impl Ports for Machine {
    type Axes = Steppers;
    type Axis = MachineAxis;
    type Io = MachineIo;

    #[inline]
    fn axis(&mut self, axis: usize) -> &mut MachineAxis {
        &mut self.axes[axis]
    }

    #[inline]
    fn io(&mut self) -> &mut MachineIo {
        &mut self.io
    }

    fn exchange(&mut self, chip_select: u8, bytes: &mut [u8]) {
        match self.io.spi.get_mut(usize::from(chip_select)) {
            Some(device) => device.exchange(bytes),
            None => bytes.fill(0),
        }
    }
}
