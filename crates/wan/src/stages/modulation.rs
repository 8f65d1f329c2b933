//! Links whose condition changes by chance: a chain of states in continuous time, each with a whole configuration.
//!
//! A Wi-Fi cell that is busy or not, a phone that changes cells, a route that flaps. The chain's path is a function of (seed, name of the modulator), so
//! links that name the same modulator change at the same instants without knowing of each other.

use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::Instant;

use crate::laws::sojourn::SOJOURN;
use crate::laws::sojourn::Sojourn;
use crate::parameters::{Form, Table, WEIGHT, number, optional, required};
use crate::random::{Purpose, Stream, unit};
use crate::stages::config::LinkConfig;

/// A chain of states in continuous time: how long each lasts, and which comes next. It begins in state 0 at the begin of time.
#[derive(Clone, PartialEq, Debug)]
pub struct Modulator {
    name: String,
    states: Arc<[ModulatorState]>,
}

/// One state of a modulator.
#[derive(Clone, PartialEq, Debug)]
pub struct ModulatorState {
    /// How long it lasts; `None`: for ever.
    pub sojourn: Option<Sojourn>,
    /// How likely each state comes next, in proportion; its own must be 0.
    pub next: Vec<f64>,
}

/// Why a modulator is refused. States count from 0.
#[derive(Clone, PartialEq, Debug)]
pub enum ModulatorError {
    /// There is no state.
    NoStates,
    /// A state names more or fewer states than there are.
    Size {
        /// Which state.
        state: usize,
        /// How many it names.
        found: usize,
        /// How many there are.
        expected: usize,
    },
    /// A likelihood or a rate is negative or no number, or a state follows itself.
    Weight {
        /// Which state.
        state: usize,
        /// Which would follow.
        next: usize,
        /// How likely.
        value: f64,
    },
    /// A state ends and nothing follows, or its time is no time.
    Ends {
        /// Which state.
        state: usize,
    },
    /// The configurations have their stages in different orders.
    Layouts,
    /// There are more or fewer configurations than states.
    Configs {
        /// How many configurations.
        configs: usize,
        /// How many states.
        states: usize,
    },
}

impl fmt::Display for ModulatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoStates => f.write_str("a modulator without states: expected at least one"),
            Self::Size { state, found, expected } => {
                write!(f, "state {state} says how likely {found} states come next: expected {expected}, one for each")
            }
            Self::Weight { state, next, value } => write!(
                f,
                "state {state} cannot be followed by state {next} with {value}: expected a finite number, not negative, and 0 for the state itself"
            ),
            Self::Ends { state } => {
                write!(f, "state {state} ends, but no state follows it, or it lasts no time: expected a next state and a time above zero")
            }
            Self::Layouts => f.write_str("configurations with their stages in different orders: expected one order for all states"),
            Self::Configs { configs, states } => write!(f, "{configs} configurations for {states} states: expected one for each"),
        }
    }
}

impl core::error::Error for ModulatorError {}

impl Modulator {
    /// A chain with these states.
    ///
    /// # Errors
    ///
    /// [`ModulatorError`] if a state has no way on or a value is none.
    pub fn new(name: &str, states: Vec<ModulatorState>) -> Result<Self, ModulatorError> {
        if states.is_empty() {
            return Err(ModulatorError::NoStates);
        }
        for (place, state) in states.iter().enumerate() {
            if state.next.len() != states.len() {
                return Err(ModulatorError::Size { state: place, found: state.next.len(), expected: states.len() });
            }
            for (next, &value) in state.next.iter().enumerate() {
                if !(value.is_finite() && value >= 0.0 && (next != place || value == 0.0)) {
                    return Err(ModulatorError::Weight { state: place, next, value });
                }
            }
            if state.sojourn.is_some_and(|sojourn| !sojourn.is_sound() || state.next.iter().all(|weight| *weight == 0.0)) {
                return Err(ModulatorError::Ends { state: place });
            }
        }
        Ok(Self { name: name.into(), states: states.into() })
    }

    /// A Markov chain by its rates of going from each state (row) to each other (column) [1/s]; what stands on the diagonal is not looked at. A state whose
    /// rates are all zero lasts for ever.
    ///
    /// # Errors
    ///
    /// [`ModulatorError`] if the matrix is not square or a rate is none.
    pub fn from_rates(name: &str, rates: &[Vec<f64>]) -> Result<Self, ModulatorError> {
        let state = |(place, row): (usize, &Vec<f64>)| {
            let next: Vec<f64> = row.iter().enumerate().map(|(next, rate)| if next == place { 0.0 } else { *rate }).collect();
            let total: f64 = next.iter().sum();
            let sojourn = (total > 0.0 && total.is_finite()).then(|| {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive; saturates at 584 years")]
                let nanos = libm::rint(1e9 / total).max(1.0) as u64;
                Sojourn::Exponential(core::time::Duration::from_nanos(nanos))
            });
            ModulatorState { sojourn, next }
        };
        Self::new(name, rates.iter().enumerate().map(state).collect())
    }

    /// Its name: with the seed, the address of its path.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its states.
    #[must_use]
    pub fn states(&self) -> &[ModulatorState] {
        &self.states
    }
}

/// A link whose configuration follows a modulator.
#[derive(Clone, PartialEq, Debug)]
pub struct Modulated {
    modulator: Modulator,
    configs: Arc<[LinkConfig]>,
}

impl Modulated {
    /// A link that has the n-th configuration while the modulator is in its n-th state. A change of state is a live change: what propagates keeps its
    /// delay, a packet that is being sent keeps the bits already sent.
    ///
    /// # Errors
    ///
    /// [`ModulatorError::Configs`] if there is not one configuration for each state, [`ModulatorError::Layouts`] if they differ in the order of their stages.
    pub fn new(modulator: Modulator, configs: Vec<LinkConfig>) -> Result<Self, ModulatorError> {
        if configs.len() != modulator.states.len() {
            return Err(ModulatorError::Configs { configs: configs.len(), states: modulator.states.len() });
        }
        if configs.windows(2).any(|pair| pair[0].layout != pair[1].layout) {
            return Err(ModulatorError::Layouts);
        }
        Ok(Self { modulator, configs: configs.into() })
    }

    /// The modulator.
    #[must_use]
    pub const fn modulator(&self) -> &Modulator {
        &self.modulator
    }

    /// The configurations, one a state.
    #[must_use]
    pub fn configs(&self) -> &[LinkConfig] {
        &self.configs
    }
}

/// The path of a modulator as one link sees it.
#[derive(Clone, Debug)]
pub(crate) struct ModulationStage {
    modulated: Modulated,
    draws: Stream,
    state: usize,
    changes: u64,
    until: Instant,
}

impl ModulationStage {
    /// The path from the begin of time, brought to `now`.
    pub(crate) fn new(seed: u64, modulated: Modulated, now: Instant) -> Self {
        let draws = Stream::new(seed, alloc::format!("modulator {}", modulated.modulator.name).as_bytes());
        let mut stage = Self { modulated, draws, state: 0, changes: 0, until: Instant::ZERO };
        stage.until = stage.end_of_state(Instant::ZERO);
        while stage.next_change().is_some_and(|at| at <= now) {
            stage.change();
        }
        stage
    }

    /// When the state changes; `None` if never.
    pub(crate) fn next_change(&self) -> Option<Instant> {
        (self.until < Instant::MAX).then_some(self.until)
    }

    /// Goes to the next state.
    pub(crate) fn change(&mut self) {
        let weights = &self.modulated.modulator.states[self.state].next;
        let total: f64 = weights.iter().sum();
        let mut left = unit(self.draws.packet(self.changes).first(Purpose::Modulation)) * total;
        // Rounding may leave a rest behind the last state that can follow.
        let last = weights.iter().rposition(|weight| *weight > 0.0).unwrap_or(self.state);
        let next = weights.iter().position(|weight| {
            left -= weight;
            *weight > 0.0 && left < 0.0
        });
        self.state = next.unwrap_or(last);
        self.changes += 1;
        self.until = self.end_of_state(self.until);
    }

    /// The configuration of the present state.
    pub(crate) fn config(&self) -> &LinkConfig {
        &self.modulated.configs[self.state]
    }

    fn end_of_state(&self, begin: Instant) -> Instant {
        let Some(sojourn) = self.modulated.modulator.states[self.state].sojourn else { return Instant::MAX };
        let mut more = self.draws.packet(self.changes).more(Purpose::Modulation);
        begin.saturating_add(sojourn.draw(|| more.next_word()))
    }
}

/// The parameters of a modulator.
pub static MODULATOR: Table = Table::of(&[&[
    required("name", Form::Text, "What links call it, without space or dot").expecting("a name that links refer to"),
    required("states", Form::List(&Form::Table(&MODULATOR_STATE)), "Its states; the first is the one in the beginning")
        .expecting("a list such as [{ name = \"good\", sojourn = \"2s\" }, { name = \"bad\", sojourn = \"1s\" }]"),
]]);
static MODULATOR_STATE: Table = Table::of(&[&[
    required("name", Form::Text, "The name of the state, without space or dot, and not by").expecting("the name of the state"),
    optional("sojourn", SOJOURN, "How long it lasts; without it for ever"),
    optional(
        "next",
        Form::AnyOf(const { &[Form::Text, Form::Table(&WEIGHTS)] }),
        "Which state follows: a name, or names with weights; without it each other one alike",
    ),
]]);
static WEIGHTS: Table = Table::with_others(&[], &number(WEIGHT));

#[cfg(test)]
mod tests {
    use super::*;

    fn path(seed: u64, modulator: &Modulator, until: u64) -> Vec<(usize, u64)> {
        let configs = vec![LinkConfig::default(); modulator.states().len()];
        let mut stage = ModulationStage::new(seed, Modulated::new(modulator.clone(), configs).unwrap(), Instant::ZERO);
        let mut path = Vec::new();
        while let Some(at) = stage.next_change().filter(|at| at.as_nanos() < until) {
            path.push((stage.state, at.as_nanos()));
            stage.change();
        }
        path
    }

    /// Three states with rates; the stationary law of this generator is (9, 4.5, 2)/15.5. Over 2000 s with a few hundred changes a second in all, fractions of time
    /// are known to about 1/√(changes) = 0.2 %.
    #[test]
    fn time_in_each_state_is_the_stationary_law() {
        let rates = [vec![0.0, 50.0, 0.0], vec![60.0, 0.0, 40.0], vec![90.0, 0.0, 0.0]];
        // π·Q = 0: π₀·50 = π₁·60 + π₂·90, π₁·100 = π₀·50, π₂·90 = π₁·40.
        let weights = [1.0, 0.5, 0.5 * 40.0 / 90.0];
        let modulator = Modulator::from_rates("cell", &rates).unwrap();
        let mut spent = [0_u64; 3];
        let mut begin = 0;
        let path = path(3, &modulator, 2_000_000_000_000);
        for (state, end) in &path {
            spent[*state] += end - begin;
            begin = *end;
        }
        let error = 4.5 / (path.len() as f64).sqrt();
        for (spent, weight) in spent.iter().zip(weights) {
            let expected = weight / weights.iter().sum::<f64>();
            assert!((*spent as f64 / begin as f64 - expected).abs() < error, "{spent} {expected} {error}");
        }
    }

    #[test]
    fn the_path_belongs_to_the_seed_and_the_name() {
        let modulator = |name| Modulator::from_rates(name, &[vec![0.0, 1.0], vec![2.0, 0.0]]).unwrap();
        let first = path(1, &modulator("a"), 100_000_000_000);
        assert_eq!(first, path(1, &modulator("a"), 100_000_000_000));
        assert_ne!(first, path(2, &modulator("a"), 100_000_000_000));
        assert_ne!(first, path(1, &modulator("b"), 100_000_000_000));
    }

    #[test]
    fn what_is_no_chain_is_refused() {
        let rates = |rates: &[Vec<f64>]| Modulator::from_rates("x", rates);
        assert_eq!(rates(&[]), Err(ModulatorError::NoStates));
        assert!(matches!(rates(&[vec![0.0, 1.0]]), Err(ModulatorError::Size { .. })));
        assert!(matches!(rates(&[vec![0.0, -1.0], vec![1.0, 0.0]]), Err(ModulatorError::Weight { state: 0, next: 1, .. })));
        let dead_end = ModulatorState { sojourn: Some(Sojourn::Fixed(core::time::Duration::from_secs(1))), next: vec![0.0] };
        assert_eq!(Modulator::new("x", vec![dead_end]), Err(ModulatorError::Ends { state: 0 }));
        let alone = Modulator::new("x", vec![ModulatorState { sojourn: None, next: vec![0.0] }]).unwrap();
        assert!(matches!(Modulated::new(alone, vec![]), Err(ModulatorError::Configs { .. })));
        let two = Modulator::from_rates("x", &[vec![0.0, 1.0], vec![2.0, 0.0]]).unwrap();
        let configs = [crate::stages::config::Layout::Physical, crate::stages::config::Layout::Netem]
            .map(|layout| LinkConfig { layout, ..LinkConfig::default() });
        assert_eq!(Modulated::new(two, configs.to_vec()), Err(ModulatorError::Layouts));
    }
}
