//! Events of a session, in the form of the file of the session.

use serde::{Deserialize, Serialize};

/// An event of a session. A session is the sequence of its events.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "event", deny_unknown_fields)]
pub enum Event {
    /// The trial has ended.
    TrialEnded {
        /// Reasons for which the trial is not valid; empty for a valid trial.
        faults: Vec<Fault>,
    },
    /// A person has answered a question.
    Answered(Answer),
    /// The break is over.
    BreakOver,
    /// The experimenter repeats the last trial at the end of its block.
    Repeat,
    /// The experimenter has abandoned the session.
    Abandon,
}

/// Reason for which a trial is not valid.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Too many ticks were late by the clock of the computer.
    LateTicks,
    /// A browser did not show the page.
    HiddenPage,
    /// A pointer gave no position for a second.
    SilentPointer,
    /// A browser lost its connection.
    LostPartner,
    /// The experimenter repeated the trial.
    Repeated,
}

/// Answer of a person to a question.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// Seat of the person in the group, from 0.
    pub seat: usize,
    /// Index of the question in [`Study::questions`](crate::Study::questions).
    pub question: usize,
    /// Values, one per scale.
    pub values: Vec<u32>,
}

impl Fault {
    /// Returns the reason in a word, as in the table.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LateTicks => "late-ticks",
            Self::HiddenPage => "hidden-page",
            Self::SilentPointer => "silent-pointer",
            Self::LostPartner => "lost-partner",
            Self::Repeated => "repeated",
        }
    }
}

/// Reason for which a session refuses an event.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum SequenceError {
    /// The session waits for something else.
    #[error("the session waits for {waits_for}")]
    Other {
        /// Next step of the session, in words.
        waits_for: &'static str,
    },
    /// The session has ended.
    #[error("the session has ended")]
    Ended,
    /// The question is not asked at this point.
    #[error("this question is not asked now")]
    NotAsked,
    /// The person has answered the question.
    #[error("this question is answered already")]
    Answered,
    /// The values are no answer to the question.
    #[error("this is no answer to {question}: expected a value on each scale")]
    NoAnswer {
        /// Name of the question.
        question: String,
    },
    /// The last trial cannot be repeated.
    #[error("there is no trial to repeat: expected a valid trial of this condition, the last one, which is no practice and was not repeated before")]
    NothingToRepeat,
}
