//! What threads tell each other where they meet.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::barrier::{Barrier, Guard};
use crate::arrays::lanes::{larger, smaller};
use crate::arrays::samples::Sample;

/// The words that threads exchange.
pub(super) struct Exchange<const A: usize> {
    /// The words of each thread, in turns: an early thread tells the next while others still read the last.
    told: [Vec<Mutex<Told<A>>>; 2],
    barrier: Barrier,
    goes_on: AtomicBool,
}

/// The words of a thread at a tick.
struct Told<const A: usize> {
    samples: Vec<(usize, Sample<A, 1>)>,
    /// The least and the greatest position of its copies along each axis, at each tick since it last told.
    extremes: Vec<(f64, f64)>,
    is_finite: bool,
}

/// A thread's side of the exchange.
pub(super) struct Thread<'e, const A: usize> {
    exchange: &'e Exchange<A>,
    place: usize,
    members: Range<usize>,
    turn: usize,
    /// Those of its copies since it last told.
    extremes: Vec<(f64, f64)>,
    /// Those of all threads at a meeting.
    extremes_of_all: Vec<(f64, f64)>,
    is_finite: bool,
    /// As far as all have told.
    all_are_finite: bool,
    max_discrepancy: f64,
}

impl<const A: usize> Exchange<A> {
    pub(super) fn new(threads: usize) -> Self {
        let told = || (0..threads).map(|_| Mutex::new(Told { samples: Vec::new(), extremes: Vec::new(), is_finite: true })).collect();
        Self { told: [told(), told()], barrier: Barrier::new(threads), goes_on: AtomicBool::new(true) }
    }

    /// While it lives, a panic of its thread is one of all threads.
    pub(super) const fn guard(&self) -> Guard<'_> {
        self.barrier.guard()
    }
}

impl<'e, const A: usize> Thread<'e, A> {
    /// The thread in that place, which has these peers.
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

    /// Whether all numbers of all threads were finite when they last met.
    pub(super) const fn all_are_finite(&self) -> bool {
        self.all_are_finite
    }

    /// The largest discrepancy up to the last meeting \[m\].
    pub(super) const fn max_discrepancy(&self) -> f64 {
        self.max_discrepancy
    }

    /// Of how many ticks since it last told it knows where copies are.
    pub(super) const fn ticks_noted(&self) -> usize {
        self.extremes.len() / A
    }

    /// Whether all numbers of some of its peers are finite.
    pub(super) const fn note_finite(&mut self, is_finite: bool) {
        self.is_finite &= is_finite;
    }

    /// Where some of its copies are at most, along each axis, in the tick in that place of the ticks since it last told.
    pub(super) fn note_extremes(&mut self, tick: usize, extremes: impl Iterator<Item = (f64, f64)>) {
        let extremes = extremes.enumerate().map(|(axis, extremes)| (tick * A + axis, extremes));
        for (place, (low, high)) in extremes {
            match self.extremes.get_mut(place) {
                Some(all) => *all = (smaller(low, all.0), larger(high, all.1)),
                None => self.extremes.push((low, high)),
            }
        }
    }

    /// At this tick these peers of the scene send: puts what those of other threads send into their places in `sent`, where those of this one are already.
    pub(super) fn exchange(&mut self, senders: &[usize], sent: &mut [Sample<A, 1>]) {
        let told = &self.exchange.told[self.turn];
        self.turn = 1 - self.turn;
        {
            let mut own = told[self.place].lock().unwrap_or_else(PoisonError::into_inner);
            own.samples.clear();
            own.samples.extend(senders.iter().filter(|sender| self.members.contains(sender)).map(|sender| (*sender, sent[*sender])));
            // They change places, so that neither is allocated again.
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
            self.extremes_of_all.resize(told.extremes.len(), (f64::INFINITY, f64::NEG_INFINITY));
            for ((low, high), told) in self.extremes_of_all.iter_mut().zip(&told.extremes) {
                (*low, *high) = (smaller(told.0, *low), larger(told.1, *high));
            }
            self.all_are_finite &= told.is_finite;
        }
        self.max_discrepancy = self.extremes_of_all.iter().fold(self.max_discrepancy, |largest, (low, high)| largest.max(high - low));
    }

    /// Whether the run goes on, which one thread knows and the others ask.
    pub(super) fn goes_on(&self, known: Option<bool>) -> bool {
        let Exchange { barrier, goes_on, .. } = self.exchange;
        if let Some(known) = known {
            goes_on.store(known, Ordering::Relaxed);
        }
        barrier.wait();
        let wanted = goes_on.load(Ordering::Relaxed);
        // The next answer may be given once all have this one.
        barrier.wait();
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two groups note two ticks and, after a stretch without a meeting, a third: copies are as far apart as in one tick of all groups.
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
