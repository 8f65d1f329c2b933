//! The delays of the latest datagrams, to be looked at while a relay runs.

use core::time::Duration;

/// The delays of the latest datagrams that came out of a link. Takes memory only where something does.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent {
    delays: Vec<Duration>,
    /// Where the next one goes once there are as many as are remembered.
    next: usize,
}

impl Recent {
    /// The number of delays that are remembered.
    const MOST: usize = 128;

    #[inline]
    pub(super) fn record(&mut self, delay: Duration) {
        if let Some(oldest) = self.delays.get_mut(self.next) {
            *oldest = delay;
        } else {
            self.delays.push(delay);
        }
        self.next = (self.next + 1) % Self::MOST;
    }

    /// In no order.
    pub(super) fn delays(&self) -> &[Duration] {
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
