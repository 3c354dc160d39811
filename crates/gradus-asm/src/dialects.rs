//! Words and signs of other languages: what somebody who knows them writes by habit, and what TMCL has instead.

use gradus_tmcl::Opcode;
use gradus_tmcl::catalogue::COMMANDS;

/// Mnemonics of other dialects with the commands that do the same; the likeliest comes first.
#[rustfmt::skip]
const MNEMONICS: &[(&[&str], &[Opcode])] = &[
    (&["RET", "RETURN", "RTS"], &[Opcode::RSUB, Opcode::RETI]),
    (&["GOSUB", "JSR"],         &[Opcode::CSUB]),
    (&["GOTO", "JMP", "BRA"],   &[Opcode::JA]),
    (&["CMP"],                  &[Opcode::COMP]),
    (&["MOV", "MOVE"],          &[Opcode::MVP]),
    (&["HALT", "END"],          &[Opcode::STOP]),
];

/// What opens or closes a comment in other languages. None of it has a meaning in TMCL.
const COMMENT_SIGNS: &[&str] = &[";", "'", "/*", "*/"];

/// The question that goes with a mnemonic of another dialect.
pub(crate) fn hint(mnemonic: &str) -> Option<String> {
    let known = |words: &[&str]| words.iter().any(|word| word.eq_ignore_ascii_case(mnemonic));
    let (_, opcodes) = MNEMONICS.iter().find(|(words, _)| known(words))?;
    let rows = opcodes.iter().filter_map(|opcode| COMMANDS.iter().find(|row| row.opcode == *opcode));
    let meant: Vec<_> = rows.map(|row| format!("`{}` ({})", row.mnemonic, row.name)).collect();
    Some(format!("did you mean {}?", meant.join(" or ")))
}

/// The first sign of a foreign comment in a line without its own comment, and where it stands.
pub(crate) fn comment(code: &str) -> Option<(usize, &'static str)> {
    COMMENT_SIGNS.iter().filter_map(|sign| Some((code.find(sign)?, *sign))).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mnemonic_of_another_dialect_is_one_of_ours() {
        for word in MNEMONICS.iter().flat_map(|(words, _)| *words) {
            assert!(!COMMANDS.iter().any(|row| row.mnemonic == *word), "{word}");
        }
    }

    #[test]
    fn the_first_sign_of_a_comment_counts() {
        for (code, found) in
            [("MST 0", None), ("MST 0 /* ; */", Some((6, "/*"))), ("2 / 3 * 4", None), ("; it's", Some((0, ";")))]
        {
            assert_eq!(comment(code), found, "{code}");
        }
    }
}
