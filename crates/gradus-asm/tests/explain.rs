//! The pages of `explain`: their examples give what they say.

use gradus_asm::{Assembly, Code, LintOptions, Options, assemble, lint};
use gradus_tmcl::catalogue::{Module, TMCM_3351};

/// An example of a page: the words behind its fence, and the program.
struct Example<'a> {
    words: Vec<&'a str>,
    text: &'a str,
}

impl Example<'_> {
    fn word(&self, name: &str) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix(name)?.strip_prefix('='))
    }

    /// The program as its words ask for it: repeated, with a STOP behind it, in UTF-16.
    fn bytes(&self) -> Vec<u8> {
        let mut text = self.text.repeat(self.word("repeat").map_or(1, |count| count.parse().unwrap()));
        text += if self.words.contains(&"stop") { "    STOP\n" } else { "" };
        if self.words.contains(&"utf16") {
            return "\u{feff}".chars().chain(text.chars()).flat_map(|c| (c as u16).to_le_bytes()).collect();
        }
        text.into_bytes()
    }

    fn assembled(&self) -> Assembly {
        let module = self.word("module").map_or(&TMCM_3351, |name| Module::named(name).unwrap());
        let text = self.bytes();
        let load = |path: &std::path::Path| match path.to_str() {
            Some("main.tmc") => Ok(text.clone()),
            _ => Err(std::io::ErrorKind::NotFound.into()),
        };
        assemble("main.tmc", &text, module, &Options::default(), &load)
    }

    fn codes(&self) -> Vec<&'static str> {
        let mut codes: Vec<_> =
            lint(&self.assembled(), &LintOptions::default()).iter().map(|problem| problem.code.text()).collect();
        codes.dedup();
        codes
    }
}

fn examples(page: &'static str) -> Vec<Example<'static>> {
    let fences = page.split("```tmc,").skip(1).map(|rest| rest.split_once("```").unwrap().0);
    let example = |fence: &'static str| {
        let (words, text) = fence.split_once('\n').unwrap();
        Example { words: words.split(',').collect(), text }
    };
    fences.map(example).collect()
}

#[test]
fn a_bad_example_gives_exactly_its_code_and_a_good_one_nothing() {
    let mut wrong = Vec::new();
    for code in Code::ALL {
        let examples = examples(code.page());
        let of = |word: &str| examples.iter().filter(|example| example.words[0] == word).collect::<Vec<_>>();
        let (bad, good) = (of("bad"), of("good"));
        assert!(!bad.is_empty() && !good.is_empty(), "{code:?}");
        let gives = |example: &&Example| (example.words[0].to_owned(), example.codes());
        wrong.extend(bad.iter().map(gives).filter(|(_, codes)| *codes != [code.text()]).map(|it| (code.text(), it)));
        wrong.extend(good.iter().map(gives).filter(|(_, codes)| !codes.is_empty()).map(|it| (code.text(), it)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_page_has_its_parts_in_order() {
    let parts = ["## What it does", "## Why it is bad", "## Example", "## How to allow it", "## Known false alarms"];
    for code in Code::ALL {
        let page = code.page();
        let places: Vec<_> =
            parts.iter().map(|part| page.find(part).unwrap_or_else(|| panic!("{code:?}: {part}"))).collect();
        assert!(page.starts_with(&format!("# {}\n", code.text())) && places.is_sorted(), "{code:?}");
    }
}

#[test]
fn codes_are_found_by_name() {
    assert_eq!(Code::named("UNREACHABLE"), Some(Code::Unreachable));
    assert_eq!((Code::named("unreachabl"), Code::nearest("unreachabl")), (None, Some(Code::Unreachable)));
}
