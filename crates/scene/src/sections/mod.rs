//! The parts of a scene file, each read by a function of its own.

mod expect;
mod hand;
mod header;
mod kind;
mod measure;
mod motion_file;
mod object;
mod peer;
mod peers;
mod rotation;
mod timeline;
mod topology;

pub(crate) use expect::read_expect;
pub(crate) use header::{Header, Stepping, read_coordination, read_header, read_stepping};
pub(crate) use measure::{Measured, read_measure, read_measure_name};
pub(crate) use object::read_object;
pub(crate) use peers::{PeerSources, check_enough, read_names, read_peers};
pub(crate) use rotation::{refuse_rotational_keys, rotation};
pub(crate) use timeline::read_timeline;
pub(crate) use topology::{Ways, read_topology, refuse_unlinked};
