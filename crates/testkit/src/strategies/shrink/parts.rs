//! Which parts can go: all, halves, halves of halves.

/// Heaps of parts that may go together, the next to try at the end.
#[derive(Clone, Debug)]
pub(super) struct Parts<P> {
    heaps: Vec<Vec<P>>,
    tried: Option<Vec<P>>,
}

impl<P> Parts<P> {
    pub(super) fn new(all: Vec<P>) -> Self {
        Self { heaps: vec![all], tried: None }
    }

    /// The value without the next heap.
    pub(super) fn propose<V>(&mut self, without: impl Fn(&[P]) -> Option<V>) -> Option<V> {
        while let Some(heap) = self.heaps.pop() {
            if heap.is_empty() {
                continue;
            }
            let candidate = without(&heap);
            self.tried = Some(heap);
            if candidate.is_some() {
                return candidate;
            }
            self.answer(false);
        }
        None
    }

    /// Halves the heap that cannot go as a whole.
    pub(super) fn answer(&mut self, went: bool) {
        let Some(mut first) = self.tried.take() else { return };
        if !went && first.len() > 1 {
            let second = first.split_off(first.len() / 2);
            self.heaps.extend([second, first]);
        }
    }
}
