//! Delay between an image and its use by the person.

use alloc::vec::Vec;

use super::View;

/// Views of the latest ticks. A view is used a fixed number of ticks after its tick.
#[derive(Clone, Debug)]
pub(super) struct DelayLine<const A: usize> {
    /// Views of the latest ticks, in a ring. Empty before the first tick.
    views: Vec<View<A>>,
    /// Number of views in the ring: the delay in ticks, and one for the present tick.
    len: usize,
    /// Place of the oldest view, which the next view replaces.
    next: usize,
}

impl<const A: usize> DelayLine<A> {
    /// Returns a line with this delay in ticks.
    pub(super) fn new(delay: u64) -> Self {
        let len = usize::try_from(delay).unwrap_or(usize::MAX).saturating_add(1);
        Self { views: Vec::new(), len, next: 0 }
    }

    /// Takes in the view of a tick and returns the view that is used at this tick. Before the delay has passed for the first time, this is the first view.
    #[inline]
    pub(super) fn pass(&mut self, view: &View<A>) -> View<A> {
        if self.views.is_empty() {
            // Filled with the first view, so that the first view stands for all earlier views.
            self.views.resize(self.len, *view);
        }
        self.views[self.next] = *view;
        self.next += 1;
        if self.next == self.len {
            self.next = 0;
        }
        self.views[self.next]
    }

    /// Returns the views that are still to be used, the newest first. Empty before the first tick.
    pub(super) fn waiting(&self) -> impl Iterator<Item = &View<A>> {
        let (len, newest) = (self.len, self.next + self.len - 1);
        (0..len - 1).filter_map(move |age| self.views.get((newest - age) % len))
    }

    /// Replaces the views not used yet by `views`, the newest first. Missing views stand for views of the origin.
    pub(super) fn set_waiting(&mut self, views: impl Iterator<Item = View<A>>) {
        let origin = View { position: [0.0; A], target: [0.0; A], radius: 0.0 };
        self.views.clear();
        self.views.resize(self.len, origin);
        // The next view takes place 0, so the newest of these stands last.
        self.next = 0;
        for (place, view) in self.views.iter_mut().skip(1).rev().zip(views) {
            *place = view;
        }
    }
}
