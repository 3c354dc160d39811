//! Names of documents in the protocol, and paths.

use std::path::{Path, PathBuf};

const FILE: &str = "file://";

/// Returns the path of a `file:` URI; of any other URI (a text that was never saved) the URI itself.
pub fn to_path(uri: &str) -> PathBuf {
    match uri.strip_prefix(FILE) {
        Some(rest) => {
            let path = rest.find('/').map_or(rest, |start| &rest[start..]); // without a host
            PathBuf::from(without_drive_slash(&decode(path)))
        }
        None => PathBuf::from(uri),
    }
}

/// Returns the URI of a path that [`to_path`] turns back.
pub fn from_path(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    if text.contains("://") || text.starts_with("untitled:") {
        return text;
    }
    let slash = if text.starts_with('/') { "" } else { "/" };
    format!("{FILE}{slash}{}", encode(&text))
}

/// `/c:/programs` is `c:/programs`.
fn without_drive_slash(path: &str) -> &str {
    let is_drive = path.as_bytes().get(2) == Some(&b':') && path.as_bytes().get(1).is_some_and(u8::is_ascii_alphabetic);
    if is_drive { &path[1..] } else { path }
}

fn decode(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(byte) = bytes.get(at) {
        let code = (*byte == b'%').then(|| hex(bytes.get(at + 1..at + 3)?)).flatten();
        decoded.push(code.unwrap_or(*byte));
        at += if code.is_some() { 3 } else { 1 };
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

fn hex(digits: &[u8]) -> Option<u8> {
    u8::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()
}

fn encode(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-._~:".contains(&byte);
    let encoded =
        text.bytes().map(|byte| if is_plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") });
    encoded.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_and_uris_are_turned_into_each_other() {
        for (uri, path) in [
            ("file:///home/anna/stage.tmc", "/home/anna/stage.tmc"),
            ("file:///home/M%C3%BCller/my%20stage.tmc", "/home/Müller/my stage.tmc"),
            ("file:///c:/stages/a.tmc", "c:/stages/a.tmc"),
            ("untitled:Untitled-1", "untitled:Untitled-1"),
        ] {
            assert_eq!(to_path(uri), PathBuf::from(path));
            assert_eq!(from_path(Path::new(path)), uri);
        }
    }

    #[test]
    fn other_spellings_of_a_uri_are_read() {
        assert_eq!(to_path("file://localhost/a%2fb"), PathBuf::from("/a/b"));
        assert_eq!(to_path("file:///c%3A/a.tmc"), PathBuf::from("c:/a.tmc"));
        assert_eq!(to_path("file:///a%zz%"), PathBuf::from("/a%zz%"));
    }
}
