//! Models of links.

use crate::laws::sojourn::Sojourn;
use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::sync::Arc;
use alloc::vec::Vec;
use cohaptic_units::print::Counted;
use core::time::Duration;

use crate::fates::log::FateLog;
use crate::netem::kernel::{self, Qdisc, QdiscError};
use crate::netem::{Netem, TableName};
use crate::parameters::{Form, Key, NONE, Table, required, usual};
use crate::stages::config::LINK_PARAMETERS;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::loss::Loss;
use crate::stages::modulation::Modulated;
use crate::stages::queue::Load;

/// Model of a link: one configuration, several configurations in turn, a recording, or Linux's netem to the bit.
#[derive(Clone, PartialEq, Debug)]
#[expect(clippy::large_enum_variant, reason = "nearly all links are of the large variant, and a scene shares one model between its links")]
pub enum LinkModel {
    /// One configuration for the whole run.
    Fixed(LinkConfig),
    /// A configuration for each state of a modulator.
    Modulated(Modulated),
    /// A log of fates. The n-th packet meets the fate of the n-th packet of the log, after the same time since its offer. A packet offered after the end of
    /// the log is dropped.
    Replay(Arc<FateLog>),
    /// The behaviour of Linux 6.6 with these words of netem: see [`crate::netem::kernel`].
    Kernel(KernelNetem),
}

/// A checked configuration of the kernel's netem. Packets have the length seen by the link, plus a configured overhead. Each link draws with a separate seed,
/// unless the words name a seed.
#[derive(Clone, PartialEq, Debug)]
pub struct KernelNetem {
    words: Netem,
    tables: Arc<[(TableName, kernel::Table)]>,
}

impl KernelNetem {
    /// Checks the words. `tables` holds the named distributions that are not built in.
    ///
    /// # Errors
    ///
    /// [`QdiscError`] if options contradict each other, a delay is larger than `tc` can represent, or a table is missing.
    pub fn new(words: Netem, tables: Vec<(TableName, kernel::Table)>) -> Result<Self, QdiscError> {
        let checked = Self { words, tables: tables.into() };
        // A trial with any seed finds every error.
        checked.build::<()>(0)?;
        Ok(checked)
    }

    /// Returns the words of netem.
    #[must_use]
    pub const fn words(&self) -> &Netem {
        &self.words
    }

    pub(crate) fn qdisc<T>(&self, seed: u64) -> Qdisc<T> {
        // `new` built the same words and tables, and the seed decides nothing about success.
        self.build(seed).expect("it was built once when it was checked")
    }

    fn build<T>(&self, seed: u64) -> Result<Qdisc<T>, QdiscError> {
        let table = |wanted: &TableName| self.tables.iter().find(|(name, _)| name == wanted).map(|(_, table)| table.clone());
        Qdisc::new(&self.words, seed, table)
    }
}

impl Default for LinkModel {
    /// Returns the model of an ideal link: no delay, no loss, no queue.
    fn default() -> Self {
        Self::Fixed(LinkConfig::default())
    }
}

impl From<LinkConfig> for LinkModel {
    fn from(config: LinkConfig) -> Self {
        Self::Fixed(config)
    }
}

impl From<Modulated> for LinkModel {
    fn from(modulated: Modulated) -> Self {
        Self::Modulated(modulated)
    }
}

impl From<KernelNetem> for LinkModel {
    fn from(netem: KernelNetem) -> Self {
        Self::Kernel(netem)
    }
}

impl LinkModel {
    /// Returns the configuration if the model is a single one, else `None`.
    #[must_use]
    pub const fn as_fixed(&self) -> Option<&LinkConfig> {
        match self {
            Self::Fixed(config) => Some(config),
            Self::Modulated(_) | Self::Replay(_) | Self::Kernel(_) => None,
        }
    }

    /// Returns the order of the link's stages, or `None` if the model has no stages.
    pub(crate) fn layout(&self) -> Option<Layout> {
        match self {
            Self::Fixed(config) => Some(config.layout),
            // All configurations of a modulated link have one layout, so the first configuration is enough.
            Self::Modulated(modulated) => modulated.configs().first().map(|config| config.layout),
            Self::Replay(_) | Self::Kernel(_) => None,
        }
    }

    /// Returns whether the link delays every packet by the same time and does no more.
    #[must_use]
    pub fn is_constant_delay(&self) -> bool {
        self.as_fixed().is_some_and(LinkConfig::is_constant_delay)
    }

    /// Returns the link's delay of every packet of this load, or `None` if the link does more. The delay is the transmission time, if no packet waits
    /// for a transmission, plus the propagation delay.
    #[must_use]
    pub fn constant_delay_of(&self, load: Load) -> Option<Duration> {
        self.as_fixed()?.constant_delay_of(load)
    }

    /// Returns the configured mean propagation delay: the unweighted mean over the states of a modulator, and zero for a recording.
    #[must_use]
    pub fn mean_delay(&self) -> Duration {
        match self {
            Self::Fixed(config) => config.delay.mean(),
            Self::Modulated(modulated) => {
                let configs = modulated.configs();
                configs.iter().map(|config| config.delay.mean()).sum::<Duration>() / u32::try_from(configs.len()).unwrap_or(u32::MAX)
            }
            Self::Replay(_) => Duration::ZERO,
            Self::Kernel(netem) => netem.words().delay.as_ref().map_or(Duration::ZERO, |delay| delay.time),
        }
    }

    /// Returns this model with `loss` in place of its own model of loss, in each state of a modulator. Losses of recorded traces and of listed impairments
    /// stay. A replay and the kernel's netem have no separate model of loss, and are returned unchanged.
    #[must_use]
    pub fn with_loss(&self, loss: &Loss) -> Self {
        let losing = |config: &LinkConfig| LinkConfig { loss: loss.clone(), ..config.clone() };
        match self {
            Self::Fixed(config) => Self::Fixed(losing(config)),
            Self::Modulated(modulated) => Self::Modulated(modulated.map_configs(losing)),
            Self::Replay(_) | Self::Kernel(_) => self.clone(),
        }
    }

    /// Returns whether any part of this link is random.
    #[must_use]
    pub fn has_chance(&self) -> bool {
        match self {
            Self::Fixed(config) => config.has_chance(),
            Self::Modulated(_) | Self::Kernel(_) => true,
            Self::Replay(_) => false,
        }
    }

    /// Returns whether the link may deliver packets with flipped bits.
    #[must_use]
    pub fn may_damage(&self) -> bool {
        match self {
            Self::Fixed(config) => config.corruption.is_some(),
            Self::Modulated(modulated) => modulated.configs().iter().any(|config| config.corruption.is_some()),
            Self::Replay(log) => log.has_damage(),
            Self::Kernel(netem) => netem.words.corrupt.is_some(),
        }
    }

    /// Returns whether the link has cross-traffic, now or in a state of its modulator.
    #[must_use]
    pub fn has_cross_traffic(&self) -> bool {
        self.configs().iter().any(|config| config.cross_traffic.is_some() && config.bottleneck.is_some())
    }

    /// Returns whether the link limits the number of packets inside, now or in a state of its modulator.
    #[must_use]
    pub fn has_limit(&self) -> bool {
        self.configs().iter().any(|config| config.limit.is_some())
    }

    /// Returns the configuration, or a configuration for each state of the modulator. Empty for a model without stages.
    fn configs(&self) -> &[LinkConfig] {
        match self {
            Self::Fixed(config) => core::slice::from_ref(config),
            Self::Modulated(modulated) => modulated.configs(),
            Self::Replay(_) | Self::Kernel(_) => &[],
        }
    }

    /// Returns whether this link draws random numbers for loss or for jitter at an offer.
    pub(crate) fn is_random(&self) -> bool {
        self.as_fixed().is_some_and(LinkConfig::is_random)
    }

    /// Returns whether a packet's fate is certain at its offer, and no packet is copied.
    pub(crate) fn is_direct(&self) -> bool {
        self.as_fixed().is_some_and(LinkConfig::is_direct)
    }
}

/// Parameters that choose the kind of a link. A modulator cannot change these parameters between its states.
pub const LINK_KIND_PARAMETERS: [Key; 4] = [
    usual("modulated", Form::AnyOf(const { &[Form::Table(&MODULATED), NONE] }), "\"none\"", "Keys for the states of a modulator"),
    usual(
        "replay",
        Form::File,
        "\"none\"",
        "Log of fates: the n-th packet meets the fate of the n-th packet of the log. Takes away all other keys; \"none\" takes it away",
    ),
    usual("netem", NETEM, "\"none\"", "Link in the words of tc-netem. Takes away all other keys; \"none\" takes it away"),
    usual("netem-profile", Form::Words(&PROFILES), "\"exact\"", "Meaning of the words of netem"),
];
static MODULATED: Table = Table::with_others(
    &[&[required("by", Form::Text, "Name of a modulator; further keys of this table are its states, each with keys of the link")]],
    &Form::Table(&STATE),
);
/// Keys of a link in one state of a modulator.
static STATE: Table = Table::over(&LINK_PARAMETERS);
const PROFILES: [(&str, &str); 2] = [("exact", "what the words say"), ("kernel-6.6", "what Linux 6.6 does when it is told so")];
const NETEM: Form = Form::Like(&["delay 20ms 5ms 25% distribution normal loss gemodel 1% 10%", "none"]);

impl LinkModel {
    /// Returns a description of the link: each configured stage with its numbers.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::Fixed(config) => config.words(),
            Self::Modulated(modulated) => {
                let states = modulated.modulator().states().iter().zip(modulated.configs()).enumerate().map(|(place, (state, config))| {
                    let lasts = state.sojourn.map_or_else(|| "for ever".to_owned(), Sojourn::words);
                    format!("state {} ({lasts}): {}", place + 1, config.words())
                });
                format!("as \"{}\" goes; {}", modulated.modulator().name(), states.collect::<Vec<_>>().join("; "))
            }
            Self::Replay(log) => format!("a replay of {}, and nothing after it", Counted(log.packets(), "packet")),
            Self::Kernel(netem) => format!("netem of Linux 6.6, to the bit: {}", netem.words()),
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use cohaptic_units::Probability;

    use super::*;
    use crate::stages::delay::Delay;
    use crate::stages::loss::Pattern;
    use crate::stages::modulation::{Modulator, ModulatorState};

    /// States of a modulator lose the chosen packets alone, and keep the delays.
    #[test]
    fn another_loss_leaves_all_else_as_it_was() {
        let chosen = Loss::Pattern(Pattern::of_packets(vec![2..3], None).unwrap());
        let config = |millis| LinkConfig {
            loss: Loss::Independent(Probability::new(0.5).unwrap()),
            delay: Delay::constant(Duration::from_millis(millis)),
            ..LinkConfig::default()
        };
        let fixed = LinkModel::from(config(8)).with_loss(&chosen);
        assert_eq!(fixed, LinkModel::from(LinkConfig { loss: chosen.clone(), ..config(8) }));
        let state = |next| ModulatorState { sojourn: None, next };
        let modulator = Modulator::new("m", vec![state(vec![0.0, 1.0]), state(vec![1.0, 0.0])]).unwrap();
        let LinkModel::Modulated(modulated) = LinkModel::from(Modulated::new(modulator, vec![config(8), config(9)]).unwrap()).with_loss(&chosen)
        else {
            panic!("the modulator stays");
        };
        let expected = [8, 9].map(|millis| LinkConfig { loss: chosen.clone(), ..config(millis) });
        assert_eq!(modulated.configs(), expected);
    }
}
