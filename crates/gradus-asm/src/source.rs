//! Source texts and the places in them.

use std::borrow::Cow;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use crate::problem::Span;

/// A file of a program, decoded.
#[derive(Clone, Debug)]
pub struct Source {
    /// Where it was found; for a built-in file only its name.
    pub path: PathBuf,
    /// The text. Spans count its bytes, which are not those of the file if that was Windows-1252.
    pub text: Arc<str>,
    /// True for the files that the assembler makes from the catalogue.
    pub built_in: bool,
    /// Where each line begins.
    line_starts: Arc<[usize]>,
}

impl Source {
    /// Decodes a file.
    pub fn new(path: impl Into<PathBuf>, bytes: &[u8]) -> Self {
        Self::of(path.into(), &decode(bytes), false)
    }

    /// A file that the assembler makes.
    pub(crate) fn built_in(path: impl Into<PathBuf>, text: &str) -> Self {
        Self::of(path.into(), text, true)
    }

    fn of(path: PathBuf, text: &str, built_in: bool) -> Self {
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(newline, _)| newline + 1)).collect();
        Self { path, text: text.into(), built_in, line_starts }
    }

    /// The same file without its text.
    pub(crate) fn emptied(self) -> Self {
        Self::of(self.path, "", self.built_in)
    }

    /// True for UTF-16 with its byte order mark. It is never UTF-8; as Windows-1252 it begins with the two letters of the
    /// mark, and half of the bytes of a program are zeros.
    pub(crate) fn is_utf16(&self) -> bool {
        ["ÿþ", "þÿ"].iter().any(|mark| self.text.starts_with(mark)) && self.is_binary()
    }

    /// True for what is no text: it has a zero in it.
    pub(crate) fn is_binary(&self) -> bool {
        self.text.contains('\0')
    }

    /// Line and column of a byte, both from 1; columns count characters.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let offset = self.text.floor_char_boundary(offset);
        let line = self.line_starts.partition_point(|start| *start <= offset);
        (line, self.text[self.line_starts[line - 1]..offset].chars().count() + 1)
    }

    /// The bytes of the lines from that of one byte to that of another, without the last line's end, and the number of the first,
    /// from 1.
    pub(crate) fn lines(&self, first: usize, last: usize) -> (usize, Range<usize>) {
        let line = |offset: usize| self.line_starts.partition_point(|start| *start <= offset);
        let end = self.line_starts.get(line(last)).map_or(self.text.len(), |next| next - 1);
        (line(first), self.line_starts[line(first) - 1]..end)
    }

    /// First bytes of the lines, ascending; never empty.
    pub fn line_starts(&self) -> &[usize] {
        &self.line_starts
    }

    /// The text of a span.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.start..span.end).unwrap_or("")
    }
}

/// UTF-8 where it is valid UTF-8, with or without a byte order mark, else Windows-1252.
fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|byte| windows_1252(*byte)).collect::<String>().into(),
    }
}

/// The bytes 0x80..=0x9f, where Windows-1252 is not Latin-1. Five of them mean nothing and stay control characters.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

fn windows_1252(byte: u8) -> char {
    match byte {
        0x80..=0x9f => WINDOWS_1252[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_decoded_from_utf8_or_windows_1252() {
        for (bytes, text) in [
            (&b"ROR 0, 1"[..], "ROR 0, 1"),
            ("// Größe".as_bytes(), "// Größe"),
            (b"\xef\xbb\xbfSTOP", "STOP"),
            (b"// Gr\xf6\xdfe, 5 \x80, \x84a\x93", "// Größe, 5 €, „a“"),
        ] {
            assert_eq!(decode(bytes), text);
        }
    }

    #[test]
    fn utf16_is_known_by_its_mark_and_its_zeros() {
        for (bytes, is_utf16) in [
            (&b"\xff\xfeS\0T\0"[..], true),
            (b"\xfe\xff\0S\0T", true),
            ("ÿþ: STOP".as_bytes(), false),
            (b"\xff\xfe: STOP", false),
            (b"STOP", false),
        ] {
            assert_eq!(Source::new("a.tmc", bytes).is_utf16(), is_utf16, "{bytes:x?}");
        }
    }

    #[test]
    fn position_counts_lines_and_characters_from_one() {
        let source = Source::new("a.tmc", "ä b\r\nc".as_bytes());
        for (offset, position) in [(0, (1, 1)), (1, (1, 1)), (2, (1, 2)), (3, (1, 3)), (6, (2, 1)), (99, (2, 2))] {
            assert_eq!(source.position(offset), position, "byte {offset}");
        }
    }

    #[test]
    fn lines_are_found_by_their_bytes() {
        let source = Source::new("a.tmc", b"ab\ncd\n\nef");
        for (first, last, line, bytes) in
            [(0, 1, 1, 0..2), (2, 2, 1, 0..2), (4, 5, 2, 3..5), (1, 6, 1, 0..6), (9, 99, 4, 7..9)]
        {
            assert_eq!(source.lines(first, last), (line, bytes), "{first} to {last}");
        }
    }
}
