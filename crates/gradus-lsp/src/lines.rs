//! Differences of two texts, line by line.

/// Lines that take the place of others.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LineEdit {
    /// First byte that is replaced.
    pub start: usize,
    /// The byte behind the last one.
    pub end: usize,
    /// What comes there.
    pub text: String,
}

/// Lines of a text that are looked through for a line of the other.
const REACH: usize = 50;

/// Returns the edits that turn one text into another, in the order of the text: a run of lines that differ each.
///
/// Where lines are removed or added, the next equal line is looked for nearby: the edits are right in any case, and short where
/// the texts are alike.
pub fn edits(old: &str, new: &str) -> Vec<LineEdit> {
    let (old_lines, new_lines): (Vec<_>, Vec<_>) =
        (old.split_inclusive('\n').collect(), new.split_inclusive('\n').collect());
    let (mut i, mut j, mut offset) = (0, 0, 0);
    let mut edits: Vec<LineEdit> = Vec::new();
    while i < old_lines.len() || j < new_lines.len() {
        if i < old_lines.len() && old_lines.get(i) == new_lines.get(j) {
            offset += old_lines[i].len();
            (i, j) = (i + 1, j + 1);
            continue;
        }
        let (next_i, next_j) = meeting(&old_lines, &new_lines, i, j);
        let removed: usize = old_lines[i..next_i].iter().map(|line| line.len()).sum();
        edits.push(LineEdit { start: offset, end: offset + removed, text: new_lines[j..next_j].concat() });
        offset += removed;
        (i, j) = (next_i, next_j);
    }
    edits
}

/// The nearest lines at which the texts are equal again; their ends if there are none.
fn meeting(old: &[&str], new: &[&str], i: usize, j: usize) -> (usize, usize) {
    for distance in 1..=2 * REACH {
        for ahead in 0..=distance.min(REACH) {
            let (x, y) = (i + ahead, j + distance - ahead);
            if x < old.len() && y < new.len() && old[x] == new[y] {
                return (x, y);
            }
        }
    }
    (old.len(), new.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(old: &str, edits: &[LineEdit]) -> String {
        let mut text = old.to_owned();
        for edit in edits.iter().rev() {
            text.replace_range(edit.start..edit.end, &edit.text);
        }
        text
    }

    #[test]
    fn edits_turn_one_text_into_the_other() {
        for (old, new, count) in [
            ("a\nb\nc\n", "a\nb\nc\n", 0),
            ("a\nb\nc\n", "a\nB\nc\n", 1),
            ("a\nb\nc\n", "a\nc\n", 1),
            ("a\nc\n", "a\nb\nc\n", 1),
            ("a\n\n\n\nb", "a\n\nb\n", 1),
            ("", "a\n", 1),
            ("a", "", 1),
            ("x\na\ny\n", "X\na\nY\n", 2),
        ] {
            let edits = edits(old, new);
            assert_eq!(apply(old, &edits), new);
            assert_eq!(edits.len(), count, "{old:?} {new:?}");
        }
    }
}
