//! Descriptions of links.

use cohaptic_units::Instant;
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{KernelNetem, LinkConfig, LinkModel, Modulated};

#[cfg(feature = "files")]
use crate::library::LibraryLink;

/// Description of a link: a model, a configuration, or the words of `tc-netem`.
pub trait ToLink {
    /// Returns the model of the link.
    ///
    /// # Panics
    ///
    /// If the words describe no link that can be emulated. The message names the place of the error.
    fn to_link(&self) -> LinkModel;

    /// Returns the words of `tc-netem` for the same link, for the test printed after a failure. Empty for the ideal link, `None` for a link that words cannot
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
    /// Parses the words of `tc-netem` for an exact emulation: see [`Netem::to_link_config`]. An empty text is the ideal link. With the feature `files`, a text
    /// can also be the name of a measured link, such as `starlink/up`: see `docs/how-to-named-link.md` in the repository.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    fn to_link(&self) -> LinkModel {
        parse(self).unwrap_or_else(|fault| panic!("{fault}"))
    }

    fn words(&self) -> Option<String> {
        // The name of a link of the library is given its version, so that a test printed today means the same link for ever.
        #[cfg(feature = "files")]
        if let Some(Ok(link)) = LibraryLink::parse(self) {
            return Some(link.to_string());
        }
        Some(self.trim().to_owned())
    }
}

/// Parses the words of `tc-netem`, or the name of a link of the library. The error names the place of the fault.
pub(crate) fn parse(words: &str) -> Result<LinkModel, String> {
    if words.trim().is_empty() {
        return Ok(LinkModel::default());
    }
    // A name of the library is no word of netem, so the library is asked first and a fault of the rest of the name is reported as such.
    if let Some(link) = named(words.trim()) {
        return link;
    }
    let netem = Netem::parse(words).map_err(|error| format!("this is not a link: {error}\n{}", error.excerpt(words)))?;
    netem.to_link_config(&mut |_| None).map(LinkModel::from).map_err(|error| format!("`{words}` is not a link: {error}"))
}

/// Returns the link of the library named `text`; `None` if the text is no name of the library.
#[cfg(feature = "files")]
pub(crate) fn named(text: &str) -> Option<Result<LinkModel, String>> {
    let link = LibraryLink::parse(text)?.and_then(|link| link.one_way());
    Some(link.map_err(|error| format!("`{text}` is not a link: {error}")))
}

/// Without the feature `files` there is no library.
#[cfg(not(feature = "files"))]
pub(crate) fn named(_text: &str) -> Option<Result<LinkModel, String>> {
    None
}

#[cfg(feature = "files")]
impl ToLink for LibraryLink {
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    fn to_link(&self) -> LinkModel {
        self.one_way().unwrap_or_else(|error| panic!("`{self}` is not a link: {error}"))
    }

    fn words(&self) -> Option<String> {
        Some(self.to_string())
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

#[cfg(all(test, feature = "files"))]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_the_library_is_a_link_and_its_own_words() {
        assert_eq!("transatlantic".to_link().mean_delay(), std::time::Duration::from_millis(38));
        assert_eq!(ToLink::words(" starlink/up ").as_deref(), Some("starlink@1/up"));
        assert!(matches!("starlink/up".to_link(), LinkModel::Modulated(_)));
    }

    #[test]
    #[should_panic(expected = "starlink differs by direction: expected starlink/down, towards the user, or starlink/up")]
    fn a_name_needs_a_direction_where_both_differ() {
        "starlink".to_link();
    }
}
