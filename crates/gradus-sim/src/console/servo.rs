//! Lines that work the machine of a servo module.

use gradus_plant::Mechanics;
use gradus_tmcl::catalogue::Ap;

use super::{Command, LEVEL, Operand, TEMPERATURE, change};
use crate::{Bench, MachineIo, ServoDrive};

const HALL: Operand = Operand::Word(&["a", "b", "c"]);

pub(super) const COMMANDS: &[Command] = &[
    change(
        "analog",
        &[Operand::Word(&["0", "1", "2"]), Operand::Number { name: "VALUE", limit: 4096 }],
        "ADC value of an analogue input",
        |bench, value| bench.machine().io.set_analog(MachineIo::SERVO_PINS[value[0] as usize], value[1] as i32),
    ),
    change(
        "load",
        &[Operand::Axis, Operand::Real { name: "NM", min: -1000.0, max: 1000.0 }],
        "torque at the shaft against the positive direction, like that of a weight",
        |bench, value| change_mechanics(bench, value[0], |mechanics| mechanics.load_nm = value[1]),
    ),
    change(
        "friction",
        &[Operand::Axis, Operand::Real { name: "NM", min: 0.0, max: 1000.0 }],
        "torque at the shaft that opposes motion",
        |bench, value| change_mechanics(bench, value[0], |mechanics| mechanics.friction_nm = value[1]),
    ),
    change("block", &[Operand::Axis], "something holds the shaft", |bench, value| {
        drive(bench, value[0]).plant.block(true);
    }),
    change("block", &[Operand::Axis, Operand::Word(&["off"])], "nothing holds the shaft", |bench, value| {
        drive(bench, value[0]).plant.block(false);
    }),
    change("unblock", &[Operand::Axis], "the same", |bench, value| drive(bench, value[0]).plant.block(false)),
    change(
        "push",
        &[Operand::Axis, Operand::Real { name: "DEGREES", min: -36000.0, max: 36000.0 }],
        "turns the shaft by hand and lets it go",
        |bench, value| {
            let plant = &mut drive(bench, value[0]).plant;
            plant.place(plant.position_turns() + value[1] / 360.0);
        },
    ),
    change("encoder", &[Operand::Axis, Operand::Word(&["off", "on"])], "line of the encoder", |bench, value| {
        drive(bench, value[0]).cut_encoder(value[1] == 0.0);
    }),
    change(
        "hall",
        &[Operand::Axis, HALL, Operand::Word(&["stuck"]), LEVEL],
        "a hall sensor is stuck at a level",
        |bench, value| drive(bench, value[0]).stick_hall(value[1] as usize, Some(value[3] == 1.0)),
    ),
    change("hall", &[Operand::Axis, HALL, Operand::Word(&["ok"])], "a hall sensor works", |bench, value| {
        drive(bench, value[0]).stick_hall(value[1] as usize, None);
    }),
    change(
        "gate",
        &[Operand::Axis, Operand::Word(&["ok", "fault"])],
        "what the gate driver reports",
        |bench, value| {
            drive(bench, value[0]).fail_gate_driver(value[1] == 1.0);
        },
    ),
    change(
        "temperature",
        &[Operand::Axis, TEMPERATURE],
        "temperature of the bridge at this moment; it comes back to that of the board",
        |bench, value| drive(bench, value[0]).plant.heat_driver(value[1]),
    ),
];

/// The axis has been checked.
fn drive(bench: &mut Bench, axis: f64) -> &mut ServoDrive {
    &mut bench.machine().servos[axis as usize]
}

fn change_mechanics(bench: &mut Bench, axis: f64, change: impl FnOnce(&mut Mechanics)) {
    let plant = &mut drive(bench, axis).plant;
    let mut setup = *plant.setup();
    change(&mut setup.mechanics);
    plant.set_up(setup);
}

/// What instruments at the servos show.
pub(super) fn show(bench: &mut Bench) -> String {
    let servos: String = (0..bench.machine().servos.len()).map(|axis| show_servo(bench, axis)).collect();
    let off: String = bench.why_off().iter().map(|reason| format!("        the drive is off: {reason}\n")).collect();
    servos + &off
}

fn show_servo(bench: &mut Bench, axis: usize) -> String {
    let read = [Ap::ActualPosition, Ap::ActualSpeed].map(|id| bench.axis_parameter(axis, id));
    let module = match read {
        [Some(position), Some(rpm)] => format!(" position {position}, {rpm} rpm,"),
        _ => String::new(),
    };
    let plant = &bench.machine().servos[axis].plant;
    let [flux_a, torque_a] = plant.currents_dq_a();
    let Mechanics { load_nm, friction_nm, .. } = plant.setup().mechanics;
    format!(
        "axis {axis}:{module} shaft {:.4} turns, {:.0} rpm, hall {:03b}, encoder {}\n        \
         load {load_nm:.3} Nm, friction {friction_nm:.3} Nm{}, motor {:.3} Nm, torque {torque_a:.2} A, flux {flux_a:.2} A, \
         bus {:.1} V, winding {:.0} degC, driver {:.0} degC\n",
        plant.position_turns(),
        plant.velocity_rpm(),
        plant.hall_bits(),
        plant.encoder_count(),
        if plant.is_blocked() { ", blocked" } else { "" },
        plant.torque_nm(),
        plant.supply_v(),
        plant.winding_c(),
        plant.driver_c(),
    )
}
