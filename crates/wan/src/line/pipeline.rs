//! The deciding part of a line, compiled to the smallest form sufficient for the link.
//!
//! | link | compiled to |
//! | --- | --- |
//! | a constant delay | one addition |
//! | outage, loss, jitter, order policy | a function from a packet to its arrival |
//! | anything else | an engine with packets inside, with copies and wakes |

use alloc::boxed::Box;
use core::fmt;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;
use crate::line::direct::{Direct, Words};
use crate::line::engine::{Engine, Kind};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::replay::ReplayStage;
use crate::line::staged::Staged;
use crate::netem::kernel_link::KernelStage;
use crate::packet::Outputs;
use crate::random::{Purpose, Stream};
use crate::stages::config::LinkConfig;
use crate::stages::modulation::ModulationStage;
use crate::stages::order::OrderStage;
use crate::stages::queue::BottleneckStage;

/// The error of a call with an instant before an earlier call's instant. The callee is unchanged.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TimeWentBack {
    /// Instant of the failed call.
    pub now: Instant,
    /// Latest instant of the calls before.
    pub was: Instant,
}

impl fmt::Display for TimeWentBack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { now, was } = self;
        write!(f, "time went back to {now} after {was}")
    }
}

impl core::error::Error for TimeWentBack {}

/// Checks that `now` is not before `clock`, and sets `clock` to `now`.
pub(crate) fn check_time(clock: &mut Instant, now: Instant) -> Result<(), TimeWentBack> {
    if now < *clock {
        return Err(TimeWentBack { now, was: *clock });
    }
    *clock = now;
    Ok(())
}

/// Fate of an offered packet, as far as it is certain at once.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outcome {
    Arrives(Instant),
    Dropped(DropCause),
    /// The packet must be offered to the engine: see [`Pipeline::engine`].
    Enters,
}

/// The compiled form of a link.
#[derive(Clone, Debug)]
pub(crate) enum Pipeline<T> {
    /// A constant delay \[ns\] only, and the latest arrival so far, for a later change to the order `in-order`.
    Constant(u64, Instant),
    Direct(Box<Direct>),
    Engine(Box<Engine<T>>),
}

impl<T: Clone> Pipeline<T> {
    /// Makes the smallest pipeline for this model, or the most general pipeline if `general` is set.
    pub(crate) fn new(seed: u64, name: &LinkName, model: LinkModel, general: bool) -> Self {
        match model {
            LinkModel::Fixed(config) if config.is_constant_delay() && !general => Self::Constant(constant_nanos(&config), Instant::ZERO),
            LinkModel::Fixed(config) if config.is_direct() && !general => Self::Direct(Box::new(Direct::new(seed, name, &config))),
            LinkModel::Fixed(_) | LinkModel::Modulated(_) | LinkModel::Replay(_) | LinkModel::Kernel(_) => {
                Self::Engine(Box::new(Engine::new(kind(Instant::ZERO, seed, name, model, None))))
            }
        }
    }

    /// Makes an engine with the stages in `direct` and a bottleneck. The bottleneck keeps its packets.
    pub(crate) fn resumed(now: Instant, direct: Direct, config: LinkConfig, bottleneck: BottleneckStage<T>) -> Self {
        Self::Engine(Box::new(Engine::new(Kind::Staged(Box::new(Staged::resumed(now, direct, config, bottleneck))))))
    }

    /// Returns the first random words of packet number `number` for [`Pipeline::offer`], or zeros if the packet needs no words.
    #[inline]
    pub(crate) fn words(&self, number: u64) -> Words {
        match self {
            Self::Direct(direct) => direct.words(number),
            Self::Constant(..) | Self::Engine(_) => [0; 2],
        }
    }

    /// Decides about packet number `number` of this link. `words` holds the packet's first words if drawn before.
    #[inline(always)]
    pub(crate) fn offer(&mut self, now: Instant, number: u64, words: Option<Words>) -> Outcome {
        match self {
            Self::Constant(delay, latest) => {
                let at = now.saturating_add_nanos(*delay);
                *latest = at.max(*latest);
                Outcome::Arrives(at)
            }
            Self::Direct(direct) => {
                let words = words.unwrap_or_else(|| direct.words(number));
                match direct.offer(now, number, words) {
                    Ok(at) => Outcome::Arrives(at),
                    Err(cause) => Outcome::Dropped(cause),
                }
            }
            Self::Engine(_) => Outcome::Enters,
        }
    }

    /// Returns the engine, or `None` if the link has no engine.
    pub(crate) fn engine(&mut self) -> Option<&mut Engine<T>> {
        match self {
            Self::Engine(engine) => Some(engine),
            Self::Constant(..) | Self::Direct(_) => None,
        }
    }

    /// Returns the instant of the engine's next wake, or `None` if no engine waits.
    #[inline]
    pub(crate) fn next_wake(&self) -> Option<Instant> {
        match self {
            Self::Engine(engine) => engine.next_at(),
            Self::Constant(..) | Self::Direct(_) => None,
        }
    }

    /// Changes the model at `now`. Packets in propagation keep their delay. Packets freed from the engine by the change are put into `outputs`.
    pub(crate) fn reconfigure(&mut self, now: Instant, seed: u64, name: &LinkName, model: LinkModel, outputs: &mut Outputs<T>) {
        match (self, model) {
            (Self::Constant(delay, _), LinkModel::Fixed(config)) if config.is_constant_delay() => *delay = constant_nanos(&config),
            (Self::Direct(direct), LinkModel::Fixed(config)) if config.is_direct() => direct.reconfigure(now, &config),
            (Self::Engine(engine), model) => reconfigure_engine(engine, now, seed, name, model, outputs),
            (pipeline, model) => {
                // The state of the direct stages and the latest arrival go on in the new pipeline. The new pipeline is never a `Constant`, because a `Constant`
                // has no such state.
                let past = match pipeline {
                    Self::Direct(direct) => Some((**direct).clone()),
                    Self::Constant(delay, latest) => {
                        let delay = crate::stages::delay::Delay::constant(core::time::Duration::from_nanos(*delay));
                        let mut direct = Direct::new(seed, name, &LinkConfig { delay, ..LinkConfig::default() });
                        // The latest arrival goes on, so packets on the way are not overtaken under `in-order`.
                        direct.order = OrderStage::resumed(*latest);
                        Some(direct)
                    }
                    Self::Engine(_) => None,
                };
                *pipeline = match (model, past) {
                    (LinkModel::Fixed(config), Some(mut direct)) if config.is_direct() => {
                        direct.reconfigure(now, &config);
                        Self::Direct(Box::new(direct))
                    }
                    // Every model beyond a direct link needs an engine.
                    (model, past) => Self::Engine(Box::new(Engine::new(kind(now, seed, name, model, past)))),
                };
            }
        }
    }
}

fn reconfigure_engine<T: Clone>(engine: &mut Engine<T>, now: Instant, seed: u64, name: &LinkName, model: LinkModel, outputs: &mut Outputs<T>) {
    // The old model applies up to and including `now`.
    engine.pass(now, outputs);
    match (&mut engine.kind, model) {
        // Packets inside are at a place in the old order of stages, and go on in this order. New packets meet the new order, with the present state of the
        // direct stages.
        (Kind::Staged(staged), model) if model.layout().is_some_and(|layout| layout != staged.layout()) => {
            let past = staged.direct().clone();
            engine.replace(kind(now, seed, name, model, Some(past)));
        }
        (Kind::Staged(staged), LinkModel::Fixed(config)) => staged.reconfigure(now, config, None, outputs),
        (Kind::Staged(staged), LinkModel::Modulated(modulated)) => {
            let modulation = ModulationStage::new(seed, modulated, now);
            staged.reconfigure(now, modulation.config().clone(), Some(modulation), outputs);
        }
        // A replay and the kernel's queue take no state over from stages, and give no state to stages.
        (_, model) => engine.replace(kind(now, seed, name, model, None)),
    }
}

/// Makes the engine of a model. `past` holds the direct stages of the pipeline before, if any.
fn kind<T: Clone>(now: Instant, seed: u64, name: &LinkName, model: LinkModel, past: Option<Direct>) -> Kind<T> {
    let staged = |config: LinkConfig, modulation| {
        // Outages of a link with stages from a later change begin at `now`, not at the beginning of the run.
        let direct = past.unwrap_or_else(|| {
            let mut direct = Direct::new(seed, name, &LinkConfig::default());
            direct.reconfigure(now, &config);
            direct
        });
        Kind::Staged(Box::new(Staged::new(now, direct, config, modulation)))
    };
    match model {
        LinkModel::Fixed(config) => staged(config, None),
        LinkModel::Modulated(modulated) => {
            let modulation = ModulationStage::new(seed, modulated, now);
            staged(modulation.config().clone(), Some(modulation))
        }
        LinkModel::Replay(log) => Kind::Replay(ReplayStage::new(log)),
        LinkModel::Kernel(netem) => {
            // The kernel's queue has a random generator of its kind, so the link's stream gives the seed only.
            let seed = Stream::new(seed, name.as_str().as_bytes()).packet(0).first(Purpose::InitialState);
            Kind::Kernel(Box::new(KernelStage::new(netem.qdisc(seed))))
        }
    }
}

fn constant_nanos(config: &LinkConfig) -> u64 {
    u64::try_from(config.delay.mean().as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::netem::Netem;

    fn of_words(words: &str, general: bool) -> Pipeline<()> {
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        Pipeline::new(1, &LinkName::between("a", "b"), config.into(), general)
    }

    #[test]
    fn a_link_of_words_is_compiled_to_the_least_that_it_needs() {
        assert!(matches!(of_words("delay 24ms", false), Pipeline::Constant(24_000_000, _)));
        assert!(matches!(of_words("delay 24ms 2ms loss 1%", false), Pipeline::Direct(_)));
        for words in ["delay 24ms limit 10", "delay 24ms duplicate 1%", "delay 24ms rate 1mbit", "delay 24ms loss 1% ecn"] {
            assert!(matches!(of_words(words, false), Pipeline::Engine(_)), "{words}");
        }
        assert!(matches!(of_words("delay 24ms", true), Pipeline::Engine(_)));
    }
}
