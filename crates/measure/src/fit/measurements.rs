//! One-way measurements, checked once when made.

use cohaptic_wan::{Fate, FateLog};

use super::skew::{Skew, SkewError};
use super::ticks::Ticks;

/// A measured packet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measurement {
    /// Instant of sending \[s\], from any origin.
    pub sent_s: f64,
    /// One-way delay \[s\]; `None` for a lost packet. Can be negative if the two clocks are offset, see [`Measurements::shifted`].
    pub delay_s: Option<f64>,
}

/// Measured packets in the order of sending, with finite numbers only.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Measurements {
    pub(super) packets: Vec<Measurement>,
    /// Removed drift; `None` if no drift was removed.
    pub(super) removed: Option<Skew>,
    pub(super) ticks: Ticks,
}

/// Error of making measurements. Packets are counted from 1.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeasurementsError {
    /// An instant or a delay is NaN or infinite.
    #[error("packet {packet}: found {value}, expected a finite time and a finite delay (a lost packet has none)")]
    NotFinite {
        /// Number of the packet.
        packet: usize,
        /// Value found.
        value: f64,
    },
    /// A packet was sent earlier than the packet before.
    #[error("packet {packet} was sent at {sent_s} s, the one before it at {before_s} s: expected packets in the order of sending")]
    TimeGoesBack {
        /// Number of the packet.
        packet: usize,
        /// Instant of sending \[s\].
        sent_s: f64,
        /// Instant of sending of the packet before \[s\].
        before_s: f64,
    },
    /// A tick of the clock is no finite number above zero.
    #[error("found a tick of {tick_s} s: expected a finite time above zero")]
    Tick {
        /// Tick found \[s\].
        tick_s: f64,
    },
    /// A share of a round trip is out of range.
    #[error("found the share {share} of a round trip: expected above 0 and at most 1")]
    Share {
        /// Share found.
        share: f64,
    },
}

impl Measurements {
    /// Checks that all numbers are finite and that packets are in the order of sending. Equal instants are allowed.
    ///
    /// # Errors
    ///
    /// [`MeasurementsError`] for the first wrong packet.
    pub fn new(packets: Vec<Measurement>) -> Result<Self, MeasurementsError> {
        let mut before_s = f64::NEG_INFINITY;
        for (packet, &Measurement { sent_s, delay_s }) in (1..).zip(&packets) {
            // Finite numbers are checked before the order, because no comparison with NaN holds and NaN would pass as in order.
            if let Some(value) = [Some(sent_s), delay_s].into_iter().flatten().find(|value| !value.is_finite()) {
                return Err(MeasurementsError::NotFinite { packet, value });
            }
            if sent_s < before_s {
                return Err(MeasurementsError::TimeGoesBack { packet, sent_s, before_s });
            }
            before_s = sent_s;
        }
        Ok(Self::in_order(packets))
    }

    /// Takes the packets of a fate log. A packet is sent when offered, and has the delay of its first arrived copy.
    #[must_use]
    pub fn from_fates(log: &FateLog) -> Self {
        let mut packets: Vec<Measurement> = Vec::with_capacity(log.packets());
        let mut before = None;
        for record in log.records() {
            // A log is sorted by packet and copy, so a new number begins a new packet.
            if before != Some(record.sequence) {
                before = Some(record.sequence);
                packets.push(Measurement { sent_s: record.offered.as_secs_f64(), delay_s: None });
            }
            if let (Fate::Delivered(at), Some(packet)) = (record.fate, packets.last_mut()) {
                let delay_s = at.saturating_duration_since(record.offered).as_secs_f64();
                packet.delay_s = Some(packet.delay_s.map_or(delay_s, |earlier| earlier.min(delay_s)));
            }
        }
        // A log is in the order of sending, and its instants are finite.
        Self::in_order(packets)
    }

    /// Makes measurements of packets known to be finite and in the order of sending.
    pub(super) const fn in_order(packets: Vec<Measurement>) -> Self {
        Self { packets, removed: None, ticks: Ticks::Found }
    }

    /// Returns the packets, in the order of sending.
    #[must_use]
    pub fn packets(&self) -> &[Measurement] {
        &self.packets
    }

    /// Returns the number of different instants of sending, below the number of packets for bursts.
    #[must_use]
    pub fn instants(&self) -> usize {
        self.packets.chunk_by(|one, other| one.sent_s.total_cmp(&other.sent_s).is_eq()).count()
    }

    /// Returns the least delay \[s\]; `None` if no packet arrived.
    #[must_use]
    pub fn least_s(&self) -> Option<f64> {
        self.arrivals().map(|arrival| arrival.1).reduce(f64::min)
    }

    /// Returns the mean delay \[s\]; `None` if no packet arrived.
    #[must_use]
    pub fn mean_s(&self) -> Option<f64> {
        crate::series::mean(&self.arrivals().map(|arrival| arrival.1).collect::<Vec<_>>())
    }

    /// Returns the removed drift. The error of the drift adds to the error of the mean delay.
    pub(super) const fn removed(&self) -> Option<&Skew> {
        self.removed.as_ref()
    }

    /// Returns (sending, delay) \[s\] of all arrived packets.
    pub(super) fn arrivals(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.packets.iter().filter_map(|packet| Some((packet.sent_s, packet.delay_s?)))
    }

    /// Returns the measurements with all delays longer by `by_s` \[s\], for two clocks with a known or assumed offset. One-way measurements alone cannot
    /// separate the offset from the delay.
    ///
    /// # Errors
    ///
    /// [`MeasurementsError::NotFinite`] if a sum is not finite.
    pub fn shifted(&self, by_s: f64) -> Result<Self, MeasurementsError> {
        let later = |packet: &Measurement| Measurement { delay_s: packet.delay_s.map(|delay| delay + by_s), ..*packet };
        Ok(Self { removed: self.removed, ticks: self.ticks.clone(), ..Self::new(self.packets.iter().map(later).collect())? })
    }

    /// Estimates the linear drift of a clock against the other. Returns the measurements without the drift if the drift is significant
    /// ([`Skew::significant`]), and unchanged otherwise, with the estimate. The delay of the first packet stays the same.
    ///
    /// See [`Skew`] for other causes with the look of a drift.
    ///
    /// # Errors
    ///
    /// [`SkewError`] if fewer than 50 packets arrived, if all of them were sent at the same instant, or if the delays have a too long memory.
    pub fn without_skew(&self) -> Result<(Self, Skew), SkewError> {
        let arrivals: Vec<(f64, f64)> = self.arrivals().collect();
        let skew = Skew::of(&arrivals)?;
        let Some(first) = self.packets.first().filter(|_| skew.significant) else { return Ok((self.clone(), skew)) };
        let corrected = |packet: &Measurement| Measurement {
            delay_s: packet.delay_s.map(|delay| delay - skew.seconds_per_second * (packet.sent_s - first.sent_s)),
            ..*packet
        };
        Ok((Self { packets: self.packets.iter().map(corrected).collect(), removed: Some(skew), ticks: self.ticks.clone() }, skew))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fate_log_is_measurements() {
        let rows = "0,0,0,64,24000000,delivered,0,0\n1,0,1000000,64,1000000,loss,0,0\n2,0,2000000,64,2000000,duplicated,0,0\n\
                    2,0,2000000,64,27000000,delivered,0,0\n2,1,2000000,64,26000000,delivered,0,0\n";
        let log = FateLog::parse(&format!("{}\n{rows}", cohaptic_wan::FateRow::HEADER)).unwrap();
        let packet = |sent_s, delay_s| Measurement { sent_s, delay_s };
        assert_eq!(Measurements::from_fates(&log).packets(), [packet(0.0, Some(0.024)), packet(0.001, None), packet(0.002, Some(0.024))]);
    }
}
