//! What a link was asked for, beside what it did.

use std::time::Duration;

use cohaptic_wan::{LinkModel, LinkStats};

/// The mean delay that a link was asked for when the run began, and how often it was changed since.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct ConfiguredDelay {
    /// `None` where only a recording knows.
    pub(crate) first: Option<Duration>,
    pub(crate) changes: u64,
}

impl ConfiguredDelay {
    pub(crate) fn of(model: &LinkModel) -> Self {
        let is_recording = matches!(model, LinkModel::Replay(_));
        Self { first: (!is_recording).then(|| model.mean_delay()), changes: 0 }
    }

    /// Its propagation delay, as it was asked for and as it was.
    pub(crate) fn beside(&self, stats: &LinkStats) -> Option<String> {
        let mean = stats.mean_delay()?;
        let asked = self.first.map_or_else(String::new, |first| format!(", asked {}", millis(first)));
        let changed = match self.changes {
            0 => String::new(),
            1 => " at first, changed once".to_owned(),
            more => format!(" at first, changed {more} times"),
        };
        Some(format!("mean delay {}{asked}{changed}", millis(mean)))
    }
}

fn millis(span: Duration) -> String {
    format!("{:.3} ms", span.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use cohaptic_units::{Bytes, Instant};
    use cohaptic_wan::{Link, LinkName, PacketInfo};

    use super::*;

    #[test]
    fn both_delays_are_said_and_that_it_was_changed() {
        let model = cohaptic_linkfile::link_from_keys(&["delay=24ms".to_owned()]).unwrap();
        let mut link = Link::new(0, &LinkName::between("a", "b"), model.clone());
        let asked = ConfiguredDelay::of(&model);
        assert_eq!(asked.beside(&link.stats()), None, "nothing was delivered yet");
        link.handle_packet(Instant::ZERO, PacketInfo { size: Bytes::new(1), ecn_capable: false }, ()).unwrap();
        link.handle_timeout(Instant::from_nanos(24_000_000)).unwrap();
        assert_eq!(asked.beside(&link.stats()).unwrap(), "mean delay 24.000 ms, asked 24.000 ms");
        let changed = ConfiguredDelay { changes: 2, ..asked };
        assert_eq!(changed.beside(&link.stats()).unwrap(), "mean delay 24.000 ms, asked 24.000 ms at first, changed 2 times");
    }
}
