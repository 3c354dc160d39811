//! Problems of programs as tools read them: JSON, GitHub's workflow commands, SARIF.

use gradus_asm::{Code, Problem, Severity, Source, Span};
use serde_json::{Value, json};

/// A problem with the sources that its places are in.
pub struct Finding<'a> {
    pub problem: &'a Problem,
    pub sources: &'a [Source],
}

/// A place as people count: from 1, in characters.
struct Place {
    file: String,
    line: usize,
    column: usize,
    end_line: usize,
    end_column: usize,
}

impl Finding<'_> {
    fn place(&self, span: Span) -> Place {
        let Some(source) = self.sources.get(span.source) else {
            return Place { file: String::new(), line: 1, column: 1, end_line: 1, end_column: 1 };
        };
        let ((line, column), (end_line, end_column)) = (source.position(span.start), source.position(span.end));
        Place { file: source.path.display().to_string(), line, column, end_line, end_column }
    }

    /// One object; the changes of a fix are in bytes of the text as the assembler reads it (UTF-8).
    fn json(&self) -> Value {
        let problem = self.problem;
        let note = problem.note.as_ref().map(|note| {
            let place = self.place(note.span);
            json!({ "file": place.file, "line": place.line, "column": place.column, "text": note.text })
        });
        let fix = problem.fix.as_ref().map(|fix| {
            let edit = |edit: &gradus_asm::Edit| {
                json!({ "file": self.place(edit.span).file, "start": edit.span.start, "end": edit.span.end, "text": edit.text })
            };
            json!({ "title": fix.title, "safe": fix.safe, "edits": fix.edits.iter().map(edit).collect::<Vec<_>>() })
        });
        let Place { file, line, column, end_line, end_column } = self.place(problem.span);
        json!({
            "file": file, "line": line, "column": column, "end_line": end_line, "end_column": end_column,
            "severity": problem.severity.text(), "code": problem.code.text(), "message": problem.message,
            "help": problem.help, "note": note, "fix": fix,
        })
    }

    /// A line that annotates a pull request.
    pub fn github(&self) -> String {
        let Place { file, line, column, end_line, end_column } = self.place(self.problem.span);
        let level = match self.problem.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Hint => "notice",
        };
        let help = self.problem.help.iter().map(|help| format!("\nhelp: {help}")).collect::<String>();
        let message = escaped(&format!("{}{help}", self.problem.message), "%\r\n");
        let (file, code) = (escaped(&file, "%\r\n:,"), self.problem.code.text());
        format!(
            "::{level} file={file},line={line},endLine={end_line},col={column},endColumn={end_column},title={code}::{message}"
        )
    }

    fn sarif(&self) -> Value {
        let level = match self.problem.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Hint => "note",
        };
        json!({
            "ruleId": self.problem.code.text(),
            "level": level,
            "message": { "text": self.problem.message },
            "locations": [self.location(self.problem.span)],
            "relatedLocations": self.problem.note.iter().map(|note| {
                let mut location = self.location(note.span);
                location["message"] = json!({ "text": note.text });
                location
            }).collect::<Vec<_>>(),
        })
    }

    fn location(&self, span: Span) -> Value {
        let Place { file, line, column, end_line, end_column } = self.place(span);
        let region = json!({ "startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column });
        json!({ "physicalLocation": { "artifactLocation": { "uri": file.replace('\\', "/") }, "region": region } })
    }
}

/// A text with these characters as `%0A`.
fn escaped(text: &str, special: &str) -> String {
    let escape = |c: char| if special.contains(c) { format!("%{:02X}", u32::from(c)) } else { c.to_string() };
    text.chars().map(escape).collect()
}

/// All findings as one object with its version.
pub fn json(findings: &[Finding]) -> Value {
    json!({ "version": 1, "problems": findings.iter().map(Finding::json).collect::<Vec<_>>() })
}

/// A SARIF 2.1.0 log with the rules that have findings.
pub fn sarif(findings: &[Finding]) -> Value {
    let mut codes: Vec<Code> = findings.iter().map(|finding| finding.problem.code).collect();
    codes.sort_unstable();
    codes.dedup();
    let rule = |code: &Code| {
        let page = code.explanation();
        json!({ "id": code.text(), "help": { "text": page, "markdown": page } })
    };
    let driver = json!({
        "name": "gradus",
        "version": env!("CARGO_PKG_VERSION"),
        "rules": codes.iter().map(rule).collect::<Vec<_>>(),
    });
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": driver },
            "columnKind": "unicodeCodePoints",
            "results": findings.iter().map(Finding::sarif).collect::<Vec<_>>(),
        }],
    })
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn special_characters_are_escaped() {
        assert_eq!(escaped("50 %, a\nb", "%\r\n"), "50 %25, a%0Ab");
        assert_eq!(escaped("c:\\a,b", "%\r\n:,"), "c%3A\\a%2Cb");
    }
}
