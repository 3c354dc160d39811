//! Positions of the protocol and bytes of a text.

/// How a position counts within a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Encoding {
    /// In bytes.
    Utf8,
    /// In UTF-16 units: the protocol's own way.
    #[default]
    Utf16,
}

/// A position as the protocol has it: line and character from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Place {
    /// Line from 0.
    pub line: u32,
    /// Distance from the start of the line, see [`Encoding`].
    pub character: u32,
}

/// The lines of a text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Lines {
    /// First byte of each line.
    starts: Vec<usize>,
}

impl Lines {
    /// Finds the lines of a text.
    pub fn of(text: &str) -> Self {
        Self { starts: std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect() }
    }

    /// Returns the line of a byte, from 0.
    pub fn line(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset).saturating_sub(1)
    }

    /// Returns the bytes of a line without its end; those of the last line for a line past the end.
    pub fn range(&self, text: &str, line: usize) -> (usize, usize) {
        let line = line.min(self.starts.len().saturating_sub(1));
        let start = self.starts.get(line).copied().unwrap_or(0);
        let end = self.starts.get(line + 1).map_or(text.len(), |next| next - 1);
        let content = text.get(start..end).unwrap_or("");
        (start, start + content.trim_end_matches('\r').len())
    }

    /// Returns the position of a byte.
    pub fn place(&self, text: &str, offset: usize, encoding: Encoding) -> Place {
        let offset = text.floor_char_boundary(offset.min(text.len()));
        let line = self.line(offset);
        let start = self.starts.get(line).copied().unwrap_or(0);
        let before = text.get(start..offset).unwrap_or("");
        let character = match encoding {
            Encoding::Utf8 => before.len(),
            Encoding::Utf16 => before.encode_utf16().count(),
        };
        Place { line: line as u32, character: character as u32 }
    }

    /// Returns the byte at a position. One past the end of its line means the end; one inside a character its start.
    pub fn offset(&self, text: &str, place: Place, encoding: Encoding) -> usize {
        if place.line as usize >= self.starts.len() {
            return text.len();
        }
        let (start, end) = self.range(text, place.line as usize);
        let content = text.get(start..end).unwrap_or("");
        let wanted = place.character as usize;
        let within = match encoding {
            Encoding::Utf8 => content.floor_char_boundary(wanted.min(content.len())),
            Encoding::Utf16 => utf16_offset(content, wanted),
        };
        start + within
    }
}

fn utf16_offset(content: &str, wanted: usize) -> usize {
    let mut units = 0;
    for (at, character) in content.char_indices() {
        units += character.len_utf16();
        if units > wanted {
            return at;
        }
    }
    content.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "ROR 0, 1 // 😀 größer\r\nSTOP\n";

    #[test]
    fn positions_count_bytes_or_utf16_units() {
        let lines = Lines::of(TEXT);
        let after = TEXT.find(" gr").unwrap();
        let utf8 = Place { line: 0, character: after as u32 };
        let utf16 = Place { line: 0, character: after as u32 - 2 };
        assert_eq!(lines.place(TEXT, after, Encoding::Utf8), utf8);
        assert_eq!(lines.place(TEXT, after, Encoding::Utf16), utf16);
        assert_eq!(lines.offset(TEXT, utf8, Encoding::Utf8), after);
        assert_eq!(lines.offset(TEXT, utf16, Encoding::Utf16), after);
    }

    #[test]
    fn every_byte_that_begins_a_character_comes_back() {
        let lines = Lines::of(TEXT);
        for (at, character) in TEXT.char_indices().filter(|(_, character)| !"\r\n".contains(*character)) {
            for encoding in [Encoding::Utf8, Encoding::Utf16] {
                let place = lines.place(TEXT, at, encoding);
                assert_eq!(lines.offset(TEXT, place, encoding), at, "{character:?}");
            }
        }
    }

    #[test]
    fn positions_past_an_end_mean_the_end() {
        let lines = Lines::of(TEXT);
        let place = |line, character| lines.offset(TEXT, Place { line, character }, Encoding::Utf16);
        assert_eq!(place(1, 99), TEXT.len() - 1);
        assert_eq!(place(0, 99), TEXT.find('\r').unwrap());
        assert_eq!((place(2, 0), place(9, 9)), (TEXT.len(), TEXT.len()));
    }

    #[test]
    fn position_inside_a_character_means_its_start() {
        let lines = Lines::of(TEXT);
        let smile = TEXT.find('😀').unwrap();
        let inside = Place { line: 0, character: smile as u32 + 1 };
        assert_eq!(lines.offset(TEXT, inside, Encoding::Utf16), smile);
        assert_eq!(lines.offset(TEXT, inside, Encoding::Utf8), smile);
    }
}
