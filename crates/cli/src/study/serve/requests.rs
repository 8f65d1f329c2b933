//! Requests of the pages: moves and words of the people, and commands of the experimenter. Threads of the control server call these methods.

use std::sync::atomic::Ordering;
use std::sync::{Arc, TryLockError};
use std::time::{Duration, Instant as Clock};

use cohaptic_control::{Hands, Study as StudyPages};
use cohaptic_study::{Answer, Event, Step};
use serde_json::Value;

use super::lab::{Lab, token};
use super::people::{Way, Work};
use super::state::{State, Wish};
use super::{lock, overview};

/// Time between two pings of a browser: a trial of three seconds has thirty.
const PING: Duration = Duration::from_millis(100);

impl Hands for Lab {
    fn frame(&self, hand: Option<usize>) -> (u64, Arc<str>) {
        // A second window of a person has no hand, and is told of nobody.
        hand.map_or_else(|| (0, "{}".into()), |hand| self.frames.text(Some(hand)))
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
        self.free_seat(&mut state, hand);
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
            // A page says the name of its button, so that a second press, or a second page, does not do what comes after that.
            Some("next") if wish["expects"].as_str().is_some_and(|expected| overview::next_name(self, &state) != Some(expected)) => {
                Err("the group has gone on meanwhile: look again".to_owned())
            }
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
                    self.free_seat(&mut state, person);
                }
                self.update(&mut state);
                Ok(())
            }
            _ => Err("the page has changed meanwhile".to_owned()),
        }
    }
}

impl Lab {
    /// Begins the trial if everybody is ready and at the page.
    fn begin_if_ready(&self, state: &mut State) {
        if state.is_at_trial() && state.people.all_ready() && self.missing(state).is_empty() {
            state.people.work = Work::Starting;
            self.update(state);
        }
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

    /// Makes a new address for the seat of a person who refused, so that another person can come.
    fn free_seat(&self, state: &mut State, seat: usize) {
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
