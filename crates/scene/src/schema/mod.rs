//! The kinds of files and their catalogues of keys: see [`cohaptic_linkfile::schema`].
//!
//! A test reads files in which every table occurs, and compares the keys that the readers know with those of the catalogue: neither may have one more.

mod scene;
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

    /// The unit in which the value of a key is a plain number: `"N/m"` of `coordination.stiffness` and of `peers.anna.coupling.stiffness`. Empty for a key
    /// whose values carry their units (`link.delay`), are no numbers or have no unit, and for a text that names no key.
    #[must_use]
    pub fn unit_of(self, key: &str) -> &'static str {
        let mut parts = key.split('.');
        let Some(first) = parts.next().and_then(|name| form_of(self.root(), name)) else { return "" };
        parts.try_fold(first, within).map_or("", unit)
    }

    /// The catalogue as a JSON Schema of draft 7.
    #[must_use]
    pub fn json(self) -> Value {
        schema::json_schema(self.root(), self.title())
    }
}

/// The form of the value under a name within a value: a key of a table, or an entry of a list by its name or place.
fn within(form: &'static Form, name: &str) -> Option<&'static Form> {
    if let Form::List(entry) = form {
        Some(entry)
    } else if let Form::AnyOf(forms) = form {
        forms.iter().find_map(|form| within(form, name))
    } else {
        form_of(form.table()?, name)
    }
}

/// The form of the value under a name of a table.
fn form_of(table: &'static Table, name: &str) -> Option<&'static Form> {
    table.keys().find(|key| key.name == name).map(|key| &key.form).or(table.others)
}

/// The unit of a number that may stand there.
fn unit(form: &'static Form) -> &'static str {
    let Form::AnyOf(forms) = form else { return form.unit() };
    forms.iter().map(unit).find(|unit| !unit.is_empty()).unwrap_or_default()
}
