//! Quotes words of a command for POSIX shells, and makes the commands of pages.

use std::fmt::Display;
use std::path::Path;

use crate::{input, output};

/// Returns a path as one word, quoted if necessary.
pub(crate) fn path(path: &Path) -> String {
    quoted(&output::path(path))
}

/// Returns a word that POSIX shells read as `word`. Words of plain characters stay unquoted.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./=:,%+@".contains(letter);
    // Between single quotes a shell reads all characters but the quote as they are. A quote ends the quoted text, stands escaped, and begins quoted text again.
    if !word.is_empty() && word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

/// Placeholder for the folder of `--out` in a [`CommandLine`]. The content of a page must not depend on the folder of the page.
const FOLDER: &str = "DIR";

/// Command for making the files of a folder again, as a line for a POSIX shell. Options without an effect on files, such as `--json`, are left out.
pub(crate) struct CommandLine {
    words: Vec<String>,
    reads_standard_input: bool,
}

impl CommandLine {
    /// Begins a command on a scene, with the overrides of `--set`.
    pub(crate) fn new(command: &str, scene: &Path, set: &[String]) -> Self {
        let line = Self { words: vec![format!("cohaptic {command}"), path(scene)], reads_standard_input: input::is_standard_input(scene) };
        line.option("--set", set)
    }

    /// Begins a command with plain words, such as those of a link.
    pub(crate) fn of_words(command: &str, words: &[String]) -> Self {
        let words = words.iter().map(|word| quoted(word));
        Self { words: std::iter::once(format!("cohaptic {command}")).chain(words).collect(), reads_standard_input: false }
    }

    /// Appends another program with its arguments, after two dashes. Appends nothing for an empty list.
    pub(crate) fn program(mut self, words: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        let mut words = words.into_iter().map(|word| quoted(word.as_ref())).peekable();
        self.words.extend(words.peek().is_some().then(|| "--".to_owned()));
        self.words.extend(words);
        self
    }

    /// Appends an option once per value, so that an option without a value is left out.
    pub(crate) fn option(mut self, name: &str, values: impl IntoIterator<Item = impl Display>) -> Self {
        self.words.extend(values.into_iter().map(|value| format!("{name} {}", quoted(&value.to_string()))));
        self
    }

    /// Appends an option without a value, if `is_given`.
    pub(crate) fn flag(mut self, name: &str, is_given: bool) -> Self {
        self.words.extend(is_given.then(|| name.to_owned()));
        self
    }

    /// Appends `--out` with a placeholder for the folder.
    pub(crate) fn out(self) -> Self {
        self.option("--out", [FOLDER])
    }

    /// Returns the line. A scene from standard input gets a placeholder for the file.
    pub(crate) fn text(mut self) -> String {
        self.words.extend(self.reads_standard_input.then(|| "< scene.toml".to_owned()));
        self.words.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_has_each_option_as_often_as_it_was_given() {
        let none: Option<u64> = None;
        let line = CommandLine::new("run", Path::new("a b.toml"), &["x=1".to_owned(), "y=\"z\"".to_owned()]);
        let text = line.option("--seed", Some(7)).option("--grid", none).flag("--force", true).flag("--general", false).out().text();
        assert_eq!(text, "cohaptic run 'a b.toml' --set x=1 --set 'y=\"z\"' --seed 7 --force --out DIR");
        assert_eq!(CommandLine::new("run", Path::new("-"), &[]).out().text(), "cohaptic run - --out DIR < scene.toml");
        let line = CommandLine::of_words("exec", &["delay 8ms".to_owned()]).option("--seed", Some(7));
        assert_eq!(line.program(["sh", "-c", "exit 1"]).text(), "cohaptic exec 'delay 8ms' --seed 7 -- sh -c 'exit 1'");
        assert_eq!(CommandLine::of_words("exec", &[]).program([""; 0]).text(), "cohaptic exec");
    }

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
