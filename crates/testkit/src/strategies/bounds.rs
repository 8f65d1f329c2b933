//! Bounds on the impairments of links.

use core::ops::RangeInclusive;
use core::time::Duration;

use super::bounds_error::BoundsError;
use super::grid::Span;
use super::stage::Stage;
use super::units::{nanos, percent, units};

/// Bounds of links, stage by stage: whether the stage may be present, and the range of its number.
///
/// [`LinkBounds::any`] permits every stage, [`LinkBounds::ideal`] none. A range for a stage permits the stage; [`LinkBounds::always`] and [`LinkBounds::never`]
/// change this. A range that begins at zero begins at the least value with an effect instead: 1 µs, 0.01 %, one packet; a link without the stage stands for
/// zero. Percentages are counted in ten-thousandths, rates in whole bytes per second.
///
/// | stage | its number | where [`LinkBounds::any`] has it |
/// |---|---|---|
/// | delay | mean delay, that of jitter and reordering too | 1 ms to 500 ms |
/// | jitter | half the width if uniform, else the standard deviation; never above the mean | 1 ms to 100 ms |
/// | loss | packets lost in the long run, whatever the model | 0.1 % to 30 % |
/// | corrupt | packets with a flipped bit, which the receiver's checksum discards | 0.1 % to 10 % |
/// | duplicate | packets that come twice | 0.1 % to 20 % |
/// | reorder | packets that go at once | 1 % to 50 % |
/// | rate | \[bit/s\] | 64 kbit/s to 100 Mbit/s |
/// | limit | packets held at most | 2 to 1000 |
/// | slot | least time from one slot to the next | 1 ms to 50 ms |
///
/// The following words are never drawn: `ecn`, `seed`, the framing of a rate, bytes of a slot, tables from files, and correlated Pareto laws, which take long
/// to compute.
///
/// ```
/// use std::time::Duration;
/// use cohaptic_testkit::strategies::{LinkBounds, Stage, links_like};
///
/// let late_and_lossy = LinkBounds::ideal().delay(Duration::ZERO..=Duration::from_millis(100)).loss(1.0..=5.0).always(Stage::Loss);
/// let links = links_like(late_and_lossy);
/// # let _ = links;
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct LinkBounds {
    presence: [Presence; Stage::ALL.len()],
    spans: [Span; Stage::ALL.len()],
    pub(super) distributions: bool,
    pub(super) correlation: bool,
    pub(super) models: Vec<LossModel>,
    fault: Option<BoundsError>,
}

/// Presence of a stage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Presence {
    Never,
    Maybe,
    Always,
}

/// Model of loss.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[non_exhaustive]
pub enum LossModel {
    /// `loss PERCENT`.
    Random,
    /// `loss gemodel`.
    Gemodel,
    /// `loss state`.
    State,
}

/// One percent, in ten-thousandths of a percent.
const PERCENT: u64 = 10_000;
const MS: u64 = 1_000_000;

const fn span(low: u64, high: u64, step: u64) -> Span {
    Span { low, high, step }
}

/// Default range of each stage, in the order of [`Stage::ALL`].
const DEFAULTS: [Span; Stage::ALL.len()] = [
    span(2, 1000, 1),
    span(MS, 500 * MS, 1),
    span(MS, 100 * MS, 1),
    span(PERCENT / 10, 30 * PERCENT, 1),
    span(PERCENT / 10, 10 * PERCENT, 1),
    span(PERCENT / 10, 20 * PERCENT, 1),
    span(PERCENT, 50 * PERCENT, 1),
    span(64_000, 100_000_000, 1_000),
    span(MS, 50 * MS, 1),
];

impl LinkBounds {
    /// Creates bounds that permit every stage, with the ranges above, every distribution, correlation and model of loss.
    #[must_use]
    pub fn any() -> Self {
        Self { presence: [Presence::Maybe; Stage::ALL.len()], ..Self::ideal() }
    }

    /// Creates the bounds of a phone: a delay from 21.5 to 101.6 ms, half of the round trip, and a rate from 0.5 to 99 Mbit/s. These are the 5th and the 95th
    /// percentile of the speed tests in the data of ERRANT (Trevisan, Safari Khatouni and Giordano, *ERRANT: Realistic emulation of radio access networks*,
    /// Computer Networks 176, 2020), which come from phones of several operators on 3G and 4G. That both ways take half of the round trip is assumed.
    #[must_use]
    pub fn phone() -> Self {
        Self::ideal().delay(Duration::from_micros(21_500)..=Duration::from_micros(101_600)).rate(500_000..=99_000_000)
    }

    /// Creates bounds that permit no stage.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            presence: [Presence::Never; Stage::ALL.len()],
            spans: DEFAULTS,
            distributions: true,
            correlation: true,
            models: vec![LossModel::Random, LossModel::Gemodel, LossModel::State],
            fault: None,
        }
    }

    /// Sets the range of the mean delay, including the delay of jitter and reordering.
    #[must_use]
    pub fn delay(self, range: RangeInclusive<Duration>) -> Self {
        self.time(Stage::Delay, &range)
    }

    /// Sets the range of the jitter: half the width of a uniform law, otherwise the standard deviation.
    #[must_use]
    pub fn jitter(self, range: RangeInclusive<Duration>) -> Self {
        self.time(Stage::Jitter, &range)
    }

    /// Sets the range of the long-run loss \[%\]. Models with bursts keep the range to a hundredth of a percent.
    #[must_use]
    pub fn loss(self, range: RangeInclusive<f64>) -> Self {
        self.percent(Stage::Loss, &range)
    }

    /// Sets the range of the share of corrupted packets \[%\].
    #[must_use]
    pub fn corrupt(self, range: RangeInclusive<f64>) -> Self {
        self.percent(Stage::Corrupt, &range)
    }

    /// Sets the range of the share of duplicated packets \[%\].
    #[must_use]
    pub fn duplicate(self, range: RangeInclusive<f64>) -> Self {
        self.percent(Stage::Duplicate, &range)
    }

    /// Sets the range of the share of packets that overtake the delayed packets \[%\].
    #[must_use]
    pub fn reorder(self, range: RangeInclusive<f64>) -> Self {
        self.percent(Stage::Reorder, &range)
    }

    /// Sets the range of the rate \[bit/s\].
    #[must_use]
    pub fn rate(mut self, range: RangeInclusive<u64>) -> Self {
        const MOST: u64 = 1_000_000_000_000;
        for found in [*range.start(), *range.end()] {
            if !(8..=MOST).contains(&found) {
                return self.refuse(BoundsError::Rate { found });
            }
        }
        // A rate is rounded to whole bytes, and the result must stay within the range.
        let (low, high) = (range.start().next_multiple_of(8), range.end() - range.end() % 8);
        if low > high {
            let (low, high) = (format!("{}bit", range.start()), format!("{}bit", range.end()));
            return self.refuse(BoundsError::Empty { stage: Stage::Rate, low, high });
        }
        self.set(Stage::Rate, low, high);
        self
    }

    /// Sets the range of the limit: the maximum number of packets held, packets under way included.
    #[must_use]
    pub fn limit(mut self, range: RangeInclusive<u32>) -> Self {
        let (low, high) = (*range.start(), *range.end());
        if let Err(error) = check(Stage::Limit, low, high, |packets| packets.to_string()) {
            return self.refuse(error);
        }
        self.set(Stage::Limit, low.max(1).into(), high.into());
        self
    }

    /// Sets the range of the least time between two slots. The longest time is drawn up to twice the least time.
    #[must_use]
    pub fn slot(self, range: RangeInclusive<Duration>) -> Self {
        self.time(Stage::Slot, &range)
    }

    /// Sets whether jitter may have laws other than the uniform law.
    #[must_use]
    pub const fn distributions(mut self, may: bool) -> Self {
        self.distributions = may;
        self
    }

    /// Sets whether neighbouring packets may be correlated: in uniform and normal jitter, and in every stage with a probability.
    #[must_use]
    pub const fn correlation(mut self, may: bool) -> Self {
        self.correlation = may;
        self
    }

    /// Sets the permitted models of loss.
    #[must_use]
    pub fn loss_models(mut self, models: &[LossModel]) -> Self {
        self.models = models.to_vec();
        self
    }

    /// Makes the stage present in every link. Shrinking does not remove the stage.
    #[must_use]
    pub const fn always(mut self, stage: Stage) -> Self {
        self.presence[stage.place()] = Presence::Always;
        self
    }

    /// Permits the stage, with its present range.
    #[must_use]
    pub const fn maybe(mut self, stage: Stage) -> Self {
        self.presence[stage.place()] = Presence::Maybe;
        self
    }

    /// Forbids the stage. Jitter and reordering bring a delay even where a delay by itself is forbidden.
    #[must_use]
    pub const fn never(mut self, stage: Stage) -> Self {
        self.presence[stage.place()] = Presence::Never;
        self
    }

    /// Checks whether the bounds make sense. The strategies made from the bounds check as well.
    ///
    /// # Errors
    ///
    /// The first fault of the bounds.
    pub fn check(&self) -> Result<(), BoundsError> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        // Jitter must not exceed the mean delay. If even the least jitter exceeds the longest delay, no link can be drawn.
        let (jitter, delay) = (self.span(Stage::Jitter).low, self.span(Stage::Delay).high);
        if self.presence(Stage::Jitter) != Presence::Never && jitter > delay {
            return Err(BoundsError::JitterAboveDelay { jitter: Duration::from_nanos(jitter), delay: Duration::from_nanos(delay) });
        }
        let no_model = self.models.is_empty() && self.presence(Stage::Loss) != Presence::Never;
        if no_model { Err(BoundsError::NoModel) } else { Ok(()) }
    }

    pub(super) const fn presence(&self, stage: Stage) -> Presence {
        self.presence[stage.place()]
    }

    pub(super) const fn span(&self, stage: Stage) -> Span {
        self.spans[stage.place()]
    }

    fn refuse(mut self, error: BoundsError) -> Self {
        // The methods of the builder return no errors. The first fault is kept for `check`.
        self.fault = self.fault.or(Some(error));
        self
    }

    fn set(&mut self, stage: Stage, low: u64, high: u64) {
        let place = stage.place();
        (self.spans[place].low, self.spans[place].high) = (low, high);
        // A range permits the stage, and does not take back an earlier `always`.
        if self.presence[place] == Presence::Never {
            self.presence[place] = Presence::Maybe;
        }
    }

    fn time(mut self, stage: Stage, range: &RangeInclusive<Duration>) -> Self {
        const LONGEST: Duration = Duration::from_secs(3600);
        let (low, high) = (*range.start(), *range.end());
        if let Some(found) = [low, high].into_iter().find(|time| *time > LONGEST) {
            return self.refuse(BoundsError::TooLong { stage, found });
        }
        if let Err(error) = check(stage, low, high, |time| format!("{time:?}")) {
            return self.refuse(error);
        }
        // Zero has no effect, so the range begins at a microsecond instead. A range that ends earlier becomes its end.
        let low = if low.is_zero() { high.min(Duration::from_micros(1)) } else { low };
        self.set(stage, nanos(low), nanos(high));
        self
    }

    fn percent(mut self, stage: Stage, range: &RangeInclusive<f64>) -> Self {
        let (low, high) = (*range.start(), *range.end());
        if let Some(found) = [low, high].into_iter().find(|percent| !(0.0..=100.0).contains(percent)) {
            return self.refuse(BoundsError::Percentage { stage, found });
        }

        if let Err(error) = check(stage, units(low), units(high), |units| percent(units).to_string()) {
            return self.refuse(error);
        }
        // Zero has no effect, so the range begins at a hundredth of a percent instead. A range that ends earlier becomes its end.
        let least = if units(low) == 0 { units(high).min(PERCENT / 100) } else { units(low) };
        self.set(stage, least, units(high));
        self
    }
}

fn check<N: PartialOrd + Default + Copy>(stage: Stage, low: N, high: N, print: impl Fn(N) -> String) -> Result<(), BoundsError> {
    if low > high {
        return Err(BoundsError::Empty { stage, low: print(low), high: print(high) });
    }
    if high == N::default() { Err(BoundsError::OnlyZero { stage }) } else { Ok(()) }
}
