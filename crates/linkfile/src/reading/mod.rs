//! Readers of documents: values are read key by key, and every fault is reported at the place of the fault.
//!
//! A reader is a function from a [`Node`](crate::document::Node) and a [`Context`] to an `Option`. A reader returns `None` exactly after a reported fault, and
//! goes on after a fault, so that of several faults the first in the text is found.

mod context;
pub mod named_file;
mod names;
mod overrides;
mod parse;
mod table_reader;
pub mod values;

pub use context::{Context, FileReader, Modulators};
pub(crate) use names::nearest;
pub use names::{Names, one_of};
pub use parse::{Parsed, default_title, defaults, file_text, parse, parse_with, text_of, with_text};
pub use table_reader::{TableReader, only_one};
