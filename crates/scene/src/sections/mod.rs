//! Readers of the parts of a scene file, a function per part. A reader with an `Option` as result reports each fault at the place of the fault, and then
//! returns `None`; a reader of an optional key returns `Some(None)` without the key. Readers go on after a fault, because of all reported faults the first in
//! the order of the text is shown.

mod access;
mod coordination;
mod device;
mod expect;
mod hand;
mod header;
mod inverse3;
mod kind;
mod measure;
mod motion_file;
mod object;
mod operator;
mod peer;
mod peers;
mod rotation;
mod task;
mod timeline;
mod topology;
mod turning;

pub(crate) use coordination::{COORDINATION, read_coordination};
pub(crate) use expect::{EXPECT, read_expect};
pub(crate) use header::{Header, SCENE, SIMULATION, read_header, read_stepping};
pub(crate) use measure::{MEASURE, Measured, Offered, read_measure, read_measure_name};
pub(crate) use object::{OBJECT, read_object};
pub(crate) use peer::{PEER, PEERS};
pub(crate) use peers::{PeerSources, check_enough, read_names, read_peers};
pub(crate) use rotation::refuse_rotational_keys;
pub(crate) use task::{TASK, read_task};
pub(crate) use timeline::{TIMELINE, read_timeline};
pub(crate) use topology::{TOPOLOGY, Ways, read_topology, refuse_unlinked};
pub(crate) use turning::rotation;

/// Largest integer of TOML.
const MOST: u64 = i64::MAX.unsigned_abs();
