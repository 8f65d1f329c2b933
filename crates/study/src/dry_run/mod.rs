//! Dry runs: modelled persons play a study, through the same sessions, folder and tables as people.
//!
//! The duration of movements T, the visual delay τ and the noise c of a person, or with a moving target the visual delay τ and the crossover frequency ω, are
//! the values of the study times e^(0.15·z), with an independent normal z for each value of each person. Two thirds of these values lie within ±16 % of the
//! mean, and nearly all within ±36 %. Answers to questions are drawn evenly from the possible answers, so that the answers say nothing about the conditions.

mod power;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::Duration;

use cohaptic_files::write_whole;
use cohaptic_harness::record::InputRecorder;
use cohaptic_scene::scene_content_of_text;
use cohaptic_wan::random::{Purpose, Stream};

use crate::codes::{GroupCode, PersonCode};
use crate::error::StudyError;
use crate::folder::{StudyFolder, TrialFacts};
use crate::model::{Person, QuestionKind, Study};
use crate::sequence::{Answer, Event, Sequence, Step, TrialPlan};
use crate::trial::Players;

pub use power::{DifferencePower, Power, power_lines, timed_out_lines};

/// Standard deviation of the logarithm of T, τ, c and ω over persons.
const SPREAD: f64 = 0.15;

/// An observer of a dry run, which can also stop it. The methods are called from several threads.
pub trait Watch: Sync {
    /// Returns whether to go on. Asked before each trial.
    fn keep_going(&self) -> bool {
        true
    }

    /// Reports a trial of the first run, which is kept.
    fn kept(&self) {}

    /// Reports a whole further run, which is counted for the power.
    fn ran(&self) {}
}

/// A watch without any effect.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatch;

impl Watch for NoWatch {}

impl Study {
    /// Returns the number of trials of a dry run, of all groups.
    #[must_use]
    pub fn trials_in_all(&self) -> usize {
        self.groups * self.conditions.len() * (self.practice + self.trials)
    }

    /// Returns a modelled person of the study.
    #[must_use]
    pub fn person(&self, code: PersonCode) -> Person {
        // With groups of one, the index of the group is the index of the person, whatever the size of the groups.
        let (group, _) = code.group_and_seat(1);
        let stream = Stream::new(self.seed, b"study person");
        let factor = |key: u8| {
            // Each property has draws of its own, so that the properties are independent over persons.
            let mut words = stream.copy(group.index() as u64, key).draws(Purpose::Study);
            // Box & Muller (1958), from two uniform numbers. 1 − u is above zero.
            let (radius, angle) = (words.next_unit(), words.next_unit());
            libm::exp(SPREAD * libm::sqrt(-2.0 * libm::log1p(-radius)) * libm::cos(core::f64::consts::TAU * angle))
        };
        let times = |duration: Duration, factor: f64| duration.mul_f64(factor);
        let Person { movement, visual_delay, reaction, noise, crossover } = self.operator;
        Person {
            movement: times(movement, factor(0)),
            visual_delay: times(visual_delay, factor(1)),
            reaction,
            noise: noise * factor(2),
            crossover: crossover * factor(3),
        }
    }

    /// Returns the persons of a session, indexed by seat.
    pub(crate) fn persons_of(&self, session: &Sequence) -> Vec<Person> {
        session.people().into_iter().map(|code| self.person(code)).collect()
    }
}

impl StudyFolder {
    /// Begins a dry run in a folder, or continues the dry run found there if both are the same. `program` as in [`StudyFolder::open`].
    ///
    /// # Errors
    ///
    /// Errors of [`StudyFolder::open`], and a refusal of a person's numbers in the first trial of the person's group. The folder is not made then.
    pub fn open_dry(study: Study, path: &Path, program: &str) -> Result<Self, StudyError> {
        for slot in 0..study.groups {
            let session = Sequence::new(&study, GroupCode::of_index(slot), slot);
            if let Step::Trial(plan) = session.step() {
                study.trial_scene(&plan, Players::Modelled(&study.persons_of(&session)))?;
            }
        }
        Self::begin(study, path, program, true)
    }

    /// Lets modelled persons play until the study is full, and writes the tables. Returns `false` if the watch stopped the run; the same call then goes on.
    ///
    /// # Errors
    ///
    /// [`StudyError`] if a person's scene is refused, or if a file cannot be written.
    pub fn play_dry(&mut self, watch: &dyn Watch) -> Result<bool, StudyError> {
        // `next_group` gives an interrupted session before a new one, so a stopped run goes on where it stopped.
        while let Some(mut session) = self.next_group() {
            if !self.play_session(&mut session, watch)? {
                return Ok(false);
            }
        }
        // Tables are written once at the end, because each writing reads the records of all trials.
        self.write_tables()?;
        Ok(true)
    }

    /// Plays a session to its end. Returns `false` if the watch stopped it.
    fn play_session(&mut self, session: &mut Sequence, watch: &dyn Watch) -> Result<bool, StudyError> {
        let persons = self.study().persons_of(session);
        loop {
            match session.step() {
                Step::Trial(plan) => {
                    if !watch.keep_going() {
                        return Ok(false);
                    }
                    self.stage(&plan, &persons)?;
                    self.keep_trial(session, TrialFacts::default())?;
                    watch.kept();
                }
                Step::Questions { due, .. } => {
                    let first = due.iter().enumerate().find_map(|(seat, due)| Some((seat, *due.first()?)));
                    // A session that waits for questions has a question without an answer.
                    let Some((seat, question)) = first else { return Ok(true) };
                    let answer = self.drawn_answer(session, seat, question);
                    self.keep(session, Event::Answered(answer))?;
                }
                // Modelled persons need no rest, but the event is kept so that the session has the form of a session with people.
                Step::Break { .. } => self.keep(session, Event::BreakOver)?,
                Step::Done | Step::Abandoned => return Ok(true),
            }
        }
    }

    /// Records a trial of modelled persons in the staging folder. The persons are part of the scene, so the record of inputs has none.
    fn stage(&self, plan: &TrialPlan, persons: &[Person]) -> Result<(), StudyError> {
        let trial = self.study().trial_scene(plan, Players::Modelled(persons))?;
        let staging = self.staging()?;
        let file = staging.join("scene.toml");
        write_whole(&file, |to| std::io::Write::write_all(to, trial.text.as_bytes())).map_err(StudyError::file("write", &file))?;
        // The content is read from the written text, because the replay compares the head of the inputs with the same text.
        let content = scene_content_of_text(&trial.text, &file, &[])?;
        let inputs = staging.join("inputs.csv");
        let recorded = InputRecorder::create(&staging, &trial.scene, content).and_then(InputRecorder::finish);
        recorded.map_err(|error| StudyError::File { verb: "write", path: inputs, error: std::io::Error::other(error) })?;
        Ok(())
    }

    fn drawn_answer(&self, session: &Sequence, seat: usize, question: usize) -> Answer {
        let study = self.study();
        // Each answer of a session has draws of its own, by its number in the session.
        let number = (session.group().index() as u64) << 32 | session.answers().len() as u64;
        let mut words = Stream::new(study.seed, b"study answer").packet(number).draws(Purpose::Study);
        let mut below = |count: u32| {
            // The upper half of a product with the number of choices. Its bias is below 2⁻⁵⁰.
            let product = u128::from(words.next_word()) * u128::from(count);
            u32::try_from(product >> 64).unwrap_or(0)
        };
        let asked = &study.questions[question];
        let values = (0..asked.values()).map(|_| match asked.kind {
            QuestionKind::Tlx => 5 * below(21),
            QuestionKind::Scale { steps, .. } => 1 + below(steps),
        });
        Answer { seat, question, values: values.collect() }
    }
}
