//! Model of a checked study: [`Study`] and the types of its fields.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use cohaptic_campaign::{Kind, Value};
use serde::{Deserialize, Serialize};

/// A study ready to run: every key is checked, and the scene of every condition is accepted.
#[derive(Clone, PartialEq, Debug)]
pub struct Study {
    /// Path of the study file, for messages.
    pub file: PathBuf,
    /// Text of the study file.
    pub text: String,
    /// Texts of the files that the study names, indexed by the name as written.
    pub files: BTreeMap<String, String>,
    /// Title for people.
    pub title: String,
    /// Seed of orders, of trials and of modelled persons.
    pub seed: u64,
    /// Path of the scene file.
    pub scene_file: PathBuf,
    /// Text of the scene file. The scene names no other file, so that the text alone repeats a trial.
    pub scene_text: String,
    /// Names of the peers in people's hands, in the order of the scene. Person `n` of a group has the hand `n`.
    pub hands: Vec<String>,
    /// Number of groups that the study needs; at least 1. The participants are this number times the number of hands.
    pub groups: usize,
    /// Rule for the order of the conditions.
    pub order: Order,
    /// Trials of a condition that are analysed; at least 1.
    pub trials: usize,
    /// Trials at the beginning of a condition that are never analysed.
    pub practice: usize,
    /// Breaks; `None` for no breaks.
    pub breaks: Option<Breaks>,
    /// Text that a person accepts or refuses first; Markdown.
    pub consent: String,
    /// Text that a person reads after the consent; Markdown.
    pub instructions: String,
    /// Keys of the scene that differ between the conditions, in the order of the file.
    pub factors: Vec<Factor>,
    /// Conditions; at least 1. The last factor varies fastest.
    pub conditions: Vec<Condition>,
    /// Questions, in the order of the file.
    pub questions: Vec<Question>,
    /// Names of the analysed measures, in the order of the file.
    pub measures: Vec<String>,
    /// Time that counts for a trial that timed out: the limit of the task.
    pub limit: Duration,
    /// Persons of the dry run.
    pub operator: Person,
}

/// Rule for the order of the conditions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Order {
    /// The order of the file, for every group.
    Given,
    /// An order of its own for every group, drawn from the seed.
    Shuffled,
    /// The rows of a Williams design (Williams 1949), in turn: each condition follows each other one equally often.
    Williams,
}

/// Breaks between trials.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Breaks {
    /// Number of trials from a break to the next; at least 1.
    pub every: usize,
    /// Least duration of a break.
    pub at_least: Duration,
}

/// A key of the scene that differs between conditions.
#[derive(Clone, PartialEq, Debug)]
pub struct Factor {
    /// Dotted path of the key.
    pub key: String,
    /// Name of the column, which ends in the unit of the values, if all have the same.
    pub column: String,
    /// Type of the column.
    pub kind: Kind,
}

/// A condition: one value of each factor.
#[derive(Clone, PartialEq, Debug)]
pub struct Condition {
    /// Overrides `KEY=VALUE` of the scene.
    pub overrides: Vec<String>,
    /// Values for the table, indexed by factor.
    pub values: Vec<Value>,
    /// Values as written, indexed by factor.
    pub texts: Vec<String>,
    /// Short text for people and for the report: the values as written.
    pub label: String,
    /// `true` if the target of the task moves, so that modelled persons follow the target by the law crossover. Otherwise the persons make movements.
    pub tracks: bool,
}

/// A question or a group of questions on one page.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Question {
    /// Name in the table of answers.
    pub name: String,
    /// Point of the session at which the question is asked.
    pub after: After,
    /// Form of the answer.
    pub kind: QuestionKind,
}

/// Point of the session at which a question is asked.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum After {
    /// After each analysed trial that is valid, repetitions included.
    Trial,
    /// After the last trial of each condition.
    Condition,
    /// At the end of the session.
    Study,
}

/// Form of an answer.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum QuestionKind {
    /// The six scales of the NASA Task Load Index (Hart & Staveland 1988), 0 to 100 in steps of 5, without weights.
    Tlx,
    /// A single scale with equal steps.
    Scale {
        /// The question.
        text: String,
        /// Words at the lower and at the upper end.
        ends: [String; 2],
        /// Number of steps, 2 to 101. The answer is 1 at the lower end and `steps` at the upper end.
        steps: u32,
    },
}

/// Scales of the Task Load Index: name in the table, question, words at the ends.
pub const TLX: [(&str, &str, [&str; 2]); 6] = [
    ("mental", "How mentally demanding was the task?", ["very low", "very high"]),
    ("physical", "How physically demanding was the task?", ["very low", "very high"]),
    ("temporal", "How hurried or rushed was the pace of the task?", ["very low", "very high"]),
    ("performance", "How successful were you in doing what you were asked to do?", ["perfect", "failure"]),
    ("effort", "How hard did you have to work to reach this performance?", ["very low", "very high"]),
    ("frustration", "How insecure, discouraged, irritated, stressed or annoyed were you?", ["very low", "very high"]),
];

impl Question {
    /// Returns the number of values of an answer: 6 for the Task Load Index, otherwise 1.
    #[must_use]
    pub const fn values(&self) -> usize {
        match self.kind {
            QuestionKind::Tlx => TLX.len(),
            QuestionKind::Scale { .. } => 1,
        }
    }

    /// Returns whether a number is a possible value of an answer.
    #[must_use]
    pub fn accepts(&self, value: u32) -> bool {
        match self.kind {
            QuestionKind::Tlx => value <= 100 && value.is_multiple_of(5),
            QuestionKind::Scale { steps, .. } => (1..=steps).contains(&value),
        }
    }
}

/// A modelled person of the dry run, or the means of all persons.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Person {
    /// Least duration T of a movement.
    pub movement: Duration,
    /// Time τ from an image to its use.
    pub visual_delay: Duration,
    /// Time until the first movement.
    pub reaction: Duration,
    /// Standard deviation c of the end of a movement, over its length.
    pub noise: f64,
    /// Velocity ω of the hand over the seen error, of a person who tracks [rad/s].
    pub crossover: f64,
}

impl Study {
    /// Returns the number of people in a group: the number of hands.
    #[must_use]
    pub fn group_size(&self) -> usize {
        self.hands.len()
    }

    /// Returns the number of participants that the study needs.
    #[must_use]
    pub fn participants(&self) -> usize {
        self.groups * self.hands.len()
    }

    /// Returns the questions asked at a point, in the order of the file.
    pub fn questions_after(&self, after: After) -> impl Iterator<Item = &Question> {
        self.questions.iter().filter(move |question| question.after == after)
    }
}
