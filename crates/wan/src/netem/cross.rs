//! `cross`: packets of other senders that share the line of `rate`. `tc` does not know this option.

use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use cohaptic_units::{Bytes, Rate};

use super::{Contradiction, RateSpec};
use crate::stages::queue::{CrossTraffic, CrossTrafficError, OnOff, Poisson};

/// `cross { poisson RATE | on-off SOURCES PEAK ON OFF [SHAPE] } [size BYTES]`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CrossSpec {
    /// Source of the packets.
    pub source: CrossSource,
    /// Size of each packet \[bytes\]. Default: 1500.
    pub size: Option<NonZeroU32>,
}

/// The sources of cross packets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum CrossSource {
    /// `poisson RATE`: independent, exponentially distributed distances.
    Poisson {
        /// Mean rate \[bytes/s\], rounded down as in `rate`.
        bytes_per_sec: NonZeroU64,
    },
    /// `on-off SOURCES PEAK ON OFF [SHAPE]`: sources that send and are silent in turn, for spans with Pareto laws.
    OnOff {
        /// Number of sources, at most 65,536.
        sources: NonZeroU32,
        /// Rate of one source while it sends \[bytes/s\], rounded down as in `rate`.
        peak: NonZeroU64,
        /// Mean span of sending, at least the time of one packet at the peak rate.
        on: Duration,
        /// Mean span of silence, above zero.
        off: Duration,
        /// Shape of both laws, above 1 and below 2. Default: 1.5.
        shape: Option<f64>,
    },
}

/// Size of a cross packet without `size` \[bytes\].
const USUAL_SIZE: u64 = 1500;
/// Shape of the laws of on-off sources without SHAPE.
const USUAL_SHAPE: f64 = 1.5;
/// Number of sources, at most. A source takes 64 bytes of memory.
pub(super) const MOST_SOURCES: u32 = 65_536;

impl CrossSpec {
    /// Returns the cross-traffic of the words. The line of `rate` must send more than the cross packets need, because words give no limit to its queue.
    ///
    /// # Errors
    ///
    /// The first [`Contradiction`] of the cross packets with themselves or with the line.
    pub(super) fn traffic(&self, rate: Option<&RateSpec>) -> Result<CrossTraffic, Contradiction> {
        let line = rate.ok_or(Contradiction::CrossWithoutRate)?;
        let size = Bytes::new(self.size.map_or(USUAL_SIZE, |size| size.get().into()));
        // A rate beyond 64 bits per second is more than any line sends.
        let bits = |bytes: NonZeroU64| bytes.get().checked_mul(8).and_then(Rate::bits_per_sec).ok_or(Contradiction::CrossFillsLine);
        let traffic = match self.source {
            CrossSource::Poisson { bytes_per_sec } => CrossTraffic::poisson(Poisson { rate: bits(bytes_per_sec)?, size }),
            CrossSource::OnOff { sources, .. } if sources.get() > MOST_SOURCES => return Err(Contradiction::CrossSources),
            CrossSource::OnOff { sources, peak, on, off, shape } => {
                let shape = shape.unwrap_or(USUAL_SHAPE);
                CrossTraffic::on_off(OnOff { sources: sources.get(), peak: bits(peak)?, size, on, off, shape })
            }
        };
        let traffic = traffic.map_err(|error| match error {
            CrossTrafficError::Shape(_) => Contradiction::CrossShape,
            CrossTrafficError::NoSilence | CrossTrafficError::ShortBursts { .. } => Contradiction::CrossSpans,
            CrossTrafficError::TooDense | CrossTrafficError::NoBytes => Contradiction::CrossTooDense,
        })?;
        // A line that is itself refused has no load to compare with; `rate` is then blamed when the link is made.
        match super::exact::bottleneck(line) {
            Ok(bottleneck) if traffic.load(&bottleneck) >= 1.0 => Err(Contradiction::CrossFillsLine),
            Ok(_) | Err(_) => Ok(traffic),
        }
    }
}
