//! How the window shrinks during recovery (RFC 6937).

/// Proportional rate reduction: from the window before to the threshold, in step with what arrives.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Reduction {
    pub(crate) prior_window: u32,
    delivered: u32,
    pub(crate) sent: u32,
}

impl Reduction {
    pub(crate) const fn new(prior_window: u32) -> Self {
        Self { prior_window, delivered: 0, sent: 0 }
    }

    /// The window after `delivered` segments have arrived; `None` if none has.
    pub(crate) fn window(&mut self, threshold: u32, in_flight: u32, delivered: u32, has_advanced: bool, has_lost: bool) -> Option<u32> {
        if delivered == 0 || self.prior_window == 0 {
            return None;
        }
        self.delivered = self.delivered.saturating_add(delivered);
        let more = if in_flight > threshold {
            let due = (u64::from(threshold) * u64::from(self.delivered)).div_ceil(u64::from(self.prior_window));
            u32::try_from(due).unwrap_or(u32::MAX).saturating_sub(self.sent)
        } else {
            let slow_start = self.delivered.saturating_sub(self.sent).max(delivered) + u32::from(has_advanced && !has_lost);
            slow_start.min(threshold - in_flight)
        };
        // The first retransmission never waits.
        Some(in_flight + more.max(u32::from(self.sent == 0)))
    }
}
