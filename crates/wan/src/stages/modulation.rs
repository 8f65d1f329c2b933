//! Modulation: links with a configuration changing by chance. A chain of states in continuous time selects one of several whole configurations.
//!
//! Examples are a busy or idle Wi-Fi cell, a phone on its way between cells, and a flapping route. The sequence of states is a function of the seed and the
//! name of the modulator, so links with the same modulator change at the same instants without sharing state.

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

/// Chain of states in continuous time: the lengths of stays and the order of states. The chain begins in state 0 at the begin of time.
#[derive(Clone, PartialEq, Debug)]
pub struct Modulator {
    name: String,
    states: Arc<[ModulatorState]>,
}

/// State of a modulator.
#[derive(Clone, PartialEq, Debug)]
pub struct ModulatorState {
    /// Law of the length of a stay. Under `None` the state lasts for ever.
    pub sojourn: Option<Sojourn>,
    /// Weights of the next states, indexed by state. A weight is finite and not negative; the weight of the state itself is 0.
    pub next: Vec<f64>,
}

/// Reason for the refusal of a modulator. States count from 0.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum ModulatorError {
    /// The modulator has no state.
    NoStates,
    /// A state has more or fewer weights than the modulator has states.
    Size {
        /// Index of the state.
        state: usize,
        /// Number of weights of the state.
        found: usize,
        /// Number of states of the modulator.
        expected: usize,
    },
    /// A weight or a rate is negative or not finite, or a state follows itself.
    Weight {
        /// Index of the state.
        state: usize,
        /// Index of the state that would follow.
        next: usize,
        /// Refused weight or rate.
        value: f64,
    },
    /// A state ends and no state follows, or the law of its length is not sound.
    Ends {
        /// Index of the state.
        state: usize,
    },
    /// The configurations have different orders of stages.
    Layouts,
    /// The number of configurations differs from the number of states.
    Configs {
        /// Number of configurations.
        configs: usize,
        /// Number of states.
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
    /// Returns a chain with the given states.
    ///
    /// # Errors
    ///
    /// [`ModulatorError`] if a state ends and no state follows, or a weight or a length is refused.
    pub fn new(name: &str, states: Vec<ModulatorState>) -> Result<Self, ModulatorError> {
        if states.is_empty() {
            return Err(ModulatorError::NoStates);
        }
        // A state followed by itself would end without a change, so its weight after itself must be 0.
        for (place, state) in states.iter().enumerate() {
            if state.next.len() != states.len() {
                return Err(ModulatorError::Size { state: place, found: state.next.len(), expected: states.len() });
            }
            for (next, &value) in state.next.iter().enumerate() {
                if !(value.is_finite() && value >= 0.0 && (next != place || value == 0.0)) {
                    return Err(ModulatorError::Weight { state: place, next, value });
                }
            }
            // A state that lasts for ever needs no next state.
            if state.sojourn.is_some_and(|sojourn| !sojourn.is_sound() || state.next.iter().all(|weight| *weight == 0.0)) {
                return Err(ModulatorError::Ends { state: place });
            }
        }
        Ok(Self { name: name.into(), states: states.into() })
    }

    /// Returns a Markov chain with the rates of going from each state (row) to each different state (column) \[1/s\]. Numbers on the diagonal are ignored. A
    /// state with all rates zero lasts for ever.
    ///
    /// # Errors
    ///
    /// [`ModulatorError`] if the matrix is not square, or a rate is negative or not finite.
    pub fn from_rates(name: &str, rates: &[Vec<f64>]) -> Result<Self, ModulatorError> {
        let state = |(place, row): (usize, &Vec<f64>)| {
            let next: Vec<f64> = row.iter().enumerate().map(|(next, rate)| if next == place { 0.0 } else { *rate }).collect();
            // The time in a state is exponential with the sum of the rates, and the next state is chosen in proportion to the rates.
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

    /// Returns the name: with the seed, the address of the modulator's random numbers.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the states.
    #[must_use]
    pub fn states(&self) -> &[ModulatorState] {
        &self.states
    }

    /// Returns the same chain under another name, and therefore with other random numbers.
    #[must_use]
    pub fn renamed(&self, name: &str) -> Self {
        Self { name: name.into(), states: Arc::clone(&self.states) }
    }

    /// Returns the share of time that the chain spends in each state in the long run, indexed by state. `None` if the chain has no such shares that do not
    /// depend on chance: if a state lasts for ever, or if some state cannot be reached from another state.
    #[must_use]
    pub fn shares(&self) -> Option<Vec<f64>> {
        let size = self.states.len();
        let mut weights: Vec<Vec<f64>> = self.states.iter().map(|state| state.next.clone()).collect();
        for row in &mut weights {
            let total: f64 = row.iter().sum();
            row.iter_mut().for_each(|weight| *weight /= total);
        }
        // Grassmann, Taksar and Heyman (1985): states are taken out of the chain from the last one on, without a subtraction, so that no digits are lost. A sum
        // of zero, or one that is no number, tells that the remaining states cannot be reached.
        for last in (1..size).rev() {
            let leaves: f64 = weights[last][..last].iter().sum();
            // The weights of a state that lasts for ever are zero, and their shares no numbers.
            if leaves.is_nan() || leaves <= 0.0 {
                return None;
            }
            for from in 0..last {
                weights[from][last] /= leaves;
                for to in 0..last {
                    weights[from][to] += weights[from][last] * weights[last][to];
                }
            }
        }
        // The number of visits of each state, for one visit of state 0.
        let mut visits = alloc::vec![1.0; size];
        for state in 1..size {
            visits[state] = (0..state).map(|from| visits[from] * weights[from][state]).sum();
        }
        let times = visits.iter().zip(self.states.iter()).map(|(visits, state)| Some(visits * state.sojourn?.mean().as_secs_f64()));
        let times: Vec<f64> = times.collect::<Option<_>>()?;
        let total: f64 = times.iter().sum();
        times.iter().all(|time| *time > 0.0).then(|| times.iter().map(|time| time / total).collect())
    }
}

/// Configurations of a link with a modulator.
#[derive(Clone, Debug)]
pub struct Modulated {
    modulator: Modulator,
    configs: Arc<[LinkConfig]>,
}

impl PartialEq for Modulated {
    fn eq(&self, other: &Self) -> bool {
        // The links of a mesh share configurations, whose comparison would take longer than the rest of adding a link.
        self.modulator == other.modulator && (Arc::ptr_eq(&self.configs, &other.configs) || self.configs == other.configs)
    }
}

impl Modulated {
    /// Returns a link with the n-th configuration while the modulator is in its n-th state. A change of state is a live change: packets in propagation
    /// keep their delay, and a packet in transmission keeps the bits already sent.
    ///
    /// # Errors
    ///
    /// [`ModulatorError::Configs`] if the number of configurations is not the number of states, [`ModulatorError::Layouts`] if the configurations have
    /// different orders of stages.
    pub fn new(modulator: Modulator, configs: Vec<LinkConfig>) -> Result<Self, ModulatorError> {
        if configs.len() != modulator.states.len() {
            return Err(ModulatorError::Configs { configs: configs.len(), states: modulator.states.len() });
        }
        // A change of state reconfigures the stages in place, and so cannot change their order.
        if configs.windows(2).any(|pair| pair[0].layout != pair[1].layout) {
            return Err(ModulatorError::Layouts);
        }
        Ok(Self { modulator, configs: configs.into() })
    }

    /// Returns the modulator.
    #[must_use]
    pub const fn modulator(&self) -> &Modulator {
        &self.modulator
    }

    /// Returns the same link, following another modulator name. Links with the same name and seed change state at the same instants.
    #[must_use]
    pub fn with_modulator_name(&self, name: &str) -> Self {
        Self { modulator: self.modulator.renamed(name), configs: Arc::clone(&self.configs) }
    }

    /// Returns the same link with other configurations, which must keep the order of stages.
    pub(crate) fn map_configs(&self, map: impl Fn(&LinkConfig) -> LinkConfig) -> Self {
        Self { modulator: self.modulator.clone(), configs: self.configs.iter().map(map).collect() }
    }

    /// Returns the configurations, indexed by state.
    #[must_use]
    pub fn configs(&self) -> &[LinkConfig] {
        &self.configs
    }
}

/// Sequence of a modulator's states, as followed by one link.
#[derive(Clone, Debug)]
pub(crate) struct ModulationStage {
    modulated: Modulated,
    draws: Stream,
    /// Index of the present state.
    state: usize,
    /// Number of changes so far: the address of the present stay's random numbers.
    changes: u64,
    /// End of the present state, or the end of time if the state lasts for ever.
    until: Instant,
}

impl ModulationStage {
    /// Returns the modulation at `now`, after all changes since the begin of time.
    pub(crate) fn new(seed: u64, modulated: Modulated, now: Instant) -> Self {
        let draws = Stream::new(seed, alloc::format!("modulator {}", modulated.modulator.name).as_bytes());
        let mut stage = Self { modulated, draws, state: 0, changes: 0, until: Instant::ZERO };
        stage.until = stage.end_of_state(Instant::ZERO);
        // A later link walks through the same states from the begin of time, so the link changes with all further links of the modulator.
        while stage.next_change().is_some_and(|at| at <= now) {
            stage.change();
        }
        stage
    }

    /// Returns the instant of the next change, or `None` if the state lasts for ever.
    pub(crate) fn next_change(&self) -> Option<Instant> {
        (self.until < Instant::MAX).then_some(self.until)
    }

    /// Moves to the next state.
    pub(crate) fn change(&mut self) {
        let weights = &self.modulated.modulator.states[self.state].next;
        let total: f64 = weights.iter().sum();
        let mut left = unit(self.draws.packet(self.changes).first(Purpose::Modulation)) * total;
        // Subtracting may leave a remainder by rounding, so no state is chosen. The last state with a weight is chosen then.
        let last = weights.iter().rposition(|weight| *weight > 0.0).unwrap_or(self.state);
        let next = weights.iter().position(|weight| {
            left -= weight;
            *weight > 0.0 && left < 0.0
        });
        self.state = next.unwrap_or(last);
        self.changes += 1;
        self.until = self.end_of_state(self.until);
    }

    /// Returns the index of the present state.
    pub(crate) const fn state(&self) -> usize {
        self.state
    }

    /// Returns the configuration of the present state.
    pub(crate) fn config(&self) -> &LinkConfig {
        &self.modulated.configs[self.state]
    }

    /// Returns the end of the present state with the begin `begin`.
    fn end_of_state(&self, begin: Instant) -> Instant {
        let Some(sojourn) = self.modulated.modulator.states[self.state].sojourn else { return Instant::MAX };
        // The first word at this address chooses the state after this stay, so the length takes the following words.
        let mut more = self.draws.packet(self.changes).more(Purpose::Modulation);
        begin.saturating_add(sojourn.draw(|| more.next_word()))
    }
}

/// Parameters of a modulator.
pub static MODULATOR: Table = Table::of(&[&[
    required("name", Form::Text, "Name of the modulator, without space or dot").expecting("a name that links refer to"),
    required("states", Form::List(&Form::Table(&MODULATOR_STATE)), "States; the modulator begins in the first")
        .expecting("a list such as [{ name = \"good\", sojourn = \"2s\" }, { name = \"bad\", sojourn = \"1s\" }]"),
]]);
static MODULATOR_STATE: Table = Table::of(&[&[
    required("name", Form::Text, "Name of the state, without space or dot, and not by").expecting("the name of the state"),
    optional("sojourn", SOJOURN, "Length of a stay in the state; endless by default"),
    optional(
        "next",
        Form::AnyOf(const { &[Form::Text, Form::Table(&WEIGHTS)] }),
        "Next state: a name, or names with weights; each other state is equally likely by default",
    ),
]]);
static WEIGHTS: Table = Table::with_others(&[], &number(WEIGHT));

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares of time against chains that can be solved by hand: two states by their sojourns, a walk whose ends last twice as long (each state alike), and a
    /// state visited every other time.
    #[test]
    fn shares_of_time_are_those_of_the_chain() {
        let state = |seconds: u64, next: &[f64]| ModulatorState {
            sojourn: Some(Sojourn::Exponential(core::time::Duration::from_secs(seconds))),
            next: next.to_vec(),
        };
        let shares = |states: Vec<ModulatorState>| Modulator::new("cell", states).unwrap().shares();
        assert_eq!(shares(vec![state(3, &[0.0, 1.0]), state(1, &[1.0, 0.0])]), Some(vec![0.75, 0.25]));
        let walk = vec![state(2, &[0.0, 1.0, 0.0]), state(1, &[5.0, 0.0, 5.0]), state(2, &[0.0, 1.0, 0.0])];
        assert!(shares(walk).unwrap().iter().all(|share| (share - 1.0 / 3.0).abs() < 1e-15));
        let edges = vec![state(1, &[0.0, 1.0, 3.0]), state(4, &[1.0, 0.0, 0.0]), state(4, &[1.0, 0.0, 0.0])];
        assert_eq!(shares(edges), Some(vec![0.2, 0.2, 0.6]));
        assert_eq!(shares(vec![state(1, &[0.0])].into_iter().map(|one| ModulatorState { sojourn: None, ..one }).collect()), None);
        // The third state is left and never entered, and the last one is never left.
        assert_eq!(shares(vec![state(1, &[0.0, 1.0, 0.0]), state(1, &[1.0, 0.0, 0.0]), state(1, &[1.0, 0.0, 0.0])]), None);
        assert_eq!(shares(vec![state(1, &[0.0, 1.0]), ModulatorState { sojourn: None, next: vec![0.0, 0.0] }]), None);
    }

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

    /// Three states with rates, whose generator has the stationary law (9, 4.5, 2)/15.5. In 2000 s there are a few hundred changes a second, so that
    /// fractions of time are known to about 1/√(changes) = 0.2 %.
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
