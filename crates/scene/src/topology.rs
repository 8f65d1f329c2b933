//! Topologies: the receivers of each peer, in scenes where not every peer sends to every other peer.

use std::ops::Range;
use std::sync::Arc;

use cohaptic_linkfile::reading::named_file::{Fault, line_span};
use cohaptic_peer::Coordination;
use cohaptic_peer::coordination::Pull;
use cohaptic_wan::LinkModel;

use crate::{LinkTable, Scene};

/// Neighbours of each peer: the peer sends to all neighbours and hears all neighbours. Neighbours are mutual, and so are weights.
///
/// Memory grows with the number of pairs of neighbours, not with the number of pairs of peers.
#[derive(Clone, PartialEq, Debug)]
pub struct Topology {
    kind: TopologyKind,
    /// Index in `neighbours` of the first neighbour of each peer, indexed by peer. Has one more entry than there are peers, the length of `neighbours`, so
    /// that the neighbours of peer `p` are `first[p]..first[p + 1]`.
    first: Vec<usize>,
    /// Neighbours of peer 0, then of peer 1 and so on; ascending for each peer, so that a binary search finds a neighbour.
    neighbours: Vec<u32>,
    /// Weights, indexed as `neighbours`. Empty if all weights are 1.
    weights: Vec<f64>,
}

/// Form of a topology.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TopologyKind {
    /// A ring: half of the neighbours of a peer come before the peer, half after the peer.
    Ring {
        /// Number of neighbours of each peer.
        neighbours: usize,
    },
    /// A star: the hub has all other peers as neighbours, and every other peer has the hub alone.
    Star {
        /// Index of the hub in [`Scene::peers`].
        hub: usize,
    },
    /// A graph given by a matrix of weights.
    Graph,
}

/// Fault of a matrix of weights, with the place of the fault in the matrix.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("{message}")]
pub struct WeightsError {
    /// Row of the fault, from 0.
    pub row: usize,
    /// Column of the fault, from 0; `None` if the row as a whole is at fault.
    pub column: Option<usize>,
    /// Description of the fault and of the expected number.
    pub message: String,
}

impl Topology {
    /// Returns a ring of `peers` peers with `neighbours` neighbours each, half on either side. `None` unless `neighbours` is even, above 0 and below `peers`.
    #[must_use]
    pub fn ring(peers: usize, neighbours: usize) -> Option<Self> {
        // Below `peers`, the steps to both sides never reach the same peer.
        let fits = neighbours > 0 && neighbours.is_multiple_of(2) && neighbours < peers;
        fits.then(|| {
            let half = neighbours / 2;
            let of = |peer: usize| {
                let mut near: Vec<usize> = (1..=half).flat_map(|step| [(peer + step) % peers, (peer + peers - step) % peers]).collect();
                // Steps to both sides alternate and wrap around the ring, so that the neighbours are not in order yet.
                near.sort_unstable();
                near
            };
            Self::unweighted(TopologyKind::Ring { neighbours }, (0..peers).map(of))
        })
    }

    /// Returns a star of `peers` peers around the peer `hub`. `None` if `hub` is not below `peers`, or for fewer than two peers.
    #[must_use]
    pub fn star(peers: usize, hub: usize) -> Option<Self> {
        let of = |peer: usize| if peer == hub { (0..peers).filter(|other| *other != hub).collect() } else { vec![hub] };
        (hub < peers && peers >= 2).then(|| Self::unweighted(TopologyKind::Star { hub }, (0..peers).map(of)))
    }

    /// Returns the graph of a matrix of weights, one row per peer. A weight above zero makes two peers neighbours.
    ///
    /// # Errors
    ///
    /// [`WeightsError`] unless the matrix is square, every weight is finite and not negative, weights between two peers are equal both ways, the weight of
    /// each peer with itself is 0, and a chain of neighbours connects all peers.
    pub fn graph(rows: &[Vec<f64>]) -> Result<Self, WeightsError> {
        let peers = rows.len();
        let refuse = |row, column, message| Err(WeightsError { row, column, message });
        for (row, weights) in rows.iter().enumerate() {
            if weights.len() != peers {
                let message = format!("row {} has {} weights and there are {peers} rows: expected as many", row + 1, weights.len());
                return refuse(row, None, message);
            }
            for (column, weight) in weights.iter().enumerate() {
                // `get`, because the row of the mirrored weight may be too short: the length of the row is checked later, when the loop gets there.
                let mutual = rows[column].get(row).copied();
                let wrong = if !weight.is_finite() || *weight < 0.0 {
                    "expected a finite number that is not negative".to_owned()
                } else if row == column && *weight != 0.0 {
                    "a peer is not its own neighbour: expected 0".to_owned()
                } else if row > column && mutual != Some(*weight) {
                    format!("weights are mutual: expected {} as in row {}, column {}", mutual.unwrap_or(0.0), column + 1, row + 1)
                } else {
                    continue;
                };
                return refuse(row, Some(column), format!("the weight in row {}, column {} is {weight}: {wrong}", row + 1, column + 1));
            }
        }
        // Rows are square and mutual from here on, so that neighbours and weights are mutual.
        let neighbours = |row: &Vec<f64>| row.iter().enumerate().filter(|(_, weight)| **weight > 0.0).map(|(peer, _)| peer).collect();
        let mut graph = Self::unweighted(TopologyKind::Graph, rows.iter().map(neighbours));
        let weights: Vec<f64> = rows.iter().flatten().copied().filter(|weight| *weight > 0.0).collect();
        // An empty list if all weights are 1, so that such a graph prints and computes as a graph without weights.
        if weights.iter().any(|weight| weight.to_bits() != 1.0_f64.to_bits()) {
            graph.weights = weights;
        }
        match graph.unreached() {
            None => Ok(graph),
            Some(peer) => {
                let message = format!("no chain of neighbours leads from the first peer to that of row {}: expected a connected graph", peer + 1);
                refuse(peer, None, message)
            }
        }
    }

    /// Returns a topology without weights. `rows` has the neighbours of each peer in ascending order.
    fn unweighted(kind: TopologyKind, rows: impl Iterator<Item = Vec<usize>>) -> Self {
        let (mut first, mut neighbours) = (vec![0], Vec::new());
        for row in rows {
            neighbours.extend(row.into_iter().map(|peer| u32::try_from(peer).expect("peers are counted in 32 bits")));
            first.push(neighbours.len());
        }
        Self { kind, first, neighbours, weights: Vec::new() }
    }

    /// Returns the first peer to which no chain of neighbours leads from peer 0; `None` if the graph is connected.
    fn unreached(&self) -> Option<usize> {
        let mut reached = vec![false; self.peers()];
        let mut next = vec![0];
        while let Some(peer) = next.pop() {
            // A peer may be in `next` several times. Only the first visit continues.
            if !std::mem::replace(&mut reached[peer], true) {
                next.extend(self.neighbours(peer).iter().map(|other| *other as usize).filter(|other| !reached[*other]));
            }
        }
        reached.iter().position(|reached| !reached)
    }

    /// Returns the form.
    #[must_use]
    pub const fn kind(&self) -> TopologyKind {
        self.kind
    }

    /// Returns the number of peers.
    #[must_use]
    pub const fn peers(&self) -> usize {
        // `first` is never empty: `unweighted` begins it with 0.
        self.first.len() - 1
    }

    /// Returns the number of directed links: twice the number of pairs of neighbours.
    #[must_use]
    pub const fn links(&self) -> usize {
        self.neighbours.len()
    }

    /// Returns the places of the links from a peer, if links are counted by sender, then receiver. The links to the peer have the same places if links are
    /// counted by receiver, then sender.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn places(&self, peer: usize) -> Range<usize> {
        self.first[peer]..self.first[peer + 1]
    }

    /// Returns the neighbours of a peer in ascending order.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn neighbours(&self, peer: usize) -> &[u32] {
        &self.neighbours[self.places(peer)]
    }

    /// Returns the index of `other` among the neighbours of `peer`; `None` if the two are not neighbours.
    #[must_use]
    pub fn place(&self, peer: usize, other: usize) -> Option<usize> {
        if peer >= self.peers() {
            return None;
        }
        // A number above 32 bits is no peer, and so no neighbour.
        self.neighbours(peer).binary_search(&u32::try_from(other).ok()?).ok()
    }

    /// Returns true if there is a link from `from` to `to`.
    #[must_use]
    pub fn has_link(&self, from: usize, to: usize) -> bool {
        self.place(from, to).is_some()
    }

    /// Iterates over the directed links (sender, receiver), by sender, then receiver.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.peers()).flat_map(|from| self.neighbours(from).iter().map(move |to| (from, *to as usize)))
    }

    /// Returns the weights of the neighbours of a peer, indexed as [`Topology::neighbours`]; `None` if all weights are 1.
    fn weights(&self, peer: usize) -> Option<&[f64]> {
        // `get` alone is not enough: the range 0..0 of a peer without neighbours is valid in an empty list too.
        self.weights.get(self.places(peer)).filter(|_| !self.weights.is_empty())
    }

    /// Returns the weight between two peers; 0 if the two are not neighbours.
    #[must_use]
    pub fn weight(&self, peer: usize, other: usize) -> f64 {
        self.place(peer, other).map_or(0.0, |place| self.weights(peer).map_or(1.0, |weights| weights[place]))
    }

    /// Returns the sum of the weights of a peer's neighbours: the number of neighbours, if all weights are 1.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn degree(&self, peer: usize) -> f64 {
        self.weights(peer).map_or_else(|| self.neighbours(peer).len() as f64, |weights| weights.iter().sum())
    }

    /// Returns the weights of a peer's neighbours divided by their mean, so that the mean of weighted values is the weighted mean of the values. `None` if
    /// the weights are equal.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn relative_weights(&self, peer: usize) -> Option<Vec<f64>> {
        // Compared by bits: equal weights change no mean, and weights are never NaN.
        let weights = self.weights(peer).filter(|weights| weights.windows(2).any(|pair| pair[0].to_bits() != pair[1].to_bits()))?;
        // Two weights differ, so that there are at least two and the divisor is not zero.
        let mean = self.degree(peer) / weights.len() as f64;
        Some(weights.iter().map(|weight| weight / mean).collect())
    }

    /// Returns true if all peers have the same sum of weights ([`Topology::degree`]), to the bit.
    #[must_use]
    pub(crate) fn is_regular(&self) -> bool {
        (1..self.peers()).all(|peer| self.degree(peer).to_bits() == self.degree(0).to_bits())
    }
}

/// Reads a matrix of weights from a text: a row per line, numbers between commas. Empty lines are skipped.
///
/// # Errors
///
/// A fault at the first field that is not a number.
pub fn read_weights(text: &str) -> Result<Vec<Vec<f64>>, Fault> {
    let rows = rows_of(text);
    let number = |(line, row): &(usize, &str), field: &str| {
        let message = || format!("found {:?}: expected numbers between commas", field.trim());
        // `field` is a part of `row`, so that the difference of the two addresses is the offset of the field in the line.
        let start = line_span(text, *line).start + field.as_ptr() as usize - row.trim_start().as_ptr() as usize;
        field.trim().parse().map_err(|_| Fault { span: start..start + field.len(), message: message() })
    };
    rows.iter().map(|row| row.1.trim().split(',').map(|field| number(row, field)).collect()).collect()
}

/// Returns the lines with text, with line numbers from 1.
fn rows_of(text: &str) -> Vec<(usize, &str)> {
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(|(number, line)| (number + 1, line)).collect()
}

/// Reads the graph of `peers` peers from a text of weights. Faults have the span of the wrong field, of the wrong row, or of the end of the text.
pub(crate) fn parse_graph(text: &str, peers: usize) -> Result<Arc<Topology>, Fault> {
    let rows = read_weights(text)?;
    // The lines of `rows`, for the places of faults.
    let lines = rows_of(text);
    let at = |row: usize| lines.get(row).map_or(text.len()..text.len(), |line| line_span(text, line.0));
    // At the first row too many, or at the end of the text if rows are missing.
    if rows.len() != peers {
        let message = format!("the file has {} rows of weights: expected {peers}, one for each peer", rows.len());
        return Err(Fault { span: at(rows.len().min(peers)), message });
    }
    Topology::graph(&rows).map(Arc::new).map_err(|WeightsError { row, column, message }| {
        let line = at(row);
        // Sum of the lengths of the fields before `column`, commas included.
        let before = |column: usize| text[line.clone()].split(',').take(column).map(|field| field.len() + 1).sum::<usize>();
        let span = column.map_or_else(
            || line.clone(),
            |column| {
                let start = line.start + before(column);
                // Without the comma after the field. `before` counts a comma after the last field too.
                start..(line.start + before(column + 1)).saturating_sub(1).max(start)
            },
        );
        Fault { span, message }
    })
}

impl Scene {
    /// Iterates over the links of the scene (sender, receiver), by sender, then receiver.
    pub fn linked_pairs(&self) -> Box<dyn Iterator<Item = (usize, usize)> + '_> {
        match &self.topology {
            Some(topology) => Box::new(topology.pairs()),
            None => Box::new(cohaptic_linkfile::mesh::pairs(self.peers.len())),
        }
    }

    /// Returns the number of links of the scene.
    #[must_use]
    pub fn link_count(&self) -> u64 {
        let peers = self.peers.len() as u64;
        self.topology.as_ref().map_or(peers * (peers - 1), |topology| topology.links() as u64)
    }

    /// Returns the configurations of the links of the scene, each with the number of links of this configuration, at least 1.
    #[must_use]
    pub fn used_links(&self) -> Vec<(&Arc<LinkModel>, u64)> {
        let Some(topology) = &self.topology else { return self.links.used().collect() };
        let configs = self.links.configs();
        let mut counts = vec![0; configs.len()];
        // All links have the same configuration, so that no loop over the links is needed.
        if self.links.is_uniform() {
            counts[0] = topology.links() as u64;
        } else {
            topology.pairs().for_each(|(from, to)| counts[self.links.config_between(from, to)] += 1);
        }
        configs.iter().zip(counts).filter(|(_, count)| *count > 0).collect()
    }

    /// Returns the scene without its topology: all peers send to all. A configuration common to all links of the topology becomes the configuration of all
    /// links of the returned scene; otherwise the table of links stays as before.
    #[must_use]
    pub fn without_topology(&self) -> Self {
        let links = match self.used_links().as_slice() {
            // The table may hold other configurations for pairs that are not neighbours. Links of such pairs appear now, and must not have a configuration
            // that the scene never used.
            [(only, _)] if !self.links.is_uniform() => LinkTable::new(self.peers.len(), Arc::clone(only), []),
            _ => self.links.clone(),
        };
        Self { topology: None, links, ..self.clone() }
    }

    /// Returns why the scene cannot have the topology or the relay; `None` if the scene can.
    pub(crate) fn refused_topology(&self) -> Option<String> {
        let strategy = self.coordination.strategy;
        // A relay copies each sample to all receivers, so that samples must not differ by receiver.
        if self.relay && (self.sample_kind().is_personal() || strategy == Coordination::ClientServer) {
            return Some(format!(
                "the strategy {} sends each peer a sample of its own, and a relay hands one on to all: expected another strategy, or no role = \"relay\"",
                strategy.name()
            ));
        }
        self.topology.as_ref()?;
        // Only a law follows a mean of the heard peers. Every other strategy needs all peers.
        if self.law(0).is_none() {
            return Some(format!(
                "the strategy {} has every peer hear every other: expected kind = \"full\", or a strategy that follows the mean of what it hears",
                strategy.name()
            ));
        }
        self.rotation
            .is_some()
            .then(|| "an object that turns is followed only where all peers send to all: expected kind = \"full\", or no object.inertia".to_owned())
    }

    /// Returns the number by which a sum over heard peers multiplies the gains of a peer: the sum of the weights of the neighbours, or N − 1 without a
    /// topology.
    #[must_use]
    pub(crate) fn heard_by(&self, peer: usize) -> f64 {
        self.topology.as_ref().map_or_else(|| crate::assembly::count(self.number() - 1), |topology| topology.degree(peer))
    }

    /// Returns true if the gains of peers depend on the heard peers, and so differ from peer to peer.
    #[must_use]
    pub fn has_gains_by_peer(&self) -> bool {
        // A pull towards a mean does not depend on the number of heard peers.
        let sums = [self.coordination.strategy.pull(), self.coordination.pull].contains(&Pull::Sum);
        self.topology.as_ref().is_some_and(|topology| sums && !topology.is_regular())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_has_as_many_neighbours_on_either_side() {
        let ring = Topology::ring(6, 4).unwrap();
        assert_eq!((0..6).map(|peer| ring.neighbours(peer).to_vec()).collect::<Vec<_>>()[..2], [vec![1, 2, 4, 5], vec![0, 2, 3, 5]]);
        assert_eq!((ring.links(), ring.degree(3), ring.is_regular(), ring.relative_weights(0)), (24, 4.0, true, None));
        assert!(ring.pairs().all(|(from, to)| ring.has_link(to, from) && from != to));
        assert_eq!(ring.pairs().count(), 24);
        for (peers, neighbours) in [(6, 0), (6, 3), (6, 6), (2, 2)] {
            assert_eq!(Topology::ring(peers, neighbours), None);
        }
        assert_eq!(Topology::ring(3, 2).unwrap().neighbours(1), [0, 2]);
    }

    #[test]
    fn a_star_has_its_hub_wherever_it_is() {
        let star = Topology::star(4, 2).unwrap();
        assert_eq!((star.neighbours(2), star.neighbours(3)), ([0, 1, 3].as_slice(), [2].as_slice()));
        assert_eq!((star.place(2, 3), star.place(3, 0), star.has_link(9, 0), star.is_regular()), (Some(2), None, false, false));
        assert_eq!((Topology::star(4, 4), Topology::star(1, 0)), (None, None));
    }

    /// Weights 1 and 3 are 0.5 and 1.5 times their mean. A single weight equals its mean, so that it counts as no weight.
    #[test]
    fn weights_count_over_their_mean() {
        let graph = Topology::graph(&[vec![0.0, 1.0, 3.0], vec![1.0, 0.0, 0.0], vec![3.0, 0.0, 0.0]]).unwrap();
        assert_eq!((graph.relative_weights(0), graph.relative_weights(1)), (Some(vec![0.5, 1.5]), None));
        assert_eq!((graph.degree(0), graph.degree(2), graph.weight(0, 2), graph.weight(1, 2)), (4.0, 3.0, 3.0, 0.0));
    }

    #[test]
    fn what_is_no_graph_is_refused_with_its_place() {
        let refused = |text: &str| {
            let Fault { span, message } = parse_graph(text, 3).unwrap_err();
            assert!(message.contains("expected"), "{message}");
            (text[span].to_owned(), message)
        };
        let mut shown = Vec::new();
        for (text, at) in [
            ("0,1,1\n1, 0,1\n1,1.5,0\n", "1.5"),
            ("0,1,1\n\n1,0,-1\n1,1,0\n", "-1"),
            ("0,NaN,1\n1,0,1\n1,1,0\n", "NaN"),
            ("0,1,1\n1,2,1\n1,1,0\n", "2"),
            ("0,1,1\n1,x,1\n1,1,0\n", "x"),
            ("0,1\n1,0\n", ""),
            ("0,1,1\n1,0\n1,1,0\n", "1,0"),
            ("0,1,0\n1,0,0\n 0,0,0\n", "0,0,0"),
        ] {
            let (found, message) = refused(text);
            assert_eq!(found, at, "{message}");
            shown.push(message);
        }
        assert!(shown[0].contains("row 3, column 2 is 1.5: weights are mutual: expected 1 as in row 2, column 3"), "{}", shown[0]);
        assert!(shown[7].contains("connected"), "{}", shown[7]);
    }
}
