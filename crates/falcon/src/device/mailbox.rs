//! Numbers that one thread leaves for another, without either waiting.

use core::sync::atomic::{AtomicU64, Ordering, fence};

/// How often a reader looks again while the writer is at it.
const TRIES: u32 = 64;

/// The newest words that one writer has left. The writer never waits; a reader that comes while they are being written looks again a few times and
/// then goes without. (A sequence lock: Boehm 2012, "Can seqlocks get along with programming language memory models?", with every word atomic.)
#[derive(Debug)]
pub(super) struct Mailbox<const N: usize> {
    /// Even: whole. Odd: being written. Half of it counts the writings.
    sequence: AtomicU64,
    words: [AtomicU64; N],
}

impl<const N: usize> Mailbox<N> {
    pub(super) const fn new() -> Self {
        Self { sequence: AtomicU64::new(0), words: [const { AtomicU64::new(0) }; N] }
    }

    /// Only one thread may write.
    pub(super) fn write(&self, words: &[u64; N]) {
        let sequence = self.sequence.load(Ordering::Relaxed);
        self.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        for (place, word) in self.words.iter().zip(words) {
            place.store(*word, Ordering::Relaxed);
        }
        self.sequence.store(sequence.wrapping_add(2), Ordering::Release);
    }

    /// The newest words if they are newer than those of number `seen`, with their number; 0 is before the first.
    pub(super) fn read_newer(&self, seen: u64) -> Option<([u64; N], u64)> {
        for _ in 0..TRIES {
            let before = self.sequence.load(Ordering::Acquire);
            if before == seen {
                return None;
            }
            if before.is_multiple_of(2) {
                let mut words = [0; N];
                for (word, place) in words.iter_mut().zip(&self.words) {
                    *word = place.load(Ordering::Relaxed);
                }
                fence(Ordering::Acquire);
                if self.sequence.load(Ordering::Relaxed) == before {
                    return Some((words, before));
                }
            }
            core::hint::spin_loop();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_torn_and_nothing_goes_backwards() {
        let mailbox = Mailbox::<8>::new();
        assert_eq!(mailbox.read_newer(0), None);
        let last = 20_000;
        std::thread::scope(|scope| {
            scope.spawn(|| (1..=last).for_each(|count| mailbox.write(&[count; 8])));
            let (mut seen, mut newest) = (0, 0);
            while newest < last {
                if let Some((words, number)) = mailbox.read_newer(seen) {
                    assert!(words.iter().all(|word| *word == words[0]), "torn: {words:?}");
                    assert!(words[0] > newest && number == 2 * words[0]);
                    (seen, newest) = (number, words[0]);
                }
            }
            assert_eq!(mailbox.read_newer(seen), None);
        });
    }
}
