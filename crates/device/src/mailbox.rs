//! Newest value of a writer thread for reader threads. No thread waits for another thread.

use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::RwLock;

/// Attempts at a place that another thread uses.
const TRIES: u32 = 64;

/// Newest value of one writer, such as the reading of a driver's thread for the thread of a session.
///
/// No thread waits: the writer writes to a place that no reader uses, and a reader returns without a value if the newest value is being replaced at each of its
/// attempts.
#[derive(Debug)]
pub struct Mailbox<T> {
    /// Number of the newest value, counted from 1, above the two lowest bits, which contain the place of this value.
    newest: AtomicU64,
    /// Values with their numbers, counted from 1.
    places: [RwLock<Option<(T, u64)>>; 3],
}

impl<T: Copy> Default for Mailbox<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Copy> Mailbox<T> {
    /// Returns a mailbox without a value.
    #[must_use]
    pub const fn new() -> Self {
        Self { newest: AtomicU64::new(0), places: [const { RwLock::new(None) }; 3] }
    }

    /// Makes `value` the newest value. Only one thread may write. A value is dropped if readers occupy both other places at all attempts.
    pub fn write(&self, value: T) {
        // Relaxed is enough: only this thread writes `newest`.
        let newest = self.newest.load(Ordering::Relaxed);
        let number = (newest >> 2) + 1;
        for _ in 0..TRIES {
            // Two places do not hold the newest value; a reader can still occupy an older one.
            for (place, kept) in (0..).zip(&self.places).filter(|(place, _)| *place != newest & 3) {
                if let Ok(mut kept) = kept.try_write() {
                    *kept = Some((value, number));
                    drop(kept);
                    // Release orders the value before its place, for the acquire of a reader. The lock is free before a reader can learn the place.
                    return self.newest.store(number << 2 | place, Ordering::Release);
                }
            }
            core::hint::spin_loop();
        }
    }

    /// Returns the newest value and its number, if the number is greater than `seen`. With 0 for `seen`, every value is newer. Returns `None` also if the
    /// newest value is being replaced at all attempts.
    #[must_use]
    pub fn read_newer(&self, seen: u64) -> Option<(T, u64)> {
        for _ in 0..TRIES {
            let newest = self.newest.load(Ordering::Acquire);
            // Acquire makes the value visible that was written before its place was published.
            let place = (0..).zip(&self.places).find(|(place, _)| *place == newest & 3)?.1;
            if let Ok(kept) = place.try_read() {
                // The writer may have reused this place since the load, for a newer value. The number tells the value's age in any case.
                return kept.filter(|(_, number)| *number > seen);
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
        let mailbox = Mailbox::<[u64; 8]>::new();
        assert_eq!(mailbox.read_newer(0), None);
        let last = 20_000;
        std::thread::scope(|scope| {
            scope.spawn(|| (1..=last).for_each(|count| mailbox.write([count; 8])));
            let (mut seen, mut newest) = (0, 0);
            while newest < last {
                if let Some((words, number)) = mailbox.read_newer(seen) {
                    assert!(words.iter().all(|word| *word == words[0]), "torn: {words:?}");
                    assert!(words[0] > newest && number == words[0]);
                    (seen, newest) = (number, words[0]);
                }
            }
            assert_eq!(mailbox.read_newer(seen), None);
        });
    }
}
