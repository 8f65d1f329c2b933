//! The links between named ends, peers or programs: what a file says of all of them, of single ones, and of each after a change.

mod link_keys;
mod link_table;
mod links;
mod selector;

pub use link_keys::{KeysOfLinks, LinkKeys, link_from_keys};
pub use link_table::{LinkChange, LinkTable, pairs};
pub use links::{LinkClasses, OnLinks, read_key_changes, read_links};
pub use selector::{LinkSelector, read_ends, read_link_or_line, read_links_between, read_peer_name};
