//! Parameters by name or number.
//!
//! Upper and lower case, spaces, underscores and hyphens are all the same: `Actual Position`, `actual_position` and
//! `actual-position` name one parameter, and so does its symbol in programs, `APActualPosition`. A beginning is enough if it
//! fits only one name (`microstep`), and so are the beginnings of its words (`act_pos`).

use gradus_tmcl::catalogue::{GlobalParameter, Module};

use crate::name::{normalise, words};
use crate::named::Named;

/// A name or number that stands for no parameter, or for several.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NameError {
    /// No parameter has that name.
    #[error("the {module} has no parameter `{text}`{}", did_you_mean(suggestions))]
    Unknown {
        /// Name of the module.
        module: &'static str,
        /// What was asked for.
        text: String,
        /// Names that look like it.
        suggestions: Vec<String>,
    },
    /// Several names fit.
    #[error("`{text}` may be {}; write more of it", list(names))]
    Ambiguous {
        /// What was asked for.
        text: String,
        /// The names.
        names: Vec<String>,
    },
    /// No parameter has that number.
    #[error("the {module} has no {parameter}")]
    NoNumber {
        /// Name of the module.
        module: &'static str,
        /// `axis parameter 99`, or `global parameter 99 in bank 2`.
        parameter: String,
    },
}

/// How many names a message lists.
const LISTED: usize = 5;

fn list(names: &[String]) -> String {
    let more = if names.len() > LISTED { ", ..." } else { "" };
    names.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ") + more
}

fn did_you_mean(suggestions: &[String]) -> String {
    match suggestions {
        [] => "; `gradus params` lists them all".into(),
        names => format!("; did you mean {}?", names.join(" or ")),
    }
}

/// Finds an axis parameter by number or name, or a global parameter by name.
///
/// # Errors
/// When there is none, or several names fit.
pub fn find(module: &'static Module, text: &str) -> Result<Named, NameError> {
    if text.parse::<u32>().is_ok() {
        return find_axis(module, text);
    }
    by_name(module, text, axis_parameters(module).chain(global_parameters(module)).collect())
}

/// Finds an axis parameter by number or name.
///
/// # Errors
/// When there is none, or several names fit.
pub fn find_axis(module: &'static Module, text: &str) -> Result<Named, NameError> {
    let Ok(number) = text.parse::<u32>() else { return by_name(module, text, axis_parameters(module).collect()) };
    let row = u8::try_from(number).ok().and_then(|number| module.axis_parameter(number));
    row.map(Named::Axis).ok_or_else(|| no_number(module, format!("axis parameter {text}")))
}

/// Finds a global parameter of a bank by number or name.
///
/// # Errors
/// When there is none, or several names fit.
pub fn find_global(module: &'static Module, bank: u8, text: &str) -> Result<Named, NameError> {
    let Ok(number) = text.parse::<u32>() else {
        let in_bank = |named: &Named| matches!(named, Named::Global { row, .. } if row.bank == bank);
        return by_name(module, text, global_parameters(module).filter(in_bank).collect());
    };
    let found = u8::try_from(number).ok().and_then(|number| Some((module.global_parameter(bank, number)?, number)));
    let named = found.map(|(row, number)| Named::Global { row, number });
    named.ok_or_else(|| no_number(module, format!("global parameter {text} in bank {bank}")))
}

/// Finds a global parameter of any bank by name.
pub(crate) fn find_among_globals(module: &'static Module, text: &str) -> Result<Named, NameError> {
    by_name(module, text, global_parameters(module).collect())
}

/// Every axis parameter of a module.
pub fn axis_parameters(module: &'static Module) -> impl Iterator<Item = Named> {
    module.axis_parameters.iter().map(Named::Axis)
}

/// Every global parameter of a module; those that share a row one by one.
pub fn global_parameters(module: &'static Module) -> impl Iterator<Item = Named> {
    let run = |row: &'static GlobalParameter| (row.first..=row.last).map(move |number| Named::Global { row, number });
    module.global_parameters.iter().flat_map(run)
}

fn no_number(module: &'static Module, parameter: String) -> NameError {
    NameError::NoNumber { module: module.name, parameter }
}

/// How well a name fits, best first.
const FITS: [fn(&str, &Named) -> bool; 3] = [is_name, begins_name, begins_words];

fn by_name(module: &'static Module, text: &str, candidates: Vec<Named>) -> Result<Named, NameError> {
    let wanted = normalise(text);
    for fits in FITS {
        let found: Vec<&Named> = candidates.iter().filter(|named| !wanted.is_empty() && fits(&wanted, named)).collect();
        match found.as_slice() {
            [] => {}
            [one] => return Ok(**one),
            several => {
                let names = several.iter().map(|named| named.name()).collect();
                return Err(NameError::Ambiguous { text: text.into(), names });
            }
        }
    }
    Err(NameError::Unknown { module: module.name, text: text.into(), suggestions: suggestions(&wanted, &candidates) })
}

fn squashed(text: &str) -> String {
    words(text).concat()
}

fn symbol(named: &Named) -> String {
    match named {
        Named::Axis(row) => squashed(row.symbol),
        Named::Global { .. } => String::new(),
    }
}

fn is_name(wanted: &str, named: &Named) -> bool {
    let wanted = squashed(wanted);
    squashed(&named.name()) == wanted || symbol(named) == wanted
}

fn begins_name(wanted: &str, named: &Named) -> bool {
    let wanted = squashed(wanted);
    squashed(&named.name()).starts_with(&wanted) || symbol(named).starts_with(&wanted)
}

/// `max_speed` begins the words of `maximum_positioning_speed`: the first one, and others in their order.
fn begins_words(wanted: &str, named: &Named) -> bool {
    let name = words(&named.name());
    let wanted = words(wanted);
    let first = wanted.first().zip(name.first()).is_some_and(|(wanted, word)| word.starts_with(wanted.as_str()));
    let mut rest = name.iter();
    first && wanted.iter().all(|wanted| rest.any(|word| word.starts_with(wanted.as_str())))
}

/// Below this likeness a name is no help.
const ALIKE: f64 = 0.75;
/// How many names are suggested.
const SUGGESTED: usize = 3;

fn suggestions(wanted: &str, candidates: &[Named]) -> Vec<String> {
    let mut names: Vec<(f64, String)> =
        candidates.iter().map(|named| (likeness(wanted, &named.name()), named.name())).collect();
    names.retain(|(likeness, _)| *likeness >= ALIKE);
    names.sort_by(|a, b| b.0.total_cmp(&a.0));
    names.into_iter().map(|(_, name)| name).take(SUGGESTED).collect()
}

fn likeness(wanted: &str, name: &str) -> f64 {
    if name.contains(wanted) { 1.0 } else { strsim::jaro_winkler(wanted, name) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gradus_tmcl::catalogue::TMCM_3351;

    #[test]
    fn every_spelling_finds_the_parameter() {
        let cases = [
            ("1", "actual_position (axis parameter 1)"),
            ("actual_position", "actual_position (axis parameter 1)"),
            ("Actual Position", "actual_position (axis parameter 1)"),
            ("actual-position", "actual_position (axis parameter 1)"),
            ("APActualPosition", "actual_position (axis parameter 1)"),
            ("apmaxpos", "maximum_positioning_speed (axis parameter 4)"),
            ("microstep", "microstep_resolution (axis parameter 140)"),
            ("max_speed", "maximum_positioning_speed (axis parameter 4)"),
            ("act pos", "actual_position (axis parameter 1)"),
            ("auto start mode", "auto_start_mode (global parameter 77, bank 0)"),
            ("user_variable_42", "user_variable_42 (global parameter 42, bank 2)"),
        ];
        for (text, expected) in cases {
            assert_eq!(find(&TMCM_3351, text).unwrap().to_string(), expected, "{text}");
        }
    }

    #[test]
    fn a_bank_is_searched_alone() {
        assert_eq!(find_global(&TMCM_3351, 2, "5").unwrap().number(), 5);
        assert_eq!(find_global(&TMCM_3351, 0, "last tmcl").unwrap().number(), 131);
        assert!(find_global(&TMCM_3351, 2, "actual_position").is_err());
    }

    #[test]
    fn a_wrong_name_gets_suggestions() {
        let cases = [
            ("actual_positon", "the TMCM-3351 has no parameter `actual_positon`; did you mean actual_position"),
            ("xyzzy", "has no parameter `xyzzy`; `gradus params` lists them all"),
            ("actual", "`actual` may be actual_position, actual_speed"),
            ("99", "the TMCM-3351 has no axis parameter 99"),
            ("4711", "the TMCM-3351 has no axis parameter 4711"),
            ("", "has no parameter ``"),
        ];
        for (text, expected) in cases {
            let message = find(&TMCM_3351, text).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn every_name_finds_its_own_parameter() {
        for named in axis_parameters(&TMCM_3351) {
            assert_eq!(find_axis(&TMCM_3351, &named.name()).unwrap(), named);
        }
        for named in global_parameters(&TMCM_3351) {
            assert_eq!(find(&TMCM_3351, &named.name()).unwrap(), named);
        }
    }
}
