//! The catalogue of keys: every key with its meaning, unit, default and form, for editors and for authors of scenes.
//!
//! The readers of this crate decide what a file means; this is the catalogue of what they read. A test reads files in which every table occurs, and
//! compares the keys that the readers asked for with those that stand here: neither may have one more. Ranges and units of numbers are those of the
//! readers themselves.
//!
//! [`json_schema`] is the catalogue as a JSON Schema. It is coarser than the readers: what depends on another key, such as a unit that fits, a peer that
//! exists, or two keys that exclude each other, is left to them.

mod form;
mod json;
mod link;
mod relay;
mod router;
mod scene;
#[cfg(test)]
mod tests;

pub use form::{Amount, Form, Key, Need, Table, Words};
pub use json::json_schema;

/// A kind of file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FileSchema {
    /// A scene.
    Scene,
    /// What `cohaptic relay` reads.
    Relay,
    /// What `cohaptic router` reads.
    Router,
}

impl FileSchema {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Scene, Self::Relay, Self::Router];

    /// The keys at the top of such a file.
    #[must_use]
    pub const fn root(self) -> &'static Table {
        match self {
            Self::Scene => &scene::ROOT,
            Self::Relay => &relay::ROOT,
            Self::Router => &router::ROOT,
        }
    }

    /// What such a file is called.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Scene => "cohaptic scene",
            Self::Relay => "cohaptic relay file",
            Self::Router => "cohaptic router file",
        }
    }
}

#[cfg(test)]
pub(crate) use tests::seen;
