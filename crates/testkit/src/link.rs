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
    /// Parses the words of `tc-netem`, which are emulated exactly: see [`Netem::to_link_config`]. An empty text is the ideal link. With the feature `files`, a text
    /// can also be the name of a link that somebody measured, such as `starlink/up`: see `docs/how-to-named-link.md` in the repository.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    fn to_link(&self) -> LinkModel {
        if self.trim().is_empty() {
            return LinkModel::default();
        }
        #[cfg(feature = "files")]
        if let Some(link) = named(self) {
            return link;
        }
        let netem = Netem::parse(self).unwrap_or_else(|error| panic!("this is not a link: {error}\n{}", error.excerpt(self)));
        netem.to_link_config(&mut |_| None).unwrap_or_else(|error| panic!("`{self}` is not a link: {error}")).into()
    }

    fn words(&self) -> Option<String> {
        Some(self.trim().to_owned())
    }
}

/// Returns the link of the library with a name; `None` if the text is no name of the library.
#[cfg(feature = "files")]
#[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the way out")]
fn named(text: &str) -> Option<LinkModel> {
    let name = text.trim().parse::<cohaptic_linkfile::library::ProfileName>().ok()?;
    if let Err(error) = name.one_direction() {
        panic!("`{text}` is no link in one direction: {error}");
    }
    Some(cohaptic_linkfile::link_from_keys(&[format!("profile={}", text.trim())]).unwrap_or_else(|error| panic!("`{text}` is not a link: {error}")))
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

#[cfg(all(test, feature = "files"))]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_the_library_is_a_link_and_its_own_words() {
        assert_eq!("transatlantic".to_link().mean_delay(), std::time::Duration::from_millis(38));
        assert_eq!(ToLink::words("starlink@1/up").as_deref(), Some("starlink@1/up"));
        assert!(matches!("starlink/up".to_link(), LinkModel::Modulated(_)));
    }

    #[test]
    #[should_panic(expected = "starlink differs by direction: expected starlink/down, towards the user, or starlink/up")]
    fn a_name_needs_a_direction_where_both_differ() {
        "starlink".to_link();
    }
}
