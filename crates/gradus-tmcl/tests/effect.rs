//! What a host may send again by itself.

use gradus_tmcl::catalogue::{COMMANDS, Effect, Impact, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode};

fn effect(text: &str) -> Effect {
    Instruction::parse(text, &TMCM_3351).unwrap().effect()
}

#[test]
fn reads_and_absolute_writes_may_be_repeated_and_nothing_else() {
    let cases = [
        (
            Effect::Read,
            ["GAP 1, 0", "GGP 66, 0", "GIO 0, 1", "GCO 1, 0", "RFS STATUS, 0", "DATA 134, 0, 0, 5"].as_slice(),
        ),
        (Effect::Read, &["DATA 135, 1, 0, 0", "DATA 136, 1, 0, 0", "DATA 148, 0, 0, 0", "DATA 157, 0, 0, 0"]),
        (
            Effect::Set,
            &["SAP 4, 0, 1000", "SGP 0, 2, 1", "SIO 0, 2, 1", "ROR 0, 5", "ROL 0, 5", "MST 0", "SCO 1, 0, 9"],
        ),
        (Effect::Set, &["MVP ABS, 0, 1000", "MVP COORD, 0, 1", "STGP 0, 2", "RSGP 0, 2", "RFS STOP, 0", "GCO 1, 255"]),
        (Effect::Act, &["MVP REL, 0, 1000", "RFS START, 0", "CALC ADD, 1", "CCO 1, 0", "EI 0", "UF0 0, 0, 0"]),
        (Effect::Act, &["DATA 128, 0, 0, 0", "DATA 129, 0, 0, 0", "DATA 132, 0, 0, 0", "DATA 255, 0, 0, 1234"]),
    ];
    for (expected, texts) in cases {
        for text in texts {
            assert_eq!(effect(text), expected, "{text}");
        }
    }
}

#[test]
fn what_is_unknown_is_not_repeated() {
    let known: Vec<Opcode> = COMMANDS.iter().map(|command| command.opcode).collect();
    for opcode in (0..=255).map(Opcode).filter(|opcode| !known.contains(opcode)) {
        assert_eq!(Instruction::new(opcode, 0, 0, 0).effect(), Effect::Act);
    }
}

#[test]
fn while_a_line_is_stopped_pass_stops_and_what_only_reads() {
    let reads = [10, 6, 15, 31, 134, 135, 136, 148, 157]; // GAP is 6, GGP 10, GIO 15, GCO 31
    let stops = [3, 128, 133];
    for number in 0..=255 {
        let expected = match number {
            number if reads.contains(&number) => Impact::Reads,
            number if stops.contains(&number) => Impact::Stops,
            _ => Impact::Acts,
        };
        assert_eq!(Instruction::new(Opcode(number), 0, 0, 0).impact(), expected, "{number}");
    }
}

#[test]
fn whether_two_commands_act_depends_on_their_operands() {
    let impact = |text| Instruction::parse(text, &TMCM_3351).unwrap().impact();
    assert_eq!(impact("RFS STATUS, 0"), Impact::Reads);
    assert_eq!([impact("RFS START, 0"), impact("RFS STOP, 0")], [Impact::Acts; 2]);
    assert_eq!([impact("GCO 1, 0"), impact("GCO 1, 255")], [Impact::Reads, Impact::Acts]);
}

#[test]
fn what_reads_may_be_repeated_and_the_other_way_round() {
    for (number, kind, motor) in (0..=255).flat_map(|number| [(number, 0, 0), (number, 2, 0), (number, 0, 255)]) {
        let instruction = Instruction::new(Opcode(number), kind, motor, 0);
        let reads = instruction.impact() == Impact::Reads;
        assert_eq!(instruction.effect() == Effect::Read, reads, "{instruction:?}");
    }
}
