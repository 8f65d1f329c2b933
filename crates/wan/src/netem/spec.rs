//! The options of `tc-netem`, typed.

use alloc::string::String;
use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use super::{CrossSpec, Percent};

/// The options of one netem, as written. A missing option is `None`.
///
/// [`Netem::parse`] makes only values valid for [`Netem::check`]. Check a value from another source.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Netem {
    /// `limit`: number of packets held at most, packets in propagation included. The kernel's default is 1000.
    pub limit: Option<u32>,
    /// `delay`, and the `distribution` of its jitter.
    pub delay: Option<DelaySpec>,
    /// `loss`: the model of loss.
    pub loss: Option<LossSpec>,
    /// `ecn`: marks ECN-capable packets instead of losing these packets.
    pub ecn: bool,
    /// `corrupt`: flips one bit of a packet.
    pub corrupt: Option<ChanceSpec>,
    /// `duplicate`: sends a packet twice.
    pub duplicate: Option<ChanceSpec>,
    /// `reorder` and its `gap`: sends a packet at once, before the waiting packets.
    pub reorder: Option<ReorderSpec>,
    /// `rate`: the rate of the transmitter, and the framing of packets.
    pub rate: Option<RateSpec>,
    /// `cross`: packets of other senders that share the line of `rate`. Unknown to `tc` and to the kernel.
    pub cross: Option<CrossSpec>,
    /// `slot`: lets packets leave in bunches.
    pub slot: Option<SlotSpec>,
    /// `seed`: the seed of the kernel's generator.
    pub seed: Option<u64>,
}

/// `delay TIME [JITTER …]`.
#[derive(Clone, PartialEq, Debug)]
pub struct DelaySpec {
    /// Mean delay, to the nearest nanosecond.
    pub time: Duration,
    /// Variation around the mean delay.
    pub jitter: Option<JitterSpec>,
}

/// `JITTER [CORRELATION]`, and `distribution NAME`.
#[derive(Clone, PartialEq, Debug)]
pub struct JitterSpec {
    /// Half the width of a uniform distribution, or the standard deviation of any further distribution.
    pub time: Duration,
    /// Correlation of a packet's delay with the delay of the packet before.
    pub correlation: Option<Percent>,
    /// Law of the jitter; `None` is uniform.
    pub distribution: Option<Distribution>,
}

/// The law of jitter or of the gaps between slots.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Distribution {
    /// `uniform`: the law without a name. The manual lists the name, but `tc` finds no file.
    Uniform,
    /// `normal`.
    Normal,
    /// `pareto`: 1/u^(1/3), centred and scaled.
    Pareto,
    /// `paretonormal`: a quarter of normal and three quarters of Pareto.
    ParetoNormal,
    /// Any other name: the name of a file `NAME.dist`.
    Table(TableName),
}

impl Distribution {
    /// Returns the distribution of this name, or `None` if the name is not a single word.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "uniform" => Self::Uniform,
            "normal" => Self::Normal,
            "pareto" => Self::Pareto,
            "paretonormal" => Self::ParetoNormal,
            other => Self::Table(TableName::new(other)?),
        })
    }

    /// Returns the name of the distribution.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Uniform => "uniform",
            Self::Normal => "normal",
            Self::Pareto => "pareto",
            Self::ParetoNormal => "paretonormal",
            Self::Table(name) => name.as_str(),
        }
    }
}

/// The name of a distribution from a file: one word, and not the name of a built-in distribution.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct TableName(String);

impl TableName {
    /// Checks a name. Returns `None` if the name is empty, contains white space, or is the name of a built-in distribution.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        let built_in = ["uniform", "normal", "pareto", "paretonormal"].contains(&name);
        let one_word = !name.is_empty() && !name.contains(char::is_whitespace);
        (one_word && !built_in).then(|| Self(name.into()))
    }

    /// Returns the name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// `PERCENT [CORRELATION]`: the share of packets, and the correlation of neighbouring packets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChanceSpec {
    /// Share of affected packets.
    pub percent: Percent,
    /// Requested correlation of neighbouring packets.
    pub correlation: Option<Percent>,
}

/// The models of `loss`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LossSpec {
    /// `loss [random] PERCENT [CORRELATION]`.
    Random(ChanceSpec),
    /// `loss state P13 [P31 [P32 [P23 [P14]]]]`.
    State(StateSpec),
    /// `loss gemodel P [R [1-H [1-K]]]`.
    Gemodel(GemodelSpec),
}

/// The four-state chain of Salsano, Ludovici & Ordine (2009): 1 received in a gap, 2 received in a burst, 3 lost in a burst, 4 lost alone.
///
/// Each probability can be given only if all probabilities before it are given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StateSpec {
    /// From state 1 to state 3: from a gap into a burst.
    pub p13: Percent,
    /// From state 3 to state 1: from a loss in a burst into a gap. Default: 1 − p13.
    pub p31: Option<Percent>,
    /// From state 3 to state 2: from a loss in a burst to a reception in the burst. Default: 0.
    pub p32: Option<Percent>,
    /// From state 2 to state 3: from a reception in a burst to a loss in the burst. Default: 1.
    pub p23: Option<Percent>,
    /// From state 1 to state 4: from a gap to a single loss. Default: 0.
    pub p14: Option<Percent>,
}

impl StateSpec {
    /// Returns \[p13, p31, p32, p23, p14\] as fractions, with defaults for missing probabilities.
    #[must_use]
    pub(crate) fn probabilities(&self) -> [f64; 5] {
        let or = |said: Option<Percent>, default: f64| said.map_or(default, Percent::fraction);
        let p13 = self.p13.fraction();
        [p13, or(self.p31, 1.0 - p13), or(self.p32, 0.0), or(self.p23, 1.0), or(self.p14, 0.0)]
    }
}

/// The chain of Gilbert and Elliott. Each probability can be given only if all probabilities before it are given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GemodelSpec {
    /// Probability of the change from the good to the bad state, per packet.
    pub p: Percent,
    /// Probability of the change from the bad to the good state, per packet. Default: 1 − p.
    pub r: Option<Percent>,
    /// Share of packets lost in the bad state, 1 − h. Default: 1.
    pub loss_in_bad: Option<Percent>,
    /// Share of packets lost in the good state, 1 − k. Default: 0.
    pub loss_in_good: Option<Percent>,
}

impl GemodelSpec {
    /// Returns \[p, r, 1 − h, 1 − k\] as fractions, with defaults for missing probabilities.
    #[must_use]
    pub(crate) fn probabilities(&self) -> [f64; 4] {
        let or = |said: Option<Percent>, default: f64| said.map_or(default, Percent::fraction);
        let p = self.p.fraction();
        [p, or(self.r, 1.0 - p), or(self.loss_in_bad, 1.0), or(self.loss_in_good, 0.0)]
    }
}

/// `reorder PERCENT [CORRELATION] [gap DISTANCE]`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ReorderSpec {
    /// Share of the candidate packets sent at once.
    pub chance: ChanceSpec,
    /// Distance of candidate packets: with gap n, at least n − 1 packets are delayed before the next candidate. Default: 1, every packet is a candidate.
    pub gap: Option<NonZeroU32>,
}

/// `rate RATE [PACKETOVERHEAD [CELLSIZE [CELLOVERHEAD]]]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RateSpec {
    /// Rate \[bytes/s\], rounded down as in `tc`.
    pub bytes_per_sec: NonZeroU64,
    /// Bytes added to a packet's length.
    pub framing: Option<FramingSpec>,
}

/// `PACKETOVERHEAD [CELLSIZE [CELLOVERHEAD]]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FramingSpec {
    /// Bytes added to the length of each packet; may be negative.
    pub overhead: i32,
    /// Cells of a packet; `None` for whole packets.
    pub cell: Option<CellSpec>,
}

/// `CELLSIZE [CELLOVERHEAD]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellSpec {
    /// Payload of a cell \[bytes\]. The last cell of a packet is padded.
    pub size: NonZeroU32,
    /// Bytes of a cell besides the payload \[bytes\]. Default: 0.
    pub overhead: Option<i32>,
}

/// `slot { MIN [MAX] | distribution NAME DELAY JITTER } [packets N] [bytes N]`.
#[derive(Clone, PartialEq, Debug)]
pub struct SlotSpec {
    /// Time from slot to slot.
    pub gap: SlotGap,
    /// Number of packets for a slot, at most. Default: no limit.
    pub packets: Option<NonZeroU32>,
    /// Number of bytes for a slot. The packet with the last byte still leaves. Default: no limit.
    pub bytes: Option<NonZeroU32>,
}

/// The time from slot to slot.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SlotGap {
    /// `MIN [MAX]`: uniform between the two times.
    Range {
        /// Shortest time.
        min: Duration,
        /// Longest time; `None` if equal to the shortest.
        max: Option<Duration>,
    },
    /// `distribution NAME DELAY JITTER`.
    Drawn {
        /// Law of the times.
        distribution: Distribution,
        /// Mean of the times.
        delay: Duration,
        /// Standard deviation of the times, above zero (half the width if the law is uniform).
        jitter: Duration,
    },
}
