//! Coordination laws, in any [`Number`].

use core::time::Duration;

use cohaptic_units::parse;

use crate::{Gains, Motion, Number};

/// What a law is told at a tick, along one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation<N = f64> {
    /// The peer's own copy of the object.
    pub own: Motion<N>,
    /// The peer's own copy [`Law::lag`] ticks ago; before the first tick it was as at the first. The same as `own` for a law that does not look back.
    pub past: Motion<N>,
    /// The mean of the newest samples held from the other peers.
    pub mean: Motion<N>,
    /// By how much those samples have moved on since they were sent, on average: the mean of min(age, [`Law::horizon`])·velocity \[m\]. Zero for a law that
    /// has no horizon.
    pub lead: N,
}

/// A coordination law: the force that holds the copies of the shared object together, as a function of what a peer knows. Each axis is by itself.
///
/// A law must be deterministic: the answer depends on the observation and the memory alone. It knows the other peers by their mean, so peers with equal
/// parameters may be analysed as one class.
pub trait Law<N: Number> {
    /// How many numbers the law remembers from tick to tick, along each axis.
    fn memory(&self) -> usize {
        0
    }

    /// L, how many ticks old the own state is that the law takes as [`Observation::past`]; 0 for a law that does not look back. A law that does has no
    /// [`Law::memory`] beside it.
    fn lag(&self) -> usize {
        0
    }

    /// β [N·s/m]: by how much the law damps the peer's own copy. It is part of the body, bO + β, so it acts between ticks too, and [`Law::force`] leaves it out.
    fn damping(&self) -> f64 {
        0.0
    }

    /// Up to which age \[s\] samples are extrapolated; `None` for a law that takes them as they are.
    fn horizon(&self) -> Option<f64> {
        None
    }

    /// The coordination force FT of a tick \[N\]; equation (8) subtracts it. `memory` has [`Law::memory`] numbers: those that the law left at the tick
    /// before, zeros at the first.
    fn force(&self, seen: &Observation<N>, memory: &mut [N]) -> N;

    /// The desired motion of the copy (xd, vd), for the record.
    #[inline(always)]
    fn target(&self, seen: &Observation<N>) -> Motion<N> {
        seen.mean
    }
}

/// The coefficients of a law, in any type: of one peer, of eight lanes, of a linear form.
pub trait Coefficients {
    /// The type of a coefficient.
    type Coefficient;
    /// The law with coefficients of another type.
    type Of<D: Copy>;

    /// The law with each coefficient replaced by what `coefficient` makes of it, always in one order.
    fn map<D: Copy>(&self, coefficient: impl FnMut(&Self::Coefficient) -> D) -> Self::Of<D>;
}

/// Something that is done with a law, whichever of the registry it is. The compiler makes code for each law, so that a loop within does not choose
/// between laws at every turn.
pub trait LawVisitor<C> {
    /// What comes out.
    type Output;

    /// Does it.
    fn visit<L: Coefficients<Coefficient = C, Of<f64>: Law<f64>>>(self, law: &L) -> Self::Output;
}

/// What the registry knows of a law.
pub(super) trait LawKind {
    /// How it pulls towards the others.
    const PULL: Pull = Pull::Mean;
    /// Which gains it uses.
    const GAINS: UsedGains = UsedGains::Both;
    /// The parameters that it alone has.
    const PARAMETERS: &[LawParameter] = &[];

    /// The law with these parameters.
    fn new(parameters: &LawParameters) -> Self;
}

/// What the coefficients of a law are computed from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawParameters {
    /// KT and BT.
    pub gains: Gains,
    /// How many peers there are.
    pub peers: usize,
    /// The period of the peer's tick, Tc.
    pub tick: Duration,
    /// How many ticks old a sample in use is at most, where the links bound it; for parameters that are [`LawValue::Automatic`].
    pub oldest: Option<u64>,
    /// How many ticks old samples are in the middle of their use, where the links give all one such age; for parameters that are [`LawValue::Automatic`].
    pub middle: Option<u64>,
    /// The parameters that this law alone has.
    pub own: LawValues,
}

/// How a law pulls towards the others.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pull {
    /// Towards their mean: as strongly however many there are.
    Mean,
    /// Towards each of them: the more there are, the more strongly.
    Sum,
}

/// Which of the gains KT and BT a law uses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UsedGains {
    /// Both.
    Both,
    /// KT alone.
    Stiffness,
    /// None of them.
    Neither,
}

/// A parameter that one law alone has: a key of the table `[coordination.NAME]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LawParameter {
    /// The key.
    pub key: &'static str,
    /// What values it has.
    pub form: LawForm,
    /// The value without the key, as TOML writes it.
    pub default: &'static str,
    /// What it means, without the last full stop.
    pub about: &'static str,
    /// Whether the timeline of a scene may change it; a parameter that only says how a run begins, or what its samples mean, cannot change.
    pub can_change: bool,
}

/// What values a parameter of a law has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LawForm {
    /// A duration.
    Duration,
    /// `"auto"`, or a duration.
    AutomaticDuration,
    /// `"auto"`, or a damping of at least zero [N·s/m].
    AutomaticDamping,
    /// A damping of at least zero [N·s/m].
    Damping,
    /// An impedance above zero [N·s/m].
    Impedance,
    /// An energy of at least zero \[J\].
    Energy,
    /// One of these words, with what they mean.
    Words(&'static [(&'static str, &'static str)]),
    /// The name of a peer; the first peer without the key.
    Peer,
}

impl LawForm {
    /// The unit of a number; empty where values are no numbers.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::AutomaticDamping | Self::Damping | Self::Impedance => "N·s/m",
            Self::Energy => "J",
            Self::Duration | Self::AutomaticDuration | Self::Words(_) | Self::Peer => "",
        }
    }

    /// The form of values that are no `"auto"`.
    #[must_use]
    pub const fn without_automatic(self) -> Self {
        match self {
            Self::AutomaticDuration => Self::Duration,
            Self::AutomaticDamping => Self::Damping,
            Self::Duration | Self::Damping | Self::Impedance | Self::Energy | Self::Words(_) | Self::Peer => self,
        }
    }

    /// The word at that place; empty where values are no words.
    #[must_use]
    pub const fn word(self, place: usize) -> &'static str {
        match self {
            Self::Words(words) if place < words.len() => words[place].0,
            Self::Words(_)
            | Self::AutomaticDamping
            | Self::Damping
            | Self::Impedance
            | Self::Energy
            | Self::Duration
            | Self::AutomaticDuration
            | Self::Peer => "",
        }
    }
}

/// The value of a parameter of a law.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LawValue {
    /// `"auto"`: as the links of the scene ask for.
    Automatic,
    /// A duration.
    Duration(Duration),
    /// A number, in the unit of the [`LawForm`].
    Number(f64),
    /// The place of a word in its [`LawForm`].
    Word(usize),
    /// The place of a peer in the scene.
    Place(usize),
}

impl LawValue {
    /// The duration; `None` for any other value.
    #[must_use]
    pub const fn duration(self) -> Option<Duration> {
        match self {
            Self::Duration(duration) => Some(duration),
            Self::Automatic | Self::Number(_) | Self::Word(_) | Self::Place(_) => None,
        }
    }

    /// The number; `None` for any other value.
    #[must_use]
    pub const fn number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Automatic | Self::Duration(_) | Self::Word(_) | Self::Place(_) => None,
        }
    }
}

/// The values of a law's own parameters, in the order of [`Coordination::parameters`](super::Coordination::parameters).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawValues([LawValue; Self::MOST]);

impl Default for LawValues {
    /// Durations of zero.
    fn default() -> Self {
        Self([LawValue::Duration(Duration::ZERO); Self::MOST])
    }
}

impl LawValues {
    /// How many parameters of its own a law has at most.
    pub const MOST: usize = 4;

    /// Each at its default.
    ///
    /// # Panics
    ///
    /// If a default has not the form of its parameter.
    #[must_use]
    pub fn defaults(parameters: &[LawParameter]) -> Self {
        let mut values = Self::default();
        for (value, parameter) in values.0.iter_mut().zip(parameters) {
            let text = parameter.default.trim_matches('"');
            let found = match parameter.form {
                LawForm::AutomaticDuration | LawForm::AutomaticDamping if text == "auto" => Some(LawValue::Automatic),
                LawForm::Duration | LawForm::AutomaticDuration => parse::duration(text).map(LawValue::Duration).ok(),
                LawForm::AutomaticDamping | LawForm::Damping | LawForm::Impedance | LawForm::Energy => text.parse().map(LawValue::Number).ok(),
                LawForm::Words(words) => words.iter().position(|(word, _)| *word == text).map(LawValue::Word),
                LawForm::Peer => Some(LawValue::Place(0)),
            };
            *value = found.expect("the default of a law's parameter has its form");
        }
        values
    }

    /// Whether a value is `"auto"`.
    #[must_use]
    pub fn any_automatic(&self) -> bool {
        self.0.contains(&LawValue::Automatic)
    }

    /// The value of the parameter at that place.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    #[must_use]
    pub const fn get(&self, place: usize) -> LawValue {
        self.0[place]
    }

    /// The duration at that place; zero for any other value.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    #[must_use]
    pub fn duration(&self, place: usize) -> Duration {
        self.get(place).duration().unwrap_or(Duration::ZERO)
    }

    /// The number at that place; zero for any other value.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    #[must_use]
    pub fn number(&self, place: usize) -> f64 {
        self.get(place).number().unwrap_or(0.0)
    }

    /// The place of a peer at that place; the first peer for any other value.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    #[must_use]
    pub const fn place(&self, place: usize) -> usize {
        if let LawValue::Place(peer) = self.get(place) { peer } else { 0 }
    }

    /// Replaces the value of the parameter at that place.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    pub const fn set(&mut self, place: usize, value: LawValue) {
        self.0[place] = value;
    }
}
