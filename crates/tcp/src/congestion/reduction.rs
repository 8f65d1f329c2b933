//! Reduction of the congestion window during recovery (RFC 6937).

/// Proportional rate reduction: moves the window from its value before the reduction to the threshold, in proportion to the segments that arrive.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Reduction {
    /// Window before the reduction \[segments\]. Zero before any reduction.
    pub(crate) prior_window: u32,
    /// Segments that have arrived since the beginning of the reduction.
    delivered: u32,
    /// Segments that were sent since the beginning of the reduction, new or again.
    pub(crate) sent: u32,
}

impl Reduction {
    pub(crate) const fn new(prior_window: u32) -> Self {
        Self { prior_window, delivered: 0, sent: 0 }
    }

    /// Returns the window \[segments\] after `delivered` more segments have arrived, or `None` if no segment has arrived. `in_flight` is the estimate of
    /// segments on the way, `has_advanced` says that the acknowledgement number has moved, `has_lost` that a segment was found lost.
    pub(crate) fn window(&mut self, threshold: u32, in_flight: u32, delivered: u32, has_advanced: bool, has_lost: bool) -> Option<u32> {
        if delivered == 0 || self.prior_window == 0 {
            return None;
        }
        self.delivered = self.delivered.saturating_add(delivered);
        let more = if in_flight > threshold {
            // Of the segments that arrive, the share threshold/prior_window is replaced by new transmissions.
            let due = (u64::from(threshold) * u64::from(self.delivered)).div_ceil(u64::from(self.prior_window));
            u32::try_from(due).unwrap_or(u32::MAX).saturating_sub(self.sent)
        } else {
            // The losses have already brought the flight below the threshold: the sender catches up as in slow start (PRR-SSRB).
            let slow_start = self.delivered.saturating_sub(self.sent).max(delivered) + u32::from(has_advanced && !has_lost);
            slow_start.min(threshold - in_flight)
        };
        // The first retransmission leaves at once.
        Some(in_flight + more.max(u32::from(self.sent == 0)))
    }
}
