//! Where names are used.

use crate::encoder;
use crate::encoder::is_keyword;
use crate::expression::Expression;
use crate::names::Defined;
use crate::problem::Span;
use crate::reader::{Placed, Text};

/// A name where it is used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Use {
    /// Where.
    pub span: Span,
    /// What it stands for. Where a name is defined twice, the first definition.
    pub of: Defined,
}

/// Every use of a name, in the order of the text. Case does not matter.
pub(crate) fn uses(text: &Text) -> Vec<Use> {
    let numbers = text.names.numbered();
    let of_commands = text.commands.iter().flat_map(operands);
    let mut uses: Vec<_> = of_commands
        .chain(text.names.expressions())
        .flat_map(Expression::names)
        .filter_map(|(name, span)| Some(Use { span, of: numbers[text.names.find(name)?]? }))
        .collect();
    uses.sort_by_key(|used| (used.span.source, used.span.start));
    uses
}

/// The operands of a command in which names are labels or constants, not keywords.
fn operands(placed: &Placed) -> impl Iterator<Item = &Expression> {
    let row = encoder::find(&placed.command.mnemonic.text);
    let expected = row.map_or(&[][..], |row| row.operands);
    let operand =
        move |(index, text): (usize, &Expression)| !expected.get(index).is_some_and(|it| is_keyword(text, it));
    placed
        .command
        .operands
        .iter()
        .enumerate()
        .filter(move |(index, text)| operand((*index, text)))
        .map(|(_, text)| text)
}
