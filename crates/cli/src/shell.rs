//! Quotes words of a command for POSIX shells.

use std::path::Path;

use crate::output;

/// Returns a path as one word, quoted if necessary.
pub(crate) fn path(path: &Path) -> String {
    quoted(&output::path(path))
}

/// Returns a word that POSIX shells read as `word`. Words of plain characters stay unquoted.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./=:,%+@".contains(letter);
    if !word.is_empty() && word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_read_them_otherwise() {
        for (word, expected) in [
            ("link.delay=24ms", "link.delay=24ms"),
            ("", "''"),
            ("scene.title=\"a b\"", "'scene.title=\"a b\"'"),
            ("it's", "'it'\\''s'"),
            ("$HOME", "'$HOME'"),
            ("a\nb", "'a\nb'"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }
}
