//! The link with exactly the behaviour of the words.
//!
//! Each option becomes the stage of the same name, in netem's order ([`Layout::Netem`]). No time is rounded to ticks, and no sum wraps around.
//! `docs/netem.md` gives the meaning word by word, and the kernel's behaviour beside it.

use alloc::sync::Arc;
use core::fmt;
use core::time::Duration;

use cohaptic_units::print::Span;
use cohaptic_units::{Probability, Rate};

use super::{ChanceSpec, Contradiction, DelaySpec, Distribution, GemodelSpec, JitterSpec, LossSpec, Netem, RateSpec, SlotGap, StateSpec, TableName};
use crate::laws::chance::{Chance, ChanceError};
use crate::laws::delay::DistTable;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::corruption::{Checksum, Corruption, Flips};
use crate::stages::delay::{Correlation, Delay, DelayError, Jitter};
use crate::stages::loss::{FourState, FourStateError, GilbertElliott, Loss};
use crate::stages::queue::{Bottleneck, Cells, Framing};
use crate::stages::reorder::{Displacement, Reorder};
use crate::stages::slots::Slots;

/// Reason for the refusal of words that `tc` accepts: an impossible link.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum ExactError {
    /// Contradicting options.
    Contradiction(Contradiction),
    /// A law with a smallest value below zero. netem sends a packet at once if its time lies in the past: another law with another mean.
    BelowZero {
        /// Name of the option.
        option: &'static str,
        /// Name of the law.
        law: &'static str,
        /// Mean of the law.
        mean: Duration,
        /// Jitter: half the width if the law is uniform, else the standard deviation.
        jitter: Duration,
        /// Largest jitter for a law without values below zero.
        largest: Duration,
    },
    /// A delay or a gap between slots, impossible for the law.
    Delay {
        /// Name of the option.
        option: &'static str,
        /// Why the delay is impossible.
        reason: DelayError,
    },
    /// A correlation, impossible for events of this probability.
    Chance {
        /// Name of the option.
        option: &'static str,
        /// Why the correlation is impossible.
        reason: ChanceError,
    },
    /// A four-state chain with impossible probabilities.
    State(FourStateError),
    /// A table unknown to the caller.
    NoTable(TableName),
    /// A rate too large for 64 bits of bits per second.
    Rate {
        /// Requested rate \[bytes/s\].
        bytes_per_sec: u64,
    },
    /// A negative cell overhead: a cell cannot be smaller in transmission than its payload.
    CellOverhead {
        /// Requested cell overhead \[bytes\].
        found: i32,
    },
}

impl fmt::Display for ExactError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradiction(error) => fmt::Display::fmt(error, f),
            Self::BelowZero { option, law, mean, jitter, largest } => write!(
                f,
                "{option}: {law} jitter of {} around {} begins below zero: expected a jitter of at most {}",
                Span(*jitter),
                Span(*mean),
                Span(*largest)
            ),
            Self::Delay { option, reason } => write!(f, "{option}: {reason}"),
            Self::Chance { option, reason } => write!(f, "{option}: {reason}"),
            Self::State(error) => write!(f, "loss state: {error}"),
            Self::NoTable(name) => write!(
                f,
                "distribution {0}: there is no such table: expected uniform, normal, pareto, paretonormal or a file {0}.dist",
                name.as_str()
            ),
            Self::Rate { bytes_per_sec } => {
                write!(f, "rate: {bytes_per_sec} bytes/s are more bits than can be counted: expected at most {} bytes/s", u64::MAX / 8)
            }
            Self::CellOverhead { found } => write!(f, "rate: a cell overhead of {found} bytes: expected zero or more"),
        }
    }
}

impl core::error::Error for ExactError {}

impl From<Contradiction> for ExactError {
    fn from(error: Contradiction) -> Self {
        Self::Contradiction(error)
    }
}

impl ExactError {
    /// Returns the name of the option to change.
    #[must_use]
    pub const fn option(&self) -> &'static str {
        match self {
            Self::Contradiction(contradiction) => contradiction.option(),
            Self::BelowZero { option, .. } | Self::Delay { option, .. } | Self::Chance { option, .. } => option,
            Self::State(_) => "loss",
            Self::NoTable(_) => "distribution",
            Self::Rate { .. } | Self::CellOverhead { .. } => "rate",
        }
    }
}

/// Function with the table of a distribution, or `None`.
type Tables<'a> = &'a mut dyn FnMut(&TableName) -> Option<Arc<DistTable>>;

impl Netem {
    /// Returns the link with the behaviour of the words. `tables` finds the distributions that are not built in.
    ///
    /// In contrast to the kernel, any number of packets is held without `limit`, and `seed` is ignored, because every link has separate random numbers.
    ///
    /// # Errors
    ///
    /// [`ExactError`] if the words describe an impossible link: a uniform or Pareto delay below zero, a correlation impossible for the law, or a missing table.
    pub fn to_link_config(&self, tables: &mut dyn FnMut(&TableName) -> Option<Arc<DistTable>>) -> Result<LinkConfig, ExactError> {
        self.check()?;
        let corrupted = self.corrupt.map_or_else(|| Ok(Chance::default()), |spec| chance("corrupt", spec))?;
        Ok(LinkConfig {
            loss: self.loss.as_ref().map_or(Ok(Loss::None), loss)?,
            marks_instead_of_loss: self.ecn,
            duplication: self.duplicate.map_or_else(|| Ok(Chance::default()), |spec| chance("duplicate", spec))?,
            // As in the kernel, checksums are complete before a bit flips, so receivers discard the packet.
            corruption: (!corrupted.is_never()).then_some(Corruption {
                bits: Flips::Bits { packets: corrupted, count: 1 },
                within: None,
                checksum: Checksum::Discards,
            }),
            limit: self.limit.map(u64::from),
            bottleneck: self.rate.as_ref().map(bottleneck).transpose()?,
            cross_traffic: self.cross.map(|cross| cross.traffic(self.rate.as_ref())).transpose()?,
            slots: self.slots(tables)?,
            reorder: self.reordering()?,
            delay: self.delay.as_ref().map_or_else(|| Ok(Delay::default()), |spec| delay(spec, tables))?,
            layout: Layout::Netem,
            ..LinkConfig::default()
        })
    }

    fn slots(&self, tables: Tables<'_>) -> Result<Option<Slots>, ExactError> {
        let Some(spec) = &self.slot else { return Ok(None) };
        let mut slots = match &spec.gap {
            SlotGap::Range { min, max } => {
                // A single time is a range of no width.
                let max = max.unwrap_or(*min);
                Slots::new(*min, max).map_err(|_| Contradiction::SlotRange)?
            }
            SlotGap::Drawn { distribution, delay, jitter } => {
                let spec = JitterSpec { time: *jitter, correlation: None, distribution: Some(distribution.clone()) };
                Slots::drawn(with_jitter("slot", *delay, &spec, tables)?)
            }
        };
        slots.packets = spec.packets.map(Into::into);
        slots.bytes = spec.bytes.map(Into::into);
        Ok(Some(slots))
    }

    fn reordering(&self) -> Result<Option<Reorder>, ExactError> {
        let Some(spec) = &self.reorder else { return Ok(None) };
        let packets = chance("reorder", spec.chance)?;
        // Without a gap, every packet may jump.
        let gap = spec.gap.unwrap_or(core::num::NonZeroU32::MIN);
        Ok((!packets.is_never()).then_some(Reorder { packets, how: Displacement::Jump { gap } }))
    }
}

fn chance(option: &'static str, spec: ChanceSpec) -> Result<Chance, ExactError> {
    let correlation = spec.correlation.map_or(0.0, super::Percent::fraction);
    Chance::correlated(spec.percent.probability(), correlation).map_err(|reason| ExactError::Chance { option, reason })
}

fn loss(spec: &LossSpec) -> Result<Loss, ExactError> {
    Ok(match spec {
        LossSpec::Random(spec) => {
            let chance = chance("loss", *spec)?;
            match chance.correlation() {
                // Without correlation the cheaper model has the same law.
                _ if chance.is_never() => Loss::None,
                0.0 => Loss::Independent(chance.probability()),
                _ => Loss::Correlated(chance),
            }
        }
        LossSpec::State(spec) => Loss::FourState(four_state(spec)?),
        LossSpec::Gemodel(spec) => Loss::GilbertElliott(gilbert_elliott(spec)),
    })
}

fn four_state(spec: &StateSpec) -> Result<FourState, ExactError> {
    let [p13, p31, p32, p23, p14] = spec.probabilities();
    // Percentages whose sum is 100 may sum to slightly more in binary. The excess is cut off.
    let [p32, p14] = [p32.min(1.0 - p31), p14.min(1.0 - p13)];
    let [p13, p31, p32, p23, p14] = [p13, p31, p32, p23, p14].map(probability);
    FourState::new(p13, p31, p32, p23, p14).map_err(ExactError::State)
}

fn gilbert_elliott(spec: &GemodelSpec) -> GilbertElliott {
    let [p, r, loss_in_bad, loss_in_good] = spec.probabilities();
    // The words give the fractions lost, the model takes the fractions received.
    let [p, r, h, k] = [p, r, 1.0 - loss_in_bad, 1.0 - loss_in_good].map(probability);
    GilbertElliott { p, r, h, k }
}

fn delay(spec: &DelaySpec, tables: Tables<'_>) -> Result<Delay, ExactError> {
    match &spec.jitter {
        // `tc` accepts a jitter of zero: a constant delay.
        Some(jitter) if !jitter.time.is_zero() => with_jitter("delay", spec.time, jitter, tables),
        _ => Ok(Delay::constant(spec.time)),
    }
}

fn with_jitter(option: &'static str, mean: Duration, spec: &JitterSpec, tables: Tables<'_>) -> Result<Delay, ExactError> {
    let (distribution, sd) = match &spec.distribution {
        // The words give half the width of a uniform law, and all further laws have the deviation.
        None | Some(Distribution::Uniform) => (crate::laws::delay::Distribution::Uniform, deviation_of_half_width(spec.time)),
        Some(Distribution::Normal) => (crate::laws::delay::Distribution::Normal, spec.time),
        Some(Distribution::Pareto) => (crate::laws::delay::Distribution::Pareto, spec.time),
        Some(Distribution::ParetoNormal) => (crate::laws::delay::Distribution::ParetoNormal, spec.time),
        Some(Distribution::Table(name)) => {
            let table = tables(name).ok_or_else(|| ExactError::NoTable(name.clone()))?;
            (crate::laws::delay::Distribution::Table(table), spec.time)
        }
    };
    let correlation = spec.correlation.map_or(Correlation::None, |percent| Correlation::PerPacket(percent.fraction()));
    let jitter = Jitter { correlation, ..Jitter::new(sd, distribution) };
    Delay::with_jitter(mean, jitter).map_err(|reason| match reason {
        DelayError::ReachesBelowFloor { law, largest, .. } => {
            // In the unit of the words: for a uniform law half its width, at most the mean.
            let largest = if matches!(spec.distribution, None | Some(Distribution::Uniform)) { mean } else { largest };
            ExactError::BelowZero { option, law, mean, jitter: spec.time, largest }
        }
        DelayError::FloorAboveMean { .. } | DelayError::Correlation { .. } | DelayError::NoTime | DelayError::Share(_) | DelayError::TooLong => {
            ExactError::Delay { option, reason }
        }
    })
}

/// Returns the standard deviation of a uniform law, 1/√3 of the half-width, rounded down to a nanosecond. Rounding down keeps a law with its begin exactly at
/// zero valid.
fn deviation_of_half_width(half_width: Duration) -> Duration {
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a jitter is below 292 years; not negative"
    )]
    let nanos = (half_width.as_nanos() as f64 / libm::sqrt(3.0)) as u64;
    Duration::from_nanos(nanos)
}

pub(super) fn bottleneck(spec: &RateSpec) -> Result<Bottleneck, ExactError> {
    let bytes_per_sec = spec.bytes_per_sec.get();
    // `tc` counts bytes per second, and the model bits.
    let rate = bytes_per_sec.checked_mul(8).and_then(Rate::bits_per_sec).ok_or(ExactError::Rate { bytes_per_sec })?;
    let mut framing = Framing::default();
    if let Some(spec) = &spec.framing {
        framing.overhead = spec.overhead;
        if let Some(cell) = &spec.cell {
            let overhead = cell.overhead.unwrap_or(0);
            let overhead = u32::try_from(overhead).map_err(|_| ExactError::CellOverhead { found: overhead })?;
            framing.cells = Some(Cells { payload: cell.size, overhead });
        }
    }
    Ok(Bottleneck { framing, ..Bottleneck::at_rate(rate) })
}

/// Returns a fraction computed from percentages as a probability. Rounding errors outside of 0..=1 are cut off.
fn probability(value: f64) -> Probability {
    Probability::new(value.clamp(0.0, 1.0)).unwrap_or_default()
}
