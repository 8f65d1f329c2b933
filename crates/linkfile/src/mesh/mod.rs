//! Links between named ends (peers or programs): keys for all links, keys for single links, and the links after each change.

mod link_keys;
mod link_table;
mod links;
mod selector;

pub use link_keys::{KeysOfLinks, LinkKeys, link_from_keys};
pub use link_table::{LinkChange, LinkTable, pairs};
pub use links::{LinkClasses, OnLinks, read_key_changes, read_links};
pub use selector::{LinkSelector, read_link_or_line, read_links_between, read_peer_name};
