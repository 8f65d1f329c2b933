//! Timers, in the order in which they go off: by deadline, then by when they were set.

use std::collections::{BTreeMap, VecDeque};
use std::task::Waker;

use cohaptic_units::Instant;

use super::waking::Woken;
use crate::wire::earlier;

/// A timer: its deadline, and a number that makes it different from others with the same one.
pub(crate) type TimerId = (Instant, u64);

/// All timers.
///
/// Most are set in the order in which they go off, or nearly so: as programs do that all wait for the same span, and one that waits for all of them. These lie in a
/// queue, in which a timer is set and goes off in a few steps; a tree alone took a hundred instructions more for each.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    /// In order. The first one was not cancelled.
    ordered: VecDeque<(TimerId, Option<Waker>)>,
    /// How many of these were cancelled: they have no waker.
    cancelled: usize,
    /// Those that were set too early for the queue.
    others: BTreeMap<TimerId, Waker>,
    set: u64,
}

/// Before how many timers of the queue another one is set at most.
const FEW: usize = 4;

/// How many cancelled timers the queue holds without being cleaned.
const CANCELLED: usize = 32;

impl Timers {
    pub(crate) fn set(&mut self, deadline: Instant, waker: Waker) -> TimerId {
        let id = (deadline, self.set);
        self.set += 1;
        let later = self.ordered.iter().rev().take(FEW + 1).take_while(|((other, _), _)| *other > deadline).count();
        if later > FEW {
            self.others.insert(id, waker);
        } else {
            self.ordered.insert(self.ordered.len() - later, (id, Some(waker)));
        }
        id
    }

    /// Sees to it that another one is woken.
    pub(crate) fn renew(&mut self, id: TimerId, waker: &Waker) {
        let known = match self.place(id) {
            Some(place) => self.ordered[place].1.as_mut(),
            None => self.others.get_mut(&id),
        };
        if let Some(known) = known {
            known.clone_from(waker);
        }
    }

    pub(crate) fn cancel(&mut self, id: TimerId) {
        let Some(place) = self.place(id) else {
            self.others.remove(&id);
            return;
        };
        if self.ordered[place].1.take().is_some() {
            self.cancelled += 1;
            self.clean();
        }
    }

    fn place(&self, id: TimerId) -> Option<usize> {
        self.ordered.binary_search_by_key(&id, |(id, _)| *id).ok()
    }

    /// Drops those that were cancelled: at both ends at once, in between when there are more of them than others.
    fn clean(&mut self) {
        let is_cancelled = |timer: Option<&(TimerId, Option<Waker>)>| timer.is_some_and(|(_, waker)| waker.is_none());
        while is_cancelled(self.ordered.front()) {
            self.ordered.pop_front();
            self.cancelled -= 1;
        }
        while is_cancelled(self.ordered.back()) {
            self.ordered.pop_back();
            self.cancelled -= 1;
        }
        if self.cancelled > CANCELLED.max(self.ordered.len() / 2) {
            self.ordered.retain(|(_, waker)| waker.is_some());
            self.cancelled = 0;
        }
    }

    #[inline]
    pub(crate) fn next(&self) -> Option<Instant> {
        let deadline = |id: &TimerId| id.0;
        earlier(self.ordered.front().map(|(id, _)| deadline(id)), self.others.first_key_value().map(|(id, _)| deadline(id)))
    }

    /// Returns the first deadline for which a task with that waker waits.
    pub(super) fn deadline_of(&self, waker: &Waker) -> Option<Instant> {
        let is_of = |other: Option<&Waker>| other.is_some_and(|other| other.will_wake(waker));
        let ordered = self.ordered.iter().find(|(_, other)| is_of(other.as_ref())).map(|((deadline, _), _)| *deadline);
        let other = self.others.iter().find(|(_, other)| is_of(Some(other))).map(|((deadline, _), _)| *deadline);
        earlier(ordered, other)
    }

    /// Takes out those that are due.
    #[inline]
    pub(crate) fn fire(&mut self, now: Instant, woken: &mut Woken) {
        while self.next().is_some_and(|next| next <= now) {
            self.fire_first(woken);
        }
    }

    /// The first timer goes off.
    fn fire_first(&mut self, woken: &mut Woken) {
        let first_other = self.others.first_entry();
        if let Some(other) = first_other
            && self.ordered.front().is_none_or(|(id, _)| other.key() < id)
        {
            return woken.wake(other.remove());
        }
        if let Some((_, waker)) = self.ordered.pop_front() {
            waker.into_iter().for_each(|waker| woken.wake(waker));
        }
        if self.cancelled > 0 {
            self.clean();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};
    use std::task::Wake;

    use proptest::prelude::*;

    use super::*;

    /// Notes which timer has gone off.
    struct Note(u64, Arc<Mutex<Vec<u64>>>);

    impl Wake for Note {
        fn wake(self: Arc<Self>) {
            self.1.lock().unwrap().push(self.0);
        }
    }

    proptest! {
        /// Each act is a span after which a timer is to go off, how often time passes to the next one afterwards, and which of the timers is cancelled or renewed.
        #[test]
        fn they_go_off_as_in_a_tree(acts in prop::collection::vec((0_u64..40, 0_u8..3, prop::option::of((any::<prop::sample::Index>(), any::<bool>()))), 1..300)) {
            let gone_off: Arc<Mutex<Vec<u64>>> = Arc::default();
            let waker = |number| Waker::from(Arc::new(Note(number, Arc::clone(&gone_off))));
            let (mut timers, mut woken, mut now) = (Timers::default(), Woken::default(), 0);
            let (mut tree, mut ids, mut renewals) = (BTreeMap::new(), Vec::new(), 1000);
            for (span, passes, touched) in acts {
                let (deadline, number) = (Instant::from_nanos(now + span), ids.len() as u64);
                let id = timers.set(deadline, waker(number));
                prop_assert_eq!(id, (deadline, number));
                tree.insert(id, number);
                ids.push(id);
                if let Some((index, is_renewed)) = touched {
                    let id = *index.get(&ids);
                    if is_renewed {
                        renewals += 1;
                        timers.renew(id, &waker(renewals));
                        tree.entry(id).and_modify(|number| *number = renewals);
                    } else {
                        timers.cancel(id);
                        tree.remove(&id);
                    }
                }
                for _ in 0..passes {
                    let next = tree.first_key_value().map(|((deadline, _), _)| *deadline);
                    prop_assert_eq!(timers.next(), next);
                    let Some(next) = next else { break };
                    let later = tree.split_off(&(next, u64::MAX));
                    let expected: Vec<u64> = std::mem::replace(&mut tree, later).into_values().collect();
                    now = now.max(next.as_nanos());
                    timers.fire(next, &mut woken);
                    woken.take().into_iter().flatten().for_each(Waker::wake);
                    prop_assert_eq!(std::mem::take(&mut *gone_off.lock().unwrap()), expected);
                }
                prop_assert_eq!(timers.next(), tree.first_key_value().map(|((deadline, _), _)| *deadline));
            }
        }
    }

    #[test]
    fn timers_that_were_cancelled_take_no_memory_for_long() {
        let mut timers = Timers::default();
        let set = |timers: &mut Timers, nanos| timers.set(Instant::from_nanos(nanos), Waker::noop().clone());
        // Between two that stay, so that none of the others is at an end.
        let _stay = [0, 20_000].map(|nanos| set(&mut timers, nanos));
        for nanos in 1..10_000 {
            let id = set(&mut timers, nanos);
            timers.cancel(id);
        }
        assert!(timers.ordered.len() + timers.others.len() <= 3 * CANCELLED, "{} and {}", timers.ordered.len(), timers.others.len());
        assert_eq!(timers.next(), Some(Instant::ZERO));
    }
}
