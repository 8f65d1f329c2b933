//! The parts of a scene file, each read by a function of its own.

mod expect;
mod hand;
mod header;
mod kind;
pub(crate) mod link;
mod links;
mod modulators;
mod motion_file;
mod named_file;
mod object;
mod peer;
mod peers;
pub(crate) mod selector;
mod sojourn;
mod timeline;

pub(crate) use expect::read_expect;
pub(crate) use header::{Header, read_coordination, read_header, read_integrator};
pub(crate) use link::read_link;
pub(crate) use links::{LinkClasses, read_links};
pub(crate) use modulators::{Modulators, read_modulators};
pub(crate) use named_file::Files;
pub(crate) use object::read_object;
pub(crate) use peers::{PeerSources, check_enough, read_names, read_peers};
pub(crate) use timeline::read_timeline;
