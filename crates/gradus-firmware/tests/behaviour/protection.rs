//! A program that is protected against disassembling never leaves the module, in whatever order its protection is attacked.

use gradus_tmcl::catalogue::{Module, TMCM_351, TMCM_3351};
use gradus_tmcl::{Instruction, Opcode};
use proptest::prelude::*;

use crate::support::{Bench, Machine, Memory};

/// Addresses that programs are stored at.
const ADDRESSES: u16 = 4;

/// What somebody does who wants the program.
#[derive(Clone, Copy, Debug)]
enum Attack {
    /// SGP 64, which the TMCM-3351 does not have.
    Magic(i32),
    /// SGP 81.
    Protection(i32),
    /// SGP 73, which the TMCM-3351 does not have.
    Lock(bool),
    /// Command 137.
    FactorySettings,
    /// Command 255.
    Restart,
    PowerCycle,
    /// Stores one more secret.
    Download(u16),
}

fn attack() -> impl Strategy<Value = Attack> {
    prop_oneof![
        prop_oneof![Just(0), Just(228)].prop_map(Attack::Magic),
        (0..4).prop_map(Attack::Protection),
        any::<bool>().prop_map(Attack::Lock),
        Just(Attack::FactorySettings),
        Just(Attack::Restart),
        Just(Attack::PowerCycle),
        (0..ADDRESSES).prop_map(Attack::Download),
    ]
}

/// A module, and the secrets in it: instructions with values that do not occur elsewhere.
struct Victim {
    bench: Bench,
    secrets: i32,
    /// Secrets up to this one must not be seen.
    protected: i32,
}

const FIRST_SECRET: i32 = 0x5ec2_0000;

impl Victim {
    fn new(module: &'static Module) -> Self {
        let bench = Bench::of(module, Machine::default(), Memory::blank(0xff));
        Self { bench, secrets: FIRST_SECRET, protected: FIRST_SECRET }
    }

    /// What the attack is answered, if it is.
    fn suffer(&mut self, attack: Attack) -> Option<u8> {
        let control = |opcode, value| Instruction::new(opcode, 0, 0, value);
        let set = |number, value| Instruction::new(Opcode::SGP, number, 0, value);
        let instruction = match attack {
            Attack::Magic(value) => set(64, value),
            Attack::Protection(value) => set(81, value),
            Attack::Lock(on) => set(73, if on { 1234 } else { 4321 }),
            Attack::FactorySettings => control(Opcode::FACTORY_SETTINGS, 1234),
            Attack::Restart => control(Opcode::SOFTWARE_RESET, 1234),
            Attack::PowerCycle => return None,
            Attack::Download(address) => return self.store_secret(address),
        };
        self.bench.send(instruction).map(|reply| reply[2])
    }

    fn store_secret(&mut self, address: u16) -> Option<u8> {
        if self.bench.control(132, 0, address.into()).0 != 100 {
            return None;
        }
        self.secrets += 1;
        let secret = Instruction::new(Opcode::CALC, 9, 0, self.secrets);
        let (status, _) = self.bench.obey(secret);
        self.bench.control(133, 0, 0);
        Some(status)
    }

    /// The attack, with the power cut after so many bytes of the EEPROM if it writes more.
    fn attack(mut self, attack: Attack, power: Option<usize>) -> Self {
        self.bench.memory().power = power;
        let status = self.suffer(attack);
        if matches!(attack, Attack::Restart) {
            self.bench.advance_us(0);
        }
        let is_cut = self.bench.memory().power == Some(0);
        self.bench.memory().power = None;
        let is_hidden = self.bench.global(81, 0) & 1 != 0;
        if is_cut || matches!(attack, Attack::PowerCycle) {
            self.bench = self.bench.power_cycle();
        } else if status.is_some() && is_hidden {
            self.protected = self.secrets;
        }
        self
    }

    fn leak(&mut self) -> Option<i32> {
        let read = |address| Instruction::new(Opcode::READ_MEMORY, 0, 0, address);
        let shown = (0..i32::from(ADDRESSES)).filter_map(|address| self.bench.send(read(address)));
        let values: Vec<i32> = shown.map(|it| i32::from_be_bytes([it[4], it[5], it[6], it[7]])).collect();
        values.into_iter().find(|value| (FIRST_SECRET + 1..=self.protected).contains(value))
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn protected_program_never_leaves_the_module(
        attacks in prop::collection::vec((attack(), prop::option::weighted(0.4, 0_usize..120)), 1..25),
        older in any::<bool>(),
    ) {
        let mut victim = Victim::new(if older { &TMCM_351 } else { &TMCM_3351 });
        for (attack, power) in attacks {
            victim = victim.attack(attack, power);
            prop_assert_eq!(victim.leak(), None, "after {:?}", attack);
        }
    }
}
