//! Declarations of the keys of a link: in `[link]`, in an entry `[\[links\]]`, and in a change.

pub use cohaptic_wan::MODULATOR;
use cohaptic_wan::parameters::{Form, Key, Table, Words, joined, optional, required, usual};
use cohaptic_wan::{LINK_KIND_PARAMETERS, LINK_PARAMETERS};

/// Keys of a link of any kind, in the order of the reference.
pub const LINK: [&[Key]; 17] = joined(&[&LINK_PARAMETERS, &[&LINK_KIND_PARAMETERS, &PROFILE]]);

/// Key that takes a link of the [library](crate::library).
const PROFILE: [Key; 1] = [usual(
    "profile",
    Form::Like(&["starlink/up", "transatlantic", "none"]),
    "\"none\"",
    "A link of the library by its name, over which the other keys are laid. Takes away all keys below; \"none\" takes it away",
)];

/// Table of the keys of a link, such as `[link]`.
pub static LINK_TABLE: Table = Table::of(&LINK);
/// Table of the changed keys of a link. The table is laid over the keys of the link.
pub(crate) static LINK_CHANGE: Table = Table::over(&LINK);

/// Keys of the two ends of a link.
pub(crate) const ENDS: [Key; 2] = [required("from", Form::Text, "Name of the sender"), required("to", Form::Text, "Name of the receiver")];
/// Table of an entry `[\[links\]]`: both ends, and keys laid over those of `[link]`.
pub static LINK_ENTRY: Table = Table::over(&joined::<18>(&[&[&ENDS], &LINK]));

/// Word for every link.
pub const ALL_LINKS: Words = &[("all", "every link")];
/// Table with the ends of a link.
pub(crate) static ENDS_TABLE: Table = Table::of(&[&ENDS]);
/// Form of the links of a change: `"all"`, or a link by both ends.
pub const LINKS_BETWEEN: Form = Form::AnyOf(&[Form::Words(ALL_LINKS), Form::Table(&ENDS_TABLE)]);

/// Table with both ends of a link, or with the peer of an access line.
pub static LINK_OR_LINE: Table = Table::of(&[&[
    optional("from", Form::Text, "Name of the sender"),
    optional("to", Form::Text, "Name of the receiver"),
    optional("uplink", Form::Text, "Name of the peer whose uplink is meant, in place of from and to"),
    optional("downlink", Form::Text, "Name of the peer whose downlink is meant, in place of from and to"),
]]);
