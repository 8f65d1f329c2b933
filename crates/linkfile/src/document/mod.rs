//! Document: the text of a file as a tree of values with places, and diagnostics that point at places.

pub(crate) mod error;
mod source;
mod toml_text;
mod tree;

pub(crate) use error::{Diagnostic, FileError, Origin};
pub use error::{quote, shorten};
pub use source::{BEGINNING, Place, Sources};
pub use toml_text::{key_text, value_text};
pub use tree::{Entry, Node, Table, TooDeep, Value, join};
