//! Studies with people: conditions in balanced orders, sessions, records that survive a crash, tables, statistics and a report.
//!
//! Use this crate if you run an experiment in which people hold one object together, or if you plan the number of its people.
//!
//! A [`Study`] is a scene, keys of the scene that differ between conditions, people in groups, trials and questions. A [`Sequence`] is the session of one
//! group: the order of trials, questions and breaks. A trial is a scene with a seed of its own ([`Study::trial_scene`]). People move the
//! hands of a trial in a live session, and modelled persons in a dry run.
//!
//! The crate prints nothing, reads no clock and knows no browser.
//!
//! ```
//! use cohaptic_study::{GroupCode, Sequence, Step, Study};
//!
//! let study = Study::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../studies/pull/study.toml").as_ref())?;
//! assert_eq!((study.participants(), study.conditions.len()), (12, 4));
//!
//! let session = Sequence::new(&study, GroupCode::of_index(0), 0);
//! let Step::Trial(plan) = session.step() else { unreachable!() };
//! assert_eq!((plan.code.to_string(), plan.practice, plan.of), ("G01-001".to_owned(), true, 28));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact values"))]

mod analysis;
mod codes;
mod dry_run;
mod error;
mod folder;
mod model;
mod order;
mod read;
mod report;
mod sequence;
mod statistics;
mod tables;
#[cfg(test)]
mod testing;
mod text_table;
mod trial;
mod written;

pub use analysis::{Analysed, Analysis};
pub use codes::{CodeError, GroupCode, PersonCode, TrialCode};
pub use dry_run::{DifferencePower, NoWatch, Power, Watch, power_lines, timed_out_lines};
pub use error::StudyError;
pub use folder::{KeptMovement, RoundTrip, StudyFolder, TrialFacts, TrialRecord};
pub use model::{After, Breaks, Condition, Factor, Order, Person, Question, QuestionKind, Study, TLX};
pub use read::ROOT;
pub use sequence::{Answer, EndedTrial, Event, Fault, GivenAnswer, Sequence, SequenceError, Step, TrialPlan};
pub use statistics::{ConditionMean, Difference, LEAST_UNITS, condition_means, differences_to_first, effect, holm, sign_flip};
pub use trial::{Players, TrialScene};
pub use written::Verified;
