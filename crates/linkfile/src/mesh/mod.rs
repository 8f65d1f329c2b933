//! Links between named ends (peers or programs): keys for all links, keys for single links, and the links after each change.

pub(crate) mod link_keys;
pub(crate) mod link_table;
mod links;
pub(crate) mod selector;

pub(crate) use link_keys::{KeysOfLinks, LinkKeys};
pub use link_table::pairs;
pub(crate) use link_table::{LinkChange, LinkTable};
pub use links::{LinkClasses, OnLinks, read_key_changes, read_links};
pub(crate) use selector::LinkSelector;
pub use selector::{read_link_or_line, read_links_between, read_peer_name};
