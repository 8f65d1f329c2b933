//! The group under way: answers the pages of people and of the experimenter, and keeps answers, trials and the experimenter's decisions.
//!
//! Threads of the control server call [`Hands`] and [`StudyPages`]. The main thread waits for trials and runs them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError, TryLockError};
use std::time::{Duration, Instant as Clock};

use cohaptic_control::{Guests, Hands, Study as StudyPages, Token};
use cohaptic_study::{Answer, Event, Sequence, Step, Study, StudyError, StudyFolder, TrialFacts, TrialPlan, TrialScene};
use serde_json::Value;

use super::access::{Access, AccessFile, tokens};
use super::hands::Hand;
use super::people::{People, Way, Work};
use super::{lock, overview};
use crate::failure::Failure;
use crate::play::{Frames, scene_facts};
use crate::study::failure;

/// Time between two pings of a browser: a trial of three seconds has thirty.
const PING: Duration = Duration::from_millis(100);

/// The group under way, with all data shared by the threads.
pub(super) struct Lab {
    pub(super) study: Study,
    folder: Mutex<StudyFolder>,
    state: Mutex<State>,
    /// Signals the main thread that `state` has changed.
    changed: Condvar,
    /// Hands of the people, indexed by seat.
    pub(super) hands: Vec<Hand>,
    pub(super) guests: Guests,
    pub(super) frames: Frames,
    /// `true` if the running trial has to end. An atomic, so that the real-time thread asks without a lock.
    ends_trial: AtomicBool,
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

/// State of the group under way.
pub(super) struct State {
    pub(super) session: Sequence,
    pub(super) people: People,
    /// End of the least time of the break; `None` outside of breaks.
    pub(super) break_end: Option<Clock>,
    /// Wish of the experimenter for the running trial.
    wish: Wish,
    /// Line about the last trial, for the experimenter, and whether the trial was valid.
    pub(super) last: Option<(String, bool)>,
    /// `true` once the addresses of the people are printed.
    is_announced: bool,
    /// `true` once the tables of the ended group are written. The next group may begin.
    pub(super) is_closed: bool,
    /// `true` if the study needs no more groups.
    pub(super) is_full: bool,
    /// `true` if the experimenter has ended the study.
    is_over: bool,
    /// Failure that ends the program.
    failure: Option<Failure>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Wish {
    None,
    Repeat,
    Abandon,
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
    fn admit(&self, state: &mut State, tokens: Vec<Token>) -> Result<(), Failure> {
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
        self.frames.begin(number, trial.scene.axes.count());
        let mut facts = scene_facts(&trial.scene);
        // People see their own copy alone: a picture of the others' copies would pass by the emulated network.
        facts.insert("alone".to_owned(), true.into());
        state.people.facts = facts.into();
        state.people.hands.clone_from(&trial.hands);
        state.people.work = Work::Running;
        state.wish = Wish::None;
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
    fn keep(&self, state: &mut State, event: Event) -> Result<(), String> {
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

    fn update(&self, state: &mut State) {
        state.people.update(&self.study, &state.session);
        self.changed.notify_all();
    }

    /// Begins the trial if everybody is ready and at the page.
    fn begin_if_ready(&self, state: &mut State) {
        if state.is_at_trial() && state.people.all_ready() && self.missing(state).is_empty() {
            state.people.work = Work::Starting;
            self.update(state);
        }
    }

    /// Returns the codes of people without a visible page.
    pub(super) fn missing(&self, state: &State) -> Vec<String> {
        let is_away = |hand: &Hand| !hand.is_connected() || hand.is_hidden();
        state.session.people().iter().zip(&self.hands).filter(|(_, hand)| is_away(hand)).map(|(code, _)| code.to_string()).collect()
    }

    /// Carries out the experimenter's `next` at this point.
    fn next(&self, state: &mut State) -> Result<(), String> {
        match state.session.step() {
            Step::Done | Step::Abandoned if !state.is_closed => Err("the tables of the group are being written".to_owned()),
            Step::Done | Step::Abandoned if state.is_full => {
                state.is_over = true;
                self.changed.notify_all();
                Ok(())
            }
            Step::Done | Step::Abandoned => self.begin_group(state),
            _ if !state.people.has_begun() => Err("not everybody has agreed and read the instructions".to_owned()),
            Step::Trial(_) if !state.is_at_trial() => Err("a trial is under way".to_owned()),
            Step::Trial(_) => {
                let missing = self.missing(state);
                if !missing.is_empty() {
                    return Err(format!("{} has no page open, or another page in front of it", missing.join(" and ")));
                }
                state.people.work = Work::Starting;
                self.update(state);
                Ok(())
            }
            Step::Questions { .. } => Err("not everybody has answered".to_owned()),
            Step::Break { .. } if !state.people.may_end_break => Err("the break is not over".to_owned()),
            Step::Break { .. } => self.keep(state, Event::BreakOver),
        }
    }

    fn begin_group(&self, state: &mut State) -> Result<(), String> {
        let session = lock(&self.folder).next_group().ok_or("the study needs no more groups")?;
        *state = State::of(session);
        let begun = (0..self.hands.len()).map(|_| token()).collect::<Result<_, _>>().and_then(|tokens| self.admit(state, tokens));
        begun.map_err(|failure| {
            state.failure = Some(failure);
            "the study cannot go on".to_owned()
        })
    }
}

fn token() -> Result<Token, Failure> {
    Token::random().map_err(|error| Failure::System(error.to_string()))
}

impl State {
    fn of(session: Sequence) -> Self {
        let people = People::of(&session);
        let mut state = Self {
            session,
            people,
            break_end: None,
            wish: Wish::None,
            last: None,
            is_announced: false,
            is_closed: false,
            is_full: false,
            is_over: false,
            failure: None,
        };
        // A break that a crash interrupted begins again.
        if let Step::Break { at_least } = state.session.step() {
            state.break_end = Some(Clock::now() + at_least);
        }
        state
    }

    /// Returns whether the group waits for the beginning of a trial.
    pub(super) fn is_at_trial(&self) -> bool {
        self.people.has_begun() && self.people.work == Work::None && matches!(self.session.step(), Step::Trial(_))
    }

    /// Returns whether the last trial could be repeated.
    pub(super) fn may_repeat(&self) -> bool {
        self.people.work == Work::Running || (self.people.work == Work::None && self.session.clone().handle(Event::Repeat).is_ok())
    }

    pub(super) fn may_abandon(&self) -> bool {
        !matches!(self.session.step(), Step::Done | Step::Abandoned) && matches!(self.people.work, Work::None | Work::Running)
    }
}

impl Hands for Lab {
    fn frame(&self) -> (u64, Arc<str>) {
        self.frames.text()
    }

    fn take_hand(&self, wanted: Option<usize>) -> Result<usize, String> {
        let seat = wanted.filter(|seat| *seat < self.hands.len()).ok_or("expected the token of a person")?;
        if !self.hands[seat].connect() {
            return Err("another window has this address open".to_owned());
        }
        Ok(seat)
    }

    fn move_hand(&self, hand: usize, position: Option<[f64; 3]>) -> Result<(), String> {
        self.hands[hand].hear(Clock::now());
        self.hands[hand].tell(position)
    }

    fn leave_hand(&self, hand: usize) {
        self.hands[hand].disconnect();
        let mut state = lock(&self.state);
        state.people.set_ready(hand, false);
        self.free_place(&mut state, hand);
        self.update(&mut state);
    }

    fn news(&self, hand: usize, shown: u64) -> Option<(u64, String)> {
        // The lock is held while an event is written to the disk. The server asks again 16 ms later, and must not wait.
        let state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        let (number, page) = state.people.news(hand, shown)?;
        let mut page = page.clone();
        if let Some(end) = state.break_end {
            page["left_s"] = end.saturating_duration_since(Clock::now()).as_secs_f64().into();
        }
        Some((number, page.to_string()))
    }

    fn hear(&self, hand: usize, word: &str) -> Result<(), String> {
        self.hands[hand].hear(Clock::now());
        match word {
            "here" => Ok(()),
            "hidden" | "seen" => {
                self.hands[hand].hide(word == "hidden");
                self.begin_if_ready(&mut lock(&self.state));
                Ok(())
            }
            _ => Err("expected a position, here, hidden or seen".to_owned()),
        }
    }

    fn measures_round_trips(&self) -> Option<Duration> {
        Some(PING)
    }

    fn round_trip(&self, hand: usize, took: Duration) {
        self.hands[hand].round_trip(took);
    }
}

impl StudyPages for Lab {
    fn overview(&self) -> Value {
        overview::of(self, &lock(&self.state))
    }

    fn command(&self, wish: &Value) -> Result<(), String> {
        let mut state = lock(&self.state);
        match wish["do"].as_str() {
            Some("next") => self.next(&mut state),
            Some("repeat") if state.people.work == Work::Running => self.stop_trial(&mut state, Wish::Repeat),
            Some("abandon") if state.people.work == Work::Running => self.stop_trial(&mut state, Wish::Abandon),
            Some("repeat" | "abandon") if state.people.work != Work::None => Err("a trial begins or ends: wait a moment".to_owned()),
            Some("repeat") => {
                self.keep(&mut state, Event::Repeat)?;
                if let Some((said, is_valid)) = &mut state.last {
                    said.push_str(", and not valid any more: it is repeated");
                    *is_valid = false;
                }
                Ok(())
            }
            Some("abandon") => self.keep(&mut state, Event::Abandon),
            _ => Err("expected {\"do\": \"next\"}, or repeat, or abandon".to_owned()),
        }
    }

    fn tell(&self, person: usize, said: &Value) -> Result<(), String> {
        let mut state = lock(&self.state);
        let step = state.session.step();
        let has_begun = state.people.has_begun();
        match (said["do"].as_str(), step) {
            (Some("ready"), Step::Trial(_)) if state.is_at_trial() => {
                state.people.set_ready(person, true);
                self.update(&mut state);
                self.begin_if_ready(&mut state);
                Ok(())
            }
            (Some("ready"), Step::Break { .. }) if state.people.may_end_break => {
                state.people.set_ready(person, true);
                self.update(&mut state);
                if state.people.all_ready() { self.keep(&mut state, Event::BreakOver) } else { Ok(()) }
            }
            (Some("answer"), Step::Questions { .. }) if has_begun => self.answer(&mut state, person, &said["answers"]),
            (Some(word), _) if !has_begun => {
                state.people.walk(person, word)?;
                // The page of a person who refused is shown as long as it is open.
                if !self.hands[person].is_connected() {
                    self.free_place(&mut state, person);
                }
                self.update(&mut state);
                Ok(())
            }
            _ => Err("the page has changed meanwhile".to_owned()),
        }
    }
}

impl Lab {
    /// Gives the place of a person who refused another address, for another person.
    fn free_place(&self, state: &mut State, seat: usize) {
        if state.people.way(seat) != Way::Refused {
            return;
        }
        let freed = token().and_then(|new| {
            let mut tokens = self.guests.tokens();
            tokens[seat] = new;
            state.people.replace(seat);
            self.admit(state, tokens)
        });
        state.failure = state.failure.take().or_else(|| freed.err());
    }

    fn stop_trial(&self, state: &mut State, wish: Wish) -> Result<(), String> {
        state.wish = wish;
        self.ends_trial.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Keeps the answers of a person: `[{"question": 0, "answer": [50, 5, …]}, …]`.
    fn answer(&self, state: &mut State, seat: usize, answers: &Value) -> Result<(), String> {
        let refused = || "expected answers to all questions of the page".to_owned();
        let number = |value: &Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
        let read = |answer: &Value| {
            let question = answer["question"].as_u64().and_then(|index| usize::try_from(index).ok())?;
            let values = answer["answer"].as_array()?.iter().map(number).collect::<Option<Vec<u32>>>()?;
            Some(Answer { seat, question, values })
        };
        let answers: Vec<Answer> = answers.as_array().ok_or_else(refused)?.iter().map(read).collect::<Option<_>>().ok_or_else(refused)?;
        // All answers are tried first, so that a refusal keeps none of them.
        let mut tried = state.session.clone();
        for answer in &answers {
            tried.handle(Event::Answered(answer.clone())).map_err(|error| error.to_string())?;
        }
        answers.into_iter().try_for_each(|answer| self.keep(state, Event::Answered(answer)))
    }
}
