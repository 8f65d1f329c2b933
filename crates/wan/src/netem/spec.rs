//! What the words of `tc-netem` say, typed.

use alloc::string::String;
use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use super::Percent;

/// The options of one netem, as they were said: what was not said is `None`.
///
/// [`Netem::parse`] makes only values that pass [`Netem::check`]; one made by hand should be checked.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Netem {
    /// `limit`: how many packets are held at most, those under way included. The kernel's default is 1000.
    pub limit: Option<u32>,
    /// `delay`, and the `distribution` of its jitter.
    pub delay: Option<DelaySpec>,
    /// `loss`.
    pub loss: Option<LossSpec>,
    /// `ecn`: packets that can carry a congestion mark are marked where they would be lost.
    pub ecn: bool,
    /// `corrupt`: one bit of the packet is flipped.
    pub corrupt: Option<ChanceSpec>,
    /// `duplicate`: the packet is sent twice.
    pub duplicate: Option<ChanceSpec>,
    /// `reorder`, and its `gap`: the packet is sent at once, before those that wait.
    pub reorder: Option<ReorderSpec>,
    /// `rate`.
    pub rate: Option<RateSpec>,
    /// `slot`: packets are let go in bunches.
    pub slot: Option<SlotSpec>,
    /// `seed` of the kernel's generator.
    pub seed: Option<u64>,
}

/// `delay TIME [JITTER …]`.
#[derive(Clone, PartialEq, Debug)]
pub struct DelaySpec {
    /// The mean, to the nearest nanosecond.
    pub time: Duration,
    /// The variation around it.
    pub jitter: Option<JitterSpec>,
}

/// `JITTER [CORRELATION]`, and `distribution NAME`.
#[derive(Clone, PartialEq, Debug)]
pub struct JitterSpec {
    /// Half the width if the distribution is uniform, else the standard deviation.
    pub time: Duration,
    /// The correlation of one packet's delay with the one before.
    pub correlation: Option<Percent>,
    /// The law; `None` is uniform.
    pub distribution: Option<Distribution>,
}

/// The law of jitter or slots.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Distribution {
    /// `uniform`, which the manual lists and `tc` cannot find: the law that holds where none is named.
    Uniform,
    /// `normal`.
    Normal,
    /// `pareto`: 1/u^(1/3), centred and scaled.
    Pareto,
    /// `paretonormal`: a quarter of normal and three quarters of Pareto.
    ParetoNormal,
    /// Any other name: that of a file `NAME.dist`.
    Table(TableName),
}

impl Distribution {
    /// The distribution of that name; `None` if it is no single word.
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

    /// The name that names it.
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

/// The name of a distribution that is read from a file: one word, and none of the built-in names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct TableName(String);

impl TableName {
    /// Checks a name; `None` if it is empty, has white space in it, or is that of a built-in distribution.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        let built_in = ["uniform", "normal", "pareto", "paretonormal"].contains(&name);
        let one_word = !name.is_empty() && !name.contains(char::is_whitespace);
        (one_word && !built_in).then(|| Self(name.into()))
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// `PERCENT [CORRELATION]`: how often, and how much alike neighbours are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChanceSpec {
    /// How many packets are meant.
    pub percent: Percent,
    /// The correlation asked for.
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
/// Each can be said only if those before it are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StateSpec {
    /// From a gap into a burst.
    pub p13: Percent,
    /// From a burst's loss into a gap. Default: 1 − p13.
    pub p31: Option<Percent>,
    /// From a burst's loss to a reception in the burst. Default: 0.
    pub p32: Option<Percent>,
    /// From a reception in a burst to a loss in it. Default: 1.
    pub p23: Option<Percent>,
    /// From a gap to a loss alone. Default: 0.
    pub p14: Option<Percent>,
}

impl StateSpec {
    /// \[p13, p31, p32, p23, p14\] as fractions, with the defaults.
    #[must_use]
    pub fn probabilities(&self) -> [f64; 5] {
        let or = |said: Option<Percent>, default: f64| said.map_or(default, Percent::fraction);
        let p13 = self.p13.fraction();
        [p13, or(self.p31, 1.0 - p13), or(self.p32, 0.0), or(self.p23, 1.0), or(self.p14, 0.0)]
    }
}

/// The chain of Gilbert and Elliott. Each can be said only if those before it are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GemodelSpec {
    /// From good to bad.
    pub p: Percent,
    /// From bad to good. Default: 1 − p.
    pub r: Option<Percent>,
    /// 1 − h, the loss in the bad state. Default: 1.
    pub loss_in_bad: Option<Percent>,
    /// 1 − k, the loss in the good state. Default: 0.
    pub loss_in_good: Option<Percent>,
}

impl GemodelSpec {
    /// \[p, r, 1 − h, 1 − k\] as fractions, with the defaults.
    #[must_use]
    pub fn probabilities(&self) -> [f64; 4] {
        let or = |said: Option<Percent>, default: f64| said.map_or(default, Percent::fraction);
        let p = self.p.fraction();
        [p, or(self.r, 1.0 - p), or(self.loss_in_bad, 1.0), or(self.loss_in_good, 0.0)]
    }
}

/// `reorder PERCENT [CORRELATION] [gap DISTANCE]`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ReorderSpec {
    /// How often a packet whose turn it is goes at once.
    pub chance: ChanceSpec,
    /// Every how many packets it is one's turn. Default: 1, always.
    pub gap: Option<NonZeroU32>,
}

/// `rate RATE [PACKETOVERHEAD [CELLSIZE [CELLOVERHEAD]]]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RateSpec {
    /// The rate \[bytes/s\], rounded down as `tc` does.
    pub bytes_per_sec: NonZeroU64,
    /// The bytes added to a packet's length.
    pub framing: Option<FramingSpec>,
}

/// `PACKETOVERHEAD [CELLSIZE [CELLOVERHEAD]]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FramingSpec {
    /// Added to the length of a packet \[bytes\].
    pub overhead: i32,
    /// The cells into which packets are cut.
    pub cell: Option<CellSpec>,
}

/// `CELLSIZE [CELLOVERHEAD]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellSpec {
    /// What a cell carries \[bytes\]; the last one is filled up.
    pub size: NonZeroU32,
    /// What a cell has besides \[bytes\].
    pub overhead: Option<i32>,
}

/// `slot { MIN [MAX] | distribution NAME DELAY JITTER } [packets N] [bytes N]`.
#[derive(Clone, PartialEq, Debug)]
pub struct SlotSpec {
    /// From one slot to the next.
    pub gap: SlotGap,
    /// How many packets leave in one slot.
    pub packets: Option<NonZeroU32>,
    /// How many bytes leave in one slot: the packet that uses up the last one still does.
    pub bytes: Option<NonZeroU32>,
}

/// The time from one slot to the next.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SlotGap {
    /// `MIN [MAX]`: uniform between them.
    Range {
        /// The shortest.
        min: Duration,
        /// The longest; `None`: the shortest.
        max: Option<Duration>,
    },
    /// `distribution NAME DELAY JITTER`.
    Drawn {
        /// The law.
        distribution: Distribution,
        /// Its mean.
        delay: Duration,
        /// Its deviation, above zero.
        jitter: Duration,
    },
}
