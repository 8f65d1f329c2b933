//! The keys of a link in tables of files: those of `[link]`, of an entry `[\[links\]]`, and of a change.

pub use cohaptic_wan::MODULATOR;
use cohaptic_wan::parameters::{Form, Key, Table, Words, joined, required};
use cohaptic_wan::{LINK_KIND_PARAMETERS, LINK_PARAMETERS};

/// The keys of a link, of every kind.
pub const LINK: [&[Key]; 14] = joined(&[&LINK_PARAMETERS, &[&LINK_KIND_PARAMETERS]]);

/// Keys of a link alone.
pub static LINK_TABLE: Table = Table::of(&LINK);
/// Keys of a link that change.
pub static LINK_CHANGE: Table = Table::over(&LINK);

/// The two ends of a link.
pub const ENDS: [Key; 2] =
    [required("from", Form::Text, "The name of the one that sends"), required("to", Form::Text, "The name of the one that receives")];
/// An entry `[\[links\]]`.
pub static LINK_ENTRY: Table = Table::over(&joined::<15>(&[&[&ENDS], &LINK]));

/// The word for every link.
pub const ALL_LINKS: Words = &[("all", "every link")];
static ENDS_TABLE: Table = Table::of(&[&ENDS]);
/// Which links a change is of.
pub const LINKS_BETWEEN: Form = Form::AnyOf(&[Form::Words(ALL_LINKS), Form::Table(&ENDS_TABLE)]);
