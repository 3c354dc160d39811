//! Digital and analogue ports of a simulated module.

use gradus_firmware::{InputCircuit, Io};
use gradus_plant::Surroundings;
use gradus_tmcl::catalogue::Module;

use crate::SpiDevice;

/// Full scale of the converters of 10 and 12 bits.
const TEN_BITS: i32 = 1023;
const TWELVE_BITS: i32 = 4095;

/// Ports that measure the board itself.
const SUPPLY_ADC: u8 = 4;
const TEMPERATURE_ADC: u8 = 5;
const SUPPLY_DECIVOLT: u8 = 8;
const TEMPERATURE_CELSIUS: u8 = 9;

/// A converter with its input circuit: from a physical quantity to an ADC value and back.
///
/// The manuals do not say how the board measures itself, so [`Adc::SUPPLY`] and [`Adc::TEMPERATURE`] are choices.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Adc {
    zero: f64,
    full: f64,
    full_scale: i32,
}

impl Adc {
    /// ANA0 to ANA3 in the range that `SIO 8, 0, 0` selects, in volts.
    pub const THREE_VOLTS: Self = Self { zero: 0.0, full: 3.3, full_scale: TEN_BITS };
    /// ANA0 to ANA3 in the range that `SIO 8, 0, 1` selects, in volts; IN6 and IN7 always.
    pub const TEN_VOLTS: Self = Self { zero: 0.0, full: 10.0, full_scale: TEN_BITS };
    /// Supply voltage behind a divider by 17, in volts: 24.0 V is 438.
    pub const SUPPLY: Self = Self { zero: 0.0, full: 56.1, full_scale: TEN_BITS };
    /// A sensor of 0.5 V at 0 degC and 10 mV a degree at a 3.3 V converter, in degrees Celsius: 25 degC is 233.
    pub const TEMPERATURE: Self = Self { zero: -50.0, full: 280.0, full_scale: TEN_BITS };
    /// AIN0 to AIN2 of the TMCM-1617, 12 bits, in volts: a choice too.
    pub const SERVO: Self = Self { zero: 0.0, full: 5.0, full_scale: TWELVE_BITS };

    /// The ADC value of a quantity, from 0 to the full scale, rounded; what is out of range reads as the end of the range.
    pub fn value(self, quantity: f64) -> i32 {
        let share = (quantity - self.zero) / (self.full - self.zero);
        let full_scale = f64::from(self.full_scale);
        (share * full_scale).round().clamp(0.0, full_scale) as i32
    }

    /// The quantity that reads as `value`.
    pub fn quantity(self, value: i32) -> f64 {
        self.zero + f64::from(value) / f64::from(self.full_scale) * (self.full - self.zero)
    }
}

/// Levels and voltages on the connectors of a module.
///
/// IN6 and IN7 are one pin each in banks 0 and 1, and so are the ports 0, 1 and 2 of both banks of a TMCM-1617 (its manual, §3.6.14: the
/// analogue lines can be read as digital inputs in bank 0): the digital level is high from half of the converter's range on.
#[derive(Clone, PartialEq, Debug)]
pub struct MachineIo {
    inputs: u8,
    outputs: u8,
    enable: bool,
    circuit: InputCircuit,
    /// Inputs that something drives; the others have the level of their pull-up resistor.
    driven: u8,
    /// The converters are those of the TMCM-1617.
    servo: bool,
    /// Voltages of bank 1; [`Self::ANALOG_PINS`] says which are pins.
    volts: [f64; 8],
    /// Supply and climate of the module.
    pub surroundings: Surroundings,
    /// What the chip selects of the SPI bus select.
    pub spi: [SpiDevice; 3],
}

impl MachineIo {
    /// The ports of bank 1 that are pins; the others measure the board.
    pub const ANALOG_PINS: [u8; 6] = [0, 1, 2, 3, 6, 7];

    /// The same of a TMCM-1617.
    pub const SERVO_PINS: [u8; 3] = [0, 1, 2];

    /// Those of this module.
    pub fn analog_pins(&self) -> &'static [u8] {
        if self.servo { &Self::SERVO_PINS } else { &Self::ANALOG_PINS }
    }

    /// What a converter of bank 1 reads at the end of its range.
    pub fn full_scale(&self) -> i32 {
        if self.servo { TWELVE_BITS } else { TEN_BITS }
    }

    /// The ports of a module, everything low.
    pub fn of(catalogue: &Module) -> Self {
        Self { servo: catalogue.is_servo(), ..Self::default() }
    }

    /// Sets a digital input, below 8. A pin that is analogue too goes to an end of the converter's range.
    pub fn set_input(&mut self, port: u8, level: bool) {
        if self.is_both(port) {
            self.set_analog(port, if level { self.full_scale() } else { 0 });
        } else {
            self.set_level(port, level);
        }
    }

    /// Puts the voltage on an analogue pin that reads as `value` in the range of this moment. The voltage stays when the
    /// range changes.
    pub fn set_analog(&mut self, port: u8, value: i32) {
        let volts = self.adc(port).quantity(value);
        if let Some(pin) = self.volts.get_mut(usize::from(port)) {
            *pin = volts;
        }
        if self.is_both(port) {
            self.set_level(port, value > self.full_scale() / 2);
        }
    }

    /// Sets the level of the ENABLE input.
    pub fn set_enable(&mut self, level: bool) {
        self.enable = level;
    }

    /// Levels of the digital inputs, bit 0 is input 0.
    pub fn levels(&self) -> u8 {
        self.inputs & self.driven | self.circuit.pull_ups & !self.driven
    }

    /// Levels of the digital outputs, bit 0 is output 0.
    pub fn outputs(&self) -> u8 {
        self.outputs
    }

    /// Level of the ENABLE input.
    pub fn enabled(&self) -> bool {
        self.enable
    }

    /// What a port of bank 1 reads: an ADC value; the supply in 0.1 V from port 8, the temperature in degC from port 9.
    pub fn adc_value(&self, port: u8) -> i32 {
        let Surroundings { supply_v, temperature_c } = self.surroundings;
        match port {
            _ if self.servo => self.volts.get(usize::from(port)).map_or(0, |volts| Adc::SERVO.value(*volts)),
            SUPPLY_ADC => Adc::SUPPLY.value(supply_v),
            TEMPERATURE_ADC => Adc::TEMPERATURE.value(temperature_c),
            SUPPLY_DECIVOLT => (supply_v * 10.0).round() as i32,
            TEMPERATURE_CELSIUS => temperature_c.round() as i32,
            _ => self.volts.get(usize::from(port)).map_or(0, |volts| self.adc(port).value(*volts)),
        }
    }

    /// Takes the drive from the outputs; the converters are in their 3.3 V range after power-on.
    pub(crate) fn lose_power(&mut self) {
        self.outputs = 0;
        self.circuit = InputCircuit::default();
        self.spi.iter_mut().for_each(SpiDevice::lose_power);
    }

    fn is_both(&self, port: u8) -> bool {
        if self.servo { Self::SERVO_PINS.contains(&port) } else { matches!(port, 6 | 7) }
    }

    fn set_level(&mut self, port: u8, level: bool) {
        let bit = 1_u8.checked_shl(port.into()).unwrap_or(0);
        self.driven |= bit;
        self.inputs = if level { self.inputs | bit } else { self.inputs & !bit };
    }

    fn adc(&self, port: u8) -> Adc {
        match port {
            _ if self.servo => Adc::SERVO,
            _ if self.circuit.ten_volts || self.is_both(port) => Adc::TEN_VOLTS,
            _ => Adc::THREE_VOLTS,
        }
    }
}

impl Default for MachineIo {
    /// Everything low, ENABLE high.
    fn default() -> Self {
        Self {
            inputs: 0,
            outputs: 0,
            enable: true,
            circuit: InputCircuit::default(),
            driven: 0,
            servo: false,
            volts: [0.0; 8],
            surroundings: Surroundings::default(),
            spi: Default::default(),
        }
    }
}

impl Io for MachineIo {
    #[inline]
    fn inputs(&mut self) -> u8 {
        self.levels()
    }

    #[inline]
    fn set_outputs(&mut self, levels: u8) {
        self.outputs = levels;
    }

    fn analog(&mut self, port: u8) -> i32 {
        self.adc_value(port)
    }

    fn set_circuit(&mut self, circuit: InputCircuit) {
        self.circuit = circuit;
    }

    #[inline]
    fn enable(&mut self) -> bool {
        self.enable
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analogue_pin_reads_what_was_set() {
        for ten_volts in [false, true] {
            for port in MachineIo::ANALOG_PINS {
                for value in 0..=1023 {
                    let mut io = MachineIo::default();
                    io.set_circuit(InputCircuit { ten_volts, ..InputCircuit::default() });
                    io.set_analog(port, value);
                    assert_eq!(io.analog(port), value, "port {port}");
                }
            }
        }
    }

    #[test]
    fn voltage_stays_when_the_range_changes() {
        let mut io = MachineIo::default();
        io.set_analog(0, 1000);
        io.set_circuit(InputCircuit { ten_volts: true, ..InputCircuit::default() });
        assert_eq!(io.analog(0), 330);
        io.set_analog(0, 1000);
        io.set_circuit(InputCircuit::default());
        assert_eq!(io.analog(0), 1023);
    }

    #[test]
    fn in6_and_in7_are_digital_and_analogue() {
        let mut io = MachineIo::default();
        let cases = [(511, 0), (512, 1 << 6)];
        for (value, inputs) in cases {
            io.set_analog(6, value);
            assert_eq!(io.inputs(), inputs, "ADC value {value}");
        }
        io.set_input(7, true);
        assert_eq!((io.inputs(), io.analog(7)), (0b1100_0000, 1023));
        io.set_input(7, false);
        assert_eq!((io.inputs(), io.analog(7)), (0b0100_0000, 0));
    }

    #[test]
    fn analogue_lines_of_a_servo_module_are_digital_inputs_too() {
        let mut io = MachineIo::of(&gradus_tmcl::catalogue::TMCM_1617);
        for port in 0..3 {
            for (value, level) in [(0, 0), (2047, 0), (2048, 1 << port), (4095, 1 << port)] {
                io.set_analog(port, value);
                assert_eq!((io.analog(port), io.inputs()), (value, level), "port {port}");
            }
            io.set_input(port, false);
            assert_eq!((io.analog(port), io.inputs()), (0, 0));
        }
        io.set_input(3, true);
        assert_eq!((io.inputs(), io.analog(3)), (1 << 3, 0), "REF_L is digital only");
    }

    #[test]
    fn board_measures_supply_and_temperature() {
        let mut io = MachineIo::default();
        assert_eq!([4, 5, 8, 9].map(|port| io.analog(port)), [438, 233, 240, 25]);
        io.surroundings = Surroundings { supply_v: 60.0, temperature_c: -60.0 };
        assert_eq!([4, 5, 8, 9].map(|port| io.analog(port)), [1023, 0, 600, -60]);
    }

    #[test]
    fn unknown_ports_read_zero_and_change_nothing() {
        let mut io = MachineIo::default();
        io.set_input(8, true);
        io.set_analog(200, 5);
        assert_eq!((io.analog(200), io), (0, MachineIo::default()));
    }

    #[test]
    fn input_that_nothing_drives_has_the_level_of_its_pull_up() {
        let mut io = MachineIo::default();
        io.set_circuit(InputCircuit { pull_ups: 0b0110, ten_volts: false });
        assert_eq!(io.inputs(), 0b0110);
        io.set_input(1, false);
        io.set_input(3, true);
        assert_eq!(io.inputs(), 0b1100);
        io.set_circuit(InputCircuit::default());
        assert_eq!(io.inputs(), 0b1000);
    }
}
