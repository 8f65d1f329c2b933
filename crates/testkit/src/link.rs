//! Descriptions of links.

use cohaptic_units::Instant;
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{KernelNetem, LinkConfig, LinkModel, Modulated};

/// Description of a link: a model, a configuration, or the words of `tc-netem`.
pub trait ToLink {
    /// Returns the model of the link.
    ///
    /// # Panics
    ///
    /// If the words describe no link that can be emulated. The message names the place of the error.
    fn to_link(&self) -> LinkModel;

    /// Returns the words of `tc-netem` for the same link, for the test that a failure prints. Empty for the ideal link, `None` for a link that words cannot
    /// describe.
    fn words(&self) -> Option<String> {
        None
    }
}

/// Replacement of a link at an instant of the run.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct LinkChange {
    pub(crate) at: Instant,
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) link: LinkModel,
}

impl ToLink for LinkModel {
    fn to_link(&self) -> LinkModel {
        self.clone()
    }
}

impl ToLink for LinkConfig {
    fn to_link(&self) -> LinkModel {
        self.clone().into()
    }
}

impl ToLink for Modulated {
    fn to_link(&self) -> LinkModel {
        self.clone().into()
    }
}

impl ToLink for KernelNetem {
    fn to_link(&self) -> LinkModel {
        self.clone().into()
    }
}

impl ToLink for str {
    /// Parses the words of `tc-netem`, which are emulated exactly: see [`Netem::to_link_config`]. An empty text is the ideal link.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    fn to_link(&self) -> LinkModel {
        if self.trim().is_empty() {
            return LinkModel::default();
        }
        let netem = Netem::parse(self).unwrap_or_else(|error| panic!("this is not a link: {error}\n{}", error.excerpt(self)));
        netem.to_link_config(&mut |_| None).unwrap_or_else(|error| panic!("`{self}` is not a link: {error}")).into()
    }

    fn words(&self) -> Option<String> {
        Some(self.trim().to_owned())
    }
}

impl ToLink for String {
    fn to_link(&self) -> LinkModel {
        (**self).to_link()
    }

    fn words(&self) -> Option<String> {
        ToLink::words(&**self)
    }
}

impl<T: ToLink + ?Sized> ToLink for &T {
    fn to_link(&self) -> LinkModel {
        (**self).to_link()
    }

    fn words(&self) -> Option<String> {
        ToLink::words(&**self)
    }
}
