//! Delays of the latest packets of a link, for displays of a running program.

use core::time::Duration;

/// Ring of the delays of the latest 128 packets delivered by a link. Allocates nothing before the first packet.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    /// At most [`Recent::MOST`] delays.
    delays: Vec<Duration>,
    /// Index of the next delay. Once the ring is full, the oldest delay is at this index.
    next: usize,
}

impl Recent {
    /// Capacity of the ring.
    const MOST: usize = 128;

    /// Records the delay of a packet in place of the oldest delay.
    pub fn record(&mut self, delay: Duration) {
        // While the ring grows, `next` is its length, and the lookup finds nothing.
        if let Some(oldest) = self.delays.get_mut(self.next) {
            *oldest = delay;
        } else {
            self.delays.push(delay);
        }
        self.next = (self.next + 1) % Self::MOST;
    }

    /// Returns the delays in no particular order.
    #[must_use]
    pub fn delays(&self) -> &[Duration] {
        &self.delays
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_are_remembered_and_the_oldest_forgotten() {
        let mut recent = Recent::default();
        (0..300).for_each(|delay| recent.record(Duration::from_nanos(delay)));
        let mut delays: Vec<u128> = recent.delays().iter().map(Duration::as_nanos).collect();
        delays.sort_unstable();
        assert_eq!(delays, (300 - 128..300).collect::<Vec<u128>>());
    }
}
