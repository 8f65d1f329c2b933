//! Link, relay, router and exec files: from TOML text to checked links.
//!
//! Use this crate if your program reads links from files, or from words such as `delay=24ms`.
//!
//! A link is a table of keys, such as `{ delay = "24ms", loss = "1%" }`. This crate reads the keys of a link, the links between named ends, the file of a
//! relay of UDP ([`RelayFile`]) or of TCP ([`TcpRelayFile`]), the file of a router ([`router::RouterFile`]) and the file of hosts with commands
//! ([`ExecFile`]). Every refusal is a [`FileError`] that names file, line, column and key, shows
//! the line, and says what was expected.
//!
//! This crate knows nothing of haptics. `cohaptic-scene` reads the other parts of a scene with the same [`reading::TableReader`] from the same
//! [`document::Node`]s, and reads links with [`mesh::read_links`].
//!
//! Read [`RelayFile::parse`] first, then [`link::read_link`].
//!
//! ```
//! use cohaptic_linkfile::link_from_keys;
//!
//! let link = link_from_keys(&["delay=24ms".to_owned(), "loss=1%".to_owned()])?;
//! assert_eq!(link.mean_delay().as_millis(), 24);
//!
//! let error = link_from_keys(&["delay=24 parsecs".to_owned()]).unwrap_err();
//! assert!(error.to_string().starts_with("--set link.delay=24 parsecs: link.delay: unknown unit \"parsecs\""));
//! # Ok::<(), cohaptic_linkfile::FileError>(())
//! ```

mod address;
pub mod document;
mod exec;
mod fingerprint;
/// Library of links with a name: each link with the sources of its numbers, the way from the sources to the numbers, and what is not modelled.
pub mod library {
    pub use crate::link::library::*;
}
pub mod link;
pub mod mesh;
mod quantity_text;
pub mod reading;
mod relay;
pub mod router;
pub mod schema;
pub mod stream;

pub use address::{AddressError, address};
pub use document::error::{Diagnostic, FileError};
pub use exec::{ExecFile, ExecHost};
pub use fingerprint::{Fingerprint, FingerprintError};
pub use mesh::link_keys::{KeysOfLinks, LinkKeys, link_from_keys};
pub use mesh::link_table::{LinkChange, LinkTable};
pub use mesh::selector::LinkSelector;
pub use quantity_text::{number_and_unit, text_of_quantity};
pub use relay::{RelayChange, RelayFile, RelayLimits, RelayProgram, relay_link_keys_of_text};
pub use relay::{TcpProxy, TcpRelayFile, TcpStream};
