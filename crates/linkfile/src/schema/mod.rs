//! The catalogue of keys: every key with its meaning, unit, default and form, for editors and for authors of files.
//!
//! Each table is declared once, beside its reader, which takes names, forms, ranges, units and defaults from the declaration. The catalogue is these
//! declarations, from the table at the top of a file down.
//!
//! [`json_schema`] is the catalogue as a JSON Schema. It is coarser than the readers: what depends on another key, such as a unit that fits, a peer that
//! exists, or two keys that exclude each other, is left to them.

mod json;
pub mod link;

pub use crate::relay::ROOT as RELAY;
pub use crate::router::read::ROOT as ROUTER;
pub use cohaptic_wan::parameters::{Choices, Form, Key, Need, Table, Words, joined, number, optional, required, somewhere, usual, vector, words};
pub use json::json_schema;
