//! A value that one thread leaves for others, without either waiting.

use core::sync::atomic::{AtomicU64, Ordering};
use std::sync::RwLock;

/// How often one looks again while others are where it wants to be.
const TRIES: u32 = 64;

/// The newest value that one writer has left. Nobody waits: the writer writes where no reader looks, and a reader goes without if the newest value is being
/// replaced each time that it looks.
#[derive(Debug)]
pub(super) struct Mailbox<T> {
    /// How many values were written, and, in the two lowest bits, where the newest one is.
    newest: AtomicU64,
    /// Values with their numbers, from 1.
    places: [RwLock<Option<(T, u64)>>; 3],
}

impl<T: Copy> Mailbox<T> {
    pub(super) const fn new() -> Self {
        Self { newest: AtomicU64::new(0), places: [const { RwLock::new(None) }; 3] }
    }

    /// Only one thread may write. A value is left out if readers keep looking at both older ones.
    pub(super) fn write(&self, value: T) {
        let newest = self.newest.load(Ordering::Relaxed);
        let number = (newest >> 2) + 1;
        for _ in 0..TRIES {
            for (place, kept) in (0..).zip(&self.places).filter(|(place, _)| *place != newest & 3) {
                if let Ok(mut kept) = kept.try_write() {
                    *kept = Some((value, number));
                    drop(kept);
                    return self.newest.store(number << 2 | place, Ordering::Release);
                }
            }
            core::hint::spin_loop();
        }
    }

    /// The newest value if it is newer than that of number `seen`, with its number; 0 is before the first.
    pub(super) fn read_newer(&self, seen: u64) -> Option<(T, u64)> {
        for _ in 0..TRIES {
            let newest = self.newest.load(Ordering::Acquire);
            let place = (0..).zip(&self.places).find(|(place, _)| *place == newest & 3)?.1;
            if let Ok(kept) = place.try_read() {
                // The writer may have come back to this place since, with a newer value.
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
