//! The kinds of files and their catalogues of keys: see [`cohaptic_linkfile::schema`].
//!
//! A test reads files in which every table occurs, and compares the keys that the readers know with those of the catalogue: neither may have one more.

mod scene;
#[cfg(test)]
mod tests;

use cohaptic_linkfile::schema::{self, Table};
use serde_json::Value;

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
            Self::Relay => &schema::RELAY,
            Self::Router => &schema::ROUTER,
        }
    }

    /// The title of such a file in its schema.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Scene => "cohaptic scene",
            Self::Relay => "cohaptic relay file",
            Self::Router => "cohaptic router file",
        }
    }

    /// The catalogue as a JSON Schema of draft 7.
    #[must_use]
    pub fn json(self) -> Value {
        schema::json_schema(self.root(), self.title())
    }
}
