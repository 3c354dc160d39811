//! The operands of a command while it is written.

use crate::analysis::Analysis;
use crate::context::{Context, context};
use crate::describe;

/// A command's form with the operand that is being written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Signature {
    /// The form: `SAP <parameter>, <axis>, <value>`.
    pub label: String,
    /// The bytes of each operand in the form.
    pub operands: Vec<(usize, usize)>,
    /// The operand that is being written, from 0.
    pub active: usize,
    /// About the command, in Markdown.
    pub text: String,
}

/// Returns the form of the command whose operands stand before the cursor; `line` is the line up to there.
pub fn signature(analysis: &Analysis, line: &str) -> Option<Signature> {
    let Context::Operand { command, index, .. } = context(line, analysis.module()) else { return None };
    let label = command.to_string();
    let mut operands = Vec::new();
    let mut from = command.mnemonic.len();
    for _ in command.operands {
        let start = from + label[from..].find(['<', '['])?;
        from = start + label[start..].find(['>', ']'])? + 1;
        operands.push((start, from));
    }
    let active = index.min(operands.len().saturating_sub(1));
    Some(Signature { label, operands, active, text: describe::command(command, analysis.module()) })
}
