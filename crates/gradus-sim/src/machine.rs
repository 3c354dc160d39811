//! The hardware of a simulated module: plants behind the ports of the firmware.

use gradus_firmware::{AxisInputs, DriverState, NullEvent, Ports, StepperStage, Steppers, Switches};
use gradus_plant::{RigidAxis, Switch};

use crate::MachineIo;

/// A power stage with the simulated axis it drives.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MachineAxis {
    /// Motor, travel and encoder.
    pub plant: RigidAxis,
}

impl StepperStage for MachineAxis {
    #[inline]
    fn set_coils(&mut self, phase: i32, current: u8) {
        self.plant.set_coils(phase, current);
    }

    /// A rigid axis has no load and no faults.
    fn driver(&mut self) -> DriverState {
        DriverState::default()
    }
}

impl AxisInputs for MachineAxis {
    /// A closed switch is high; an open or missing one is low.
    #[inline]
    fn switches(&mut self) -> Switches {
        let [left, right, home] = Switch::ALL.map(|switch| self.plant.switch(switch));
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

/// All that hangs on the connectors of a module.
#[derive(Clone, PartialEq, Debug)]
pub struct Machine {
    /// The axes, one for each motor of the module.
    pub axes: Vec<MachineAxis>,
    /// Digital and analogue ports.
    pub io: MachineIo,
}

impl Machine {
    /// A machine of default axes.
    pub fn new(axes: usize) -> Self {
        Self { axes: vec![MachineAxis::default(); axes], io: MachineIo::default() }
    }

    /// What the loss of power does: no current in the coils, all outputs low.
    pub(crate) fn lose_power(&mut self) {
        for axis in &mut self.axes {
            axis.plant.release();
        }
        self.io.lose_power();
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
}
