//! The error of an analysis: the reasons for which a scene cannot be analysed.

use std::time::Duration;

use cohaptic_units::print::{SixDigits, Span};

use crate::cost::Memory;

/// Reason for which a scene cannot be analysed.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// The clocks of the scene have no common period.
    #[error("the clocks of this scene have no common period: expected ticks, updates and drifts whose multiples meet within 584 years")]
    NoFrame,
    /// The common period of the clocks is too long.
    #[error("everything repeats only after {}: expected clocks that meet sooner; set the drift of the clocks to 0 to analyse the scene without it", Span(*.frame))]
    FrameTooLong {
        /// Length of the common period.
        frame: Duration,
    },
    /// A strategy is not linear.
    #[error("the strategy of peer {peer} is not linear: twice the disturbance does not lead twice as far; simulate the scene instead")]
    NotLinear {
        /// Name of the first peer whose motion is not linear.
        peer: String,
    },
    /// A strategy depends on the time, or on memory that it does not show.
    #[error("from one state a strategy leads to two: expected one that shows all that it remembers (Strategy::memory) and does not look at the time")]
    Remembers,
    /// A scene of several axes has both a one-sided contact and a strategy of its own.
    #[error("a one-sided contact with a strategy that may mix axes cannot be analysed axis by axis: expected contact = \"grasp\" or \"none\"")]
    MixedAxes,
    /// The scene has too many combinations of open and closed contacts.
    #[error("{modes} combinations of open and closed contacts: expected at most {most}")]
    TooManyModes {
        /// Number of combinations.
        modes: u128,
        /// Greatest number of combinations that an analysis looks at.
        most: u128,
    },
    /// The strategy has no linear form.
    #[error(
        "{strategy} coordination is analysed only as a whole, not in parts of equal peers: ask `cohaptic stability point`, `map` or `boundary` for its radius, \
         without --graph, --every-number, --switching, --losses-in-a-row and --delay-within; --prove of `map` and `boundary` follows it too, and of waves --every-number"
    )]
    OtherStrategy {
        /// Name of the strategy.
        strategy: &'static str,
    },
    /// The strategy is not linear.
    #[error("{strategy} coordination has no analysis: simulations tell whether it is stable, as in `cohaptic check` and `cohaptic run`")]
    NoAnalysis {
        /// Name of the strategy.
        strategy: &'static str,
    },
    /// The object turns, and its motion does not split into scenes of one axis.
    #[error(
        "{what} of an object that turns is analysed only where its motion splits into scenes of one axis, and here it does not: {why}; \
         simulations tell what the scene does"
    )]
    Turns {
        /// Analysis that was asked for, in words.
        what: &'static str,
        /// Reason why the motion does not split.
        why: &'static str,
    },
    /// The object has no rest under the forces and torques of the hands.
    #[error("there is no rest under the forces of the hands: {why}; expected constant forces and torques that cancel, or arms")]
    NoRest {
        /// Reason why there is no rest.
        why: String,
    },
    /// The object has no steady spin.
    #[error("there is no steady spin: {why}; expected hands with constant torques about one axis and without forces")]
    NoSpin {
        /// Reason why there is no steady spin.
        why: String,
    },
    /// The object turns, its motion does not split into scenes of one axis, and this analysis needs such scenes.
    #[error(
        "{what} of an object that turns exists only where its motion splits into scenes of one axis, and here it does not: {why}; \
         `cohaptic stability point`, `map` and `boundary` take all components together where nothing else is asked for"
    )]
    Unsplit {
        /// Analysis that was asked for, in words.
        what: &'static str,
        /// Reason why the motion does not split.
        why: &'static str,
    },
    /// The object turns, and this analysis does not follow rotation.
    #[error("{what} does not follow an object that turns: expected a scene without object.inertia")]
    NoTurns {
        /// Analysis that was asked for, in words.
        what: &'static str,
    },
    /// An operator with the law crossover holds a device, and this analysis does not follow operators.
    #[error(
        "{what} does not follow the operator of {peer}, whose law is \"crossover\": expected law = \"moves\", of which the arm alone counts, or hand.arm; \
         `cohaptic stability point`, `map` and `boundary` follow the law crossover where links leave nothing to chance and nothing but the radius is asked for"
    )]
    Operator {
        /// Analysis that was asked for, in words.
        what: &'static str,
        /// Name of the peer whose device the operator holds.
        peer: String,
    },
    /// A device exchanges late or not at each tick, and this analysis does not follow such devices.
    #[error(
        "{what} does not follow the device of {peer}, which exchanges late or not at each tick: expected device.exchange-every = 1 and \
         device.exchange-age = 0; `cohaptic stability point`, `map` and `boundary` follow such devices where links leave nothing to chance"
    )]
    SlowDevice {
        /// Analysis that was asked for, in words.
        what: &'static str,
        /// Name of the peer with the device.
        peer: String,
    },
    /// The scene has a topology, and this analysis does not follow topologies.
    #[error(
        "{what} has every peer hear every other, and this scene has a [topology]: expected kind = \"full\"; \
         `cohaptic stability point`, `map` and `boundary` follow a topology where nothing but --prove is asked for"
    )]
    Topology {
        /// Analysis that was asked for, in words.
        what: &'static str,
    },
    /// The scene has a topology on which these peers cannot be analysed.
    #[error("on the [topology] of this scene: {why}")]
    OnTopology {
        /// Reason why the peers cannot be analysed.
        why: String,
    },
    /// The scene sends a sample only if the motion since the last sent sample is large enough.
    #[error(
        "with coordination.send-when a sample depends on how far things have moved, which is not linear: simulations tell whether the scene is stable, as in \
         `cohaptic check`; or expected a scene without it"
    )]
    DeadBands,
    /// Clients send displacements over a line that does more than delay all samples alike.
    #[error(
        "with sends = \"increments\" the server adds displacements, and {line} does more than to delay all of them alike: what gets lost stays missing, so that \
         the position of {peer} at the server wanders off, and no disturbance of it dies out; expected lines of a constant delay from {peer} to the server, or \
         sends = \"states\"; simulations show how far it wanders, as in `cohaptic run`"
    )]
    LostIncrements {
        /// The line, in words.
        line: String,
        /// Name of the client.
        peer: String,
    },
    /// The strategy uses the ages of samples, and the clocks drift apart.
    #[error("{strategy} coordination uses the ages of samples, which do not repeat where clocks drift apart: expected one drift for all peers")]
    AgesByClocks {
        /// Name of the strategy.
        strategy: &'static str,
    },
    /// The scene has several combinations of contacts, and so no single matrix.
    #[error("the scene is not linear: there is one matrix for each combination of contacts; expected contact = \"grasp\" or \"none\"")]
    SeveralModes,
    /// The load offered to a line exceeds its rate.
    #[error("{line} is offered {} bit/s and carries {}: its queue never settles; expected a higher rate, or fewer or rarer samples", SixDigits(*load), SixDigits(*rate))]
    Overloaded {
        /// Name of the line.
        line: String,
        /// Rate offered to the line [bit/s].
        load: f64,
        /// Rate of the line [bit/s].
        rate: f64,
    },
    /// The pattern of delays and losses of a link does not repeat soon enough.
    #[error(
        "what becomes of samples from {from} to {to} does not repeat within {most} of them: expected a link of constant delay, or periods that meet sooner"
    )]
    NoPattern {
        /// Name of the sending peer.
        from: String,
        /// Name of the receiving peer.
        to: String,
        /// Greatest number of samples after which the patterns of all links together may repeat.
        most: usize,
    },
    /// Too many peers have access lines that do more than delay.
    #[error("{peers} peers whose samples share access lines: expected at most {most}, or access lines that only delay")]
    TooManyShare {
        /// Number of peers whose samples share access lines.
        peers: usize,
        /// Greatest number of such peers that an analysis looks at.
        most: usize,
    },
    /// A link has a random part whose second moment cannot be followed.
    #[error("the mean square of link {link} cannot be followed: {why}; simulate the scene with several seeds instead")]
    ChanceWithoutMoments {
        /// The link, or the peer with the access line, in words.
        link: String,
        /// Property of the link for which no second moment can be followed, in words.
        why: &'static str,
    },
    /// The second moment takes too long.
    #[error(
        "the second moment of this scene takes about {operations:.0e} operations: at most {most:.0e} are allowed; set the drift of the clocks to 0, or simulate \
         the scene with several seeds instead"
    )]
    TooManyOperations {
        /// Number of operations of the computation, by an estimate that is good to a factor of about three.
        operations: f64,
        /// Greatest number of operations allowed.
        most: f64,
    },
    /// The matrices of a part take more memory than the watch allows.
    #[error(
        "a part of this scene has {states} states, most of them samples on the way, and its eigenvalues take {}: expected at most {}; a shorter delay, or a longer \
         coordination.update, has fewer states, --memory of `cohaptic stability point` and `cohaptic admittance` allows more, \
         and simulations need no matrix (`cohaptic check`, `cohaptic run`)",
        Memory(*.bytes), Memory::of(*.most)
    )]
    TooMuchMemory {
        /// Number of states of the part.
        states: usize,
        /// Memory of the part's matrices \[bytes\].
        bytes: f64,
        /// Memory allowed \[bytes\]: see [`Watch::most_memory`](crate::Watch::most_memory).
        most: u64,
    },
    /// The watch stopped the analysis.
    #[error("the analysis was stopped before its end")]
    Stopped,
    /// The second moment has too many unknowns.
    #[error(
        "the second moment of this scene needs {} numbers, {} joint states of its links: expected at most {most}; simulate the scene with several seeds instead",
        Many(*.unknowns), Many(*.joint)
    )]
    TooManyMoments {
        /// Number of joint states of the chains of all links; `None` if the number exceeds `usize`.
        joint: Option<usize>,
        /// Number of unknowns of the second moment; `None` if the number exceeds `usize`.
        unknowns: Option<usize>,
        /// Largest number of unknowns allowed.
        most: usize,
    },
}

/// A number for messages; `None` is a number too large to be computed.
struct Many(Option<usize>);

impl std::fmt::Display for Many {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Some(number) => write!(formatter, "{}", SixDigits(crate::rounding::real(number))),
            None => formatter.write_str("far too many"),
        }
    }
}
