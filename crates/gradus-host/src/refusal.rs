//! Why a module refused a command, in the words of its catalogue.

use gradus_tmcl::catalogue::{Command, Gp, Mode, Module, OperandKind};
use gradus_tmcl::{Instruction, Opcode, Status};

use crate::Named;

/// What the catalogue knows about a refusal; empty when it knows nothing.
pub(crate) fn reason(module: &'static Module, request: Instruction, status: Status) -> String {
    match status {
        Status::INVALID_COMMAND => format!("the {} has no such command", module.name),
        Status::NOT_AVAILABLE => not_available(module, request),
        Status::WRONG_TYPE => wrong_type(module, request),
        Status::INVALID_VALUE => invalid_value(module, request),
        Status::EEPROM_LOCKED => locked(module, request),
        _ => String::new(),
    }
}

fn not_available(module: &Module, request: Instruction) -> String {
    match module.mode(request.opcode) {
        Mode::Standalone => "it works only inside a program".into(),
        Mode::None => format!("the {} has no such command", module.name),
        Mode::Direct | Mode::Both => "not in the present state; for a motion command: is the ENABLE input on?".into(),
    }
}

fn wrong_type(module: &'static Module, request: Instruction) -> String {
    match (request.opcode, parameter(module, request)) {
        (Opcode::SAP | Opcode::AAP | Opcode::SGP | Opcode::AGP, Some(named)) if !named.access().writable() => {
            format!("{named} is read-only")
        }
        (_, Some(named)) => format!("{named} cannot be used that way"),
        (opcode, None) if uses_axis_parameter(opcode) => {
            format!("the {} has no axis parameter {}", module.name, request.kind)
        }
        (opcode, None) if uses_global_parameter(opcode) => {
            format!("the {} has no global parameter {} in bank {}", module.name, request.kind, request.motor)
        }
        (Opcode::SIO | Opcode::GIO, None) => {
            format!("the {} has no port {} in bank {} that works that way", module.name, request.kind, request.motor)
        }
        _ => String::new(),
    }
}

fn invalid_value(module: &'static Module, request: Instruction) -> String {
    if names_missing_axis(module, request) {
        return format!("the {} has the axes 0 to {}", module.name, module.axes.saturating_sub(1));
    }
    parameter(module, request).map_or_else(String::new, |named| format!("{named} takes {}", named.range()))
}

fn names_missing_axis(module: &Module, request: Instruction) -> bool {
    let operands = Command::of(request.opcode).map_or(&[] as &[_], |command| command.operands);
    let axis = operands.iter().find(|operand| operand.kind == OperandKind::Axis);
    axis.is_some_and(|axis| axis.get(&request) >= i64::from(module.axes))
}

fn locked(module: &Module, request: Instruction) -> String {
    let (id, advice) = match request.opcode {
        Opcode::ENTER_DOWNLOAD => (Gp::CodeProtection, "the program is protected against overwriting, see"),
        _ => (Gp::EepromLock, "to unlock it, write 4321 to"),
    };
    let row = module.global_parameters.iter().find(|row| row.id == id);
    row.map_or_else(String::new, |row| format!("{advice} global parameter {}", row.first))
}

fn uses_axis_parameter(opcode: Opcode) -> bool {
    matches!(opcode, Opcode::SAP | Opcode::GAP | Opcode::STAP | Opcode::RSAP | Opcode::AAP)
}

fn uses_global_parameter(opcode: Opcode) -> bool {
    matches!(opcode, Opcode::SGP | Opcode::GGP | Opcode::STGP | Opcode::RSGP | Opcode::AGP)
}

fn parameter(module: &'static Module, request: Instruction) -> Option<Named> {
    let number = request.kind;
    if uses_axis_parameter(request.opcode) {
        return module.axis_parameter(number).map(Named::Axis);
    }
    let row = module.global_parameter(request.motor, number).filter(|_| uses_global_parameter(request.opcode));
    row.map(|row| Named::Global { row, number })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_tmcl::catalogue::{TMCM_351, TMCM_3351};

    #[test]
    fn refusals_have_reasons() {
        let cases = [
            (
                "SAP 4, 0, 16777216",
                Status::INVALID_VALUE,
                "maximum_positioning_speed (axis parameter 4) takes 0 to 16777215 pps",
            ),
            ("SAP 4, 3, 0", Status::INVALID_VALUE, "the TMCM-3351 has the axes 0 to 2"),
            ("ROR 3, 0", Status::INVALID_VALUE, "the TMCM-3351 has the axes 0 to 2"),
            ("SAP 3, 0, 0", Status::WRONG_TYPE, "actual_speed (axis parameter 3) is read-only"),
            ("GAP 99, 0", Status::WRONG_TYPE, "the TMCM-3351 has no axis parameter 99"),
            ("GGP 64, 0", Status::WRONG_TYPE, "the TMCM-3351 has no global parameter 64 in bank 0"),
            ("GIO 99, 1", Status::WRONG_TYPE, "the TMCM-3351 has no port 99 in bank 1 that works that way"),
            ("JA 0", Status::NOT_AVAILABLE, "it works only inside a program"),
            ("DATA 132, 0, 0, 0", Status::EEPROM_LOCKED, "protected against overwriting, see global parameter 81"),
            ("DATA 99, 0, 0, 0", Status::INVALID_COMMAND, "the TMCM-3351 has no such command"),
        ];
        for (text, status, expected) in cases {
            let request = Instruction::parse(text, &TMCM_3351).unwrap();
            let found = reason(&TMCM_3351, request, status);
            assert!(found.contains(expected), "{text}: {found}");
        }
    }

    #[test]
    fn a_locked_eeprom_names_its_key() {
        let request = Instruction::parse("STGP 0, 2", &TMCM_351).unwrap();
        assert_eq!(
            reason(&TMCM_351, request, Status::EEPROM_LOCKED),
            "to unlock it, write 4321 to global parameter 73"
        );
    }
}
