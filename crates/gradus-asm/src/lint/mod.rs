//! The linter: what a program hardly means, though it assembles.
//!
//! A rule is a function over [`Facts`](facts::Facts). It needs a hit in a real program or a sentence of a manual, and gives no
//! warning on the programs of the manuals. Every code has a page in `explain`, whose examples a test assembles.

mod eeprom;
mod facts;
mod flow;
mod interrupts;
mod motion;
mod names;
mod options;
mod registers;
mod rules;
mod style;
mod timeouts;

pub use options::LintOptions;
pub use rules::lint;
