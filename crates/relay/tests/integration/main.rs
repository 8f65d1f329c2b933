//! The relay as its users see it: without sockets in virtual time, and on loopback. Nothing is asserted that a busy machine can break.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod engine;
mod itself;
mod loopback;
mod proxy;

use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_linkfile::{LinkTable, link_from_keys};
use cohaptic_relay::{Form, Limits, Mesh, Program, RelayConfig};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

fn link(keys: &[&str]) -> LinkModel {
    link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap()
}

fn at(micros: u64) -> Instant {
    Instant::from_nanos(micros * 1000)
}

fn address(port: u16) -> SocketAddr {
    ([127, 0, 0, 1], port).into()
}

/// Returns the configuration of a mesh of the given programs. All links equal `usual`, except for the links in `own`.
fn mesh(programs: &[(&str, SocketAddr, Option<SocketAddr>)], usual: LinkModel, own: &[((usize, usize), LinkModel)]) -> RelayConfig {
    let program =
        |(name, port, address): &(&str, SocketAddr, Option<SocketAddr>)| Program { name: (*name).to_owned(), port: *port, address: *address };
    let own = own.iter().map(|(ends, model)| (*ends, Arc::new(model.clone())));
    RelayConfig {
        seed: 5,
        form: Form::Mesh(Mesh { programs: programs.iter().map(program).collect(), links: LinkTable::new(programs.len(), Arc::new(usual), own) }),
        limits: Limits::default(),
        changes: Vec::new(),
    }
}
