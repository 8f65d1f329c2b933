//! Codes of groups, persons and trials, which stand for names that are never asked for.

use std::fmt;
use std::num::NonZeroUsize;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Code of a group: `G01`, `G02` and so on, in the order of the sessions. An abandoned session keeps its code, and the next one has another.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct GroupCode(NonZeroUsize);

/// Code of a person: `P01`, `P02` and so on. The persons of a group have consecutive codes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct PersonCode(NonZeroUsize);

/// Code of a trial: `G01-012`, the twelfth trial of the group G01.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct TrialCode {
    /// The group.
    pub group: GroupCode,
    /// Number of the trial in the session, from 1, practice and repeated trials included.
    pub number: usize,
}

/// A text is no code.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{found:?} is no code of {of}: expected a code such as {example}")]
pub struct CodeError {
    /// The text.
    pub found: String,
    of: &'static str,
    example: &'static str,
}

impl GroupCode {
    /// Returns the code of the session with this index, counted from 0.
    #[must_use]
    pub const fn of_index(index: usize) -> Self {
        Self(NonZeroUsize::MIN.saturating_add(index))
    }

    /// Returns the index of the session, counted from 0.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0.get() - 1
    }

    /// Returns the code of the person at a seat of the group, with seats counted from 0. `size`: number of people in a group.
    #[must_use]
    pub const fn person(self, seat: usize, size: usize) -> PersonCode {
        PersonCode(NonZeroUsize::MIN.saturating_add(self.index() * size + seat))
    }
}

impl PersonCode {
    /// Returns the group and the seat of the person. `size`: number of people in a group, above 0.
    #[must_use]
    pub const fn group_and_seat(self, size: usize) -> (GroupCode, usize) {
        let index = self.0.get() - 1;
        (GroupCode::of_index(index / size), index % size)
    }
}

impl fmt::Display for GroupCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "G{:02}", self.0)
    }
}

impl fmt::Display for PersonCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "P{:02}", self.0)
    }
}

impl fmt::Display for TrialCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{:03}", self.group, self.number)
    }
}

impl FromStr for GroupCode {
    type Err = CodeError;

    fn from_str(text: &str) -> Result<Self, CodeError> {
        number(text, 'G').map(Self).ok_or_else(|| CodeError { found: text.to_owned(), of: "a group", example: "G04" })
    }
}

impl FromStr for PersonCode {
    type Err = CodeError;

    fn from_str(text: &str) -> Result<Self, CodeError> {
        number(text, 'P').map(Self).ok_or_else(|| CodeError { found: text.to_owned(), of: "a person", example: "P07" })
    }
}

impl FromStr for TrialCode {
    type Err = CodeError;

    fn from_str(text: &str) -> Result<Self, CodeError> {
        let refused = || CodeError { found: text.to_owned(), of: "a trial", example: "G01-012" };
        let (group, trial) = text.split_once('-').ok_or_else(refused)?;
        let code = Self { group: group.parse().map_err(|_| refused())?, number: trial.parse().map_err(|_| refused())? };
        // Only the written form is a code, so that a folder has one name.
        if code.to_string() == text && code.number > 0 { Ok(code) } else { Err(refused()) }
    }
}

/// Returns the number after a letter; `None` for a text that a code is not written as.
fn number(text: &str, letter: char) -> Option<NonZeroUsize> {
    let number: NonZeroUsize = text.strip_prefix(letter)?.parse().ok()?;
    (format!("{letter}{number:02}") == text).then_some(number)
}

macro_rules! as_text {
    ($($code:ty)+) => {
        $(
            impl Serialize for $code {
                fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    serializer.collect_str(self)
                }
            }

            impl<'de> Deserialize<'de> for $code {
                fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
                }
            }
        )+
    };
}
as_text! { GroupCode PersonCode TrialCode }

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_read_back_and_nothing_else_is_a_code() {
        for index in [0, 1, 8, 9, 98, 99, 1000] {
            let group = GroupCode::of_index(index);
            assert_eq!((group.to_string().parse(), group.index()), (Ok(group), index));
            let trial = TrialCode { group, number: index + 1 };
            assert_eq!(trial.to_string().parse(), Ok(trial));
            for seat in 0..3 {
                let person = group.person(seat, 3);
                assert_eq!((person.group_and_seat(3), person.to_string().parse()), ((group, seat), Ok(person)));
            }
        }
        assert_eq!(GroupCode::of_index(3).person(0, 2).to_string(), "P07");
        for text in ["", "P", "P7", "P00", "p07", "P007", "P-1", "G07", "P07 "] {
            assert!(text.parse::<PersonCode>().is_err(), "{text}");
        }
        for text in ["G01", "G01-12", "G01-000", "G1-001", "G01-0012", "G01-012x"] {
            assert!(text.parse::<TrialCode>().is_err(), "{text}");
        }
    }
}
