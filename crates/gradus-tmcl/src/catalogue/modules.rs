//! All modules.

use super::commands::modes;
use super::module::{Model, Module, MotionChip, axis_rows, global_rows};
use super::tmcm351::TMCM_351;
use super::tmcm1617::TMCM_1617;
use super::tmcm3351::TMCM_3351;

/// In place of a module that the catalogue lacks: every command, six axes, the longest memory, and nothing known of
/// parameters, ports and interrupts. Programs can be assembled and checked for it, as far as that needs no catalogue.
pub static ANY: Module = Module {
    model: Model::Any,
    name: "any",
    number: 0,
    version: (0, 0),
    version_text: b"        ",
    chip: MotionChip::Tmc4361,
    axes: 6,
    program_len: u16::MAX,
    coordinates: 0,
    least_supply_v: 0,
    tick_us: 100,
    instruction_us: 10,
    axis_parameters: &[],
    global_parameters: &[],
    ports: &[],
    interrupts: &[],
    axis_rows: axis_rows(&[]),
    global_rows: global_rows(&[]),
    modes: modes(Model::Any),
};

/// The modules.
pub static MODULES: &[&Module] = &[&TMCM_3351, &TMCM_1617, &TMCM_351];

impl Module {
    /// The module of that name, as `TMCM-3351` or `tmcm-3351`.
    pub fn named(name: &str) -> Option<&'static Module> {
        MODULES.iter().find(|module| module.name.eq_ignore_ascii_case(name)).copied()
    }
}
