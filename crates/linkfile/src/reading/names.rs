//! Names of the ends of links, and suggestions for misspelt names.

use std::collections::BTreeMap;

/// Distinct names of peers or programs, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// Names, indexed by peer or program.
    ordered: Vec<String>,
    /// Index of each name in `ordered`.
    places: BTreeMap<String, usize>,
    /// Noun for an end of a link in messages. `None` stands for "peer".
    noun: Option<&'static str>,
}

impl Names {
    /// Returns an empty list of names for ends that messages call `noun`. [`Names::default`] is an empty list for peers.
    #[must_use]
    pub(crate) fn of(noun: &'static str) -> Self {
        Self { noun: Some(noun), ..Self::default() }
    }

    /// Returns the noun for an end of a link in messages, such as `peer`.
    #[must_use]
    pub fn noun(&self) -> &'static str {
        self.noun.unwrap_or("peer")
    }

    /// Adds a name. Returns `false`, and adds nothing, if the list contains the name.
    pub fn push(&mut self, name: &str) -> bool {
        if self.places.contains_key(name) {
            return false;
        }
        self.places.insert(name.to_owned(), self.ordered.len());
        self.ordered.push(name.to_owned());
        true
    }

    /// Returns the number of names.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "nothing asks for it")]
    pub fn len(&self) -> usize {
        self.ordered.len()
    }

    /// Returns the index of a name, counted from 0.
    #[must_use]
    pub fn index(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// Returns the names in the order of the file.
    #[must_use]
    pub fn as_slice(&self) -> &[String] {
        &self.ordered
    }
}

/// Lists the expected words for a message, at most 32 of them, and suggests the word nearest to `given`: `one of delay, jitter; did you mean "delay"?`
#[must_use]
pub fn one_of<'a>(words: impl IntoIterator<Item = &'a str>, given: &str) -> String {
    const MOST: usize = 32;
    let words: Vec<&str> = words.into_iter().collect();
    let mut text = match words.as_slice() {
        [] => return "none".to_owned(),
        [only] => (*only).to_owned(),
        _ => format!("one of {}", words[..words.len().min(MOST)].join(", ")),
    };
    if words.len() > MOST {
        text.push_str(&format!(" and {} more", words.len() - MOST));
    }
    if let Some(meant) = nearest(&words, given) {
        text.push_str(&format!("; did you mean \"{meant}\"?"));
    }
    text
}

/// Returns the word with the fewest typing errors to `given`, or `None` if no word is near or if `given` is longer than 40 characters.
pub(crate) fn nearest<'a>(words: &[&'a str], given: &str) -> Option<&'a str> {
    // At most 41 characters are read, because a long text is compared with no word.
    let given: Vec<char> = given.chars().take(41).collect();
    if given.len() > 40 {
        return None;
    }
    let slips = |word: &str| distance(&word.chars().collect::<Vec<_>>(), &given);
    let (least, word) = words.iter().map(|word| (slips(word), *word)).min_by_key(|(slips, _)| *slips)?;
    // One to three errors, at most a third of the word: "dlay" is near "delay", "xy" is near nothing. Distance 0 means that the word itself was given.
    (least > 0 && least <= (given.len().max(word.chars().count()) / 3).clamp(1, 3) && least < given.len()).then_some(word)
}

/// Returns the edit distance: insertions, deletions, replacements and swaps of neighbouring letters (optimal string alignment).
fn distance(a: &[char], b: &[char]) -> usize {
    // Rows of the matrix of distances between prefixes. A swap looks two rows back, so three rows are kept.
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            // `last[j] + 1` leaves out a letter of `a`, and `row[j - 1] + 1` a letter of `b`.
            let mut least = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(before_last[j - 2] + 1);
            }
            row.push(least);
        }
        before_last = core::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_finger_finds_the_word_that_was_meant() {
        let words = ["delay", "jitter", "order", "loss"];
        assert_eq!(nearest(&words, "dlay"), Some("delay"));
        assert_eq!(nearest(&words, "jittre"), Some("jitter"));
        assert_eq!(nearest(&words, "los"), Some("loss"));
        assert_eq!(nearest(&words, "bandwidth"), None);
        assert_eq!(nearest(&words, ""), None);
        assert_eq!(nearest(&words, "delay"), None);
    }

    #[test]
    fn many_words_are_not_all_listed() {
        let words: Vec<String> = (0..100).map(|n| format!("peer{n}")).collect();
        assert!(one_of(words.iter().map(String::as_str), "nobody").ends_with("peer31 and 68 more"));
    }
}
