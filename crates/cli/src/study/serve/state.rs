//! State of the group under way: place in the session, pages of the people, and wishes of the experimenter.

use std::time::Instant as Clock;

use cohaptic_study::{Event, Sequence, Step};

use super::people::{People, Work};
use crate::failure::Failure;

/// State of the group under way.
pub(super) struct State {
    pub(super) session: Sequence,
    pub(super) people: People,
    /// End of the least time of the break; `None` outside of breaks.
    pub(super) break_end: Option<Clock>,
    /// Wish of the experimenter for the running trial.
    pub(super) wish: Wish,
    /// Line about the last trial, for the experimenter, and whether the trial was valid.
    pub(super) last: Option<(String, bool)>,
    /// `true` once the addresses of the people are printed.
    pub(super) is_announced: bool,
    /// `true` once the tables of the ended group are written. The next group may begin.
    pub(super) is_closed: bool,
    /// `true` if the study needs no more groups.
    pub(super) is_full: bool,
    /// `true` if the experimenter has ended the study.
    pub(super) is_over: bool,
    /// Failure that ends the program.
    pub(super) failure: Option<Failure>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Wish {
    None,
    Repeat,
    Abandon,
}

impl State {
    pub(super) fn of(session: Sequence) -> Self {
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
