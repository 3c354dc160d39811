//! What comments tell the tools: `// gradus: allow(CODE, ...)` and its relatives.
//!
//! | pragma | meaning |
//! |---|---|
//! | `allow(CODE, ...)` | no such finding on this line, or on the next one where the pragma stands alone |
//! | `allow-file(CODE, ...)` | no such finding in this file |
//! | `entry` | the host starts the program at the label of this line, or of the next one |
//! | `no-coverage` | this line, or the next one, does not count for coverage |
//! | `module NAME` | the module that the program is for; in the first 20 lines |
//! | `firmware X.YY` | the oldest firmware that the program is for |
//! | `no-stop` | the assembler appends no STOP to the program |

use crate::assembler::Assembly;
use crate::code::Code;
use crate::comments::{NO_STOP, words};
use crate::problem::{Problem, Span};
use crate::source::Source;

/// How many comments and blank lines may stand between a pragma and the line that it is about.
const MOST_COMMENTS: usize = 20;

/// The words, as they are proposed.
pub const PRAGMAS: &[&str] = &["allow", "allow-file", "entry", "no-coverage", "module", "firmware", NO_STOP];

/// A code that a pragma allows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Allow {
    pub code: Code,
    /// Where the code is written.
    pub span: Span,
    /// Where it does not count: a line or a whole file.
    pub place: Span,
}

/// The pragmas of a program.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Pragmas {
    pub(crate) allows: Vec<Allow>,
    /// Addresses that a host starts at.
    pub entries: Vec<usize>,
    /// Lines that do not count for coverage.
    pub not_covered: Vec<Span>,
    /// The oldest firmware that the program is for.
    pub firmware: Option<(u8, u8)>,
    pub(crate) problems: Vec<Problem>,
}

impl Pragmas {
    /// Reads the pragmas of a program.
    pub fn of(assembly: &Assembly) -> Self {
        let mut pragmas = Self::default();
        for comment in &assembly.comments {
            let source = &assembly.sources[comment.source];
            if let Some(words) = words(source, *comment) {
                Reader { assembly, source, comment: *comment, pragmas: &mut pragmas }.read(words);
            }
        }
        pragmas
    }
}

/// Reads `1.11`.
pub fn firmware(text: &str) -> Option<(u8, u8)> {
    let (major, minor) = text.split_once('.')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

struct Reader<'a> {
    assembly: &'a Assembly,
    source: &'a Source,
    comment: Span,
    pragmas: &'a mut Pragmas,
}

impl Reader<'_> {
    fn read(&mut self, words: Span) {
        let text = self.source.slice(words);
        let end = text.find(|c: char| c == '(' || c.is_whitespace()).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        let operand = Span { start: words.start + end, ..words };
        match word {
            "allow" => self.allow(operand, self.line()),
            "allow-file" => self.allow(operand, Span { start: 0, end: self.source.text.len(), ..words }),
            "entry" => self.entry(words),
            "no-coverage" => self.pragmas.not_covered.push(self.line()),
            "module" | NO_STOP => {}
            "firmware" => match firmware(rest.trim()) {
                Some(version) => self.pragmas.firmware = Some(version),
                None => self.wrong(operand, "a version is expected here", "write `firmware 1.11`"),
            },
            _ => self.unknown(Span { end: words.start + end, ..words }, word),
        }
    }

    fn allow(&mut self, codes: Span, place: Span) {
        let text = self.source.slice(codes);
        let inner = text.trim().strip_prefix('(').and_then(|text| text.strip_suffix(')'));
        let Some(inner) = inner.filter(|inner| !inner.trim().is_empty()) else {
            return self.wrong(codes, "codes in brackets are expected here", "write `allow(unreachable)`");
        };
        let offset = inner.as_ptr().addr() - text.as_ptr().addr();
        let mut start = codes.start + offset;
        for part in inner.split(',') {
            let name = part.trim();
            let at = start + (part.len() - part.trim_start().len());
            let span = Span { start: at, end: at + name.len(), ..codes };
            match Code::named(name) {
                Some(code) => self.pragmas.allows.push(Allow { code, span, place }),
                None => self.unknown_code(span, name),
            }
            start += part.len() + 1;
        }
    }

    fn entry(&mut self, span: Span) {
        let line = self.line();
        let inside = |span: Span| span.source == line.source && (line.start..line.end).contains(&span.start);
        let label = self.assembly.labels.iter().find(|label| inside(label.span));
        match label {
            Some(label) => self.pragmas.entries.push(label.address),
            None => self.wrong(span, "no label stands here", "put it on the line of a label or alone above it"),
        }
    }

    /// The line that a pragma is about: its own, or, where it stands alone, the next one that is not a comment.
    fn line(&self) -> Span {
        let mut lines = self.source.text[self.start()..].split('\n');
        let mut start = self.start();
        let mut line = lines.next().unwrap_or("");
        for next in lines.take(MOST_COMMENTS) {
            if !crate::lexer::code(line).trim().is_empty() {
                break;
            }
            start += line.len() + 1;
            line = next;
        }
        Span { start, end: start + line.len(), ..self.comment }
    }

    /// Where the pragma's own line begins.
    fn start(&self) -> usize {
        self.source.text[..self.comment.start].rfind('\n').map_or(0, |newline| newline + 1)
    }

    fn wrong(&mut self, span: Span, message: &str, help: &str) {
        self.pragmas.problems.push(Problem::warning(Code::UnknownPragma, span, message).help(help));
    }

    fn unknown(&mut self, span: Span, word: &str) {
        let help = crate::nearest::hint(word, PRAGMAS.iter().copied());
        let help = help.unwrap_or_else(|| format!("there are {}", PRAGMAS.join(", ")));
        self.wrong(span, &format!("no pragma named `{word}`"), &help);
    }

    fn unknown_code(&mut self, span: Span, name: &str) {
        let near = Code::nearest(name).map(|code| format!("did you mean `{}`?", code.text()));
        let help = near.unwrap_or_else(|| "the book lists the codes".into());
        self.wrong(span, &format!("no code named `{name}`"), &help);
    }
}
