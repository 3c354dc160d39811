//! Every axis and global parameter of the catalogue: defaults, ranges, access, storage (BEHAVIOUR 1 and 6).

use gradus_tmcl::catalogue::{Access, Ap, AxisParameter, GlobalParameter, Gp, TMCM_3351, Values};
use gradus_tmcl::{Instruction, Opcode};

use crate::support::{Bench, instruction};

// Axis parameters.

/// Values around the limits of a row, those of its list and those between them, as far as a datagram carries them.
fn candidates(min: i64, max: i64, values: Values) -> impl Iterator<Item = i32> {
    let mut candidates = vec![min - 1, min, min + 1, (min + max) / 2, max - 1, max, max + 1];
    candidates.extend(values.choices().iter().flat_map(|choice| [choice.first - 1, choice.first, choice.last + 1]));
    candidates.into_iter().filter_map(|value| i32::try_from(value).ok())
}

fn sap(row: &AxisParameter, axis: u8, value: i32) -> Instruction {
    Instruction::new(Opcode::SAP, row.number, axis, value)
}

#[test]
fn axis_parameters_begin_with_their_defaults() {
    let mut bench = Bench::new();
    for row in TMCM_3351.axis_parameters {
        for axis in 0..3 {
            if let Some(default) = row.default {
                assert_eq!(i64::from(bench.get(row.number, axis)), default, "AP {} {}", row.number, row.name);
            }
        }
    }
}

#[test]
fn writable_axis_parameters_take_what_their_row_accepts() {
    // Torque needs a closed loop.
    let settings = TMCM_3351.axis_parameters.iter().filter(|row| row.access.writable() && row.id != Ap::TorqueMode);
    for row in settings {
        let mut bench = Bench::new();
        for value in candidates(row.min, row.max, row.values) {
            let before = bench.get(row.number, 1);
            let status = if row.accepts(value) { 100 } else { 4 };
            assert_eq!(bench.obey(sap(row, 1, value)), (status, value), "SAP {}, 1, {value}", row.number);
            let expected = if row.accepts(value) { value } else { before };
            assert_eq!(bench.get(row.number, 1), expected, "GAP {} after {value}", row.number);
        }
    }
}

#[test]
fn axis_parameter_limits_are_those_of_the_row() {
    for row in TMCM_3351.axis_parameters.iter().filter(|row| row.access.writable()) {
        let mut bench = Bench::new();
        for value in [row.min - 1, row.max + 1].into_iter().filter_map(|value| i32::try_from(value).ok()) {
            assert_eq!(bench.obey(sap(row, 0, value)).0, 4, "SAP {}, 0, {value}", row.number);
        }
    }
}

#[test]
fn axis_parameters_of_one_axis_leave_the_others_alone() {
    let mut bench = Bench::set_up("SAP 4, 1, 777");
    assert_eq!([0, 1, 2].map(|axis| bench.get(4, axis)), [51_200, 777, 51_200]);
}

#[test]
fn read_only_axis_parameters_refuse_every_value() {
    let mut bench = Bench::new();
    for row in TMCM_3351.axis_parameters.iter().filter(|row| row.access == Access::R) {
        for value in candidates(row.min, row.max, row.values) {
            assert_eq!(bench.obey(sap(row, 0, value)), (3, value), "SAP {}, 0, {value}", row.number);
        }
    }
}

#[test]
fn unlisted_axis_parameters_do_not_exist() {
    let mut bench = Bench::new();
    for number in (0..=255).filter(|number| TMCM_3351.axis_parameter(*number).is_none()) {
        for opcode in [Opcode::GAP, Opcode::SAP, Opcode::AAP, Opcode::GAPX, Opcode::SAPX, Opcode::AAPX] {
            assert_eq!(bench.obey(Instruction::new(opcode, number, 0, 5)), (3, 5), "{opcode:?} {number}");
        }
    }
}

#[test]
fn axis_3_does_not_exist() {
    let mut bench = Bench::new();
    for number in 0..=255 {
        for axis in [3, 4, 255] {
            assert_eq!(bench.obey(Instruction::new(Opcode::GAP, number, axis, 0)).0, 4, "GAP {number}, {axis}");
            assert_eq!(bench.obey(Instruction::new(Opcode::SAP, number, axis, 0)).0, 4, "SAP {number}, {axis}");
        }
    }
}

#[test]
fn axis_parameters_are_lost_at_power_off() {
    let mut bench = Bench::set_up("SAP 4, 0, 777; SAP 6, 2, 99");
    assert_eq!(bench.memory().written(), 0);
    let mut bench = bench.power_cycle();
    assert_eq!((bench.get(4, 0), bench.get(6, 2)), (51_200, 128));
}

// Global parameters.

/// Every number of every row with its bank.
fn globals() -> impl Iterator<Item = (&'static GlobalParameter, u8)> {
    TMCM_3351.global_parameters.iter().flat_map(|row| (row.first..=row.last).map(move |number| (row, number)))
}

fn sgp(row: &GlobalParameter, number: u8, value: i32) -> Instruction {
    Instruction::new(Opcode::SGP, number, row.bank, value)
}

/// Status and value, whatever the addresses are.
fn answer(bench: &mut Bench, instruction: Instruction) -> (u8, i32) {
    let reply = bench.reply(instruction);
    (reply.status.0, reply.value)
}

fn ggp(bench: &mut Bench, row: &GlobalParameter, number: u8) -> i32 {
    let (status, value) = answer(bench, Instruction::new(Opcode::GGP, number, row.bank, 0));
    assert_eq!(status, 100, "GGP {number}, {}", row.bank);
    value
}

/// A value that the row accepts and that is not its default.
fn another(row: &GlobalParameter) -> i32 {
    let differs = |value: &i32| row.accepts(*value) && Some(i64::from(*value)) != row.default;
    candidates(row.min, row.max, row.values).find(differs).unwrap()
}

#[test]
fn global_parameters_begin_with_their_defaults() {
    let mut bench = Bench::new();
    for (row, number) in globals() {
        if let Some(default) = row.default {
            assert_eq!(i64::from(ggp(&mut bench, row, number)), default, "GP {number}, {} {}", row.bank, row.name);
        }
    }
}

#[test]
fn writable_global_parameters_take_what_their_row_accepts() {
    let mut bench = Bench::new();
    for (row, number) in globals().filter(|(row, _)| row.access.writable()) {
        // These say something about replies, or give back something else than was written.
        if matches!(row.id, Gp::SuppressReply | Gp::RandomNumber) {
            continue;
        }
        for value in candidates(row.min, row.max, row.values) {
            let before = ggp(&mut bench, row, number);
            let status = if row.accepts(value) { 100 } else { 4 };
            assert_eq!(answer(&mut bench, sgp(row, number, value)), (status, value), "SGP {number}, {}", row.bank);
            let expected = if row.accepts(value) { value } else { before };
            assert_eq!(ggp(&mut bench, row, number), expected, "GGP {number}, {} after {value}", row.bank);
        }
    }
}

#[test]
fn timer_periods_are_unsigned() {
    let mut bench = Bench::set_up("SGP 0, 3, -1");
    assert_eq!(bench.global(0, 3), -1);
}

#[test]
fn read_only_global_parameters_refuse_every_value() {
    let mut bench = Bench::new();
    for (row, number) in globals().filter(|(row, _)| row.access == Access::R) {
        for value in candidates(row.min, row.max, row.values) {
            assert_eq!(answer(&mut bench, sgp(row, number, value)), (3, value), "SGP {number}, {}", row.bank);
        }
    }
}

#[test]
fn unlisted_global_parameters_do_not_exist() {
    let mut bench = Bench::new();
    for bank in [0, 1, 2, 3, 4, 255] {
        for number in (0..=255).filter(|number| TMCM_3351.global_parameter(bank, *number).is_none()) {
            for opcode in [Opcode::GGP, Opcode::SGP, Opcode::AGP, Opcode::STGP, Opcode::RSGP] {
                let instruction = Instruction::new(opcode, number, bank, 0);
                assert_eq!(answer(&mut bench, instruction).0, 3, "{opcode:?} {number}, {bank}");
            }
        }
    }
}

#[test]
fn stored_global_parameters_survive_power_off_and_the_others_do_not() {
    for (row, number) in globals().filter(|(row, number)| row.access.writable() && number % 8 != 1) {
        if matches!(row.id, Gp::SuppressReply | Gp::RandomNumber | Gp::TickTimer) {
            continue;
        }
        let mut bench = Bench::new();
        let value = another(row);
        assert_eq!(answer(&mut bench, sgp(row, number, value)).0, 100);
        let stored = row.access == Access::Rwa;
        assert_eq!(bench.memory().written() > 0, stored, "GP {number}, {}", row.bank);
        let mut bench = bench.power_cycle();
        let expected = if stored { value } else { row.default.unwrap() as i32 };
        assert_eq!(ggp(&mut bench, row, number), expected, "GP {number}, {} {}", row.bank, row.name);
    }
}

#[test]
fn every_global_parameter_of_bank_0_below_128_is_stored() {
    for (row, number) in globals().filter(|(row, _)| row.bank == 0) {
        assert_eq!(row.access == Access::Rwa, (64..128).contains(&number), "GP {number}");
    }
}

#[test]
fn suppress_reply_is_off_after_power_on() {
    let mut bench = Bench::new();
    bench.send(instruction("SGP 255, 0, 1"));
    assert_eq!(bench.memory().written(), 0);
    assert_eq!(bench.power_cycle().global(255, 0), 0);
}

#[test]
fn bows_have_a_limit_with_their_factor() {
    let mut bench = Bench::new();
    for (command, status) in [
        ("SAP 22, 0, 2147483647", 100),
        ("SAP 35, 0, 217", 100),
        ("SAP 35, 0, 218", 4),
        ("SAP 22, 0, 1834654901", 100),
        ("SAP 35, 0, 255", 100),
        ("SAP 22, 0, 1834654902", 4),
        ("SAP 25, 0, 1834654901", 100),
        ("SAP 25, 0, 2147483647", 4),
    ] {
        assert_eq!(bench.exchange(command).0, status, "{command}");
    }
    assert_eq!([22, 25, 35].map(|number| bench.get(number, 0)), [1_834_654_901, 1_834_654_901, 255]);
}
