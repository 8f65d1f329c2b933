//! Loss: models of lost packets, and the stage that decides about each packet.

mod four_state;
mod gilbert_elliott;
mod in_time;
mod pattern;

use crate::laws::chance::percent;
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use cohaptic_units::print::Span;

use crate::laws::chance::CHANCE;
use crate::parameters::{Form, Key, MOST, PACKETS, Table, number, optional, required, usual};
use crate::stages::outage::SPAN;
use cohaptic_units::{Instant, Probability};

pub use four_state::{Bursts, FourState, FourStateError};
pub use gilbert_elliott::GilbertElliott;
pub(crate) use gilbert_elliott::State as GilbertElliottState;
pub use in_time::{GilbertElliottInTime, NoTime};
pub use pattern::{Counts, Pattern, PatternError};

use crate::laws::chance::{Chance, ChanceStage};
use crate::random::{PacketDraws, Purpose, unit};

/// Model of loss.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum Loss {
    /// No packet is lost, and no random number is drawn.
    #[default]
    None,
    /// Every packet is lost with the same probability, independently of all further packets.
    Independent(Probability),
    /// A packet is lost more likely if the previous packet was lost. Mean and autocorrelation of losses are exactly as configured.
    Correlated(Chance),
    /// Losses come in bursts: a Markov chain of a good and a bad state.
    GilbertElliott(GilbertElliott),
    /// Losses come in bursts with a mean length in seconds, not in packets: a chain of a good and a bad state in continuous time.
    GilbertElliottInTime(GilbertElliottInTime),
    /// Losses come in bursts with received packets inside, and single packets are lost between bursts.
    FourState(FourState),
    /// Losses are chosen packets or chosen spans of time. No random number is drawn.
    Pattern(Pattern),
}

impl Loss {
    /// Returns the long-run fraction of packets lost, or `None` if the fraction depends on the start or on the instants of packets.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        match self {
            Self::None => Some(0.0),
            Self::Independent(probability) => Some(probability.get()),
            Self::Correlated(chance) => Some(chance.probability().get()),
            Self::GilbertElliott(chain) => chain.mean_loss(),
            Self::GilbertElliottInTime(chain) => Some(chain.mean_loss()),
            Self::FourState(chain) => Some(chain.mean_loss()),
            Self::Pattern(pattern) => pattern.mean_loss(),
        }
    }

    /// Returns the mean number of packets lost in a row, or `None` if the number has no simple law: for losses with other causes in between, and for chosen
    /// losses.
    ///
    /// The number is 1/(1−p) for independent losses, 1/((1−ρ)(1−p)) for correlated losses, and 1/r for a Gilbert–Elliott chain with the loss of every packet in
    /// the bad state and of no packet in the good state.
    #[must_use]
    pub fn mean_run(&self) -> Option<f64> {
        let run = match self {
            Self::Independent(probability) => 1.0 / (1.0 - probability.get()),
            Self::Correlated(chance) => 1.0 / ((1.0 - chance.correlation()) * (1.0 - chance.probability().get())),
            Self::GilbertElliott(chain) if (chain.h, chain.k) == (Probability::ZERO, Probability::ONE) => 1.0 / chain.r.get(),
            Self::None | Self::GilbertElliott(_) | Self::GilbertElliottInTime(_) | Self::FourState(_) | Self::Pattern(_) => return None,
        };
        // Without losses, or with nothing but losses, no run has a mean length.
        (run.is_finite() && self.mean().is_some_and(|mean| mean > 0.0)).then_some(run)
    }

    /// Returns the autocorrelation of losses `lag` packets apart, or `None` if there is no simple law or losses do not vary.
    #[must_use]
    pub fn autocorrelation(&self, lag: u32) -> Option<f64> {
        self.mean().filter(|mean| *mean > 0.0 && *mean < 1.0)?;
        match self {
            Self::Independent(_) => Some(if lag == 0 { 1.0 } else { 0.0 }),
            // The chain of losses has two states with the eigenvalue ρ, so the autocorrelation is ρᵏ.
            Self::Correlated(chance) => Some(libm::pow(chance.correlation(), f64::from(lag))),
            Self::GilbertElliott(chain) => chain.autocorrelation(lag),
            Self::None | Self::GilbertElliottInTime(_) | Self::FourState(_) | Self::Pattern(_) => None,
        }
    }

    /// Returns whether the model draws random numbers.
    #[must_use]
    pub(crate) const fn is_random(&self) -> bool {
        !matches!(self, Self::None | Self::Pattern(_))
    }
}

/// Loss stage of one link: the model with its state.
#[derive(Clone, Debug)]
pub(crate) enum LossStage {
    Independent(Probability),
    /// Boxed, because few links configure a model with state and an unboxed model would enlarge the loss stage of every link.
    WithMemory(Box<Remembering>),
}

/// Models with a decision from more than the packet's first random word.
#[derive(Clone, Debug)]
pub(crate) enum Remembering {
    Correlated(Option<ChanceStage>),
    GilbertElliott(GilbertElliott, gilbert_elliott::State),
    InTime(GilbertElliottInTime, Option<in_time::Seen>),
    FourState(FourState, four_state::State),
    Pattern(Pattern),
}

impl LossStage {
    /// Returns the stage for a model, or `None` if the model loses nothing. `initial` is the random word for the initial state of a chain.
    pub(crate) fn new(loss: Loss, initial: u64) -> Option<Self> {
        Self::reconfigured(None, loss, initial)
    }

    /// Returns the stage with the model `loss`. A chain stays in its state if the previous model is of the same kind.
    pub(crate) fn reconfigured(before: Option<Self>, loss: Loss, initial: u64) -> Option<Self> {
        // Independent loss has no state to continue.
        let before = match before {
            Some(Self::WithMemory(before)) => Some(*before),
            Some(Self::Independent(_)) | None => None,
        };
        // A chain of the same kind goes on from its state, with the new probabilities.
        let stage = match (before, loss) {
            (_, Loss::None) => return None,
            (_, Loss::Independent(probability)) => return Some(Self::Independent(probability)),
            (Some(Remembering::GilbertElliott(_, state)), Loss::GilbertElliott(chain)) => Remembering::GilbertElliott(chain, state),
            (_, Loss::GilbertElliott(chain)) => Remembering::GilbertElliott(chain, chain.stationary_state(initial)),
            (Some(Remembering::InTime(_, seen)), Loss::GilbertElliottInTime(chain)) => Remembering::InTime(chain, seen),
            (_, Loss::GilbertElliottInTime(chain)) => Remembering::InTime(chain, None),
            (Some(Remembering::FourState(_, state)), Loss::FourState(chain)) => Remembering::FourState(chain, state),
            (_, Loss::FourState(chain)) => Remembering::FourState(chain, chain.initial_state(unit(initial))),
            (Some(Remembering::Correlated(stage)), Loss::Correlated(chance)) => Remembering::Correlated(ChanceStage::reconfigured(stage, chance)),
            (_, Loss::Correlated(chance)) => Remembering::Correlated(ChanceStage::new(chance)),
            (_, Loss::Pattern(pattern)) => Remembering::Pattern(pattern),
        };
        Some(Self::WithMemory(Box::new(stage)))
    }

    /// Returns whether the packet `number` is lost. `word` is the packet's first random word for loss, and `packet` makes the packet's draws where `word` is not
    /// enough.
    #[inline(always)]
    pub(crate) fn loses(&mut self, now: Instant, number: u64, word: u64, packet: impl FnOnce() -> PacketDraws) -> bool {
        match self {
            Self::Independent(probability) => probability.happens(word),
            Self::WithMemory(stage) => stage.loses(now, number, word, packet()),
        }
    }
}

impl Remembering {
    fn loses(&mut self, now: Instant, number: u64, word: u64, packet: PacketDraws) -> bool {
        match self {
            Self::Correlated(chance) => chance.as_mut().is_some_and(|chance| chance.happens(word)),
            // The second word is drawn only for a loss that is uncertain within a state.
            Self::GilbertElliott(chain, state) => chain.loses(state, word, || packet.more(Purpose::Loss).next_word()),
            // The first word moves the chain, and the second word decides about the loss in the new state.
            Self::InTime(chain, seen) => chain.loses(seen, now, word, || packet.more(Purpose::Loss).next_word()),
            Self::FourState(chain, state) => chain.loses(state, unit(word)),
            Self::Pattern(pattern) => pattern.covers(number, now),
        }
    }
}

/// Parameters of losses.
pub(crate) const KEYS: [Key; 2] = [
    usual("loss", LOSS, "0", "Probability that a packet is lost, or a model of bursts, or chosen packets"),
    usual("mark-instead-of-loss", Form::Boolean, "false", "Whether packets that would be lost are marked instead (ECN)"),
];
const LOSS: Form = Form::AnyOf(&[Form::Probability, Form::Table(&LOSS_TABLE)]);
static LOSS_TABLE: Table = Table::of(&[&[
    optional("gilbert-elliott", Form::Table(&GILBERT_ELLIOTT), "Bursts: a good and a bad state, for each packet or in time"),
    optional("states", Form::Table(&FOUR_STATES), "Bursts: the four states of tc-netem"),
    optional("bursts", Form::Table(&BURSTS), "Bursts, given by the lost fraction and their length"),
    optional("correlated", CHANCE, "Losses that are correlated between successive packets"),
    optional(
        "packets",
        Form::List(&Form::AnyOf(const { &[Form::Integer(0, MOST), Form::Like(&["10-19"])] })),
        "Numbers of the lost packets, counted from 0",
    ),
    optional("times", Form::List(&Form::Table(&SPAN)), "Spans in which every packet is lost"),
    optional(
        "every",
        Form::AnyOf(&[Form::Integer(1, MOST), Form::Duration]),
        "Number of packets or time after which the pattern of packets or times repeats",
    ),
]]);
static GILBERT_ELLIOTT: Table = Table::of(&[&[
    optional("p", Form::Probability, "Probability of going from good to bad at each packet").expecting("a probability, of going from good to bad"),
    optional("r", Form::Probability, "Probability of going from bad to good at each packet; 1 - p by default"),
    optional("mean-good", Form::PositiveDuration, "Mean time in the good state, in place of p")
        .expecting("the mean time in the good state, a duration such as \"160ms\""),
    optional("mean-bad", Form::PositiveDuration, "Mean time in the bad state, in place of r")
        .expecting("the mean time in the bad state, a duration such as \"40ms\""),
    usual("h", Form::Probability, "0", "Probability that a packet gets through in the bad state"),
    usual("k", Form::Probability, "1", "Probability that a packet gets through in the good state"),
]]);
static FOUR_STATES: Table = Table::of(&[&[
    required("p13", Form::Probability, "Probability of going from receiving to a burst of loss")
        .expecting("a probability, of going from the gap to a burst"),
    optional("p31", Form::Probability, "Probability of going from a burst of loss to receiving; 1 - p13 by default"),
    usual("p32", Form::Probability, "0", "Probability of going from a burst of loss to receiving within a burst"),
    usual("p23", Form::Probability, "1", "Probability of going from receiving within a burst to loss"),
    usual("p14", Form::Probability, "0", "Probability of going from receiving to a single loss"),
]]);
static BURSTS: Table = Table::of(&[&[
    required("loss", Form::Probability, "Mean fraction of lost packets").expecting("a probability, the mean fraction lost"),
    required("length", number(PACKETS), "Mean length of a burst").expecting("the mean length of a burst, a number of packets of at least 1"),
    usual("density", Form::Probability, "1", "Fraction of lost packets within bursts"),
    usual("isolated", Form::Probability, "0", "Fraction of lost packets outside of bursts"),
    usual("good-run", number(PACKETS), "1", "Mean number of packets received in a row within a burst"),
]]);

impl Loss {
    /// Returns the model in words, or `None` if the model loses nothing.
    pub(crate) fn words(&self) -> Option<String> {
        let mean = self.mean().map_or_else(String::new, |mean| format!(", {} on average", percent(mean)));
        Some(match self {
            Self::None => return None,
            Self::Independent(probability) => format!("independent loss {}", percent(probability.get())),
            Self::Correlated(packets) => format!("loss of {}", packets.words()),
            Self::GilbertElliott(_) => format!("Gilbert-Elliott loss{mean}"),
            Self::GilbertElliottInTime(chain) => {
                let (good, bad) = chain.mean_times();
                format!("Gilbert-Elliott loss in time (good {}, bad {}){mean}", Span(good), Span(bad))
            }
            Self::FourState(_) => format!("four-state loss{mean}"),
            Self::Pattern(pattern) => match pattern.counts() {
                Counts::Packets => format!("loss of chosen packets{mean}"),
                Counts::Nanoseconds => format!("loss at chosen times{mean}"),
            },
        })
    }
}
