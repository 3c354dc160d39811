//! Did you mean: the name that a misspelled one is closest to.

/// The nearest of the candidates, if it is near: at most a third of the letters wrong, one in short names.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name: Vec<char> = name.to_lowercase().chars().take(64).collect();
    let limit = (name.len() / 3).max(1);
    let letters = |candidate: &str| candidate.to_lowercase().chars().take(64).collect::<Vec<_>>();
    candidates
        .into_iter()
        .map(|candidate| (letters(candidate), candidate))
        .filter(|(letters, _)| letters.len().abs_diff(name.len()) <= limit)
        .map(|(letters, candidate)| (distance(&name, &letters), candidate))
        .filter(|(distance, _)| *distance <= limit && *distance < name.len())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// The question that goes with a problem.
pub(crate) fn hint<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
}

/// How many letters must be inserted, removed, replaced or swapped with their neighbour.
fn distance(from: &[char], to: &[char]) -> usize {
    let mut before = vec![0; to.len() + 1];
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for (i, letter) in from.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, other) in to.iter().enumerate() {
            let mut best = (last[j] + usize::from(letter != other)).min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && *letter == to[j - 1] && from[i - 1] == *other {
                best = best.min(before[j - 1] + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut last, row);
    }
    last[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_far_ones_are_not() {
        let names = ["MVP", "MST", "WAIT", "APMaxAcceleration", "Loop"];
        for (name, expected) in [
            ("MPV", Some("MVP")),
            ("MOV", None),
            ("wiat", Some("WAIT")),
            ("WAITT", Some("WAIT")),
            ("APMaxAcelleration", Some("APMaxAcceleration")),
            ("Lop", Some("Loop")),
            ("X", None),
            ("Elsewhere", None),
            ("", None),
        ] {
            assert_eq!(nearest(name, names), expected, "{name}");
        }
    }
}
