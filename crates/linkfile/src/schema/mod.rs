//! The catalogue of keys: every key with its meaning, unit, default and form, for editors and for authors of files.
//!
//! The readers decide what a file means; this is the catalogue of what they read. A test of `cohaptic-scene` reads files in which every table occurs, and
//! compares the keys that the readers know with those that stand here: neither may have one more. Ranges and units of numbers are those of the readers
//! themselves.
//!
//! [`json_schema`] is the catalogue as a JSON Schema. It is coarser than the readers: what depends on another key, such as a unit that fits, a peer that
//! exists, or two keys that exclude each other, is left to them.

mod json;
pub mod link;
mod relay;
mod router;

pub use cohaptic_wan::parameters::{Form, Key, Need, Table, Words, joined, number, optional, required, somewhere, usual, vector};
pub use json::json_schema;
pub use relay::ROOT as RELAY;
pub use router::ROOT as ROUTER;
