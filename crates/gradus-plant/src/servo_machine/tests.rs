use super::*;
use crate::{BridgeData, Encoder, ServoMotor};

const PERIOD_S: f64 = 4e-5;

/// No friction, no load torque, no dead time, a stiff supply.
fn ideal() -> ServoSetup {
    ServoSetup {
        mechanics: Mechanics { inertia_kgm2: 5e-6, friction_nm: 0.0, viscous_nms: 0.0, load_nm: 0.0 },
        supply: Supply { resistance_ohm: 1e-3, takes_back: true, ..Supply::default() },
        bridge: BridgeData { dead_time_s: 0.0, switch_ohm: 0.0 },
        ..ServoSetup::default()
    }
}

/// Duties of a voltage vector along an electrical angle in turns.
fn along(turns: f64, volts: f64) -> Bridge {
    let duty = |phase: f64| 0.5 + volts / 24.0 * sin_cos(turns + 0.25 - phase / 3.0).0;
    Bridge::Duties([duty(0.0), duty(1.0), duty(2.0)])
}

fn run(machine: &mut ServoMachine, seconds: f64, mut bridge: impl FnMut(&ServoMachine) -> Bridge) {
    for _ in 0..(seconds / PERIOD_S).round() as u32 {
        let duties = bridge(machine);
        machine.step(PERIOD_S, duties);
    }
}

#[test]
fn current_rises_with_the_time_constant_of_the_winding() {
    let mut machine = ServoMachine::new(ideal());
    let motor = ServoMotor::default();
    // Along the magnet nothing turns.
    for periods in [10, 40, 200] {
        machine.place(0.0);
        run(&mut machine, f64::from(periods) * PERIOD_S, |_| along(0.0, 1.0));
        let constant_s = motor.inductance_d_h / motor.resistance_ohm;
        let exact = (1.0 - (-f64::from(periods) * PERIOD_S / constant_s).exp()) / motor.resistance_ohm;
        let [d_a, q_a] = machine.currents_dq_a();
        assert!((d_a / exact - 1.0).abs() < 1e-3 && q_a.abs() < 1e-9, "{d_a} {exact} after {periods}");
    }
}

#[test]
fn free_motor_turns_as_fast_as_its_voltage() {
    let mut machine = ServoMachine::new(ideal());
    run(&mut machine, 3.0, |machine| {
        let half_period_turns = 4.0 * machine.velocity_rpm() / 60.0 * PERIOD_S / 2.0;
        along(machine.electrical_turns() + half_period_turns + 0.25, 10.0)
    });
    let exact_rpm = 10.0 / (0.036 / 1.5) * 30.0 / std::f64::consts::PI;
    assert!((machine.velocity_rpm() / exact_rpm - 1.0).abs() < 2e-3, "{} {exact_rpm}", machine.velocity_rpm());
}

#[test]
fn direct_current_motor_turns_as_fast_as_its_voltage() {
    let mut machine = ServoMachine::new(ServoSetup { motor: ServoMotor::named("DC").unwrap(), ..ideal() });
    run(&mut machine, 3.0, |_| Bridge::Duties([0.75, 0.25, 0.5]));
    let exact_rpm = 12.0 / 0.05 * 30.0 / std::f64::consts::PI;
    assert!((machine.velocity_rpm() / exact_rpm - 1.0).abs() < 1e-3, "{} {exact_rpm}", machine.velocity_rpm());
}

#[test]
fn torque_accelerates_all_inertia() {
    let mut machine = ServoMachine::new(ideal());
    let mut impulse = 0.0;
    run(&mut machine, 0.01, |machine| {
        impulse += machine.torque_nm() * PERIOD_S;
        along(machine.electrical_turns() + 0.25, 3.0)
    });
    let exact_rpm = impulse / (4.8e-6 + 5e-6) * 30.0 / std::f64::consts::PI;
    assert!((machine.velocity_rpm() / exact_rpm - 1.0).abs() < 0.01, "{} {exact_rpm}", machine.velocity_rpm());
}

#[test]
fn friction_holds_the_shaft_until_the_torque_is_larger() {
    let mechanics = Mechanics { friction_nm: 0.01, ..ideal().mechanics };
    let mut machine = ServoMachine::new(ServoSetup { mechanics, ..ideal() });
    let needed_v = 0.01 / 0.036 * ServoMotor::default().resistance_ohm;
    run(&mut machine, 0.1, |_| along(0.25, 0.98 * needed_v));
    assert_eq!(machine.position_turns(), 0.0);
    run(&mut machine, 0.1, |_| along(0.25, 1.05 * needed_v));
    assert!(machine.position_turns() > 0.0);
    run(&mut machine, 0.1, |_| along(0.25, 0.0));
    assert_eq!(machine.velocity_rpm(), 0.0, "comes to rest, exactly");
}

#[test]
fn open_bridge_lets_the_currents_end_and_the_rotor_run_out() {
    let mut machine = ServoMachine::new(ideal());
    run(&mut machine, 0.002, |machine| along(machine.electrical_turns() + 0.25, 3.0));
    assert!(machine.currents_dq_a()[1] > 1.0);
    run(&mut machine, 0.001, |_| Bridge::Open);
    assert_eq!(machine.currents_dq_a(), [0.0, 0.0]);
    let coasting = machine.velocity_rpm();
    run(&mut machine, 1.0, |_| Bridge::Open);
    assert_eq!((machine.currents_dq_a(), machine.velocity_rpm()), ([0.0, 0.0], coasting));
}

#[test]
fn dead_time_takes_its_share_of_the_supply() {
    let bridge = BridgeData { dead_time_s: 1e-6, switch_ohm: 0.0 };
    let mut machine = ServoMachine::new(ServoSetup { bridge, ..ideal() });
    run(&mut machine, 0.1, |_| along(0.0, 2.0));
    // 1 us of 40 us; with the currents +, -, - that is 4/3 of it along phase A.
    let exact_a = (2.0 - 24.0 / 40.0 * 4.0 / 3.0) / ServoMotor::default().resistance_ohm;
    assert!((machine.currents_dq_a()[0] / exact_a - 1.0).abs() < 0.01, "{:?} {exact_a}", machine.currents_dq_a());
}

#[test]
fn step_of_a_pwm_period_is_as_good_as_much_shorter_ones() {
    let setup = ServoSetup { bridge: ideal().bridge, ..ServoSetup::default() };
    let mut whole = ServoMachine::new(setup);
    run(&mut whole, 0.5, |machine| along(machine.position_turns() * 4.0 + 0.3, 8.0));
    let mut fine = ServoMachine::new(setup);
    for _ in 0..12_500 {
        let duties = along(fine.position_turns() * 4.0 + 0.3, 8.0);
        for _ in 0..100 {
            fine.step(PERIOD_S / 100.0, duties);
        }
    }
    assert!(
        (whole.velocity_rpm() - fine.velocity_rpm()).abs() < 0.05,
        "{} {}",
        whole.velocity_rpm(),
        fine.velocity_rpm()
    );
}

#[test]
fn energy_is_neither_made_nor_lost() {
    let saturated = ServoMotor { saturation_a: Some(10.0), ..ServoMotor::default() };
    let salient = ServoMotor { inductance_q_h: 1e-3, ..ServoMotor::default() };
    let dc = ServoMotor::named("DC").unwrap();
    for motor in [ServoMotor::default(), saturated, salient, dc] {
        let mechanics = Mechanics { inertia_kgm2: 2e-5, friction_nm: 2e-3, viscous_nms: 1e-5, load_nm: 0.02 };
        let mut machine = ServoMachine::new(ServoSetup { motor, mechanics, ..ServoSetup::default() });
        let stored = machine.stored_j();
        let (mut supplied, mut used) = (0.0, 0.0);
        for period in 0..50_000 {
            // Drives, brakes, drives the other way.
            let volts = if period / 10_000 % 2 == 0 { 8.0 } else { -6.0 };
            let bridge = match motor.phases {
                Phases::Three => along(machine.electrical_turns() + 0.25, volts),
                Phases::One => Bridge::Duties([0.5 + volts / 48.0, 0.5 - volts / 48.0, 0.5]),
            };
            machine.switch_chopper(machine.supply_v() > 26.0);
            let before = machine.powers();
            machine.step(PERIOD_S, bridge);
            for powers in [before, machine.powers()] {
                supplied += 0.5 * PERIOD_S * powers.source_w;
                let Powers { cable_w, chopper_w, bridge_w, copper_w, friction_w, load_w, board_w, .. } = powers;
                used += 0.5 * PERIOD_S * (cable_w + chopper_w + bridge_w + copper_w + friction_w + load_w + board_w);
            }
        }
        let missing = supplied - used - (machine.stored_j() - stored);
        assert!(supplied > 5.0 && (missing / supplied).abs() < 0.01, "{motor:?}: {missing} of {supplied}");
    }
}

#[test]
fn braking_raises_the_supply_and_the_chopper_holds_it() {
    let peak = |limit_v: f64| {
        let mut machine = ServoMachine::new(ServoSetup {
            mechanics: Mechanics { inertia_kgm2: 1e-4, ..ideal().mechanics },
            ..ServoSetup::default()
        });
        run(&mut machine, 3.0, |machine| along(machine.electrical_turns() + 0.25, 12.0));
        let mut peak = 0.0_f64;
        for period in 0..12_500 {
            machine.switch_chopper(machine.supply_v() > limit_v);
            let volts = 12.0 - 12.0 * f64::from(period) / 12_500.0;
            let bridge = along(machine.electrical_turns() + 0.25, volts * 24.0 / machine.supply_v());
            machine.step(PERIOD_S, bridge);
            peak = peak.max(machine.supply_v());
        }
        peak
    };
    let (without, with) = (peak(f64::INFINITY), peak(30.0));
    assert!(without > 40.0, "{without}");
    assert!((30.0..30.5).contains(&with), "{with}");
}

#[test]
fn rated_current_warms_the_winding_which_resists_more() {
    let mut machine = ServoMachine::new(ideal());
    machine.surround(Surroundings { temperature_c: 25.0, ..Surroundings::default() });
    let volts = 3.47 * ServoMotor::default().resistance_ohm;
    // Along the magnet; large steps, nothing moves.
    for _ in 0..600_000 {
        machine.step(1e-3, along(0.0, volts));
    }
    let current = machine.currents_dq_a()[0];
    let share = (current / 3.47) * (current / 3.47);
    assert!(share < 0.8, "{share}");
    assert!((40.0..60.0).contains(&machine.winding_c()), "{}", machine.winding_c());
    let ohms = volts / current;
    let exact = ServoMotor::default().resistance_ohm * (1.0 + COPPER_PER_K * (machine.winding_c() - 25.0));
    assert!((ohms / exact - 1.0).abs() < 1e-3, "{ohms} {exact}");
}

#[test]
fn null_event_is_latched_between_two_periods() {
    let mut machine =
        ServoMachine::new(ServoSetup { encoder: Encoder { index: Some(100), ..Encoder::default() }, ..ideal() });
    machine.watch_null(Some(NullEvent { n: true, ab: None }));
    machine.place(101.5 / 4096.0);
    assert_eq!((machine.take_null(), machine.take_null()), (Some(100), None));
}

#[test]
fn sensors_agree_with_the_shaft() {
    let mut machine = ServoMachine::new(ServoSetup { magnet_turns: 0.5, ..ideal() });
    for (turns, count, electrical, hall) in
        [(0.0, 0, 0.5, 6), (0.25, 1024, 0.5, 6), (-1.0 / 24.0, -171, 1.0 / 3.0, 2), (1000.5, 4_098_048, 0.5, 6)]
    {
        machine.place(turns);
        assert_eq!((machine.encoder_count(), machine.hall_bits()), (count, hall), "at {turns}");
        assert!((machine.electrical_turns() - electrical).abs() < 1e-9, "at {turns}");
    }
}

#[test]
fn rotor_that_is_driven_faster_than_the_supply_brakes_through_the_diodes() {
    // 24 V are the line voltage of 24 / sqrt(3) / 0.024 rad/s: 5513 rpm.
    let turned = |supply: Supply| {
        let mechanics = Mechanics { load_nm: -0.05, ..ideal().mechanics };
        let mut machine = ServoMachine::new(ServoSetup { mechanics, supply, ..ideal() });
        run(&mut machine, 5.0, |_| Bridge::Open);
        machine
    };
    let machine = turned(ideal().supply);
    let (rpm, torque_nm) = (machine.velocity_rpm(), machine.torque_nm());
    assert!(
        (5_500.0..7_000.0).contains(&rpm) && torque_nm < -0.045,
        "the diodes bear the load: {torque_nm} Nm at {rpm} rpm"
    );
    let machine = turned(Supply::default());
    assert_eq!(machine.supply_v(), HIGHEST_V, "a source that takes nothing back");
}

#[test]
fn reversed_encoder_counts_down() {
    let encoder = Encoder { reversed: true, ..Encoder::default() };
    let mut machine = ServoMachine::new(ServoSetup { encoder, ..ideal() });
    machine.place(0.25);
    assert_eq!(machine.encoder_count(), -1024);
}

#[test]
fn everything_stays_finite_whatever_turns_the_shaft() {
    for load_nm in [1e3, -1e3] {
        for motor in [ServoMotor::default(), ServoMotor::named("DC").unwrap()] {
            let mechanics = Mechanics { inertia_kgm2: 1e-9, load_nm, ..ideal().mechanics };
            let mut machine = ServoMachine::new(ServoSetup { mechanics, motor, ..ServoSetup::default() });
            for period in 0..20_000 {
                let open = period / 500 % 2 == 0;
                machine.step(if open { 1e-4 } else { 1e-5 }, if open { Bridge::Open } else { along(0.3, 12.0) });
                assert!(machine.is_finite(), "{machine:?}");
            }
        }
    }
}
