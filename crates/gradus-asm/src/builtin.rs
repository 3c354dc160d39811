//! The include files that the assembler has in itself: `TMCLParam.tmc` and `Interrupts.inc`, made from the catalogue.
//!
//! The maker's files are not printed in the manuals. Parameters and interrupts have the names of their catalogue rows, so
//! the same name may have another number on another module.

use std::borrow::Cow;
use std::fmt::Write;

use gradus_tmcl::catalogue::{GlobalParameter, MODULES, Module};

const PARAMETERS: &str = "TMCLParam.tmc";
const INTERRUPTS: &str = "Interrupts.inc";

/// Names of the built-in include files.
pub const BUILT_IN: [&str; 2] = [PARAMETERS, INTERRUPTS];

/// Motors, also for modules with fewer axes: shared files use them.
#[rustfmt::skip]
const MOTORS: &[(&str, i32)] = &[
    ("Motor0", 0), ("Motor1", 1), ("Motor2", 2), ("Motor3", 3), ("Motor4", 4), ("Motor5", 5),
];

/// Values of parameters that programs for older modules use by name.
const VALUES: &[(&str, i32)] = &[
    ("APVRefSearchOneSwitch", 1),
    ("APVRefSearchTwoSwitches", 2),
    ("APVMixedDecayPermanent", -1),
    ("APVMixedDecayOff", 2048),
    ("APVRampModePosition", 0),
    ("APVRampModeVelocity", 2),
    ("APVEncoderAddOnCCW", 1),
    ("APVEncoderAlwaysTriggerNull", 2),
    ("APVEncoderClearEncoderOnNull", 4),
    ("APVEncoderHoldValueOnNull", 8),
    ("APVEncoderNullActiveHigh", 16),
];

/// The text of a built-in include file; `None` if there is none of that name. Case does not matter.
pub fn built_in(name: &str, module: &Module) -> Option<String> {
    let file = BUILT_IN.iter().find(|file| file.eq_ignore_ascii_case(name))?;
    let mut text = format!("// {file} for the {}\n", module.name);
    for (name, value) in definitions(file, module) {
        let _ = writeln!(text, "{name} = {value}"); // a string takes everything
    }
    Some(text)
}

fn definitions(file: &str, module: &Module) -> Box<dyn Iterator<Item = (Cow<'static, str>, i32)>> {
    let fixed = |list: &'static [(&str, i32)]| list.iter().map(|(name, value)| (Cow::from(*name), *value));
    let (parameters, globals, interrupts) = (module.axis_parameters, module.global_parameters, module.interrupts);
    if file == PARAMETERS {
        let parameters = parameters.iter().map(|row| (row.symbol.into(), row.number.into()));
        Box::new(fixed(MOTORS).chain(parameters).chain(fixed(VALUES)).chain(globals.iter().flat_map(global)))
    } else {
        Box::new(interrupts.iter().map(|row| (row.symbol.into(), row.number.into())))
    }
}

/// The names of a run of global parameters; the bank is not part of a name.
fn global(row: &'static GlobalParameter) -> impl Iterator<Item = (Cow<'static, str>, i32)> {
    let is_run = row.first != row.last;
    (row.first..=row.last).map(move |number| {
        let name = if is_run { format!("{}{number}", row.symbol).into() } else { row.symbol.into() };
        (name, number.into())
    })
}

/// Where an unknown name is known.
pub(crate) fn hint(name: &str, module: &Module) -> Option<String> {
    let has = |file: &str, module| definitions(file, module).any(|(symbol, _)| symbol.eq_ignore_ascii_case(name));
    let here = BUILT_IN.iter().find(|file| has(file, module)).map(|file| format!("write #include {file} first"));
    here.or_else(|| {
        let others = MODULES.iter().filter(|other| BUILT_IN.iter().any(|file| has(file, other)));
        list(others.map(|other| other.name))
            .map(|modules| format!("the {modules} has it, the {} does not", module.name))
    })
}

/// Names as a sentence has them: `a`, `a and b`, `a, b and c`; `None` without a name.
pub(crate) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let mut names = names.into_iter().peekable();
    let mut text = names.next()?.to_owned();
    while let Some(name) = names.next() {
        text.push_str(if names.peek().is_some() { ", " } else { " and " });
        text.push_str(name);
    }
    Some(text)
}
