//! Whatever is set and measured, nothing panics, and a driver that must be off is off.

use gradus_tmcl::catalogue::TMCM_1617;
use gradus_tmcl::{Instruction, Opcode};
use proptest::prelude::*;

use crate::support::{Bench, Drive};

/// A value at or near an end of the range of a parameter, or anywhere.
fn any_setting() -> impl Strategy<Value = Instruction> {
    let rows = TMCM_1617.axis_parameters;
    (0..rows.len(), 0..6_u8, any::<i32>()).prop_map(move |(row, place, any)| {
        let row = &rows[row];
        let value = match place {
            0 => row.min as i32,
            1 => row.max as i32,
            2 => (i64::from(any).rem_euclid(row.max - row.min + 1) + row.min) as i32,
            3 => row.default.unwrap_or(0) as i32,
            _ => any % 10,
        };
        Instruction::new(Opcode::SAP, row.number, 0, value)
    })
}

fn any_command() -> impl Strategy<Value = Instruction> {
    let value = prop_oneof![-3..5_i32, any::<i32>(), -200_000..200_000_i32, Just(i32::MIN), Just(i32::MAX)];
    let motion = (1..5_u8, 0..3_u8, value).prop_map(|(op, kind, value)| Instruction::new(Opcode(op), kind, 0, value));
    let commutate = (0..4_i32).prop_map(|mode| Instruction::new(Opcode::SAP, 15, 0, mode));
    prop_oneof![3 => any_setting(), 2 => motion, 1 => commutate]
}

type Sensors = ([u16; 2], u8, i32, i32, bool);

fn any_sensors() -> impl Strategy<Value = Sensors> {
    let shunt = prop_oneof![30_000..36_000_u16, any::<u16>()];
    let count = prop_oneof![-5000..5000_i32, any::<i32>()];
    ([shunt.clone(), shunt], 0..8_u8, count.clone(), count, any::<bool>())
}

fn put(drive: &mut Drive, (shunts, hall, encoder, counts_per_tick, null): Sensors) {
    (drive.shunts, drive.hall, drive.encoder, drive.counts_per_tick) = (shunts, hall, encoder, counts_per_tick);
    drive.null = null.then_some(encoder);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn any_settings_and_sensors_are_survived(
        steps in prop::collection::vec((any_command(), any_sensors(), 0..3000_u64), 1..40)
    ) {
        let mut bench = Bench::new();
        for (command, sensors, us) in steps {
            bench.obey(command);
            put(bench.drive(), sensors);
            bench.advance_us(us);
            for row in TMCM_1617.axis_parameters {
                bench.peek(row.id);
            }
            prop_assert!(bench.module.poll_at().is_none_or(|at| at > bench.now));
        }
    }

    #[test]
    fn driver_is_off_while_there_is_a_fault(
        steps in prop::collection::vec((any_sensors(), 60..340_i32, 20..130_i32), 1..20)
    ) {
        let mut bench = Bench::set_up("SAP 15, 0, 2; ROR 0, 500");
        for (sensors, voltage_dv, temperature_c) in steps {
            put(bench.drive(), sensors);
            (bench.drive().voltage_dv, bench.drive().temperature_c) = (voltage_dv, temperature_c);
            bench.advance_us(200);
            let faults = bench.get(156) & 0xef;
            prop_assert!(faults == 0 || bench.drive().duties.is_none(), "faults {:#x}", faults);
            prop_assert!(voltage_dv > 80 || faults & 2 != 0, "{} dV, faults {:#x}", voltage_dv, faults);
        }
    }
}
