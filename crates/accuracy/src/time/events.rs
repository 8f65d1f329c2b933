//! The program's way: every packet at its own nanosecond, and nothing happens in between.

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, LinkConfig, Network, NetworkConfig, NodeId};

use super::traffic::{Arrival, NODES, Traffic};
use crate::AccuracyError;

/// Sends everything through the program's network and shows what arrives.
pub(crate) fn carry(traffic: &Traffic, mut show: impl FnMut(Arrival)) -> Result<(), AccuracyError> {
    let config = NetworkConfig { seed: 1, nodes: (0..NODES).map(|node| format!("node{node}")).collect(), general: false };
    let link =
        |from: NodeId, to: NodeId| LinkConfig { delay: Delay::constant(traffic.delays[from.0 as usize][to.0 as usize]), ..LinkConfig::default() };
    let mut network: Network<()> = Network::new(config, link);
    let mut drain = |network: &mut Network<()>, until: Instant| -> Result<(), AccuracyError> {
        while let Some(at) = network.poll_timeout().filter(|at| *at <= until) {
            network.handle_timeout(at)?;
            while let Some(event) = network.poll_event() {
                let delay = event.at - event.sent;
                show(Arrival { from: event.from.0 as usize, to: event.to.0 as usize, delay });
            }
        }
        Ok(())
    };
    for (now, node) in traffic.sendings() {
        drain(&mut network, now)?;
        let node = u32::try_from(node).unwrap_or(u32::MAX);
        network.handle_broadcast(now, NodeId(node), Bytes::new(64), ())?;
    }
    drain(&mut network, Instant::MAX)
}
