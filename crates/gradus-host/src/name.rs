//! Names as they are typed.

/// Lower case, words joined by underscores: what a name is typed as.
pub fn normalise(name: &str) -> String {
    words(name).join("_")
}

/// The words of a name in lower case.
pub(crate) fn words(name: &str) -> Vec<String> {
    name.split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase)
        .collect()
}
