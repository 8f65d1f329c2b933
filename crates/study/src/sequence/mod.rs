//! Session of a group as a state machine without clock, files and network: trials, questions and breaks, each in turn.
//!
//! A session goes through the conditions in the order of its row. Each condition is a block: practice trials, analysed trials, and a repetition of each analysed
//! trial without validity. The questions of the condition follow the block. A repetition is never repeated again.
//!
//! The events of a session, in their order, make the state again: this is how a session continues after a crash.

mod event;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::time::Duration;

use cohaptic_wan::random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use crate::codes::{GroupCode, PersonCode, TrialCode};
use crate::model::{After, Breaks, Question, Study};

pub use event::{Answer, Event, Fault, SequenceError};

/// Plan of a trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TrialPlan {
    /// Code, with the number of the trial in the session.
    pub code: TrialCode,
    /// Position of the condition in the session, from 1.
    pub position: usize,
    /// Index of the condition in [`Study::conditions`].
    pub condition: usize,
    /// Number of the trial among the practice trials, or among the analysed trials, of its condition, from 1. A repetition has the number of the repeated trial.
    pub trial: usize,
    /// `true` for a trial for practice, which is never analysed.
    pub practice: bool,
    /// Number in the session of the repeated trial; `None` for the first run of a trial.
    pub repeats: Option<usize>,
    /// Seed of the scene.
    pub seed: u64,
    /// Number of planned trials of the session so far, repetitions included.
    pub of: usize,
}

/// A trial that has ended.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EndedTrial {
    /// Plan of the trial.
    pub plan: TrialPlan,
    /// Reasons for which the trial is not valid, sorted; empty for a valid trial.
    pub faults: Vec<Fault>,
}

/// A given answer with its place in the session.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenAnswer {
    /// Seat of the person in the group, from 0.
    pub seat: usize,
    /// Index of the question in [`Study::questions`].
    pub question: usize,
    /// Position of the condition in the session, from 1; `None` for a question about the study.
    pub position: Option<usize>,
    /// Index of the condition in [`Study::conditions`]; `None` for a question about the study.
    pub condition: Option<usize>,
    /// Number of the trial in the session; `None` for a question about a condition or the study.
    pub number: Option<usize>,
    /// Values, one per scale.
    pub values: Vec<u32>,
}

/// Next step of a session.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Step {
    /// A trial is run.
    Trial(TrialPlan),
    /// Each person answers questions.
    Questions {
        /// Point of the session at which the questions are asked.
        after: After,
        /// Indices in [`Study::questions`] of the questions without an answer, indexed by seat.
        due: Vec<Vec<usize>>,
    },
    /// The group rests.
    Break {
        /// Least duration of the break.
        at_least: Duration,
    },
    /// The session is complete.
    Done,
    /// The session was abandoned.
    Abandoned,
}

/// Session of one group.
///
/// ```
/// use cohaptic_study::{Event, GroupCode, Sequence, Step, Study};
///
/// let study = Study::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../studies/pull/study.toml").as_ref())?;
/// let mut session = Sequence::new(&study, GroupCode::of_index(0), 0);
/// let Step::Trial(plan) = session.step() else { unreachable!() };
/// assert_eq!((plan.code.to_string(), plan.practice), ("G01-001".to_owned(), true));
/// session.handle(Event::TrialEnded { faults: Vec::new() })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sequence {
    group: GroupCode,
    slot: usize,
    /// Indices of conditions, indexed by position.
    order: Vec<usize>,
    rules: Rules,
    /// Index of the current block; the number of blocks at the end.
    block: usize,
    /// Trials of the current block that are still to run.
    left: VecDeque<Planned>,
    /// Trials that have ended, in order.
    ended: Vec<EndedTrial>,
    /// Number of ended trials at the last break.
    rested_at: usize,
    answers: Vec<GivenAnswer>,
    state: State,
    events: Vec<Event>,
}

/// Parts of a study with an effect on the sequence.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Rules {
    seed: u64,
    people: usize,
    trials: usize,
    practice: usize,
    breaks: Option<Breaks>,
    questions: Vec<Question>,
}

/// A trial of the current block that is still to run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Planned {
    trial: usize,
    practice: bool,
    repeats: Option<usize>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Trial,
    Questions(After),
    Break,
    Done,
    Abandoned,
}

impl Sequence {
    /// Returns the session of a group before its first trial. `slot`: index of the row of the order, below [`Study::groups`].
    #[must_use]
    pub fn new(study: &Study, group: GroupCode, slot: usize) -> Self {
        let rules = Rules {
            seed: study.seed,
            people: study.group_size(),
            trials: study.trials,
            practice: study.practice,
            breaks: study.breaks,
            questions: study.questions.clone(),
        };
        let mut session = Self {
            group,
            slot,
            order: study.order_of(slot),
            left: VecDeque::new(),
            rules,
            block: 0,
            ended: Vec::new(),
            rested_at: 0,
            answers: Vec::new(),
            // Every block has a trial, because a study has at least one analysed trial per condition: the state fits the filled block.
            state: State::Trial,
            events: Vec::new(),
        };
        session.fill_block();
        session
    }

    /// Returns the session after these events.
    ///
    /// # Errors
    ///
    /// [`SequenceError`] if an event cannot happen where it stands, as in a damaged file.
    pub fn restored(study: &Study, group: GroupCode, slot: usize, events: Vec<Event>) -> Result<Self, SequenceError> {
        let mut session = Self::new(study, group, slot);
        for event in events {
            session.handle(event)?;
        }
        Ok(session)
    }

    /// Returns the next step.
    #[must_use]
    pub fn step(&self) -> Step {
        match (self.state, self.left.front()) {
            (State::Trial, Some(next)) => Step::Trial(self.plan(*next)),
            (State::Questions(after), _) => Step::Questions { after, due: (0..self.rules.people).map(|seat| self.due(after, seat)).collect() },
            (State::Break, _) => Step::Break { at_least: self.rules.breaks.map_or(Duration::ZERO, |breaks| breaks.at_least) },
            (State::Abandoned, _) => Step::Abandoned,
            // A session in the state `Trial` has a trial left: see `advance`.
            (State::Done, _) | (State::Trial, None) => Step::Done,
        }
    }

    /// Takes an event. A refused event changes nothing.
    ///
    /// # Errors
    ///
    /// [`SequenceError`] if the event does not fit the next step, or if the values do not answer the question.
    pub fn handle(&mut self, event: Event) -> Result<(), SequenceError> {
        match &event {
            Event::TrialEnded { faults } => self.end_trial(faults)?,
            Event::Answered(answer) => self.answer(answer)?,
            Event::BreakOver => {
                self.expect_state(State::Break)?;
                // The break is noted first: otherwise `advance` would find the same break due again.
                self.rested_at = self.ended.len();
                self.advance();
            }
            Event::Repeat => self.repeat()?,
            Event::Abandon => {
                if matches!(self.state, State::Done | State::Abandoned) {
                    return Err(SequenceError::Ended);
                }
                self.state = State::Abandoned;
            }
        }
        // Refused events have returned above: a kept session would fail at such an event when it is restored.
        self.events.push(event);
        Ok(())
    }

    /// Returns the code of the group.
    #[must_use]
    pub const fn group(&self) -> GroupCode {
        self.group
    }

    /// Returns the index of the row of the order.
    #[must_use]
    pub const fn slot(&self) -> usize {
        self.slot
    }

    /// Returns the codes of the people, indexed by seat.
    #[must_use]
    pub fn people(&self) -> Vec<PersonCode> {
        (0..self.rules.people).map(|seat| self.group.person(seat, self.rules.people)).collect()
    }

    /// Returns the trials that have ended, in order.
    #[must_use]
    pub fn ended(&self) -> &[EndedTrial] {
        &self.ended
    }

    /// Returns the given answers, in order.
    #[must_use]
    pub fn answers(&self) -> &[GivenAnswer] {
        &self.answers
    }

    /// Returns the events so far.
    #[must_use]
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    fn plan(&self, next: Planned) -> TrialPlan {
        let Planned { trial, practice, repeats } = next;
        let number = self.ended.len() + 1;
        let blocks_left = self.order.len() - self.block - 1;
        // Repetitions in later blocks are not known yet, so the total can grow from trial to trial.
        let of = self.ended.len() + self.left.len() + blocks_left * (self.rules.practice + self.rules.trials);
        // The seed follows from the code, and a repetition has its own code: the random losses of the repeated trial do not come back.
        let code = TrialCode { group: self.group, number };
        let condition = self.order[self.block];
        TrialPlan { code, position: self.block + 1, condition, trial, practice, repeats, seed: trial_seed(self.rules.seed, code), of }
    }

    /// Plans the trials of the current block; none after the last block.
    fn fill_block(&mut self) {
        if self.block < self.order.len() {
            let of = |practice: bool, count: usize| (1..=count).map(move |trial| Planned { trial, practice, repeats: None });
            self.left = of(true, self.rules.practice).chain(of(false, self.rules.trials)).collect();
        }
    }

    fn end_trial(&mut self, faults: &[Fault]) -> Result<(), SequenceError> {
        self.expect_state(State::Trial)?;
        let Some(next) = self.left.front().copied() else { return Err(SequenceError::Ended) };
        // The plan is made before the trial leaves the block, because `plan` counts the trial as still to run.
        let plan = self.plan(next);
        let mut faults = faults.to_vec();
        // Sorted as in the record of the trial, with which the verification compares these faults.
        faults.sort_unstable();
        faults.dedup();
        self.left.pop_front();
        // A repetition with a fault is not repeated again, so a block has at most twice its analysed trials, besides practice.
        if !faults.is_empty() && !plan.practice && plan.repeats.is_none() {
            self.left.push_back(Planned { repeats: Some(plan.code.number), ..next });
        }
        // Answers about a trial that does not count would count for nothing: the repetition is asked about.
        let counts = !plan.practice && faults.is_empty();
        self.ended.push(EndedTrial { plan, faults });
        if counts && self.asks(After::Trial) {
            self.state = State::Questions(After::Trial);
        } else {
            self.advance();
        }
        Ok(())
    }

    fn answer(&mut self, answer: &Answer) -> Result<(), SequenceError> {
        let State::Questions(after) = self.state else { return Err(SequenceError::Other { waits_for: self.waits_for() }) };
        let question = self.rules.questions.get(answer.question).filter(|question| question.after == after);
        // The seat is checked, because an answer can come from a damaged file: `due` has questions for any seat, also for a seat of nobody.
        let Some(question) = question.filter(|_| answer.seat < self.rules.people) else { return Err(SequenceError::NotAsked) };
        if !self.due(after, answer.seat).contains(&answer.question) {
            return Err(SequenceError::Answered);
        }
        if answer.values.len() != question.values() || answer.values.iter().any(|value| !question.accepts(*value)) {
            return Err(SequenceError::NoAnswer { question: question.name.clone() });
        }
        let (position, number) = self.place_of(after);
        let condition = position.map(|position| self.order[position - 1]);
        let Answer { seat, question, values } = answer.clone();
        self.answers.push(GivenAnswer { seat, question, position, condition, number, values });
        if (0..self.rules.people).all(|seat| self.due(after, seat).is_empty()) {
            match after {
                After::Trial => self.advance(),
                After::Condition => self.begin_block(),
                After::Study => self.state = State::Done,
            }
        }
        Ok(())
    }

    /// Repeats the last trial at the end of its block.
    fn repeat(&mut self) -> Result<(), SequenceError> {
        // An answer about the condition is about all trials of the block, so that no trial may follow the first answer.
        let position = Some(self.block + 1);
        let answered = self.answers.iter().any(|answer| answer.number.is_none() && answer.position == position);
        if matches!(self.state, State::Done | State::Abandoned | State::Questions(After::Study)) || answered {
            return Err(SequenceError::NothingToRepeat);
        }
        let may_repeat = |last: &&mut EndedTrial| {
            let plan = &last.plan;
            Some(plan.position) == position && !plan.practice && plan.repeats.is_none() && last.faults.is_empty()
        };
        let last = self.ended.last_mut().filter(may_repeat);
        let Some(last) = last else { return Err(SequenceError::NothingToRepeat) };
        // `Repeated` enters an empty list, as `may_repeat` has checked, so the faults stay sorted.
        last.faults.push(Fault::Repeated);
        let TrialPlan { trial, practice, code, .. } = last.plan;
        self.left.push_back(Planned { trial, practice, repeats: Some(code.number) });
        // Questions about the trial have no use any more, and those about the condition wait for the repetition. In the other states the session finds the new
        // trial in `left`.
        if matches!(self.state, State::Questions(After::Trial | After::Condition)) {
            self.advance();
        }
        Ok(())
    }

    /// Goes on after a trial, its questions and a break: to a break, to the next trial of the block, or to the end of the block.
    fn advance(&mut self) {
        let is_due = |breaks: Breaks| !self.ended.is_empty() && self.rested_at != self.ended.len() && self.ended.len().is_multiple_of(breaks.every);
        // The end of a block comes before a break: `begin_block` calls `advance` again, and a break that is due follows the questions.
        if self.left.is_empty() {
            if self.asks(After::Condition) {
                self.state = State::Questions(After::Condition);
            } else {
                self.begin_block();
            }
        } else if self.rules.breaks.is_some_and(is_due) {
            self.state = State::Break;
        } else {
            self.state = State::Trial;
        }
    }

    /// Begins the next block, or the end of the session after the last block.
    fn begin_block(&mut self) {
        self.block += 1;
        // The new block is filled before `advance`, which takes an empty block for a finished one.
        self.fill_block();
        if self.block < self.order.len() {
            self.advance();
        } else {
            self.state = if self.asks(After::Study) { State::Questions(After::Study) } else { State::Done };
        }
    }

    fn asks(&self, after: After) -> bool {
        self.rules.questions.iter().any(|question| question.after == after)
    }

    /// Returns the position and the number of the trial that answers at this point are about.
    fn place_of(&self, after: After) -> (Option<usize>, Option<usize>) {
        match after {
            After::Trial => (Some(self.block + 1), Some(self.ended.len())),
            After::Condition => (Some(self.block + 1), None),
            After::Study => (None, None),
        }
    }

    /// Returns the questions that a person has not answered at this point.
    fn due(&self, after: After, seat: usize) -> Vec<usize> {
        let (position, number) = self.place_of(after);
        let given = |question: usize| {
            let is_it = |answer: &GivenAnswer| (answer.seat, answer.question, answer.position, answer.number) == (seat, question, position, number);
            // The latest answers stand last, so the search from the end is short.
            self.answers.iter().rev().any(is_it)
        };
        let asked = self.rules.questions.iter().enumerate().filter(|(_, question)| question.after == after);
        asked.map(|(question, _)| question).filter(|question| !given(*question)).collect()
    }

    fn expect_state(&self, state: State) -> Result<(), SequenceError> {
        if self.state == state { Ok(()) } else { Err(SequenceError::Other { waits_for: self.waits_for() }) }
    }

    /// Returns the next step in words.
    const fn waits_for(&self) -> &'static str {
        match self.state {
            State::Trial => "a trial",
            State::Questions(_) => "answers to questions",
            State::Break => "the end of a break",
            State::Done => "nothing: it is complete",
            State::Abandoned => "nothing: it was abandoned",
        }
    }
}

/// Returns the seed of a trial. 53 bits, so that every reader of the table reads the same number.
fn trial_seed(seed: u64, code: TrialCode) -> u64 {
    // Group and number have 32 bits each, so no two trials of a study draw their seeds at the same address.
    let number = (code.group.index() as u64) << 32 | code.number as u64;
    Stream::new(seed, b"study trial").packet(number).first(Purpose::Study) >> 11
}
