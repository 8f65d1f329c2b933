//! How far copies are apart at instants at which some of them tick: each counts with its position at its own latest tick.

use crate::arrays::lanes::{larger, smaller};

/// Where each copy was at its latest tick.
#[derive(Clone, Debug)]
pub(super) struct Latest<const A: usize> {
    positions: Vec<[f64; A]>,
    /// By tick of the window, the last one first: the least and the greatest among those that tick later, as they were before, and those that rest.
    before: Vec<Extremes<A>>,
}

/// The least and the greatest position along each axis.
#[derive(Clone, Copy, Debug)]
struct Extremes<const A: usize> {
    low: [f64; A],
    high: [f64; A],
}

impl<const A: usize> Extremes<A> {
    const NONE: Self = Self { low: [f64::INFINITY; A], high: [f64::NEG_INFINITY; A] };

    #[inline(always)]
    fn with(mut self, position: &[f64; A]) -> Self {
        for (axis, position) in position.iter().enumerate() {
            self.low[axis] = smaller(*position, self.low[axis]);
            self.high[axis] = larger(*position, self.high[axis]);
        }
        self
    }

    #[inline(always)]
    fn and(mut self, other: &Self) -> Self {
        for axis in 0..A {
            self.low[axis] = smaller(other.low[axis], self.low[axis]);
            self.high[axis] = larger(other.high[axis], self.high[axis]);
        }
        self
    }

    #[inline(always)]
    fn distance(&self) -> f64 {
        (0..A).fold(0.0, |largest: f64, axis| largest.max(self.high[axis] - self.low[axis]))
    }
}

impl<const A: usize> Latest<A> {
    /// Where the copies begin.
    pub(super) fn new(positions: Vec<[f64; A]>) -> Self {
        Self { positions, before: Vec::new() }
    }

    /// Some peers tick, at instants and at these positions, in order; `resting` are all others. Hands the distance at each instant to `on` \[m\]; those that are
    /// not above `least` may be left out.
    pub(super) fn tick<K: PartialEq>(
        &mut self,
        ticks: impl DoubleEndedIterator<Item = (usize, K, [f64; A])> + Clone,
        resting: &[usize],
        least: Option<f64>,
        mut on: impl FnMut(K, f64),
    ) {
        let Self { positions, before } = self;
        if let Some(least) = least {
            let all = positions.iter().fold(Extremes::NONE, Extremes::with);
            if ticks.clone().fold(all, |all, (_, _, position)| all.with(&position)).distance() <= least {
                ticks.for_each(|(peer, _, position)| positions[peer] = position);
                return;
            }
        }
        let mut extremes = resting.iter().fold(Extremes::NONE, |all, peer| all.with(&positions[*peer]));
        before.clear();
        for (peer, ..) in ticks.clone().rev() {
            before.push(extremes);
            extremes = extremes.with(&positions[peer]);
        }
        let mut now = Extremes::NONE;
        let mut ticks = ticks.peekable();
        while let Some((peer, at, position)) = ticks.next() {
            positions[peer] = position;
            now = now.with(&position);
            let others = before.pop().unwrap_or(Extremes::NONE);
            if ticks.peek().is_none_or(|(_, next, _)| *next != at) {
                on(at, now.and(&others).distance());
            }
        }
    }
}
