//! Contradictions between options.

use core::fmt;
use core::time::Duration;

use super::{DelaySpec, GemodelSpec, LossSpec, Netem, Percent, SlotGap, SlotSpec, StateSpec};

/// A contradiction between two options, an option without a required second option, or a value out of range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Contradiction {
    /// `reorder` without a delay: no waiting packet can be overtaken.
    ReorderWithoutDelay,
    /// `gap` without `reorder`: the gap chooses the candidates of `reorder`.
    GapWithoutReorder,
    /// `ecn` without a loss: the marks stand in place of losses.
    EcnWithoutLoss,
    /// `distribution` without a jitter: the distribution is the law of the jitter.
    DistributionWithoutJitter,
    /// p13 + p14 of the four-state chain is above 1.
    WaysOutOfState1,
    /// p31 + p32 of the four-state chain is above 1.
    WaysOutOfState3,
    /// A probability of a loss model was given without all probabilities before it.
    ProbabilitySkipped,
    /// The longest gap between slots is shorter than the shortest.
    SlotRange,
    /// A slot distribution has no deviation.
    SlotWithoutJitter,
    /// A count of packets or bytes per slot does not fit into the kernel's signed 32 bits.
    SlotTooLarge,
    /// A time does not fit into the kernel's signed 64 bits of nanoseconds.
    TimeTooLong,
    /// `cross` without `rate`: the packets of other senders have no line to share.
    CrossWithoutRate,
    /// The packets of `cross` alone need the whole line, and the queue would grow for ever.
    CrossFillsLine,
    /// More than one packet of `cross` per nanosecond, the resolution of instants.
    CrossTooDense,
    /// A mean span of sending of `cross` below the time of one packet at the peak rate, or no silence.
    CrossSpans,
    /// A shape of `cross` that is not between 1 and 2.
    CrossShape,
    /// Too many sources of `cross`.
    CrossSources,
    /// `cross` for the kernel's netem, which has no such option.
    CrossInKernel,
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReorderWithoutDelay => f.write_str("reorder sends packets before those that wait: expected a delay above zero too"),
            Self::GapWithoutReorder => f.write_str("gap says which packets are reordered: expected reorder above 0 % too"),
            Self::EcnWithoutLoss => f.write_str("ecn marks packets that would be lost: expected a loss above 0 % too"),
            Self::DistributionWithoutJitter => f.write_str("a distribution is that of the jitter: expected delay TIME JITTER, both above zero, too"),
            Self::WaysOutOfState1 => f.write_str("p13 and p14 are the ways out of state 1: expected a sum of at most 100 %"),
            Self::WaysOutOfState3 => f.write_str("p31 and p32 are the ways out of state 3: expected a sum of at most 100 %"),
            Self::ProbabilitySkipped => f.write_str("a loss model's probabilities can only be said in order: expected those before it too"),
            Self::SlotRange => f.write_str("the longest gap between slots is shorter than the shortest: expected at least the shortest"),
            Self::SlotWithoutJitter => f.write_str("a slot distribution without deviation: expected a jitter above zero"),
            Self::SlotTooLarge => f.write_str("expected at most 2147483647 packets and bytes in a slot"),
            Self::TimeTooLong => f.write_str("expected times below 292 years"),
            Self::CrossWithoutRate => f.write_str("cross packets share a line: expected rate too"),
            Self::CrossFillsLine => {
                f.write_str("cross packets alone need the whole line, and its queue would grow for ever: expected fewer of them, or a higher rate")
            }
            Self::CrossTooDense => f.write_str("more than one cross packet per nanosecond: expected a lower rate or a larger size"),
            Self::CrossSpans => {
                f.write_str("expected a mean span of sending of at least one packet at the peak rate, and a mean span of silence above zero")
            }
            Self::CrossShape => f.write_str("expected a shape above 1 (below, spans have no mean) and below 2 (above, no long memory)"),
            Self::CrossSources => write!(f, "expected at most {} sources of cross packets", super::cross::MOST_SOURCES),
            Self::CrossInKernel => f.write_str("cross is no option of the kernel's netem: expected the profile exact, or no cross"),
        }
    }
}

impl core::error::Error for Contradiction {}

impl Contradiction {
    /// Returns the name of the option to change.
    #[must_use]
    pub(crate) const fn option(self) -> &'static str {
        match self {
            Self::ReorderWithoutDelay => "reorder",
            Self::GapWithoutReorder => "gap",
            Self::EcnWithoutLoss => "ecn",
            Self::DistributionWithoutJitter => "distribution",
            Self::WaysOutOfState1 | Self::WaysOutOfState3 | Self::ProbabilitySkipped => "loss",
            Self::SlotRange | Self::SlotWithoutJitter | Self::SlotTooLarge => "slot",
            Self::TimeTooLong => "delay",
            Self::CrossWithoutRate
            | Self::CrossFillsLine
            | Self::CrossTooDense
            | Self::CrossSpans
            | Self::CrossShape
            | Self::CrossSources
            | Self::CrossInKernel => "cross",
        }
    }
}

/// Tolerance for sums of probabilities: decimal percentages with the sum 100 may be larger after rounding to binary.
const SLACK: f64 = 1e-9;

impl Netem {
    /// Checks for contradictions between options. Every value of [`Netem::parse`] passes.
    ///
    /// # Errors
    ///
    /// The first [`Contradiction`] in the order of the checks: delay, loss, `ecn`, `reorder`, `cross`, `slot`.
    pub fn check(&self) -> Result<(), Contradiction> {
        self.delay.as_ref().map_or(Ok(()), check_delay)?;
        match &self.loss {
            None | Some(LossSpec::Random(_)) => {}
            Some(LossSpec::State(state)) => check_state(state)?,
            Some(LossSpec::Gemodel(model)) => check_gemodel(model)?,
        }
        if self.ecn && !self.can_lose() {
            return Err(Contradiction::EcnWithoutLoss);
        }
        self.check_reorder()?;
        if let Some(cross) = &self.cross {
            cross.traffic(self.rate.as_ref())?;
        }
        self.slot.as_ref().map_or(Ok(()), check_slot)
    }

    /// Returns whether `tc` sees a loss: the chains count as a loss whatever their probabilities.
    fn can_lose(&self) -> bool {
        match &self.loss {
            None => false,
            Some(LossSpec::Random(chance)) => chance.percent.as_u32() > 0,
            Some(LossSpec::State(_) | LossSpec::Gemodel(_)) => true,
        }
    }

    fn check_reorder(&self) -> Result<(), Contradiction> {
        let Some(reorder) = &self.reorder else { return Ok(()) };
        let delayed = self.delay.as_ref().is_some_and(|delay| !delay.time.is_zero());
        // A reorder of 0 % switches reordering off, and then needs no delay.
        if reorder.chance.percent.as_u32() == 0 {
            return if reorder.gap.is_some() { Err(Contradiction::GapWithoutReorder) } else { Ok(()) };
        }
        if delayed { Ok(()) } else { Err(Contradiction::ReorderWithoutDelay) }
    }
}

fn check_time(time: Duration) -> Result<(), Contradiction> {
    if i64::try_from(time.as_nanos()).is_ok() { Ok(()) } else { Err(Contradiction::TimeTooLong) }
}

fn check_delay(delay: &DelaySpec) -> Result<(), Contradiction> {
    check_time(delay.time)?;
    let Some(jitter) = &delay.jitter else { return Ok(()) };
    check_time(jitter.time)?;
    if jitter.distribution.is_some() && (delay.time.is_zero() || jitter.time.is_zero()) {
        return Err(Contradiction::DistributionWithoutJitter);
    }
    Ok(())
}

fn check_state(state: &StateSpec) -> Result<(), Contradiction> {
    check_order(&[state.p31, state.p32, state.p23, state.p14])?;
    // p23 is the only way out of state 2 and needs no sum.
    let [p13, p31, p32, _, p14] = state.probabilities();
    if p13 + p14 > 1.0 + SLACK {
        return Err(Contradiction::WaysOutOfState1);
    }
    if p31 + p32 > 1.0 + SLACK { Err(Contradiction::WaysOutOfState3) } else { Ok(()) }
}

fn check_gemodel(model: &GemodelSpec) -> Result<(), Contradiction> {
    check_order(&[model.r, model.loss_in_bad, model.loss_in_good])
}

fn check_order(said: &[Option<Percent>]) -> Result<(), Contradiction> {
    // A given probability after a missing probability has no words in `tc`.
    let in_order = said.windows(2).all(|pair| pair[0].is_some() || pair[1].is_none());
    if in_order { Ok(()) } else { Err(Contradiction::ProbabilitySkipped) }
}

fn check_slot(slot: &SlotSpec) -> Result<(), Contradiction> {
    match &slot.gap {
        SlotGap::Range { min, max } => {
            check_time(*min)?;
            if let Some(max) = max {
                check_time(*max)?;
                if max < min {
                    return Err(Contradiction::SlotRange);
                }
            }
        }
        SlotGap::Drawn { delay, jitter, .. } => {
            check_time(*delay)?;
            check_time(*jitter)?;
            if jitter.is_zero() {
                return Err(Contradiction::SlotWithoutJitter);
            }
        }
    }
    // The kernel holds both budgets of a slot in signed 32 bits.
    let countable = [slot.packets, slot.bytes].into_iter().flatten().all(|count| i32::try_from(count.get()).is_ok());
    if countable { Ok(()) } else { Err(Contradiction::SlotTooLarge) }
}
