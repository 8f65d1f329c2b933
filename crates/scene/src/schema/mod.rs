//! Kinds of files and their catalogues of keys. [`cohaptic_linkfile::schema`] has the types of the catalogue.

#[cfg(test)]
mod tests;

use cohaptic_linkfile::schema::{self, Form, Table};
use serde_json::Value;

/// A kind of file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FileSchema {
    /// A scene file.
    Scene,
    /// A relay file, for `cohaptic relay`.
    Relay,
    /// A relay file for TCP, for `cohaptic relay --tcp`.
    RelayTcp,
    /// A router file, for `cohaptic router`.
    Router,
    /// A file of hosts with commands, for `cohaptic exec`.
    Exec,
}

impl FileSchema {
    /// Every kind of file.
    pub const ALL: [Self; 5] = [Self::Scene, Self::Relay, Self::RelayTcp, Self::Router, Self::Exec];

    /// Returns the keys at the top level of a file of this kind.
    #[must_use]
    pub const fn root(self) -> &'static Table {
        match self {
            Self::Scene => &crate::read::ROOT,
            Self::Relay => &schema::RELAY,
            Self::RelayTcp => &schema::TCP_RELAY,
            Self::Router => &schema::ROUTER,
            Self::Exec => &schema::EXEC,
        }
    }

    /// Returns the title of the JSON Schema.
    #[must_use]
    pub(crate) const fn title(self) -> &'static str {
        match self {
            Self::Scene => "cohaptic scene",
            Self::Relay => "cohaptic relay file",
            Self::RelayTcp => "cohaptic relay file for TCP",
            Self::Router => "cohaptic router file",
            Self::Exec => "cohaptic exec file",
        }
    }

    /// Returns the unit of a key with a plain number: `"N/m"` of `coordination.stiffness` and of `peers.anna.coupling.stiffness`. Empty for a key with the unit
    /// in the value (`link.delay`), for a key without a number or without a unit, and for a text that names no key.
    #[must_use]
    pub fn unit_of(self, key: &str) -> &'static str {
        self.root().form(key).map_or("", unit)
    }

    /// Returns the catalogue as a JSON Schema of draft 7.
    #[must_use]
    pub fn json(self) -> Value {
        schema::json_schema(self.root(), self.title())
    }
}

/// Returns the unit of a number of this form; empty if the form admits no number with a unit.
fn unit(form: &'static Form) -> &'static str {
    let Form::AnyOf(forms) = form else { return form.unit() };
    forms.iter().map(unit).find(|unit| !unit.is_empty()).unwrap_or_default()
}
