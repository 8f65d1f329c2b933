//! Exchange of samples, extremes and finiteness between threads at their meetings.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::barrier::{Barrier, Guard};
use crate::arrays::lanes::{larger, smaller};
use crate::arrays::samples::Sample;

/// State shared by threads.
pub(super) struct Exchange<const A: usize> {
    /// Report of each thread, for two alternating meetings: a fast thread writes its next report while slow threads still read the last report.
    told: [Vec<Mutex<Told<A>>>; 2],
    barrier: Barrier,
    goes_on: AtomicBool,
}

/// Report of a thread at a meeting.
struct Told<const A: usize> {
    /// Samples of the thread's sending peers, each with the index of the peer in the scene.
    samples: Vec<(usize, Sample<A, 1>)>,
    /// Least and greatest position of the thread's copies \[m\], indexed by tick since the last report, then axis.
    extremes: Vec<(f64, f64)>,
    /// `true` if all numbers of the thread's peers have been finite so far.
    is_finite: bool,
}

/// Side of one thread in the exchange.
pub(super) struct Thread<'e, const A: usize> {
    exchange: &'e Exchange<A>,
    /// Index of the thread.
    place: usize,
    /// Peers of the scene moved by the thread.
    members: Range<usize>,
    /// Index in `told` of the next meeting: 0 or 1.
    turn: usize,
    /// Extremes of the thread's own copies since its last report, in the order of [`Told::extremes`].
    extremes: Vec<(f64, f64)>,
    /// Extremes of all threads at a meeting. A field, to use the same memory at every meeting.
    extremes_of_all: Vec<(f64, f64)>,
    is_finite: bool,
    /// `true` if all numbers of all threads were finite at the last meeting.
    all_are_finite: bool,
    /// Largest distance between two copies along an axis up to the last meeting \[m\].
    max_discrepancy: f64,
}

impl<const A: usize> Exchange<A> {
    pub(super) fn new(threads: usize) -> Self {
        let told = || (0..threads).map(|_| Mutex::new(Told { samples: Vec::new(), extremes: Vec::new(), is_finite: true })).collect();
        Self { told: [told(), told()], barrier: Barrier::new(threads), goes_on: AtomicBool::new(true) }
    }

    /// Returns a guard. If the present thread panics before dropping the guard, all threads panic.
    pub(super) const fn guard(&self) -> Guard<'_> {
        self.barrier.guard()
    }
}

impl<'e, const A: usize> Thread<'e, A> {
    /// Returns the side of the thread at index `place` with the peers `members`.
    pub(super) const fn new(exchange: &'e Exchange<A>, place: usize, members: Range<usize>) -> Self {
        Self {
            exchange,
            place,
            members,
            turn: 0,
            extremes: Vec::new(),
            extremes_of_all: Vec::new(),
            is_finite: true,
            all_are_finite: true,
            max_discrepancy: 0.0,
        }
    }

    /// Returns whether all numbers of all threads were finite at the last meeting.
    pub(super) const fn all_are_finite(&self) -> bool {
        self.all_are_finite
    }

    /// Returns the largest discrepancy up to the last meeting \[m\].
    pub(super) const fn max_discrepancy(&self) -> f64 {
        self.max_discrepancy
    }

    /// Returns the number of ticks with noted extremes since the last report.
    pub(super) const fn ticks_noted(&self) -> usize {
        self.extremes.len() / A
    }

    /// Notes whether all numbers of some of the thread's peers are finite.
    pub(super) const fn note_finite(&mut self, is_finite: bool) {
        self.is_finite &= is_finite;
    }

    /// Adds the least and greatest positions of some of the thread's copies \[m\], one pair for each axis, to the tick at index `tick` since the last report.
    pub(super) fn note_extremes(&mut self, tick: usize, extremes: impl Iterator<Item = (f64, f64)>) {
        let extremes = extremes.enumerate().map(|(axis, extremes)| (tick * A + axis, extremes));
        for (place, (low, high)) in extremes {
            match self.extremes.get_mut(place) {
                // Another group of this thread has noted this tick before.
                Some(all) => *all = (smaller(low, all.0), larger(high, all.1)),
                None => self.extremes.push((low, high)),
            }
        }
    }

    /// Meets the other threads at a tick of sending of the peers `senders`. Fills `sent` with the samples of the other threads' peers; the samples of
    /// the thread's own peers must be there already.
    pub(super) fn exchange(&mut self, senders: &[usize], sent: &mut [Sample<A, 1>]) {
        let told = &self.exchange.told[self.turn];
        self.turn = 1 - self.turn;
        {
            // No thread waits for this lock for long: a reader of the report of two meetings ago has passed a barrier since.
            let mut own = told[self.place].lock().unwrap_or_else(PoisonError::into_inner);
            own.samples.clear();
            own.samples.extend(senders.iter().filter(|sender| self.members.contains(sender)).map(|sender| (*sender, sent[*sender])));
            // The vectors are swapped, so neither is allocated again.
            own.extremes.clear();
            std::mem::swap(&mut own.extremes, &mut self.extremes);
            own.is_finite = self.is_finite;
        }
        self.exchange.barrier.wait();
        self.extremes_of_all.clear();
        for told in told {
            let told = told.lock().unwrap_or_else(PoisonError::into_inner);
            for (sender, sample) in &told.samples {
                sent[*sender] = *sample;
            }
            // All threads note the same ticks, so after the first thread the length stays.
            self.extremes_of_all.resize(told.extremes.len(), (f64::INFINITY, f64::NEG_INFINITY));
            for ((low, high), told) in self.extremes_of_all.iter_mut().zip(&told.extremes) {
                (*low, *high) = (smaller(told.0, *low), larger(told.1, *high));
            }
            self.all_are_finite &= told.is_finite;
        }
        // The extremes of one tick cover all copies, so their difference is the discrepancy of the tick.
        self.max_discrepancy = self.extremes_of_all.iter().fold(self.max_discrepancy, |largest, (low, high)| largest.max(high - low));
    }

    /// Returns whether the run goes on. One thread passes the answer, all other threads `None`.
    pub(super) fn goes_on(&self, known: Option<bool>) -> bool {
        let Exchange { barrier, goes_on, .. } = self.exchange;
        if let Some(known) = known {
            goes_on.store(known, Ordering::Relaxed);
        }
        barrier.wait();
        let wanted = goes_on.load(Ordering::Relaxed);
        // A second meeting: no thread may store the next answer before all threads have read the present answer.
        barrier.wait();
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two groups note two ticks, and a third tick after a stretch without a meeting: the discrepancy is the largest within a single tick of all groups.
    #[test]
    fn the_discrepancy_is_that_of_one_tick_of_all_groups() {
        let exchange = Exchange::<1>::new(1);
        let mut thread = Thread::new(&exchange, 0, 0..16);
        for extremes in [[(1.0, 2.0), (-5.0, -4.0)], [(0.5, 1.5), (-4.0, -3.5)]] {
            (0..).zip(extremes).for_each(|(tick, extremes)| thread.note_extremes(tick, std::iter::once(extremes)));
        }
        assert_eq!(thread.ticks_noted(), 2);
        for extremes in [(8.0, 8.5), (7.25, 8.0)] {
            thread.note_extremes(2, std::iter::once(extremes));
        }
        thread.exchange(&[], &mut []);
        assert_eq!((thread.max_discrepancy(), thread.ticks_noted()), (1.5, 0));
        thread.note_finite(false);
        assert!(thread.all_are_finite());
        thread.exchange(&[], &mut []);
        assert_eq!((thread.max_discrepancy(), thread.all_are_finite()), (1.5, false));
    }
}
