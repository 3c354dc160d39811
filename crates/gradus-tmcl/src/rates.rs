//! The rates of the lines, by the values of the global parameters that choose them.

/// Bits a second of RS-232 and RS-485, by the value of global parameter 65.
pub const BAUD_RATES: [u32; 12] =
    [9600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400, 250_000, 500_000, 1_000_000];

/// Bits a second of a CAN bus, by the value of global parameter 69; 0: there is no such value.
pub const CAN_BIT_RATES: [u32; 9] = [0, 0, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{Gp, TMCM_351, TMCM_1617, TMCM_3351};

    #[test]
    fn rates_are_those_that_the_catalogue_names() {
        for module in [&TMCM_3351, &TMCM_351, &TMCM_1617] {
            for (id, rates) in [(Gp::SerialBaudRate, BAUD_RATES.as_slice()), (Gp::CanBitRate, &CAN_BIT_RATES)] {
                let row = module.global_parameters.iter().find(|row| row.id == id).unwrap();
                let crate::catalogue::Values::Only(names) = row.values else { panic!("no names") };
                for name in names {
                    let (number, thousands) =
                        name.text.split_once(' ').map_or((name.text, 1), |(kilo, _)| (kilo, 1000));
                    assert_eq!(rates[name.first as usize], number.parse::<u32>().unwrap() * thousands, "{}", name.text);
                }
            }
        }
    }
}
