//! The file of a session: a line about the session, and a line per event.

use std::io::Write as _;
use std::path::Path;

use cohaptic_files::{read_text, write_whole};
use serde::{Deserialize, Serialize};

use crate::codes::{GroupCode, PersonCode};
use crate::error::StudyError;
use crate::model::{Question, Study};
use crate::sequence::{EndedTrial, Event, GivenAnswer, Sequence, Step};

/// A session as it is kept.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Group {
    pub(crate) code: GroupCode,
    pub(crate) slot: usize,
    pub(crate) state: GroupState,
}

/// State of a kept session.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum GroupState {
    /// The session is under way, complete or abandoned.
    Session(Box<Sequence>),
    /// The data of a person of the group were removed: the trials, in which all people of the group moved together, and the answers of this person.
    Forgotten {
        /// Persons whose data were removed.
        persons: Vec<PersonCode>,
        /// Answers of the other persons of the group.
        answers: Vec<GivenAnswer>,
    },
}

/// First line of the file.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    group: GroupCode,
    slot: usize,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    forgotten: Vec<PersonCode>,
}

impl Group {
    pub(crate) fn of(session: Sequence) -> Self {
        Self { code: session.group(), slot: session.slot(), state: GroupState::Session(Box::new(session)) }
    }

    /// Returns the session if it is under way.
    pub(crate) fn running(&self) -> Option<&Sequence> {
        match &self.state {
            GroupState::Session(session) if !matches!(session.step(), Step::Done | Step::Abandoned) => Some(session),
            GroupState::Session(_) | GroupState::Forgotten { .. } => None,
        }
    }

    pub(crate) fn is_done(&self) -> bool {
        matches!(&self.state, GroupState::Session(session) if session.step() == Step::Done)
    }

    pub(crate) const fn is_forgotten(&self) -> bool {
        matches!(self.state, GroupState::Forgotten { .. })
    }

    /// Returns the state in a word, as in the tables.
    pub(crate) fn state_name(&self) -> &'static str {
        match &self.state {
            GroupState::Forgotten { .. } => "forgotten",
            GroupState::Session(session) => match session.step() {
                Step::Done => "done",
                Step::Abandoned => "abandoned",
                Step::Trial(_) | Step::Questions { .. } | Step::Break { .. } => "running",
            },
        }
    }

    /// Returns the kept trials.
    pub(crate) fn ended(&self) -> &[EndedTrial] {
        match &self.state {
            GroupState::Session(session) => session.ended(),
            GroupState::Forgotten { .. } => &[],
        }
    }

    /// Returns the kept answers.
    pub(crate) fn answers(&self) -> &[GivenAnswer] {
        match &self.state {
            GroupState::Session(session) => session.answers(),
            GroupState::Forgotten { answers, .. } => answers,
        }
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), StudyError> {
        let forgotten = match &self.state {
            GroupState::Forgotten { persons, .. } => persons.clone(),
            GroupState::Session(_) => Vec::new(),
        };
        // The whole file is written for each event: an appended line could be cut by a crash, and a file written as a whole is old or new.
        let mut text = line(&Head { group: self.code, slot: self.slot, forgotten });
        match &self.state {
            GroupState::Session(session) => text.extend(session.events().iter().map(line)),
            GroupState::Forgotten { answers, .. } => text.extend(answers.iter().map(line)),
        }
        write_whole(path, |file| file.write_all(text.as_bytes())).map_err(StudyError::file("write", path))
    }

    pub(crate) fn read(path: &Path, code: GroupCode, study: &Study) -> Result<Self, StudyError> {
        let text = read_text(path).map_err(StudyError::file("read", path))?;
        let refused = |message: String| StudyError::damaged(path, message);
        let mut lines = text.lines();
        let head: Head = parse(1, lines.next().unwrap_or_default()).map_err(refused)?;
        // A renamed file would give a group the trials of another one, and a slot above the last would fill no row of the study.
        if head.group != code || head.slot >= study.groups {
            return Err(refused(format!("line 1 is of group {}, slot {}", head.group, head.slot)));
        }
        let state = if head.forgotten.is_empty() {
            let events: Vec<Event> = (2..).zip(lines).map(|(number, line)| parse(number, line)).collect::<Result<_, String>>().map_err(refused)?;
            // The events are played again and so checked one by one: a line that does not fit its place is a damage, not a state.
            let session = Sequence::restored(study, code, head.slot, events).map_err(|error| refused(error.to_string()))?;
            GroupState::Session(Box::new(session))
        } else {
            let answer =
                |(number, line)| parse(number, line).and_then(|answer| if is_of(study, &answer) { Ok(answer) } else { Err(no_answer(number)) });
            let answers = (2..).zip(lines).map(answer).collect::<Result<_, String>>().map_err(refused)?;
            GroupState::Forgotten { persons: head.forgotten, answers }
        };
        Ok(Self { code, slot: head.slot, state })
    }
}

fn line(of: &impl Serialize) -> String {
    // Serialisation cannot fail: the structures hold numbers and words, and no map with keys other than texts.
    serde_json::to_string(of).expect("a line of a session is written") + "\n"
}

/// Returns whether an answer fits a question of the study. Answers are checked here if the data of a person were removed: the session then has no events, which
/// otherwise check the answers.
fn is_of(study: &Study, answer: &GivenAnswer) -> bool {
    let question = study.questions.get(answer.question);
    let has_values = |question: &Question| answer.values.len() == question.values() && answer.values.iter().all(|value| question.accepts(*value));
    answer.seat < study.group_size()
        && answer.condition.is_none_or(|condition| condition < study.conditions.len())
        && question.is_some_and(has_values)
}

fn no_answer(number: usize) -> String {
    format!("line {number}: this answers no question of the study")
}

fn parse<'a, T: Deserialize<'a>>(number: usize, line: &'a str) -> Result<T, String> {
    serde_json::from_str(line).map_err(|error| format!("line {number}: {error}"))
}
