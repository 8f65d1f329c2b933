//! The command that makes a run again, as a line for a shell.

use std::path::Path;

use crate::arguments::RunArguments;
use crate::{input, output};

/// The folder of the records in such a line. Records do not depend on their folder, and neither does what they say.
const FOLDER: &str = "DIR";

/// The line, with the options that have an effect on records.
pub(super) fn line(arguments: &RunArguments) -> String {
    let scene = &arguments.scene.scene;
    let mut words = vec!["cohaptic run".to_owned(), path(scene)];
    words.extend(arguments.scene.overrides.set.iter().map(|key| format!("--set {}", quoted(key))));
    words.extend(arguments.seed.map(|seed| format!("--seed {seed}")));
    words.extend(arguments.against.iter().map(|key| format!("--against {}", quoted(key))));
    words.extend(arguments.inputs.as_deref().map(|file| format!("--inputs {}", path(file))));
    words.extend(arguments.force.then(|| "--force".to_owned()));
    words.extend(arguments.general.then(|| "--general".to_owned()));
    words.push(format!("--out {FOLDER}"));
    words.extend(arguments.pictures.word().map(|size| format!("--size {}", quoted(size))));
    if input::is_standard_input(scene) {
        words.push("< scene.toml".to_owned());
    }
    words.join(" ")
}

fn path(path: &Path) -> String {
    quoted(&output::path(path))
}

/// A word as POSIX shells read it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./=:,%+@".contains(letter);
    if !word.is_empty() && word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::quoted;

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
