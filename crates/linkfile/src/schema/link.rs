//! The keys of a link in tables of files: those of `[link]`, of an entry `[\[links\]]`, and of a change.

pub use cohaptic_wan::MODULATOR;
use cohaptic_wan::parameters::{Form, Key, Table, Words, joined, optional, required};
use cohaptic_wan::{LINK_KIND_PARAMETERS, LINK_PARAMETERS};

/// The keys of a link, of every kind, in the order in which they are explained.
pub const LINK: [&[Key]; 15] = joined(&[&LINK_PARAMETERS, &[&LINK_KIND_PARAMETERS]]);

/// Keys of a link alone.
pub static LINK_TABLE: Table = Table::of(&LINK);
/// Keys of a link that change.
pub static LINK_CHANGE: Table = Table::over(&LINK);

/// The two ends of a link.
pub const ENDS: [Key; 2] =
    [required("from", Form::Text, "The name of the one that sends"), required("to", Form::Text, "The name of the one that receives")];
/// An entry `[\[links\]]`.
pub static LINK_ENTRY: Table = Table::over(&joined::<16>(&[&[&ENDS], &LINK]));

/// The word for every link.
pub const ALL_LINKS: Words = &[("all", "every link")];
/// A link by its ends.
pub(crate) static ENDS_TABLE: Table = Table::of(&[&ENDS]);
/// Which links a change is of.
pub const LINKS_BETWEEN: Form = Form::AnyOf(&[Form::Words(ALL_LINKS), Form::Table(&ENDS_TABLE)]);

/// A link by its ends, or an access line.
pub static LINK_OR_LINE: Table = Table::of(&[&[
    optional("from", Form::Text, "The name of the peer that sends"),
    optional("to", Form::Text, "The name of the peer that receives"),
    optional("uplink", Form::Text, "In place of both: the uplink of this peer"),
    optional("downlink", Form::Text, "In place of both: the downlink of this peer"),
]]);
