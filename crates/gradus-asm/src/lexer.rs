//! The words of one line.

use crate::problem::Span;

/// A word or sign with its place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Token<'a> {
    pub kind: Kind<'a>,
    pub span: Span,
    /// As written.
    pub text: &'a str,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Kind<'a> {
    Number(f64),
    /// Begins like a number and is none.
    BadNumber,
    /// A label, constant, mnemonic, keyword or function.
    Name(&'a str),
    /// Any other character.
    Sign(char),
}

/// The tokens of a line without its comment. `span` is the place of `line`.
pub(crate) fn tokens(line: &str, span: Span) -> Vec<Token<'_>> {
    let code = code(line);
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(rest) = code.get(at..).filter(|rest| !rest.is_empty()) {
        let length = word(rest);
        let text = &rest[..length];
        let start = span.start + at;
        at += length;
        if !text.trim().is_empty() {
            tokens.push(Token { kind: kind(text), span: Span { start, end: start + length, ..span }, text });
        }
    }
    tokens
}

/// What stands in front of the comment.
pub(crate) fn code(line: &str) -> &str {
    line.split_once("//").map_or(line, |(code, _)| code)
}

/// Length of the word at the start of a text that is not empty: a name or number, else one character.
fn word(text: &str) -> usize {
    let mut characters = text.char_indices();
    let Some((_, first)) = characters.next() else { return 0 };
    let part: fn(char) -> bool = match first {
        _ if starts_name(first) => continues_name,
        '$' | '%' | '.' | '0'..='9' => continues_number,
        _ => |_| false,
    };
    characters.find(|(_, next)| !part(*next)).map_or(text.len(), |(end, _)| end)
}

fn starts_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn continues_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn continues_number(c: char) -> bool {
    continues_name(c) || c == '.'
}

fn kind(word: &str) -> Kind<'_> {
    match word.chars().next() {
        Some(c) if starts_name(c) => Kind::Name(word),
        Some('$' | '%' | '.' | '0'..='9') => number(word).map_or(Kind::BadNumber, Kind::Number),
        Some(c) => Kind::Sign(c),
        None => Kind::BadNumber,
    }
}

/// Decimal with or without a fraction, `$FF`, `0xFF`, `%1010`, `0b1010`.
fn number(word: &str) -> Option<f64> {
    for (prefix, radix) in [("$", 16), ("0x", 16), ("0X", 16), ("%", 2), ("0b", 2), ("0B", 2)] {
        if let Some(digits) = word.strip_prefix(prefix) {
            return whole(digits, radix);
        }
    }
    let decimal = word.chars().all(|c| c.is_ascii_digit() || c == '.');
    if decimal { word.parse().ok() } else { None }
}

fn whole(digits: &str, radix: u32) -> Option<f64> {
    let mut digits = digits.chars().map(|c| c.to_digit(radix)).peekable();
    digits.peek()?;
    digits.try_fold(0.0, |sum, digit| Some(sum * f64::from(radix) + f64::from(digit?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> String {
        let span = Span { start: 0, end: line.len(), source: 0 };
        let show = |token: &Token| match token.kind {
            Kind::Number(value) => format!("{value}"),
            Kind::BadNumber => format!("bad:{}", token.text),
            Kind::Name(name) => format!("name:{name}"),
            Kind::Sign(sign) => format!("'{sign}'"),
        };
        tokens(line, span).iter().map(show).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn lines_are_split_into_words_numbers_and_signs() {
        for (line, expected) in [
            ("", ""),
            ("  \t ", ""),
            ("// only a comment", ""),
            ("MST 0//stop", "name:MST 0"),
            ("Loop: mvp ABS,0,-5", "name:Loop ':' name:mvp name:ABS ',' 0 ',' '-' 5"),
            ("_a1 = 2.5*$fF", "name:_a1 '=' 2.5 '*' 255"),
            ("0xff 0B101 %11 .5 5.", "255 5 3 0.5 5"),
            ("$ % 0x 12ab 1.2.3 0b12 $1.5", "bad:$ bad:% bad:0x bad:12ab bad:1.2.3 bad:0b12 bad:$1.5"),
            ("a§b 6/2", "name:a '§' name:b 6 '/' 2"),
        ] {
            assert_eq!(words(line), expected, "{line}");
        }
    }

    #[test]
    fn spans_count_bytes_from_the_start_of_the_source() {
        let tokens = tokens("ä: 12", Span { source: 3, start: 100, end: 106 });
        let spans: Vec<_> = tokens.iter().map(|token| (token.span.source, token.span.start, token.span.end)).collect();
        assert_eq!(spans, [(3, 100, 102), (3, 102, 103), (3, 104, 106)]);
    }
}
