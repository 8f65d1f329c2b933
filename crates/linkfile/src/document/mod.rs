//! Document: the text of a file as a tree of values with places, and diagnostics that point at places.

mod error;
mod source;
mod toml_text;
mod tree;

pub(crate) use error::Origin;
pub use error::{Diagnostic, FileError, quote, shorten};
pub use source::{BEGINNING, Place, Sources};
pub use toml_text::{key_text, value_text};
pub use tree::{Entry, Node, Table, TooDeep, Value, join};
