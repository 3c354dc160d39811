//! What can be chosen about a check.

use crate::code::Code;

/// What can be chosen about a check.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LintOptions {
    /// Findings that are left out. Errors cannot be.
    pub allow: Vec<Code>,
    /// Names of the catalogue are proposed for numbers too.
    pub pedantic: bool,
    /// The oldest firmware that the program is for; `None` asks its pragma.
    pub firmware: Option<(u8, u8)>,
}
