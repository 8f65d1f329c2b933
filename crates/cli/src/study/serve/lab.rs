//! The group under way: keeps answers, trials and the experimenter's decisions, and gives the main thread its work.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant as Clock};

use cohaptic_control::{Guests, Token};
use cohaptic_study::{Event, Sequence, Step, Study, StudyError, StudyFolder, TrialFacts, TrialPlan, TrialScene};

use super::access::{Access, AccessFile, tokens};
use super::hands::Hand;
use super::lock;
use super::people::Work;
use super::state::{State, Wish};
use crate::failure::Failure;
use crate::play::{Frames, scene_facts};
use crate::study::failure;

/// The group under way, with all data shared by the threads.
pub(super) struct Lab {
    pub(super) study: Study,
    pub(super) folder: Mutex<StudyFolder>,
    pub(super) state: Mutex<State>,
    /// Signals the main thread that `state` has changed.
    pub(super) changed: Condvar,
    /// Hands of the people, indexed by seat.
    pub(super) hands: Vec<Hand>,
    pub(super) guests: Guests,
    pub(super) frames: Frames,
    /// `true` if the running trial has to end. An atomic, so that the real-time thread asks without a lock.
    pub(super) ends_trial: AtomicBool,
    access: AccessFile,
    /// Address of the server without a path, token and port, once the server listens.
    site: OnceLock<Site>,
}

/// Server of the study.
pub(super) struct Site {
    /// Address as in `http://192.0.2.7:8080`, for people at other machines.
    pub(super) url: String,
    pub(super) port: u16,
    pub(super) experimenter: Token,
}

/// Work for the main thread.
pub(super) enum Task {
    Trial(TrialPlan),
    /// The people have new addresses, which are printed: code and address of each person.
    Announce(Vec<(String, String)>),
    /// The group has ended: its tables are written.
    Close,
    /// The study is over.
    End,
}

impl Lab {
    /// Returns the lab with the group of `session`.
    pub(super) fn new(folder: StudyFolder, session: Sequence, access: AccessFile) -> Self {
        let study = folder.study().clone();
        let begun = Clock::now();
        Self {
            hands: (0..study.group_size()).map(|_| Hand::new(begun)).collect(),
            study,
            folder: Mutex::new(folder),
            state: Mutex::new(State::of(session)),
            changed: Condvar::new(),
            guests: Guests::default(),
            frames: Frames::default(),
            ends_trial: AtomicBool::new(false),
            access,
            site: OnceLock::new(),
        }
    }

    /// Begins to answer at the address of the server, for the group that the lab has. `kept`: access of before a crash.
    pub(super) fn open(&self, site: Site, kept: Option<&Access>) -> Result<(), Failure> {
        // The lab is new, so that the address is set only once.
        let _first = self.site.set(site);
        let mut state = lock(&self.state);
        let of_before = kept.filter(|access| access.group == state.session.group()).and_then(|access| tokens(&access.people));
        let tokens = match of_before.filter(|tokens| tokens.len() == self.hands.len()) {
            Some(tokens) => tokens,
            None => (0..self.hands.len()).map(|_| token()).collect::<Result<_, _>>()?,
        };
        self.admit(&mut state, tokens)
    }

    /// Gives the people their tokens, and keeps the tokens for a restart.
    pub(super) fn admit(&self, state: &mut State, tokens: Vec<Token>) -> Result<(), Failure> {
        let site = self.site.get().expect("the server listens");
        let people = tokens.iter().map(|token| token.secret().to_owned()).collect();
        self.guests.set(tokens);
        let experimenter = site.experimenter.secret().to_owned();
        self.access.write(&Access { group: state.session.group(), port: site.port, experimenter, people })?;
        state.is_announced = false;
        self.update(state);
        Ok(())
    }

    /// Returns the code and the address of each person.
    pub(super) fn addresses_of(&self, state: &State) -> Vec<(String, String)> {
        let site = self.site.get().map(|site| site.url.as_str()).unwrap_or_default();
        let address = |token: &Token| format!("{site}/join?token={}", token.secret());
        state.session.people().iter().map(ToString::to_string).zip(self.guests.tokens().iter().map(address)).collect()
    }

    /// Waits for work for the main thread, at most for `most`.
    pub(super) fn next_task(&self, most: Duration) -> Result<Option<Task>, Failure> {
        let mut state = lock(&self.state);
        if let Some(task) = self.task(&mut state)? {
            return Ok(Some(task));
        }
        let (mut state, _) = self.changed.wait_timeout(state, most).unwrap_or_else(PoisonError::into_inner);
        // The time of a break passes without an event.
        if let Some(end) = state.break_end
            && !state.people.may_end_break
            && Clock::now() >= end
        {
            state.people.may_end_break = true;
            self.update(&mut state);
        }
        self.task(&mut state)
    }

    fn task(&self, state: &mut State) -> Result<Option<Task>, Failure> {
        if let Some(failure) = state.failure.take() {
            return Err(failure);
        }
        if !state.is_announced {
            state.is_announced = true;
            return Ok(Some(Task::Announce(self.addresses_of(state))));
        }
        if state.is_over {
            return Ok(Some(Task::End));
        }
        Ok(match state.session.step() {
            Step::Trial(plan) if state.people.work == Work::Starting => Some(Task::Trial(plan)),
            Step::Done | Step::Abandoned if !state.is_closed => Some(Task::Close),
            Step::Trial(_) | Step::Questions { .. } | Step::Break { .. } | Step::Done | Step::Abandoned => None,
        })
    }

    /// Returns an empty folder for the record of a trial.
    pub(super) fn staging(&self) -> Result<std::path::PathBuf, Failure> {
        lock(&self.folder).staging().map_err(failure)
    }

    /// Shows the trial on the pages, from now on.
    pub(super) fn begin_trial(&self, trial: &TrialScene) {
        let mut state = lock(&self.state);
        let number = state.session.ended().len() + 1;
        // People are told of their own copy alone: a picture of the others' copies would pass by the emulated network.
        self.frames.begin(number, trial.scene.axes.count(), trial.hands.clone());
        let mut facts = scene_facts(&trial.scene);
        facts.insert("alone".to_owned(), true.into());
        state.people.facts = facts.into();
        state.people.hands.clone_from(&trial.hands);
        state.people.work = Work::Running;
        state.wish = Wish::None;
        // Opening the session took a while, in which no page had a trial to speak of.
        self.hands.iter().for_each(|hand| hand.hear(Clock::now()));
        self.ends_trial.store(false, Ordering::Relaxed);
        self.update(&mut state);
    }

    /// Returns whether the running trial has to end. Called on the real-time thread.
    pub(super) fn ends_trial(&self) -> bool {
        // The flag carries no data: the wish is read under the lock.
        self.ends_trial.load(Ordering::Relaxed)
    }

    /// Ends the trial, and returns the experimenter's wish of the meantime.
    pub(super) fn end_trial(&self) -> Wish {
        let mut state = lock(&self.state);
        state.people.work = Work::Keeping;
        self.update(&mut state);
        state.wish
    }

    /// Keeps the trial that has ended. `said`: lines about the trial, for the experimenter and for the people.
    pub(super) fn keep_trial(&self, facts: TrialFacts, said: [String; 2]) -> Result<(), Failure> {
        let is_valid = facts.faults.is_empty();
        // The session goes on in a copy, because the replay of the trial takes a while, and pages are answered meanwhile. Nobody else changes the session of a
        // trial that is being kept.
        let mut session = lock(&self.state).session.clone();
        lock(&self.folder).keep_trial(&mut session, facts).map_err(failure)?;
        let mut state = lock(&self.state);
        let [of_experimenter, of_people] = said;
        state.last = Some((of_experimenter, is_valid));
        state.people.note = of_people;
        state.people.work = Work::None;
        state.session = session;
        self.step_on(&mut state);
        Ok(())
    }

    /// Keeps the end of the group by the experimenter, during a trial that is not kept.
    pub(super) fn abandon_trial(&self) -> Result<(), Failure> {
        let mut state = lock(&self.state);
        state.people.work = Work::None;
        self.keep(&mut state, Event::Abandon).map_err(|said| state.failure.take().unwrap_or(Failure::System(said)))
    }

    /// Writes the tables of the ended group.
    pub(super) fn close(&self) -> Result<(), Failure> {
        let is_full = {
            let folder = lock(&self.folder);
            folder.write_tables().map_err(failure)?;
            folder.is_full()
        };
        self.access.remove();
        let mut state = lock(&self.state);
        (state.is_closed, state.is_full) = (true, is_full);
        Ok(())
    }

    /// Keeps an event, and goes on.
    pub(super) fn keep(&self, state: &mut State, event: Event) -> Result<(), String> {
        let kept = lock(&self.folder).keep(&mut state.session, event);
        match kept {
            Ok(()) => {
                self.step_on(state);
                Ok(())
            }
            Err(StudyError::Refused(error)) => Err(error.to_string()),
            Err(error) => {
                let said = format!("the study cannot go on: {error}");
                state.failure = Some(failure(error));
                self.changed.notify_all();
                Err(said)
            }
        }
    }

    /// Goes on after an event of the session.
    fn step_on(&self, state: &mut State) {
        // An event during a break, such as the wish to repeat a trial, does not prolong the break.
        state.break_end = match (state.session.step(), state.break_end) {
            (Step::Break { .. }, Some(end)) => Some(end),
            (Step::Break { at_least }, None) => Some(Clock::now() + at_least),
            (Step::Trial(_) | Step::Questions { .. } | Step::Done | Step::Abandoned, _) => None,
        };
        state.people.next_step();
        self.update(state);
    }

    pub(super) fn update(&self, state: &mut State) {
        state.people.update(&self.study, &state.session);
        self.changed.notify_all();
    }

    /// Returns the codes of people without a visible page.
    pub(super) fn missing(&self, state: &State) -> Vec<String> {
        let is_away = |hand: &Hand| !hand.is_connected() || hand.is_hidden();
        state.session.people().iter().zip(&self.hands).filter(|(_, hand)| is_away(hand)).map(|(code, _)| code.to_string()).collect()
    }
}

pub(super) fn token() -> Result<Token, Failure> {
    Token::random().map_err(|error| Failure::System(error.to_string()))
}
