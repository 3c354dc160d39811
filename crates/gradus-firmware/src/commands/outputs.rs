//! Ports: SIO and GIO.

use gradus_tmcl::Status;

use crate::module::Module;
use crate::ports::{InputCircuit, Io, Ports, Store};

const INPUTS: u8 = 0;
const ANALOG: u8 = 1;

/// Port number for all ports of a bank.
const ALL: u8 = 255;
/// Range of the analogue inputs, a port of bank 0 that is written.
const ADC_RANGE: u8 = 8;
/// The ENABLE input of the TMCM-3351, a port of bank 0.
const ENABLE: u8 = 10;

/// `SIO 255, 2, -1` sends the accumulator.
const ACCUMULATOR: i32 = -1;

/// What the firmware has set.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Outputs {
    pub(crate) levels: u8,
    circuit: InputCircuit,
}

impl<P: Ports, S: Store> Module<P, S> {
    /// GIO.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if there is no such port.
    pub(crate) fn get_port(&mut self, number: u8, bank: u8) -> Result<i32, Status> {
        self.catalogue.port(bank, number).ok_or(Status::WRONG_TYPE)?;
        let io = self.ports.io();
        Ok(match (bank, number) {
            (INPUTS, ALL) => i32::from(io.inputs()),
            (INPUTS, ADC_RANGE) => i32::from(self.outputs.circuit.ten_volts),
            (INPUTS, ENABLE) => i32::from(io.enable()),
            (INPUTS, _) => level(io.inputs(), number),
            (ANALOG, _) => io.analog(number),
            (_, ALL) => i32::from(self.outputs.levels),
            _ => level(self.outputs.levels, number),
        })
    }

    /// SIO.
    ///
    /// # Errors
    /// [`Status::WRONG_TYPE`] if there is no such output, [`Status::INVALID_VALUE`] for a value that it does not take.
    pub(crate) fn set_port(&mut self, number: u8, bank: u8, value: i32) -> Result<(), Status> {
        let row = self.catalogue.output(bank, number).ok_or(Status::WRONG_TYPE)?;
        if !row.range.is_some_and(|(min, max)| (min..=max).contains(&value)) {
            return Err(Status::INVALID_VALUE);
        }
        match (bank, number) {
            (INPUTS, ADC_RANGE) => self.set_circuit(InputCircuit { ten_volts: value != 0, ..self.outputs.circuit }),
            (INPUTS, _) => self.set_circuit(InputCircuit { pull_ups: value as u8, ..self.outputs.circuit }),
            (_, ALL) if value == ACCUMULATOR => self.set_outputs(self.program.cpu.registers.accumulator as u8),
            (_, ALL) => self.set_outputs(value as u8),
            _ => self.set_output(number, value != 0),
        }
        Ok(())
    }

    fn set_circuit(&mut self, circuit: InputCircuit) {
        self.outputs.circuit = circuit;
        self.ports.io().set_circuit(circuit);
    }

    fn set_output(&mut self, number: u8, high: bool) {
        let bit = 1_u8.checked_shl(u32::from(number)).unwrap_or(0);
        let levels = self.outputs.levels;
        self.set_outputs(if high { levels | bit } else { levels & !bit });
    }

    fn set_outputs(&mut self, levels: u8) {
        self.outputs.levels = levels;
        self.ports.io().set_outputs(levels);
    }
}

fn level(levels: u8, number: u8) -> i32 {
    i32::from(levels.checked_shr(u32::from(number)).unwrap_or(0) & 1)
}
