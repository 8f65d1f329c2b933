//! Event-driven network of the program: every packet has its own nanosecond, and no work is done in between.

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, LinkConfig, Network, NetworkConfig, NodeId};

use super::traffic::{Arrival, NODES, Traffic};
use crate::AccuracyError;

/// Sends all traffic through the program's network, and shows every arrival.
pub(crate) fn carry(traffic: &Traffic, mut show: impl FnMut(Arrival)) -> Result<(), AccuracyError> {
    let config = NetworkConfig { seed: 1, nodes: (0..NODES).map(|node| format!("node{node}")).collect(), general: false };
    let link = |from: NodeId, to: NodeId| LinkConfig { delay: Delay::constant(traffic.delays[from.index()][to.index()]), ..LinkConfig::default() };
    let mut network: Network<()> = Network::new(config, link);
    let mut drain = |network: &mut Network<()>, until: Instant| -> Result<(), AccuracyError> {
        // Arrivals before the next sending come first, so that events are handled in the order of time.
        while let Some(at) = network.poll_timeout().filter(|at| *at <= until) {
            network.handle_timeout(at)?;
            while let Some(event) = network.poll_event() {
                let delay = event.at - event.offered;
                show(Arrival { from: event.path.from.index(), to: event.path.to.index(), delay });
            }
        }
        Ok(())
    };
    for (now, node) in traffic.sendings() {
        drain(&mut network, now)?;
        network.handle_broadcast(now, NodeId::new(node), Bytes::new(64), ())?;
    }
    drain(&mut network, Instant::MAX)
}
