//! Timers, sorted by deadline. Timers of equal deadlines go off in the order of setting.

use std::collections::{BTreeMap, VecDeque};
use std::task::Waker;

use cohaptic_units::Instant;

use super::waking::Woken;
use crate::wire::earlier;

/// Deadline and number of a timer. The number orders timers of equal deadlines.
pub(crate) type TimerId = (Instant, u64);

/// All timers of a run.
///
/// Most timers are set in the order of their deadlines, or nearly so: many programs wait for the same span, and another task waits for all these programs.
/// Such timers lie in a queue, where setting and firing take a few steps. Only timers set far out of order lie in a tree.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    /// Queue of timers, sorted by [`TimerId`]. The waker is `None` if the timer was cancelled. The first timer is not cancelled.
    ordered: VecDeque<(TimerId, Option<Waker>)>,
    /// Number of cancelled timers in `ordered`.
    cancelled: usize,
    /// Timers with a deadline too early for the queue.
    others: BTreeMap<TimerId, Waker>,
    /// Number of timers set so far.
    set: u64,
}

/// Number of later timers in the queue before which a new timer is inserted at most. A timer with more later timers goes to the tree.
const FEW: usize = 4;

/// Number of cancelled timers up to which the queue is not cleaned.
const CANCELLED: usize = 32;

impl Timers {
    pub(crate) fn set(&mut self, deadline: Instant, waker: Waker) -> TimerId {
        let id = (deadline, self.set);
        self.set += 1;
        // One more than `FEW` is counted, to see whether the limit is exceeded.
        let later = self.ordered.iter().rev().take(FEW + 1).take_while(|((other, _), _)| *other > deadline).count();
        if later > FEW {
            self.others.insert(id, waker);
        } else {
            self.ordered.insert(self.ordered.len() - later, (id, Some(waker)));
        }
        id
    }

    /// Replaces the waker of a timer. Does nothing if the timer has gone off.
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
        // The entry only loses its waker. A removal from the middle of the queue would move all entries after it.
        if self.ordered[place].1.take().is_some() {
            self.cancelled += 1;
            self.clean();
        }
    }

    fn place(&self, id: TimerId) -> Option<usize> {
        // The queue is sorted by deadline and number, and no two timers have the same number.
        self.ordered.binary_search_by_key(&id, |(id, _)| *id).ok()
    }

    /// Removes cancelled timers: always at both ends of the queue, and in between if they are more than half of the queue and more than [`CANCELLED`].
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

    /// Returns the earliest deadline for which the task with the waker `waker` waits.
    pub(super) fn deadline_of(&self, waker: &Waker) -> Option<Instant> {
        // A search through all timers is slow, but only messages about waiting tasks need the answer.
        let is_of = |other: Option<&Waker>| other.is_some_and(|other| other.will_wake(waker));
        let ordered = self.ordered.iter().find(|(_, other)| is_of(other.as_ref())).map(|((deadline, _), _)| *deadline);
        let other = self.others.iter().find(|(_, other)| is_of(Some(other))).map(|((deadline, _), _)| *deadline);
        earlier(ordered, other)
    }

    /// Fires all timers whose deadline is not after `now`.
    #[inline]
    pub(crate) fn fire(&mut self, now: Instant, woken: &mut Woken) {
        while self.next().is_some_and(|next| next <= now) {
            self.fire_first(woken);
        }
    }

    /// Fires the timer with the earliest deadline.
    fn fire_first(&mut self, woken: &mut Woken) {
        let first_other = self.others.first_entry();
        if let Some(other) = first_other
            // Both collections are sorted, so the smaller of the two first keys belongs to the timer that goes off first.
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

    /// Waker that notes the number of the timer when woken.
    struct Note(u64, Arc<Mutex<Vec<u64>>>);

    impl Wake for Note {
        fn wake(self: Arc<Self>) {
            self.1.lock().unwrap().push(self.0);
        }
    }

    proptest! {
        /// Each act holds the span until the new timer goes off, how often time passes to the next timer afterwards, and which timer is cancelled or renewed.
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
                    woken.take().into_iter().for_each(Waker::wake);
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
        // The timers lie between two timers that stay, so that no cancelled timer is at an end of the queue.
        let _stay = [0, 20_000].map(|nanos| set(&mut timers, nanos));
        for nanos in 1..10_000 {
            let id = set(&mut timers, nanos);
            timers.cancel(id);
        }
        assert!(timers.ordered.len() + timers.others.len() <= 3 * CANCELLED, "{} and {}", timers.ordered.len(), timers.others.len());
        assert_eq!(timers.next(), Some(Instant::ZERO));
    }
}
