//! Catalogue of keys: every key with meaning, unit, default and form, for editors and for authors of files.
//!
//! Each table is declared once, beside the reader of the table. The reader takes names, forms, ranges, units and defaults from the declaration. The catalogue
//! consists of these declarations, from the table at the top of a file down.
//!
//! [`json_schema`] returns the catalogue as a JSON Schema. The schema is coarser than the readers: conditions between keys, such as an existing peer or two
//! exclusive keys, and the choice of the unit are left to the readers.

mod json;
/// Declarations of the keys of a link.
pub mod link {
    pub use crate::link::keys::*;
}

pub use crate::exec::ROOT as EXEC;
pub use crate::relay::ROOT as RELAY;
pub use crate::relay::TCP_ROOT as TCP_RELAY;
pub use crate::router::read::ROOT as ROUTER;
pub use cohaptic_wan::parameters::{Choices, Form, Key, Need, Table, Words, joined, number, optional, required, somewhere, usual, vector, words};
pub use json::json_schema;
