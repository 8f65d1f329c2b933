//! One value of a varied key.

use crate::value::Value;

/// A value of a varied key.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Varied {
    /// The value as written. A value without settings is put into the scene in this form.
    pub(crate) text: String,
    /// The value in the table.
    pub(crate) value: Value,
    /// Overrides set together with the value, by dotted paths.
    pub(crate) settings: Vec<String>,
}

impl Varied {
    /// Returns a value without settings.
    pub(super) const fn plain(text: String, value: Value) -> Self {
        Self { text, value, settings: Vec::new() }
    }
}
