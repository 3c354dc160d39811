//! The colours of editors know the words of the language.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use gradus_tmcl::catalogue::COMMANDS;

/// The upper-case words of a file of the repository.
fn words(file: &str) -> BTreeSet<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let text = text.replace("UF[0-7]", "UF0|UF1|UF2|UF3|UF4|UF5|UF6|UF7");
    let words = text.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| word.len() > 1);
    words
        .filter(|word| word.chars().all(|it| it.is_ascii_uppercase() || it.is_ascii_digit()))
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_mnemonic_and_keyword_has_a_colour() {
    let mnemonics = COMMANDS.iter().filter(|row| !row.mnemonic.is_empty());
    let known: BTreeSet<String> = mnemonics
        .flat_map(|row| {
            let keywords = row.operands.iter().flat_map(|operand| operand.kind.keywords()).map(|word| word.text);
            keywords.chain([row.mnemonic]).map(str::to_owned)
        })
        .collect();
    for file in ["editors/vscode/syntaxes/tmcl.tmLanguage.json", "editors/vim/syntax/tmcl.vim", "editors/kate/tmcl.xml"]
    {
        let missing: Vec<_> = known.difference(&words(file)).cloned().collect();
        assert!(missing.is_empty(), "{file} lacks {missing:?}");
    }
}
