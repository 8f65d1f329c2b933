//! Coordination laws in any [`Number`], and the parameters of laws.

use core::time::Duration;

use cohaptic_units::parse;

use crate::{Gains, Motion, Number};

/// Input of a law at a tick, along one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation<N = f64> {
    /// Motion of the peer's own copy.
    pub own: Motion<N>,
    /// Motion of the peer's own copy [`Law::lag`] ticks ago. Before the first tick, the motion of the first tick counts. Equal to `own` for a law without a
    /// lag.
    pub past: Motion<N>,
    /// Mean of the newest samples held from other peers.
    pub mean: Motion<N>,
    /// Mean displacement of these samples since they were sent \[m\]: the mean of min(age, [`Law::horizon`])·velocity. Zero for a law without a horizon.
    pub lead: N,
}

/// A coordination law: the force between the copies of the shared object, as a function of the knowledge of a peer. Axes are independent.
///
/// A law must be deterministic: its result depends on the observation and the memory alone. A law sees only the mean of the samples, so an analysis can treat
/// peers with equal parameters as one class.
pub trait Law<N: Number> {
    /// Returns the number of values in the law's memory, along each axis.
    fn memory(&self) -> usize {
        0
    }

    /// Returns L, the age of the own state in [`Observation::past`] \[ticks\]; 0 for a law without a lag. A law with a lag has no [`Law::memory`].
    fn lag(&self) -> usize {
        0
    }

    /// Returns β [N·s/m], the damping of the peer's own copy by the law. β is part of the body, bO + β, so it acts between ticks too, and [`Law::force`]
    /// leaves it out.
    fn damping(&self) -> f64 {
        0.0
    }

    /// Returns the greatest age to which samples are extrapolated \[s\]; `None` for a law without extrapolation.
    fn horizon(&self) -> Option<f64> {
        None
    }

    /// Returns the coordination force FT of a tick \[N\], which equation (8) subtracts. `memory` has [`Law::memory`] values: the values at the end of the
    /// tick before, or zeros at the first tick.
    fn force(&self, seen: &Observation<N>, memory: &mut [N]) -> N;

    /// Returns the desired motion of the copy (xd, vd), for the record.
    fn target(&self, seen: &Observation<N>) -> Motion<N> {
        seen.mean
    }
}

/// Coefficients of a law in any type: `f64` for one peer, eight lanes for eight peers, or a linear form.
pub trait Coefficients {
    /// Type of a coefficient.
    type Coefficient;
    /// The same law with coefficients of another type.
    type Of<D: Copy>;

    /// Returns the law with `coefficient` applied to each coefficient, always in the same order.
    fn map<D: Copy>(&self, coefficient: impl FnMut(&Self::Coefficient) -> D) -> Self::Of<D>;
}

/// An operation on any law of the registry. The compiler generates code for each law, so a loop inside the operation does not select the law at every
/// iteration.
pub trait LawVisitor<C> {
    /// Result of the operation.
    type Output;

    /// Applies the operation to a law.
    fn visit<L: Coefficients<Coefficient = C, Of<f64>: Law<f64>>>(self, law: &L) -> Self::Output;
}

/// Properties of a law in the registry.
pub(super) trait LawKind {
    /// Pull of the law: towards the mean, or towards each copy.
    const PULL: Pull = Pull::Mean;
    /// Gains used by the law.
    const GAINS: UsedGains = UsedGains::Both;
    /// Parameters of this law alone.
    const PARAMETERS: &[LawParameter] = &[];

    /// Returns the law with these parameters.
    fn new(parameters: &LawParameters) -> Self;
}

/// Parameters from which the coefficients of a law are computed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawParameters {
    /// Gains KT [N/m] and BT [N·s/m].
    pub gains: Gains,
    /// Number of peers in the session.
    pub peers: usize,
    /// Period Tc of the peer's tick.
    pub tick: Duration,
    /// Greatest age of a sample in use \[ticks\], for parameters that are [`LawValue::Automatic`]; `None` if the links do not bound the age.
    pub oldest: Option<u64>,
    /// Age of samples in the middle of their use \[ticks\], for parameters that are [`LawValue::Automatic`]; `None` if the links do not give all samples the
    /// same age.
    pub middle: Option<u64>,
    /// Values of the parameters of this law alone.
    pub own: LawValues,
}

/// Dependence of a law's pull on the number of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pull {
    /// A pull towards the mean of the copies, independent of the number of peers.
    Mean,
    /// A pull towards each copy, which grows with the number of peers.
    Sum,
}

/// Gains used by a law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UsedGains {
    /// KT and BT.
    Both,
    /// KT alone.
    Stiffness,
    /// Neither KT nor BT.
    Neither,
}

/// A parameter of one law alone: a key of the table `[coordination.NAME]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LawParameter {
    /// Key in the table.
    pub key: &'static str,
    /// Form of the values.
    pub form: LawForm,
    /// Default value, in TOML syntax.
    pub default: &'static str,
    /// Meaning of the parameter, without a final full stop.
    pub about: &'static str,
    /// `true` if the timeline of a scene may change the parameter. A parameter that defines the beginning of a run, or the meaning of samples, cannot change.
    pub can_change: bool,
}

/// Form of the values of a law's parameter.
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
    /// A word of this list of words and meanings.
    Words(&'static [(&'static str, &'static str)]),
    /// The name of a peer. Without the key, the first peer.
    Peer,
}

impl LawForm {
    /// Returns the unit of a number; empty for values without a number or with units in the text.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::AutomaticDamping | Self::Damping | Self::Impedance => "N·s/m",
            Self::Energy => "J",
            Self::Duration | Self::AutomaticDuration | Self::Words(_) | Self::Peer => "",
        }
    }

    /// Returns the form of the values except `"auto"`.
    #[must_use]
    pub const fn without_automatic(self) -> Self {
        match self {
            Self::AutomaticDuration => Self::Duration,
            Self::AutomaticDamping => Self::Damping,
            Self::Duration | Self::Damping | Self::Impedance | Self::Energy | Self::Words(_) | Self::Peer => self,
        }
    }

    /// Returns the word with index `place`; empty beyond the last word, and for forms without words.
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

/// A value of a law's parameter.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LawValue {
    /// `"auto"`: derived from the links of the scene.
    Automatic,
    /// A duration.
    Duration(Duration),
    /// A number in the unit of the [`LawForm`].
    Number(f64),
    /// The index of a word in the [`LawForm`].
    Word(usize),
    /// The place of a peer in the scene, from 0.
    Place(usize),
}

impl LawValue {
    /// Returns the duration; `None` for any other value.
    #[must_use]
    pub const fn duration(self) -> Option<Duration> {
        match self {
            Self::Duration(duration) => Some(duration),
            Self::Automatic | Self::Number(_) | Self::Word(_) | Self::Place(_) => None,
        }
    }

    /// Returns the number; `None` for any other value.
    #[must_use]
    pub const fn number(self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(number),
            Self::Automatic | Self::Duration(_) | Self::Word(_) | Self::Place(_) => None,
        }
    }
}

/// Values of a law's own parameters, in the order of [`Coordination::parameters`](super::Coordination::parameters).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawValues([LawValue; Self::MOST]);

impl Default for LawValues {
    /// Returns durations of zero.
    fn default() -> Self {
        Self([LawValue::Duration(Duration::ZERO); Self::MOST])
    }
}

impl LawValues {
    /// Greatest number of own parameters of a law.
    pub const MOST: usize = 4;

    /// Returns the default of each parameter.
    ///
    /// # Panics
    ///
    /// If a default does not have the form of its parameter.
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

    /// Returns whether any value is `"auto"`.
    #[must_use]
    pub fn any_automatic(&self) -> bool {
        self.0.contains(&LawValue::Automatic)
    }

    /// Returns the value of the parameter with index `place`.
    ///
    /// # Panics
    ///
    /// If `place` is [`LawValues::MOST`] or greater.
    #[must_use]
    pub const fn get(&self, place: usize) -> LawValue {
        self.0[place]
    }

    /// Returns the duration with index `place`; zero for any other value.
    ///
    /// # Panics
    ///
    /// If `place` is [`LawValues::MOST`] or greater.
    #[must_use]
    pub fn duration(&self, place: usize) -> Duration {
        self.get(place).duration().unwrap_or(Duration::ZERO)
    }

    /// Returns the number with index `place`; zero for any other value.
    ///
    /// # Panics
    ///
    /// If `place` is [`LawValues::MOST`] or greater.
    #[must_use]
    pub fn number(&self, place: usize) -> f64 {
        self.get(place).number().unwrap_or(0.0)
    }

    /// Returns the place of a peer from the parameter with index `place`; the first peer for any other value.
    ///
    /// # Panics
    ///
    /// If `place` is [`LawValues::MOST`] or greater.
    #[must_use]
    pub const fn place(&self, place: usize) -> usize {
        if let LawValue::Place(peer) = self.get(place) { peer } else { 0 }
    }

    /// Replaces the value of the parameter with index `place`.
    ///
    /// # Panics
    ///
    /// If `place` is [`LawValues::MOST`] or greater.
    pub const fn set(&mut self, place: usize, value: LawValue) {
        self.0[place] = value;
    }
}
