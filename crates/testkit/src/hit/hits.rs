//! Hits on several paths, as a value.

use std::fmt;

use super::words::Hit;

/// Hits on packets between hosts, with the names of the hosts. [`Testbed::hits`](crate::Testbed::hits) takes such a value, and `strategies::any_hits` draws
/// such values (feature `strategies`).
///
/// The text form has a line per path, with [words](crate::hit) after a colon. `Debug` prints Rust code that makes the same value.
///
/// ```
/// use cohaptic_testkit::hit::Hits;
///
/// let hits = Hits::words("a -> b: drop first SYN; delay 30ms packets 3 8");
/// assert_eq!(hits.to_string(), "a -> b: drop first SYN; delay 30ms packets 3 8");
/// ```
#[derive(Clone, PartialEq, Eq, Default)]
pub struct Hits {
    pub(crate) all: Vec<PathHit>,
}

/// Hit on a path.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct PathHit {
    pub(crate) from: String,
    pub(crate) to: String,
    pub(crate) hit: Hit,
}

impl Hits {
    /// Creates a value without hits.
    #[must_use]
    pub const fn none() -> Self {
        Self { all: Vec::new() }
    }

    /// Parses the text that `Debug` prints.
    ///
    /// # Panics
    ///
    /// If the text makes no sense, with the place. `text.parse::<Hits>()` returns an error instead.
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "documented: for text that stands in a test")]
    pub fn words(text: &str) -> Self {
        text.parse().unwrap_or_else(|error| panic!("these words do not describe hits: {error}"))
    }

    /// Returns whether nothing is hit.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns the number of hits. A hit is an action and the packets to which it applies.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.all.len()
    }
}

impl fmt::Display for Hits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Hits of a path that follow each other share a line, so that a value from `any_hits` has one line per path.
        let mut before: Option<&PathHit> = None;
        for hit in &self.all {
            match before {
                Some(before) if (&before.from, &before.to) == (&hit.from, &hit.to) => f.write_str("; ")?,
                Some(_) => write!(f, "\n{} -> {}: ", hit.from, hit.to)?,
                None => write!(f, "{} -> {}: ", hit.from, hit.to)?,
            }
            write!(f, "{}", hit.hit)?;
            before = Some(hit);
        }
        Ok(())
    }
}

impl fmt::Debug for Hits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("Hits::none()");
        }
        // The words may contain a text in quotes, which needs a raw string with `#`.
        let hashes = if self.to_string().contains('"') { "#" } else { "" };
        let r = if hashes.is_empty() { "" } else { "r" };
        write!(f, "Hits::words({r}{hashes}\"")?;
        for line in self.to_string().lines() {
            write!(f, "\n    {line}")?;
        }
        write!(f, "\n\"{hashes})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_read_back_from_what_they_print() {
        let text = "a -> b: drop first SYN; drop 2nd packet with \"a#b\"\nb -> a: delay 30ms packets 3 8\na -> b: corrupt packet 0";
        let hits = Hits::words(&format!("# Words.\n\n  {text}\n"));
        assert_eq!((hits.to_string(), hits.len()), (text.to_owned(), 4));
        assert_eq!(
            format!("{:?}", Hits::words("a -> b: drop packet 1\nb -> a: drop packet 2")),
            "Hits::words(\"\n    a -> b: drop packet 1\n    b -> a: drop packet 2\n\")"
        );
        assert!(format!("{hits:?}").starts_with("Hits::words(r#\"\n    a -> b: drop first SYN; drop 2nd packet with \"a#b\"\n"));
        assert_eq!((Hits::words("").to_string(), format!("{:?}", Hits::words(" \n# no"))), (String::new(), "Hits::none()".to_owned()));
    }

    #[test]
    fn what_makes_no_sense_is_shown_with_its_place() {
        for (text, expected) in [
            ("a -> b: drop packet 1\na -> b drop packet 1", "2:1: no colon"),
            ("a: drop packet 1", "1:1: expected `a -> b` before the colon"),
            ("a -> a: drop packet 1", "1:1: a host has no link to itself"),
            ("a -> [b]: drop packet 1", "1:6: `[b]` cannot be the name of a host"),
            ("a -> b: drop packet x", "1:21: expected numbers of packets"),
            ("a -> b:", "1:8: expected drop, delay"),
        ] {
            let error = text.parse::<Hits>().expect_err(text).to_string();
            assert!(error.starts_with(expected), "{text}: {error}");
        }
    }
}
