//! The kinds of files and their catalogues of keys: see [`cohaptic_linkfile::schema`].

#[cfg(test)]
mod tests;

use cohaptic_linkfile::schema::{self, Form, Table};
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
            Self::Scene => &crate::read::ROOT,
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

    /// The unit in which the value of a key is a plain number: `"N/m"` of `coordination.stiffness` and of `peers.anna.coupling.stiffness`. Empty for a key
    /// whose values carry their units (`link.delay`), are no numbers or have no unit, and for a text that names no key.
    #[must_use]
    pub fn unit_of(self, key: &str) -> &'static str {
        self.root().form(key).map_or("", unit)
    }

    /// The catalogue as a JSON Schema of draft 7.
    #[must_use]
    pub fn json(self) -> Value {
        schema::json_schema(self.root(), self.title())
    }
}

/// The unit of a number that may stand there.
fn unit(form: &'static Form) -> &'static str {
    let Form::AnyOf(forms) = form else { return form.unit() };
    forms.iter().map(unit).find(|unit| !unit.is_empty()).unwrap_or_default()
}
