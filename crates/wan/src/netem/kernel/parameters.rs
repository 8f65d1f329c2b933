//! The numbers in the kernel, computed by `tc` from the words, and the reasons for the refusal of words.

use core::fmt;
use core::num::NonZeroU32;
use core::time::Duration;

use super::airtime::Airtime;
use crate::netem::{ChanceSpec, Contradiction, LossSpec, Netem, Percent, TableName};

/// The kernel's parameters of a netem, except for the loss model, the tables and the slots.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    pub(super) limit: u32,
    /// Mean delay \[ns\].
    pub(super) latency: i64,
    /// Jitter \[ns\].
    pub(super) jitter: i32,
    pub(super) ecn: bool,
    pub(super) duplicate: u32,
    pub(super) corrupt: u32,
    pub(super) reorder: u32,
    /// Distance of candidates for reordering; 0 if no packet is reordered.
    pub(super) gap: u32,
    pub(super) airtime: Option<Airtime>,
    pub(super) correlations: Correlations,
}

/// Correlations in 1/2³², except for the correlation of loss.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Correlations {
    pub(super) delay: u32,
    pub(super) duplicate: u32,
    pub(super) corrupt: u32,
    pub(super) reorder: u32,
}

const DEFAULT_LIMIT: u32 = 1000;

impl Parameters {
    pub(super) fn new(netem: &Netem) -> Result<Self, QdiscError> {
        let (latency, jitter) = match &netem.delay {
            None => (0, 0),
            Some(delay) => (through_ticks(delay.time)?, delay.jitter.as_ref().map_or(Ok(0), |jitter| through_ticks(jitter.time))?),
        };
        let probability = |chance: &Option<ChanceSpec>| chance.map_or(0, |chance| chance.percent.as_u32());
        let reorder = netem.reorder.map_or(0, |reorder| reorder.chance.percent.as_u32());
        let gap = netem.reorder.and_then(|reorder| reorder.gap).map_or(1, NonZeroU32::get);
        Ok(Self {
            limit: netem.limit.unwrap_or(DEFAULT_LIMIT),
            latency,
            jitter: sigma(jitter),
            ecn: netem.ecn,
            duplicate: probability(&netem.duplicate),
            corrupt: probability(&netem.corrupt),
            reorder,
            // Without a chance of reordering, no packet is a candidate, whatever the gap.
            gap: if reorder == 0 { 0 } else { gap },
            airtime: netem.rate.as_ref().map(Airtime::new),
            correlations: Correlations::new(netem),
        })
    }
}

impl Correlations {
    fn new(netem: &Netem) -> Self {
        let delay = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).and_then(|jitter| jitter.correlation);
        let of = |chance: Option<ChanceSpec>| chance.and_then(|chance| chance.correlation);
        let loss = match netem.loss {
            Some(LossSpec::Random(chance)) => chance.correlation,
            Some(LossSpec::State(_) | LossSpec::Gemodel(_)) | None => None,
        };
        let corrupt = of(netem.corrupt);
        let reorder = of(netem.reorder.map(|reorder| reorder.chance));
        // tc sends correlations if one of these four was given. A correlation of `duplicate` alone is not sent.
        let sent = [delay, loss, corrupt, reorder].into_iter().any(|correlation| correlation.is_some());
        let bits = |correlation: Option<Percent>| correlation.map_or(0, Percent::as_u32);
        Self { delay: bits(delay), duplicate: if sent { bits(of(netem.duplicate)) } else { 0 }, corrupt: bits(corrupt), reorder: bits(reorder) }
    }
}

/// Returns a time in nanoseconds, below 2⁶³ in a checked netem.
pub(super) fn nanos(span: Duration) -> i64 {
    i64::try_from(span.as_nanos()).unwrap_or(i64::MAX)
}

/// Returns a deviation in the kernel's 32 bits. Larger values count as the largest.
pub(super) fn sigma(nanos: i64) -> i32 {
    i32::try_from(nanos).unwrap_or(i32::MAX)
}

/// Returns a delay after the conversion by `tc` \[ns\]: whole microseconds t, then ⌊t·15.625⌋ ticks of 64 ns. Ticks must fit into 32 bits.
fn through_ticks(span: Duration) -> Result<i64, QdiscError> {
    let ticks = span.as_micros() * 125 / 8;
    match u32::try_from(ticks) {
        Ok(ticks) => Ok(i64::from(ticks) << 6),
        Err(_) => Err(QdiscError::DelayTooLong { delay: span }),
    }
}

/// Reason for the refusal of a netem as a qdisc.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum QdiscError {
    /// The options contradict each other.
    Contradiction(Contradiction),
    /// A distribution has no table.
    UnknownTable {
        /// Name of the distribution.
        name: TableName,
    },
    /// A delay beyond the 2³² ticks of 64 ns of `tc`.
    DelayTooLong {
        /// The delay or the jitter.
        delay: Duration,
    },
}

impl fmt::Display for QdiscError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradiction(error) => fmt::Display::fmt(error, f),
            Self::UnknownTable { name } => write!(
                f,
                "no table for the distribution \"{}\": expected uniform, normal, pareto, paretonormal or a table that was given",
                name.as_str()
            ),
            Self::DelayTooLong { delay } => {
                write!(f, "a delay of {}: expected less than 274.877907s, which is what 32 bits of ticks hold", cohaptic_units::print::Span(*delay))
            }
        }
    }
}

impl core::error::Error for QdiscError {}

impl From<Contradiction> for QdiscError {
    fn from(error: Contradiction) -> Self {
        Self::Contradiction(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(words: &str) -> Parameters {
        Parameters::new(&Netem::parse(words).unwrap()).unwrap()
    }

    /// Ticks recorded from the messages of tc of iproute2 6.1 to a kernel.
    #[test]
    fn delays_go_through_ticks_as_in_tc() {
        let recorded = [
            ("delay 1.9us", 15),
            ("delay 0.9us", 0),
            ("delay 5us", 78),
            ("delay 1ms", 15_625),
            ("delay 1e3us", 15_625),
            ("delay 10Secs", 156_250_000),
            ("delay 274s", 4_281_250_000),
            ("delay .5ms", 7_812),
            ("latency +5ms", 78_125),
        ];
        for (words, ticks) in recorded {
            assert_eq!(parameters(words).latency, ticks * 64, "{words}");
        }
        let too_long = Parameters::new(&Netem::parse("delay 275s").unwrap());
        assert!(matches!(too_long, Err(QdiscError::DelayTooLong { .. })));
    }

    #[test]
    fn jitter_ends_where_its_type_does() {
        assert_eq!(parameters("delay 5s 3s").jitter, i32::MAX);
        assert_eq!(parameters("delay 5s 2s").jitter, 2_000_000_000);
    }

    /// Recorded from tc of iproute2 6.1.
    #[test]
    fn the_correlation_of_duplicate_needs_company() {
        assert_eq!(parameters("duplicate 1% 5%").correlations.duplicate, 0);
        for company in ["delay 1ms 1ms 1%", "corrupt 1% 1%", "delay 1ms reorder 1% 1%", "loss 5% 0%"] {
            let words = format!("duplicate 1% 5% {company}");
            assert_eq!(parameters(&words).correlations.duplicate, 0x0ccc_cccd, "{words}");
        }
    }

    #[test]
    fn reorder_without_gap_means_every_packet() {
        assert_eq!(parameters("delay 1ms reorder 10%").gap, 1);
        assert_eq!(parameters("delay 1ms reorder 10% gap 5").gap, 5);
        assert_eq!(parameters("delay 1ms reorder 0%").gap, 0);
    }
}
