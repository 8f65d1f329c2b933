//! Links in the words of `tc-netem`.

use core::fmt;
use core::str::FromStr;
use std::sync::Arc;

use cohaptic_wan::netem::{ExactError, Netem, NetemError};
use cohaptic_wan::{LinkConfig, LinkModel};

use super::stage::{self, Stage};

/// Link that emulates words of `tc-netem` exactly ([`Netem::to_link_config`]).
///
/// `Display` prints the words, `Debug` prints Rust code that makes the same value, so that the output of a failing test can be pasted into a test. The ideal
/// link is printed as `delay 0s`, which netem and scenes read as an ideal link as well. `""` and `delay 0s` are read as the ideal link.
///
/// ```
/// use cohaptic_testkit::strategies::{ImpairedLink, Stage};
///
/// let link = ImpairedLink::words("delay 24ms 2ms loss 1%");
/// assert_eq!(link.to_string(), "delay 24ms 2ms loss 1%");
/// assert_eq!(format!("{link:?}"), r#"ImpairedLink::words("delay 24ms 2ms loss 1%")"#);
/// assert_eq!(link.stages(), [Stage::Jitter, Stage::Loss]);
/// assert_eq!(ImpairedLink::ideal().to_string(), "delay 0s");
///
/// let error = "delay 24ms loss 250%".parse::<ImpairedLink>().unwrap_err();
/// assert_eq!(error.to_string(), "delay 24ms loss 250%\n                ^^^^ expected a percentage from 0 to 100");
/// ```
#[derive(Clone, Default)]
pub struct ImpairedLink {
    netem: Netem,
    config: Arc<LinkConfig>,
}

/// Error of words that describe no link.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum LinkError {
    /// The words are no words of netem. The message contains the line, and a mark under the wrong word.
    Words {
        /// Line of the words, and the mark.
        excerpt: String,
        /// Fault of the words.
        reason: NetemError,
    },
    /// The words ask for a link that cannot be emulated. Tables of distributions are not read from files here.
    Exact(ExactError),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Words { excerpt, .. } => write!(f, "{excerpt}"),
            Self::Exact(error) => fmt::Display::fmt(error, f),
        }
    }
}

impl std::error::Error for LinkError {}

impl From<ExactError> for LinkError {
    fn from(error: ExactError) -> Self {
        Self::Exact(error)
    }
}

impl ImpairedLink {
    /// Returns the link without any impairment.
    #[must_use]
    pub fn ideal() -> Self {
        Self::default()
    }

    /// Parses the words that `Debug` prints.
    ///
    /// # Panics
    ///
    /// If the words are refused; `words.parse::<ImpairedLink>()` returns an error instead.
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "documented: for words that stand in a test")]
    pub fn words(words: &str) -> Self {
        words.parse().unwrap_or_else(|error| panic!("these words do not describe a link:\n{error}"))
    }

    /// Creates a link from parsed words.
    ///
    /// # Errors
    ///
    /// [`ExactError`] if the link cannot be emulated, such as a link with a table from a file.
    pub fn new(mut netem: Netem) -> Result<Self, ExactError> {
        if netem.delay.as_ref().is_some_and(|delay| delay.time.is_zero() && delay.jitter.is_none()) {
            // Removed before the only check, below: a delay of zero without jitter contradicts nothing, and other words find no more faults without it.
            netem.delay = None;
        }
        let config = Arc::new(netem.to_link_config(&mut |_| None)?);
        Ok(Self { netem, config })
    }

    /// Returns the parsed words.
    #[must_use]
    pub const fn netem(&self) -> &Netem {
        &self.netem
    }

    /// Returns the configuration of the link.
    #[must_use]
    pub fn config(&self) -> LinkConfig {
        LinkConfig::clone(&self.config)
    }

    /// Returns the model of the link, for [`cohaptic_wan::Link`] and [`cohaptic_wan::Network`].
    #[must_use]
    pub fn model(&self) -> LinkModel {
        LinkModel::from(self.config())
    }

    /// Returns the impairments of the link, in the order of the words. A delay counts only without jitter and reordering, to which it belongs otherwise.
    /// Options with the value zero, and `seed`, do not count.
    #[must_use]
    pub fn stages(&self) -> Vec<Stage> {
        Stage::ALL.into_iter().filter(|stage| stage::has(&self.netem, *stage)).collect()
    }

    /// Returns whether the link has the impairment `stage`.
    #[must_use]
    pub fn has(&self, stage: Stage) -> bool {
        stage::has(&self.netem, stage)
    }

    /// Returns whether the link has no impairments.
    #[must_use]
    pub fn is_ideal(&self) -> bool {
        !Stage::ALL.into_iter().any(|stage| self.has(stage))
    }
}

impl PartialEq for ImpairedLink {
    fn eq(&self, other: &Self) -> bool {
        // The configuration is determined by the words.
        self.netem == other.netem
    }
}

impl FromStr for ImpairedLink {
    type Err = LinkError;

    fn from_str(words: &str) -> Result<Self, LinkError> {
        let netem = Netem::parse(words).map_err(|reason| LinkError::Words { excerpt: reason.excerpt(words), reason })?;
        Ok(Self::new(netem)?)
    }
}

impl fmt::Display for ImpairedLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.netem == Netem::default() { f.pad("delay 0s") } else { f.pad(&self.netem.to_string()) }
    }
}

impl fmt::Debug for ImpairedLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImpairedLink::words(\"{self}\")")
    }
}

impl From<&ImpairedLink> for LinkModel {
    fn from(link: &ImpairedLink) -> Self {
        link.model()
    }
}

impl From<ImpairedLink> for LinkModel {
    fn from(link: ImpairedLink) -> Self {
        link.model()
    }
}
