//! Whatever comes, nothing panics and time goes on.

use gradus_tmcl::catalogue::Ap;
use gradus_tmcl::{Instruction, Opcode};
use proptest::prelude::*;

use crate::support::{Bench, Memory, fuzz_datagrams};

fn any_instruction() -> impl Strategy<Value = Instruction> {
    let opcode = prop_oneof![4 => 0..=60_u8, 1 => any::<u8>()];
    let small = prop_oneof![4 => 0..8_u8, 1 => any::<u8>()];
    let value = prop_oneof![4 => -3..40_i32, 1 => any::<i32>(), 1 => Just(i32::MIN), 1 => Just(i32::MAX)];
    (opcode, prop_oneof![small.clone(), any::<u8>()], small, value)
        .prop_map(|(opcode, kind, motor, value)| Instruction::new(Opcode(opcode), kind, motor, value))
}

/// A module that runs these instructions, without those that control the download.
fn running(program: &[Instruction]) -> Bench {
    let mut bench = Bench::new();
    bench.control(132, 0, 0);
    for instruction in program.iter().filter(|instruction| instruction.opcode.0 < 128) {
        bench.send(*instruction);
    }
    bench.control(133, 0, 0);
    bench.control(129, 0, 0);
    bench
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_in_any_portions_are_survived(data in prop::collection::vec(any::<u8>(), 0..600)) {
        fuzz_datagrams(&data);
    }

    #[test]
    fn answers_do_not_depend_on_portions(
        bytes in prop::collection::vec(any::<u8>(), 0..90),
        cuts in prop::collection::vec(0..90_usize, 0..10),
    ) {
        let whole = Bench::new().raw(&bytes);
        let mut cuts: Vec<usize> = cuts.into_iter().filter(|cut| *cut < bytes.len()).collect();
        cuts.extend([0, bytes.len()]);
        cuts.sort_unstable();
        let mut bench = Bench::new();
        let portions: Vec<_> = cuts.windows(2).flat_map(|cut| bench.raw(&bytes[cut[0]..cut[1]])).collect();
        prop_assert_eq!(portions, whole);
    }

    #[test]
    fn any_program_is_survived(
        program in prop::collection::vec(any_instruction(), 1..40),
        steps in prop::collection::vec(0..30_000_u64, 1..20),
    ) {
        let mut bench = running(&program);
        for (i, step) in steps.into_iter().enumerate() {
            bench.board().inputs = i as u8;
            bench.advance_us(step);
            prop_assert!(bench.module.poll_at().is_none_or(|at| at > bench.now), "nothing is left to do at {}", bench.now);
        }
    }

    #[test]
    fn any_axis_parameters_are_survived(
        settings in prop::collection::vec((any::<u8>(), 0..3_u8, prop_oneof![any::<i32>(), -1000..100_000_i32]), 1..40),
        target in any::<i32>(),
        steps in prop::collection::vec(0..100_000_u64, 1..10),
    ) {
        let mut bench = Bench::new();
        for (number, axis, value) in settings {
            bench.obey(Instruction::new(Opcode::SAP, number, axis, value));
        }
        for (step, axis) in steps.into_iter().zip([0, 1, 2].into_iter().cycle()) {
            bench.obey(Instruction::new(Opcode::MVP, 1, axis, target));
            bench.advance_us(step);
        }
    }

    #[test]
    fn polling_often_and_seldom_is_the_same(
        program in prop::collection::vec(any_instruction(), 1..30),
        cuts in prop::collection::vec(0..200_000_u64, 0..40),
    ) {
        let run = |cuts: &[u64]| {
            let mut bench = running(&program);
            for cut in cuts {
                bench.advance_us(cut - bench.now);
            }
            bench.advance_us(200_000 - bench.now);
            // The program may have changed addresses and suppressed replies; GGP is always answered.
            let mut global = |number| bench.reply(Instruction::new(Opcode::GGP, number, 0, 0)).value;
            let program = [128, 130, 131].map(&mut global);
            let axes = [Ap::TargetPosition, Ap::ActualPosition, Ap::TargetSpeed, Ap::ActualSpeed]
                .map(|id| [0, 1, 2].map(|axis| bench.peek(axis, id)));
            let phases = [0, 1, 2].map(|axis| (bench.stage(axis).phase, bench.stage(axis).current));
            (program, axes, phases, bench.module.outputs())
        };
        let mut cuts = cuts;
        cuts.sort_unstable();
        prop_assert_eq!(run(&cuts), run(&[]));
    }

    #[test]
    fn any_power_cut_leaves_the_old_or_the_new_value(
        writes in prop::collection::vec((prop::sample::select(vec![68_u8, 75, 82, 83]), 0..255_i32), 1..20),
        power in 0..200_usize,
    ) {
        let mut bench = Bench::with_memory(Memory { power: Some(power), ..Memory::blank(0xff) });
        let mut allowed = [68_u8, 75, 82, 83].map(|number| (number, vec![0]));
        for (number, value) in &writes {
            let alive = bench.memory().power != Some(0);
            bench.obey(Instruction::new(Opcode::SGP, *number, 0, *value));
            let values = &mut allowed.iter_mut().find(|(other, _)| other == number).unwrap().1;
            match (alive, bench.memory().power != Some(0)) {
                (true, true) => *values = vec![*value],
                (true, false) => values.push(*value),
                _ => {}
            }
        }
        let (_, memory) = bench.module.into_parts();
        let mut bench = Bench::with_memory(Memory { power: None, ..memory });
        for (number, values) in allowed {
            prop_assert!(values.contains(&bench.global(number, 0)), "GP {}, {:?}", number, values);
        }
    }
}
