//! Where the cursor stands in a line that may be half written.

use gradus_tmcl::catalogue::{COMMANDS, Command, Module};

/// What may be written at the cursor.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Context<'a> {
    /// A mnemonic, a directive, or a name that is to be defined; so much of it is there.
    Start {
        /// What is written already.
        word: &'a str,
    },
    /// An operand of a command.
    Operand {
        /// The command.
        command: &'static Command,
        /// Which operand, from 0.
        index: usize,
        /// The operands before it, as written.
        before: Vec<&'a str>,
        /// What is written of it already.
        word: &'a str,
    },
    /// A value of a constant.
    Value {
        /// What is written already.
        word: &'a str,
    },
    /// The name of a file to include.
    Include {
        /// What is written already.
        word: &'a str,
    },
    /// A pragma behind `// gradus:`.
    Pragma {
        /// What is written already.
        word: &'a str,
    },
    /// A code in the brackets of `allow`.
    Code {
        /// What is written already.
        word: &'a str,
    },
    /// Text of a comment.
    Comment,
}

/// Returns what may be written at the end of `line`, which is the part of a line before the cursor.
pub fn context<'a>(line: &'a str, module: &Module) -> Context<'a> {
    if let Some((_, comment)) = line.split_once("//") {
        return in_comment(comment);
    }
    let rest = without_labels(line);
    if let Some(name) = rest.trim_start().get(8..).filter(|_| is_include(rest)) {
        return Context::Include { word: name.trim_start().trim_start_matches('"') };
    }
    if let Some((_, value)) = rest.split_once('=') {
        return Context::Value { word: last_word(value) };
    }
    let trimmed = rest.trim_start();
    let Some((mnemonic, operands)) = trimmed.split_once(char::is_whitespace) else {
        return Context::Start { word: trimmed };
    };
    match command(mnemonic, module) {
        Some(command) => operand(command, operands),
        None => Context::Value { word: last_word(operands) },
    }
}

fn operand<'a>(command: &'static Command, operands: &'a str) -> Context<'a> {
    let mut parts: Vec<&str> = operands.split(',').collect();
    let word = last_word(parts.pop().unwrap_or(""));
    let before: Vec<_> = parts.into_iter().map(str::trim).collect();
    Context::Operand { command, index: before.len(), before, word }
}

/// The row of a mnemonic; the module's own where it has one.
pub fn command(mnemonic: &str, module: &Module) -> Option<&'static Command> {
    let named = |command: &&Command| !mnemonic.is_empty() && command.mnemonic.eq_ignore_ascii_case(mnemonic);
    module.command(mnemonic).or_else(|| COMMANDS.iter().find(named))
}

fn in_comment(comment: &str) -> Context<'_> {
    let Some(pragma) = comment.trim_start().strip_prefix("gradus:") else { return Context::Comment };
    match pragma.rsplit_once(['(', ',']) {
        Some((_, word)) => Context::Code { word: word.trim_start() },
        None => Context::Pragma { word: pragma.trim_start() },
    }
}

fn is_include(text: &str) -> bool {
    text.trim_start().get(..8).is_some_and(|word| word.eq_ignore_ascii_case("#include"))
}

/// The line behind its labels.
fn without_labels(line: &str) -> &str {
    let mut rest = line;
    while let Some((label, behind)) = rest.split_once(':') {
        if !label.trim().chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
            break;
        }
        rest = behind;
    }
    rest
}

/// The word that the text ends with.
fn last_word(text: &str) -> &str {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '$' | '#');
    let start =
        text.rfind(|letter| !is_word(letter)).map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
    &text[start..]
}

#[cfg(test)]
mod tests {
    use gradus_tmcl::catalogue::TMCM_3351;

    use super::*;

    fn operand_of(line: &str) -> (&str, usize, Vec<&str>, &str) {
        match context(line, &TMCM_3351) {
            Context::Operand { command, index, before, word } => (command.mnemonic, index, before, word),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn line_tells_what_may_follow() {
        assert_eq!(context("Loop: sa", &TMCM_3351), Context::Start { word: "sa" });
        assert_eq!(context("", &TMCM_3351), Context::Start { word: "" });
        assert_eq!(operand_of("  sap 4, Mo"), ("SAP", 1, vec!["4"], "Mo"));
        assert_eq!(operand_of("MVP "), ("MVP", 0, vec![], ""));
        assert_eq!(operand_of("MVP ABS, 0, 2*Tur"), ("MVP", 2, vec!["ABS", "0"], "Tur"));
        assert_eq!(context("Travel = 3 * Tu", &TMCM_3351), Context::Value { word: "Tu" });
        assert_eq!(context("#include TM", &TMCM_3351), Context::Include { word: "TM" });
        assert_eq!(context("STOP // gradus: allow(unre", &TMCM_3351), Context::Code { word: "unre" });
        assert_eq!(context("STOP // gradus: en", &TMCM_3351), Context::Pragma { word: "en" });
        assert_eq!(context("STOP // no", &TMCM_3351), Context::Comment);
        assert_eq!(context("ÄÖ: größer ß", &TMCM_3351), Context::Value { word: "" });
    }
}
